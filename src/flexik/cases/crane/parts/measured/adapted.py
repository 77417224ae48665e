"""Method `adapted`: `combined` on a nominal crane that a few measured points have corrected.

The measurements identify physical offsets of the nominal crane: its dimensions, the play of its
joints, how much more the spring and the beams give way. Offsets the measurements say nothing about
stay at what an engineer expects, so three points already help and more only help further. Beyond
Rouvinen 1999, who met these differences in chapter 4.6.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexik.cases.crane.measured_section import Expected
from flexik.cases.crane.parts.crane import FlexibleCrane
from flexik.kinematics.crane import CraneGeometry, forward
from flexik.kinematics.crane_dimensions import DIMENSIONS, LENGTHS, corrected
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.multibody.joint_forces import compliance
from flexik.positioning.combined import Combined
from flexik.positioning.method import Answer, Array, Network, PositioningError, checked

# How many pins there are, by name of the joint or drive; as multibody.joint_forces.pins_of has them
JOINTS = {
    **dict.fromkeys(("lift_pivot", "jib_pivot", "rocker_pivot", "rocker_head", "coupler_pin"), 1),
    "lift": 2,
    "jib": 2,
}
PLAYS = tuple(f"play_{joint}" for joint in JOINTS)
FACTORS = ("deflection", "spring")
OFFSETS = (*DIMENSIONS, *PLAYS, *FACTORS)
N_DIMENSIONS = len(DIMENSIONS)

# Dimensions that hold the zero of a stroke too: its sensor's offset cannot be told from theirs
STROKE_ZEROS = ("lift_cylinder_length", "jib_cylinder_length", "extension_start_x")

FEWEST = 3
STEP = 1e-6  # m, of central differences
N_ROUNDS = 2  # joint forces of the nominal crane, then of the corrected one
N_ITERATIONS = 20  # at most; the model is nearly linear in its offsets
TOLERANCE = 1e-6  # of a prior standard deviation


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measured points: strokes (n, 3) commanded, in m; payload (n,) in kg; tip (n, 2) in m."""

    strokes: Array
    payload: Array
    tip: Array

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.payload))
        for name, columns in (("strokes", (3,)), ("payload", ()), ("tip", (2,))):
            values = checked(f"measured {name}", getattr(self, name), n, *columns)
            object.__setattr__(self, name, values)

    def __getitem__(self, rows: slice | Array) -> "Measurements":
        return Measurements(self.strokes[rows], self.payload[rows], self.tip[rows])


@dataclass(frozen=True, eq=False)
class Offsets:
    """Identified differences from the nominal crane, in the order of OFFSETS.

    values : (n_offsets,), m for dimensions and the clearance of a joint's pins; relative for the
        factors.
    covariance : (n_offsets, n_offsets), what measurements and expectation leave; zero: exact.
    """

    values: Array
    covariance: Array = field(default_factory=lambda: np.zeros((len(OFFSETS), len(OFFSETS))))

    @property
    def deviations(self) -> Array:
        """Standard deviations (n_offsets,)."""
        return np.sqrt(np.diag(self.covariance))

    def geometry(self, nominal: CraneGeometry) -> CraneGeometry:
        """`nominal` with the dimensions corrected."""
        return corrected(nominal, self.values[:N_DIMENSIONS])


def misjudged(expected: Expected, share: float) -> Expected:
    """What one expects who takes a crane for newer: no play, `share` of every deviation."""
    names = ("pivot", "length", "stroke_offset", "play_deviation", "section", "spring")
    smaller = {name: share * getattr(expected, name) for name in names}
    return expected.model_copy(update={"play": 0.0, **smaller})


def identify(
    crane: FlexibleCrane, network: Network, measurements: Measurements, settings: Expected
) -> Offsets:
    """Most probable offsets of the nominal `crane`, given `measurements`.

    Gauss-Newton on the measured tips minus the modelled ones, whitened by what measuring and
    repeatability leave, and on the offsets minus their expectation over their deviation; once
    with the joint forces of the nominal crane and once with those of the corrected one.

    network : predicts the nominal deflection (m) from strokes (m) and payload (kg).
    settings : standard deviations, of the clearances too, and the usual clearance `play`; that of
        `length` is of a rod, of `section` and `spring` relative, of the whole deflection and of the
        ground spring's share.

    Raises
    ------
    PositioningError
        Naming the row whose strokes some crane near the nominal one cannot take; or if there are
        fewer measurements than FEWEST, or no crane near the nominal one fits them.
    """
    if (n := len(measurements.payload)) < FEWEST:
        raise PositioningError(f"measurements: {n} rows, expected {FEWEST} or more")
    closed_tip(crane.geometry, measurements.strokes)
    offsets = Offsets(prior(settings)[0])
    for _ in range(N_ROUNDS):
        offsets = _most_probable(crane, network, measurements, settings, offsets)
    return offsets


