"""A crane as it was built: it differs a little from the nominal one, and its joints have play.

Stands in for the measured crane of Rouvinen 1999, chapter 4.6. Play is static: every pin lies at
the side of its hole to which its force pushes it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import check_assembly
from flexik.kinematics.crane_dimensions import LENGTHS, VECTORS, corrected
from flexik.machines.crane import CraneGeometry, Magnitudes
from flexik.multibody.beams import Array
from flexik.multibody.crane.model import PIVOTS, RODS, CraneModel, listed, solve
from flexik.multibody.crane.statics import joint_forces
from flexik.multibody.crane.structure import BEAMS, CraneStructure, FlexibleCrane

# B, C, D; G, F, E, H, I of CraneGeometry. H is one pin with the eyes of three rods on it
PINS = (
    *("lift_pivot", "lift_cylinder_base", "lift_cylinder_head"),
    *("jib_pivot", "rocker_pivot", "jib_cylinder_base", "rocker_head", "coupler_pin"),
)
# The two pins of each of RODS
ENDS = {
    "lift_cylinder": ("lift_cylinder_base", "lift_cylinder_head"),
    "jib_cylinder": ("jib_cylinder_base", "rocker_head"),
    "rocker": ("rocker_pivot", "rocker_head"),
    "coupler": ("rocker_head", "coupler_pin"),
}
# A force below this pushes no pin, N: a hundred times the residual of the solver
FORCE_FREE = 1.0

# Above this a joint force of the rigid crane has the sign of the flexible one's, N
SIGN_CERTAIN = 500.0

# Pins that move less than this have settled, m
SETTLED = 1e-6

# Equilibria in search of the seats of all pins; two suffice but for rods near force-free
PASSES = 12

# Rounds through the rods in search of the least energy; without rods near force-free, two suffice
SWEEPS = 200

# Radial clearance (half the difference of hole and pin) of each of PINS, m
Play = Mapping[str, float]


@dataclass(frozen=True)
class AsBuiltCrane:
    """A crane with errors of its own.

    crane : as it was built, without play.
    play : radial clearance of each of PINS, m.
    stroke_offset : (3,) in m, actual stroke minus what the sensor says.
    repeatability : standard deviation of an actual stroke about that, m.
    """

    crane: FlexibleCrane
    play: Play
    stroke_offset: Array
    repeatability: float


def draw_twin(crane: FlexibleCrane, magnitudes: Magnitudes, seed: int) -> AsBuiltCrane:
    """Draw a crane around the nominal `crane`; a seed gives the same errors in every size.

    Raises ParameterError if the linkage that was drawn does not close over its strokes.
    """
    rng = np.random.default_rng(seed)
    points = magnitudes.pivot * rng.standard_normal((len(VECTORS), 2))
    lengths = magnitudes.length * rng.standard_normal(len(LENGTHS))
    clearance = magnitudes.play * np.exp(magnitudes.play_spread * rng.standard_normal(len(PINS)))
    stroke_offset = magnitudes.stroke_offset * rng.standard_normal(3)
    sections = np.exp(magnitudes.section * rng.standard_normal(len(BEAMS)))
    spring = float(np.exp(magnitudes.spring * rng.standard_normal()))
    geometry = corrected(crane.geometry, np.concatenate([points.ravel(), lengths]))
    try:
        check_assembly(geometry)
    except ParameterError as error:
        raise ParameterError(f"as-built crane of seed {seed}: {error}") from None
    built = replace(
        crane,
        geometry=geometry,
        structure=_stiffened(crane.structure, geometry, sections),
        spring_stiffness=crane.spring_stiffness * spring,
    )
    play = dict(zip(PINS, clearance.tolist(), strict=True))
    return AsBuiltCrane(built, play, stroke_offset, magnitudes.repeatability)


def as_built_tips(
    twin: AsBuiltCrane,
    strokes: Array,
    payload: Array,
    generator: np.random.Generator | None = None,
) -> Array:
    """Tip (n, 2) in m where the sensors say `strokes` (n, 3) in m, with `payload` (n,) in kg.

    Every row is an approach of its own; `generator` draws its repeatability, None: there is none.
    Raises the SolverError of the first row without equilibrium.
    """
    return settled_tips(twin, actual_strokes(twin, strokes, generator), payload)


def actual_strokes(
    twin: AsBuiltCrane, strokes: Array, generator: np.random.Generator | None = None
) -> Array:
    """Strokes (n, 3) in m that the cylinders have where the sensors say `strokes` (n, 3)."""
    actual = np.atleast_2d(strokes) + twin.stroke_offset
    if generator is not None:
        actual = actual + twin.repeatability * generator.standard_normal(actual.shape)
    return actual


def settled_tips(twin: AsBuiltCrane, strokes: Array, payload: Array) -> Array:
    """Tip (n, 2) in m at actual `strokes` (n, 3) in m: `as_built_tips` without the sensors."""
    strokes, payload = np.atleast_2d(strokes), np.atleast_1d(payload)
    seats = _expected_seats(twin, strokes, payload)

    def settled(model: CraneModel, mass: float, row: int) -> None:
        settle(twin.play, model, mass, seats[row])

    result, failures = solve(twin.crane, strokes, payload, settled)
    if failures:
        raise next(iter(failures.values()))
    return result


# Lengths (4,) that the play adds to RODS, and where the holes of PIVOTS lie from their pins, in m
Seats = tuple[Array, dict[str, Array]]
MIDDLE: Seats = (np.zeros(len(RODS)), dict.fromkeys(PIVOTS, np.zeros(2)))


def settle(play: Play, model: CraneModel, payload: float, seats: Seats = MIDDLE) -> None:
    """Solve a placed `model` with every pin at the side of its hole to which its force pushes it.

    Tension lengthens a rod by the clearances of its ends, compression shortens it; a pivot moves
    along its reaction. Pins start at `seats`; solving and seating alternate until the seats stay.
    So the potential energy falls to a minimum within the play: a rod that is pulled where it is
    shortest and pushed where it is longest hangs free between, at the length without force; one
    that would stay pulled as well as pushed keeps the side to which it went first.

    Raises SolverError as CraneModel.solve does, or if pins still move after PASSES equilibria.
    """
    slack = _slack(play)
    lengths, pivots = seats
    stiffness = np.zeros((len(RODS), len(RODS)))
    last: tuple[Array, Array] | None = None
    for _ in range(PASSES):
        model.seat(dict(zip(RODS, lengths.tolist(), strict=True)), pivots)
        model.solve(payload)
        tensions, reactions = model.pin_forces()
        tension = np.array([tensions[name] for name in RODS])
        if last is not None:
            stiffness = _updated(stiffness, lengths - last[0], last[1] - tension)
        last = lengths, tension
        seated = {name: _hung(play[name], pivots[name], reactions[name]) for name in PIVOTS}
        moves = [np.abs(seated[name] - pivots[name]).max() for name in PIVOTS]
        pivots, lengths = seated, _least_energy(slack, lengths, tension, stiffness)
        if max(*moves, *np.abs(lengths - last[0])) <= SETTLED:
            return
    raise SolverError(
        f"joint play does not settle at strokes {listed(model.strokes)} m with {payload:g} kg"
    )


def _expected_seats(twin: AsBuiltCrane, strokes: Array, payload: Array) -> list[Seats]:
    """Seats by statics of the rigid crane, the middle where those leave a rod's side in doubt.

    They are right but for micrometres, which saves an equilibrium of two.
    """
    gravity = twin.crane.structure.gravity
    loads = -gravity * payload[:, None] * [0.0, 1.0]
    forces = joint_forces(twin.crane, strokes, loads, gravity).joints
    tension = np.column_stack([forces[name] for name in RODS])
    certain = np.abs(tension).min(axis=1) > SIGN_CERTAIN
    lengths = np.copysign(_slack(twin.play), tension)
    return [
        (lengths[k], {p: _hung(twin.play[p], MIDDLE[1][p], forces[p][k]) for p in PIVOTS})
        if certain[k]
        else MIDDLE
        for k in range(len(strokes))
    ]


def _slack(play: Play) -> Array:
    """How much longer or shorter RODS become, (4,) in m."""
    return np.array([sum(play[pin] for pin in ENDS[name]) for name in RODS])


def _updated(stiffness: Array, longer: Array, slacker: Array) -> Array:
    """Symmetric rank-one update: rods `longer` by (4,) in m lost (4,) N of tension."""
    missing = slacker - stiffness @ longer
    work = float(missing @ longer)
    if abs(work) <= 1e-8 * np.linalg.norm(missing) * np.linalg.norm(longer):
        return stiffness
    return stiffness + np.outer(missing, missing) / work


def _least_energy(slack: Array, lengths: Array, tension: Array, stiffness: Array) -> Array:
    """Lengths (4,) in m within `slack` on which `tension` in N at `lengths` leaves no pull.

    Tension falls by `stiffness` (4, 4) in N/m; where it does not fall, a rod goes to one side.
    """
    new = lengths.copy()
    pull = np.where(np.abs(tension) < FORCE_FREE, 0.0, tension)
    for _ in range(SWEEPS):
        before = new.copy()
        for k, limit in enumerate(slack):
            rest = pull[k] - stiffness[k] @ (new - lengths)
            if stiffness[k, k] > 0.0:
                new[k] = np.clip(new[k] + rest / stiffness[k, k], -limit, limit)
            elif rest != 0.0:
                new[k] = np.copysign(limit, rest)
        if np.abs(new - before).max() < SETTLED / 10:
            break
    return new


def _hung(clearance: float, hangs: Array, force: Array) -> Array:
    """Where the hole of the outer body lies from the pin, (2,) in m, `hangs` being where it lay.

    The pin pushes the body with `force` (2,) in N: the hole lies behind the pin.
    """
    size = float(np.hypot(*force))
    return hangs if size < FORCE_FREE else -clearance / size * force


def _stiffened(
    structure: CraneStructure, geometry: CraneGeometry, factors: Array
) -> CraneStructure:
    """Bend less by `factors` (4,), pillar and lift arm ending at the pivots of `geometry`."""
    ends = {"pillar": geometry.lift_pivot[1], "lift": geometry.jib_pivot[0]}
    beams = {}
    for name, factor in zip(BEAMS, factors.tolist(), strict=True):
        beam = getattr(structure, name)
        section = replace(beam.section, second_moment=factor * beam.section.second_moment)
        span = (beam.span[0], ends.get(name, beam.span[1]))
        beams[name] = replace(beam, section=section, span=span)
    return replace(structure, **beams)
