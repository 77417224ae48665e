"""A machine as it was built: it differs a little from its file, and its joints have play.

Stands in for the measured crane of Rouvinen 1999, chapter 4.6. Play is static: every pin lies at
the side of its hole to which its force pushes it. A pin is tight in the inner of two bodies; a
cylinder has play at either end.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexik.errors import ParameterError
from flexik.machines.deviations import Magnitudes
from flexik.machines.planar import Cylinder
from flexik.machines.sections import Array
from flexik.multibody.flexible import FlexibleMachine, failed
from flexik.multibody.joint_forces import joint_forces, pins_of, point_key, points_of, springs_of
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import solve

# A force below this pushes no pin, N: some times the residual of the solver
FORCE_FREE = 0.1

# Above this a joint force of the rigid machine has the direction of the flexible one's, N
CERTAIN = 500.0

# Pins this near to where they belong have settled, m
SETTLED = 1e-6

# Equilibria in search of the seats of all pins; two suffice but for joints near force-free
PASSES = 60

# By the key of a joint or cylinder. Play: radial clearance of its pins together, m. Seats: where
# the hole of the outer body lies from the pin, (2,) in m; what is added to a length, (1,) in m
Play = Mapping[str, float]
Seats = Mapping[str, Array]


@dataclass(frozen=True)
class AsBuilt:
    """A machine with errors of its own.

    machine : as it was built, without play.
    play : radial clearance by joint or cylinder with pins, m; of both ends together.
    stroke_offset : (k,) in m or rad, actual actuator coordinates minus what the sensors say.
    repeatability : standard deviation (k,) of an actual coordinate about that, or one for all.
    """

    machine: FlexibleMachine
    play: Play
    stroke_offset: Array
    repeatability: Array | float


def draw_twin(nominal: FlexibleMachine, magnitudes: Magnitudes, seed: int) -> AsBuilt:
    """Draw a machine around the `nominal` one; a seed gives the same errors in every size.

    Raises ParameterError if the linkage that was drawn does not close at a limit of its strokes.
    """
    rng, machine = np.random.default_rng(seed), nominal.machine
    changed: dict[str, object] = {}
    for end in points_of(machine):
        off = magnitudes.pivot * rng.standard_normal(2)
        changed[point_key(end)] = np.add(machine.located(end).point, off).tolist()
    for name, drive in machine.drives.items():
        if isinstance(drive, Cylinder):
            longer = magnitudes.length * float(rng.standard_normal())
            changed[f"drives.{name}.retracted"] = drive.retracted + longer
    play = {
        key: sum(magnitudes.play * np.exp(magnitudes.play_spread * rng.standard_normal(n_pins)))
        for key, n_pins in pins_of(machine).items()
    }
    turns = np.array([drive.kind == "revolute" for drive in machine.drives.values()])
    sizes = np.where(turns, magnitudes.angle_offset, magnitudes.stroke_offset)
    stroke_offset = sizes * rng.standard_normal(len(machine.drives))
    for name in machine.beams:
        stiffer = float(np.exp(magnitudes.section * rng.standard_normal()))
        changed[f"bodies.{name}.stiffness_factor"] = stiffer
    for key, value in springs_of(machine).items():
        changed[key] = value * float(np.exp(magnitudes.spring * rng.standard_normal()))
    built = nominal.like(machine.with_constants(changed))
    try:
        _check_corners(built)
    except ParameterError as error:
        raise ParameterError(f"as-built machine of seed {seed}: {error}") from None
    repeats = np.where(turns, magnitudes.angle_repeatability, magnitudes.repeatability)
    return AsBuilt(built, play, stroke_offset, repeats)


def as_built_tips(
    twin: AsBuilt, strokes: Array, payload: Array, generator: np.random.Generator | None = None
) -> Array:
    """Tip (n, 2) in m where the sensors say `strokes` (n, k), with `payload` (n,) in kg.

    Every row is an approach of its own; `generator` draws its repeatability, None: there is none.
    Raises the SolverError of the first row without equilibrium.
    """
    return settled_tips(twin, actual_strokes(twin, strokes, generator), payload)


def actual_strokes(
    twin: AsBuilt, strokes: Array, generator: np.random.Generator | None = None
) -> Array:
    """Coordinates (n, k) that the drives have where the sensors say `strokes` (n, k)."""
    actual = np.atleast_2d(strokes) + twin.stroke_offset
    if generator is not None:
        actual = actual + twin.repeatability * generator.standard_normal(actual.shape)
    return actual


def settled_tips(twin: AsBuilt, strokes: Array, payload: Array) -> Array:
    """Tip (n, 2) in m at actual `strokes` (n, k): `as_built_tips` without the sensors."""
    strokes, payload = np.atleast_2d(strokes), np.atleast_1d(payload)
    seats = _expected_seats(twin, strokes, payload)

    def settled(model: PlanarModel, mass: float, row: int) -> None:
        settle(twin.play, model, mass, {key: at[row] for key, at in seats.items()})

    result, failures = solve(twin.machine, strokes, payload, settle=settled)
    if failures:
        raise next(iter(failures.values()))
    return result


def settle(play: Play, model: PlanarModel, payload: float, seats: Seats | None = None) -> None:
    """Solve a placed `model` with every pin at the side of its hole to which its force pushes it.

    Tension lengthens a cylinder by the clearances of its ends, compression shortens it; the outer
    body of a pin moves along the force on it. Pins start at `seats`, in the middle if not given;
    solving and seating alternate until the seats stay, a pin that turns back going half as far. So
    the potential energy falls to a minimum within the play: a cylinder that is pulled where it is
    shortest and pushed where it is longest hangs free between.

    Raises SolverError as PlanarModel.solve does, or if pins still move after PASSES equilibria.
    """
    seat = {key: np.zeros(2 if key.startswith("joints.") else 1) for key in play}
    seat |= dict(seats or {})
    share = dict.fromkeys(play, 1.0)
    before: dict[str, tuple[Array, Array]] = {}
    stiffness = dict.fromkeys(play, 0.0)
    for _ in range(PASSES):
        model.seat(seat)
        model.solve(payload)
        away = 0.0
        for key, force in model.pin_forces(play).items():
            at, limit, size = seat[key], play[key], float(np.linalg.norm(force))
            last, pulled = before.get(key, (at, force))
            if len(at) == 1 and abs(at - last)[0] > limit / 10.0:
                stiffness[key] = float((pulled - force)[0] / (at - last)[0])
            if size < FORCE_FREE:
                move = np.zeros_like(at)
            elif stiffness[key] > 0.0:
                move = np.clip(at + force / stiffness[key], -limit, limit) - at
            else:
                move = limit / size * force - at
            if len(at) == 2 and move @ (at - last) < 0.0:
                share[key] /= 2.0
            away = max(away, float(np.abs(move).max()))
            before[key] = at, force
            seat[key] = at + share[key] * move
        if away <= SETTLED:
            return
    raise failed(model.flexible, model.values, f"joint play does not settle with {payload:g} kg")


def _check_corners(machine: FlexibleMachine) -> None:
    """Raise ParameterError unless the linkage closes with the drives at their limits."""
    linkage = machine.linkage
    limits = zip(linkage.lower, linkage.upper, strict=True)
    corners = np.stack(np.meshgrid(*limits), axis=-1).reshape(-1, len(linkage.lower))
    broken = ~np.isfinite(linkage.poses(corners)).all(axis=(1, 2))
    if broken.any():
        row = corners[np.argmax(broken)]
        raise ParameterError(str(failed(machine, row, "the linkage does not close")))


def _expected_seats(twin: AsBuilt, strokes: Array, payload: Array) -> dict[str, Array]:
    """Seats (n, 2) or (n, 1) by statics of the rigid machine, the middle where those leave doubt.

    They are right but for micrometres, which saves an equilibrium of two.
    """
    machine = twin.machine.machine
    poses = twin.machine.linkage.poses(strokes)
    closed = np.isfinite(poses).all(axis=(1, 2))
    loads = -machine.gravity * payload[:, None] * [0.0, 1.0]
    forces = joint_forces(machine, poses[closed], loads[closed])
    seats = {}
    for key, clearance in twin.play.items():
        size = np.linalg.norm(forces[key], axis=1)
        of = np.where(size > CERTAIN, clearance / np.maximum(size, CERTAIN), 0.0)
        seats[key] = np.zeros((len(strokes), forces[key].shape[1]))
        seats[key][closed] = of[:, None] * forces[key]
    return seats