@dataclass(frozen=True, eq=False)
class CorrectedDeflection:
    """What takes the tip of the corrected rigid crane to that of the loaded one; a Network."""

    crane: FlexibleCrane
    network: Network
    offsets: Offsets

    @cached_property
    def _known(self) -> FlexibleCrane:
        return self.crane.like(self.offsets.geometry(self.crane.geometry))

    def predict(self, values: Array) -> Array:
        """Displacement (n, 2) in m at `values` (n, 4): strokes in m and payload in kg."""
        share, fixed = displacements(self._known, self.network, values[:, :3], values[:, 3])
        return fixed + share @ self.offsets.values[N_DIMENSIONS:]


@dataclass(frozen=True, eq=False)
class Adapted:
    """`Combined` with the corrected dimensions, deflection and play.

    crane : the nominal crane.
    network : predicts its deflection (m) from strokes (m) and payload (kg).
    n_corrections : play changes sides with the strokes, so more than one pays.

    Statuses and diagnostics are those of `Combined`; the diagnosed deflection includes play.
    """

    crane: FlexibleCrane
    network: Network
    offsets: Offsets
    n_corrections: int = 3

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        manipulator = CraneManipulator(self.offsets.geometry(self.crane.geometry))
        deflection = CorrectedDeflection(self.crane, self.network, self.offsets)
        return Combined(manipulator, deflection, self.n_corrections)(query, current)


def prior(settings: Expected) -> tuple[Array, Array]:
    """Expected offsets and their standard deviations, (n_offsets,) each."""
    deviation = dict.fromkeys(OFFSETS, settings.pivot)
    deviation |= dict.fromkeys(LENGTHS, settings.length)
    for name in STROKE_ZEROS:
        deviation[name] = float(np.hypot(deviation[name], settings.stroke_offset))
    for name, n_pins in zip(PLAYS, JOINTS.values(), strict=True):
        deviation[name] = settings.play_deviation / np.sqrt(n_pins)  # mean of its pins
    deviation |= {"deflection": settings.section, "spring": settings.spring}
    expected = [settings.play if name in PLAYS else 0.0 for name in OFFSETS]
    return np.array(expected), np.array([deviation[name] for name in OFFSETS])


def predicted_tip(
    crane: FlexibleCrane,
    network: Network,
    offsets: Offsets | None,
    strokes: Array,
    payload: Array,
) -> Array:
    """Tip (n, 2) in m at `strokes` (n, 3) in m under `payload` (n,) in kg.

    offsets : of the nominal `crane` whose deflection `network` predicts; None: there are none.
    """
    inputs = np.column_stack([strokes, payload])
    if offsets is None:
        return forward(crane.geometry, strokes) + network.predict(inputs)
    deflection = CorrectedDeflection(crane, network, offsets).predict(inputs)
    return forward(offsets.geometry(crane.geometry), strokes) + deflection


def surprise(
    crane: FlexibleCrane,
    network: Network,
    measurements: Measurements,
    settings: Expected,
    offsets: Offsets | None = None,
) -> Array:
    """Distance (n,) of each measured tip from its prediction, in standard deviations.

    The covariance is that of the offsets, of measuring and of repeatability, so the squares of
    these distances have the mean 2 where everything is as expected.

    offsets : identified from other measurements; None: what was expected before measuring.
    """
    if offsets is None:
        expected, deviation = prior(settings)
        offsets = Offsets(expected, np.diag(deviation**2))
    strokes, payload = measurements.strokes, measurements.payload
    residual = measurements.tip - predicted_tip(crane, network, offsets, strokes, payload)
    known = crane.like(offsets.geometry(crane.geometry))
    share, _ = displacements(known, network, strokes, payload)
    slopes = np.concatenate(
        [slope(crane.geometry, offsets.values[:N_DIMENSIONS], strokes), share], axis=2
    )
    white = whitening(known, measurements, settings)
    spread = white @ slopes
    covariance = spread @ offsets.covariance @ spread.transpose(0, 2, 1) + np.eye(2)
    distance = (white @ residual[..., None])[..., 0]
    return np.sqrt(np.einsum("ni,nij,nj->n", distance, np.linalg.inv(covariance), distance))


