"""Method `adapted`: `combined` on a nominal machine that a few measured points have corrected.

The measurements identify physical offsets of the nominal machine, see offsets.py. Those that the
measurements say nothing about stay at what an engineer expects, so three points already help and
more only help further. Beyond Rouvinen 1999, who met these differences in chapter 4.6.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.deviations import Expected
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.joint_forces import compliance
from flexik.planar.measured.offsets import Offset, corrected, dimensions_of, offsets_of
from flexik.positioning.combined import Combined
from flexik.positioning.method import Answer, Array, Network, PositioningError, checked

FEWEST = 3
N_ROUNDS = 2  # joint forces of the nominal machine, then of the corrected one
N_ITERATIONS = 20  # at most; the model is nearly linear in its offsets
TOLERANCE = 1e-6  # of a prior standard deviation


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measured points: commanded `values` (n, k), payload (n,) and tip (n, 2), SI units."""

    values: Array
    payload: Array
    tip: Array

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.payload))
        columns = {"values": (np.shape(self.values)[-1],), "payload": (), "tip": (2,)}
        for name, shape in columns.items():
            given = checked(f"measured {name}", getattr(self, name), n, *shape)
            object.__setattr__(self, name, given)

    def __getitem__(self, rows: slice | Array) -> "Measurements":
        return Measurements(self.values[rows], self.payload[rows], self.tip[rows])