def _most_probable(
    crane: FlexibleCrane,
    network: Network,
    measurements: Measurements,
    settings: Expected,
    start: Offsets,
) -> Offsets:
    """Offsets with the joint forces of the offsets `start`."""
    expected, deviation = prior(settings)
    strokes = measurements.strokes
    known = crane.like(start.geometry(crane.geometry))
    share, fixed = displacements(known, network, strokes, measurements.payload)
    white = whitening(known, measurements, settings)
    offsets = start.values
    for _ in range(N_ITERATIONS):
        dimensions = offsets[:N_DIMENSIONS]
        tip = closed_tip(corrected(crane.geometry, dimensions), strokes)
        residual = measurements.tip - tip - fixed - share @ offsets[N_DIMENSIONS:]
        by_dimension = slope(crane.geometry, dimensions, strokes)
        slopes = white @ np.concatenate([by_dimension, share], axis=2) * deviation
        system = np.concatenate([slopes.reshape(-1, len(OFFSETS)), np.eye(len(OFFSETS))])
        right = np.concatenate(
            [(white @ residual[..., None]).ravel(), (expected - offsets) / deviation]
        )
        step = np.linalg.lstsq(system, right, rcond=None)[0]
        offsets = offsets + deviation * step
        if not np.isnan(step).any() and np.abs(step).max() < TOLERANCE:
            left = np.outer(deviation, deviation) * np.linalg.inv(system.T @ system)
            return Offsets(offsets, left)
    raise PositioningError(
        "measurements: no crane near the nominal one fits them, expected tips within centimetres "
        "of where the strokes put the nominal crane"
    )


def displacements(
    crane: FlexibleCrane, network: Network, strokes: Array, payload: Array
) -> tuple[Array, Array]:
    """Displacement (n, 2, 8) per unit of PLAYS and FACTORS, and the nominal one (n, 2)."""
    inputs = np.column_stack([strokes, payload])
    deflection = checked("predicted deflection", network.predict(inputs), len(inputs), 2)
    play, spring = compliance(crane.machine, crane.linkage.poses(strokes), payload)
    return np.concatenate([play, deflection[..., None], spring[..., None]], axis=2), deflection


def closed_tip(geometry: CraneGeometry, strokes: Array) -> Array:
    """Rigid tips (n, 2); raises PositioningError where the linkage does not close."""
    tip = forward(geometry, strokes)
    if (broken := np.isnan(tip).any(axis=1)).any():
        row = int(np.argmax(broken))
        raise PositioningError(
            f"measurements: sample {row}: the linkage does not close at strokes {strokes[row]} m"
        )
    return tip


def slope(geometry: CraneGeometry, dimensions: Array, strokes: Array) -> Array:
    """Derivative (n, 2, 20) of the rigid tip with respect to DIMENSIONS."""
    steps = STEP * np.eye(len(dimensions))
    columns = [
        forward(corrected(geometry, dimensions + step), strokes)
        - forward(corrected(geometry, dimensions - step), strokes)
        for step in steps
    ]
    return np.stack(columns, axis=-1) / (2 * STEP)


def whitening(crane: FlexibleCrane, measurements: Measurements, settings: Expected) -> Array:
    """Inverse square roots (n, 2, 2), in 1/m, of the scatter of the measured tips.

    They scatter by measuring and repeatability, and where a joint force is so small that the
    expected errors of the jib's stroke decide its sign, by the play.
    """
    strokes, payload = measurements.strokes, measurements.payload
    columns = [
        forward(crane.geometry, strokes + step) - forward(crane.geometry, strokes - step)
        for step in STEP * np.eye(3)
    ]
    by_stroke = settings.repeatability * np.stack(columns, axis=-1) / (2 * STEP)
    doubt = np.array([0.0, np.hypot(settings.length, settings.stroke_offset), 0.0])
    for shifted in (strokes - doubt, strokes + doubt):
        closed_tip(crane.geometry, shifted)
    less, more = (
        compliance(crane.machine, crane.linkage.poses(strokes + d), payload).play.sum(axis=2)
        for d in (-doubt, doubt)
    )
    scatter = np.concatenate([by_stroke, settings.play * (more - less)[..., None] / 2], axis=2)
    covariance = scatter @ scatter.transpose(0, 2, 1) + settings.measurement**2 * np.eye(2)
    return np.linalg.inv(np.linalg.cholesky(covariance))