@dataclass(frozen=True, eq=False)
class Offsets:
    """Identified differences from the nominal machine, in the order of `offsets_of`.

    values : (o,), see Offset.unit.
    covariance : (o, o), what measurements and expectation leave; zero: exact.
    """

    values: Array
    covariance: Array = field(default_factory=lambda: np.zeros((1, 1)))

    @property
    def deviations(self) -> Array:
        """Standard deviations (o,)."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, eq=False)
class Nominal:
    """A machine as its file says, and what is expected to be off in it.

    network : predicts its deflection (m) from coordinates (m or rad) and payload (kg).
    """

    flexible: FlexibleMachine
    network: Network
    expected: Expected

    @property
    def machine(self) -> PlanarMachine:
        """What the file says."""
        return self.flexible.machine

    @cached_property
    def offsets(self) -> list[Offset]:
        """What may be off."""
        return offsets_of(self.machine, self.expected)

    @cached_property
    def n_dimensions(self) -> int:
        """How many of the offsets are of the rigid machine; they come first."""
        return len(dimensions_of(self.machine, self.expected))

    @cached_property
    def prior(self) -> Offsets:
        """Offsets as they are expected before measuring."""
        deviation = np.array([offset.deviation for offset in self.offsets])
        return Offsets(np.array([o.expected for o in self.offsets]), np.diag(deviation**2))

    def like(self, offsets: Offsets) -> FlexibleMachine:
        """The machine with its dimensions corrected; raises ParameterError as `corrected` does."""
        dimensions = offsets.values[: self.n_dimensions]
        return self.flexible.like(corrected(self.machine, dimensions))

    def displacements(
        self, known: FlexibleMachine, values: Array, payload: Array
    ) -> tuple[Array, Array]:
        """Displacement of the tip by offsets but dimensions (n, 2, o - d), and by itself (n, 2).

        At coordinates (n, k), with the joint forces of the machine `known`.
        """
        inputs = np.column_stack([values, payload])
        deflection = checked("predicted deflection", self.network.predict(inputs), len(inputs), 2)
        found = compliance(known.machine, known.linkage.poses(values), payload)
        shares = [found.play, deflection[..., None], found.spring]
        return np.concatenate(shares, axis=2), deflection

    def rigid(self, offsets: Offsets, measurements: Measurements) -> tuple[Array, Array]:
        """Rigid tips (n, 2) where it was measured, and derivatives (n, 2, d) by dimensions."""
        known = self.like(offsets)
        poses = closed(known, measurements.values)
        found = compliance(known.machine, poses, measurements.payload)
        return known.linkage.tip(poses)[0], np.concatenate([found.point, found.coordinate], axis=2)


def closed(machine: FlexibleMachine, values: Array, n_samples: int | None = None) -> Array:
    """Poses (n, b, 3); raises PositioningError where the linkage does not close.

    n_samples : after so many rows those of the same samples come again; not given: they do not.
    """
    poses = machine.linkage.poses(values)
    if (broken := np.isnan(poses).any(axis=(1, 2))).any():
        row = int(np.argmax(broken)) % (n_samples or len(values))
        raise PositioningError(
            f"measurements: sample {row}: the linkage does not close at {values[row]} m or rad"
        )
    return poses


def misjudged(expected: Expected, share: float) -> Expected:
    """What one expects who takes a machine for newer: no play, `share` of every deviation."""
    kept = {"measurement", "repeatability", "angle_repeatability", "play"}
    smaller = {name: share * size for name, size in expected if name not in kept}
    return expected.model_copy(update={"play": 0.0, **smaller})


def identify(nominal: Nominal, measurements: Measurements) -> Offsets:
    """Most probable offsets of the `nominal` machine, given `measurements`.

    Gauss-Newton on the measured tips minus the modelled ones, whitened by what measuring and
    repeatability leave, and on the offsets minus their expectation over their deviation; once
    with the joint forces of the nominal machine and once with those of the corrected one.

    Raises
    ------
    PositioningError
        Naming the row whose coordinates some machine near the nominal one cannot take; or if there
        are fewer measurements than FEWEST, or no machine near the nominal one fits them.
    """
    if (n := len(measurements.payload)) < FEWEST:
        raise PositioningError(f"measurements: {n} rows, expected {FEWEST} or more")
    closed(nominal.flexible, measurements.values)
    offsets = nominal.prior
    try:
        for _ in range(N_ROUNDS):
            offsets = _most_probable(nominal, measurements, offsets)
    except (ParameterError, np.linalg.LinAlgError):
        raise _unlike() from None
    return offsets


@dataclass(frozen=True, eq=False)
class CorrectedDeflection:
    """What takes the tip of the corrected rigid machine to that of the loaded one; a Network."""

    nominal: Nominal
    offsets: Offsets

    @cached_property
    def _known(self) -> FlexibleMachine:
        return self.nominal.like(self.offsets)

    def predict(self, values: Array) -> Array:
        """Displacement (n, 2) in m at `values` (n, k + 1): coordinates and payload in kg."""
        share, fixed = self.nominal.displacements(self._known, values[:, :-1], values[:, -1])
        return fixed + share @ self.offsets.values[self.nominal.n_dimensions :]


@dataclass(frozen=True, eq=False)
class Adapted:
    """`Combined` with the corrected dimensions, deflection and play.

    n_corrections : play changes sides with the coordinates, so more than one pays.

    Statuses and diagnostics are those of `Combined`; the diagnosed deflection includes play.
    """

    nominal: Nominal
    offsets: Offsets
    n_corrections: int = 3

    @cached_property
    def _combined(self) -> Combined:
        machine, near = self.nominal.like(self.offsets).machine, self.nominal.flexible.linkage
        deflection = CorrectedDeflection(self.nominal, self.offsets)
        return Combined(manipulator_of(machine, near), deflection, self.n_corrections)

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        return self._combined(query, current)


def predicted_tip(
    nominal: Nominal, offsets: Offsets | None, values: Array, payload: Array
) -> Array:
    """Tip (n, 2) in m at coordinates (n, k) under `payload` (n,) in kg; offsets None: none."""
    inputs, known, network = np.column_stack([values, payload]), nominal.flexible, nominal.network
    if offsets is not None:
        known, network = nominal.like(offsets), CorrectedDeflection(nominal, offsets)
    return known.linkage.tip(known.linkage.poses(values))[0] + network.predict(inputs)


def surprise(nominal: Nominal, measurements: Measurements, offsets: Offsets | None = None) -> Array:
    """Distance (n,) of each measured tip from its prediction, in standard deviations.

    The covariance is that of the offsets, of measuring and of repeatability, so the squares of
    these distances have the mean 2 where everything is as expected.

    offsets : identified from other measurements; None: what was expected before measuring.
    """
    offsets = nominal.prior if offsets is None else offsets
    values, payload = measurements.values, measurements.payload
    tip, by_dimension = nominal.rigid(offsets, measurements)
    known = nominal.like(offsets)
    share, fixed = nominal.displacements(known, values, payload)
    residual = measurements.tip - tip - fixed - share @ offsets.values[nominal.n_dimensions :]
    white = whitening(known, measurements, nominal)
    spread = white @ np.concatenate([by_dimension, share], axis=2)
    covariance = spread @ offsets.covariance @ spread.transpose(0, 2, 1) + np.eye(2)
    distance = (white @ residual[..., None])[..., 0]
    return np.sqrt(np.einsum("ni,nij,nj->n", distance, np.linalg.inv(covariance), distance))


def _most_probable(nominal: Nominal, measurements: Measurements, start: Offsets) -> Offsets:
    """Offsets with the joint forces of the offsets `start`."""
    expected, deviation = nominal.prior.values, nominal.prior.deviations
    known = nominal.like(start)
    share, fixed = nominal.displacements(known, measurements.values, measurements.payload)
    white = whitening(known, measurements, nominal)
    offsets = start.values
    for _ in range(N_ITERATIONS):
        tip, by_dimension = nominal.rigid(Offsets(offsets), measurements)
        residual = measurements.tip - tip - fixed - share @ offsets[nominal.n_dimensions :]
        slopes = white @ np.concatenate([by_dimension, share], axis=2) * deviation
        system = np.concatenate([slopes.reshape(-1, len(offsets)), np.eye(len(offsets))])
        right = np.concatenate(
            [(white @ residual[..., None]).ravel(), (expected - offsets) / deviation]
        )
        step = np.linalg.lstsq(system, right, rcond=None)[0]
        offsets = offsets + deviation * step
        if not np.isnan(step).any() and np.abs(step).max() < TOLERANCE:
            left = np.outer(deviation, deviation) * np.linalg.inv(system.T @ system)
            return Offsets(offsets, left)
    raise _unlike()


def _unlike() -> PositioningError:
    return PositioningError(
        "measurements: no machine near the nominal one fits them, expected tips within centimetres "
        "of where the coordinates put the nominal machine"
    )


def whitening(known: FlexibleMachine, measurements: Measurements, nominal: Nominal) -> Array:
    """Inverse square roots (n, 2, 2), in 1/m, of the scatter of the measured tips.

    They scatter by measuring and repeatability, and where a joint force is so small that the
    expected error of a drive's zero decides its sign, by the play.
    """
    values, payload = measurements.values, measurements.payload
    expected, machine = nominal.expected, known.machine
    turns = np.array([drive.kind == "revolute" for drive in machine.drives.values()])
    repeats = np.where(turns, expected.angle_repeatability, expected.repeatability)
    doubt = np.diag(nominal.prior.deviations[: nominal.n_dimensions][-len(turns) :])
    # all at once: as commanded, and with every zero a deviation less and more
    shifts = np.vstack([np.zeros(len(turns)), -doubt, doubt])
    shifted = (values + shifts[:, None]).reshape(-1, len(turns))
    found = compliance(machine, closed(known, shifted, len(values)), np.tile(payload, len(shifts)))
    play = np.split(found.play.sum(axis=2), len(shifts))
    scatter = [repeats * found.coordinate[: len(values)]]
    for less, more in zip(play[1 : len(turns) + 1], play[len(turns) + 1 :], strict=True):
        scatter.append(expected.play * (more - less)[..., None] / 2)
    whole = np.concatenate(scatter, axis=2)
    covariance = whole @ whole.transpose(0, 2, 1) + expected.measurement**2 * np.eye(2)
    return np.linalg.inv(np.linalg.cholesky(covariance))
