"""Method `adapted`: `combined` on a nominal crane that a few measured points have corrected.

The measurements identify physical offsets of the nominal crane: its dimensions, the play of its
joints, how much more the spring and the beams give way. Offsets the measurements say nothing about
stay at what an engineer expects, so three points already help and more only help further. Beyond
Rouvinen 1999, who met these differences in chapter 4.6.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry, forward
from flexik.kinematics.crane_dimensions import DIMENSIONS, LENGTHS, corrected
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.combined import Combined
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane_measured.joint_play import JOINTS, compliance
from flexik.positioning.method import Array, Command, Network, PositioningError, checked

PLAYS = tuple(f"play_{joint}" for joint in JOINTS)
FACTORS = ("deflection", "spring")
OFFSETS = (*DIMENSIONS, *PLAYS, *FACTORS)

# Dimensions that hold the zero of a stroke too: its sensor's offset cannot be told from theirs
STROKE_ZEROS = ("lift_cylinder_length", "jib_cylinder_length", "extension_start_x")

FEWEST = 3
STEP = 1e-6  # m, of central differences
N_ROUNDS = 2  # joint forces of the nominal crane, then of the corrected one
N_ITERATIONS = 20  # at most; the model is nearly linear in its offsets
TOLERANCE = 1e-6  # of a prior standard deviation


@dataclass(frozen=True)
class Measurements:
    """Measured points: strokes (n, 3) commanded, in m; payload (n,) in kg; tip (n, 2) in m."""

    strokes: Array
    payload: Array
    tip: Array

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.payload))
        if n < FEWEST:
            raise PositioningError(f"measurements: {n} rows, expected {FEWEST} or more")
        for name, columns in (("strokes", (3,)), ("payload", ()), ("tip", (2,))):
            values = checked(f"measured {name}", getattr(self, name), n, *columns)
            object.__setattr__(self, name, values)


@dataclass(frozen=True)
class AdaptationSettings:
    """What an engineer expects before measuring: standard deviations, and the usual play.

    measurement : of a measured coordinate of the tip, m.
    repeatability : of a stroke from one approach to the next, m.
    pivot : of each coordinate of a pin in its link, m.
    length : of the length of a rod, m.
    stroke_offset : of the zero of a stroke sensor, m.
    play, play_deviation : radial clearance of a pin and its standard deviation, m.
    section : of the factor of the whole deflection, relative.
    spring : of the factor of the ground spring's share, relative.
    """

    measurement: float
    repeatability: float
    pivot: float
    length: float
    stroke_offset: float
    play: float
    play_deviation: float
    section: float
    spring: float

    def __post_init__(self) -> None:
        for setting in fields(self):
            name, value = setting.name, getattr(self, setting.name)
            least = 0.0 if name in ("repeatability", "stroke_offset", "play") else None
            if not (np.isfinite(value) and (value > 0.0 or value == least)):
                raise ParameterError(f"adaptation: {name}={value}, expected a positive number")

    def misjudged(self, share: float) -> "AdaptationSettings":
        """What one expects who takes a crane for newer: no play, `share` of every deviation."""
        names = ("pivot", "length", "stroke_offset", "play_deviation", "section", "spring")
        smaller = {name: share * getattr(self, name) for name in names}
        return replace(self, play=0.0, **smaller)


@dataclass(frozen=True)
class Offsets:
    """Identified differences from the nominal crane, by name of OFFSETS.

    values : m for dimensions and the clearance of a joint's pins; relative for the factors.
    covariance : (n_offsets, n_offsets), what measurements and expectation leave; zero: exact.
    """

    values: Mapping[str, float]
    covariance: Array = field(
        default_factory=lambda: np.zeros((len(OFFSETS), len(OFFSETS))), compare=False
    )

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations by name of OFFSETS."""
        roots = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(OFFSETS, roots, strict=True))

    def geometry(self, nominal: CraneGeometry) -> CraneGeometry:
        """`nominal` with the dimensions corrected."""
        return corrected(nominal, np.array([self.values[name] for name in DIMENSIONS]))


def identify(
    crane: FlexibleCrane, network: Network, measurements: Measurements, settings: AdaptationSettings
) -> Offsets:
    """Most probable offsets of the nominal `crane`, given `measurements`.

    Gauss-Newton on the measured tips minus the modelled ones, whitened by what measuring and
    repeatability leave, and on the offsets minus their expectation over their deviation; once
    with the joint forces of the nominal crane and once with those of the corrected one.

    network : predicts the nominal deflection (m) from strokes (m) and payload (kg).

    Raises
    ------
    PositioningError
        Naming the row whose strokes some crane near the nominal one cannot take; or if no crane
        near it fits the measurements.
    """
    closed_tip(crane.geometry, measurements.strokes)
    offsets, _ = prior(settings)
    for _ in range(N_ROUNDS):
        offsets, left = _most_probable(crane, network, measurements, settings, offsets)
    return Offsets(dict(zip(OFFSETS, offsets.tolist(), strict=True)), left)


@dataclass(frozen=True)
class CorrectedDeflection:
    """What takes the tip of the corrected rigid crane to that of the loaded one; a Network."""

    crane: FlexibleCrane
    network: Network
    offsets: Offsets

    def predict(self, values: Array) -> Array:
        """Displacement (n, 2) in m at `values` (n, 4): strokes in m and payload in kg."""
        crane = replace(self.crane, geometry=self.offsets.geometry(self.crane.geometry))
        share, fixed = displacements(crane, self.network, values[:, :3], values[:, 3])
        return fixed + share @ np.array([self.offsets.values[name] for name in (*PLAYS, *FACTORS)])


@dataclass(frozen=True)
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

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        inverse = closed_form(self.offsets.geometry(self.crane.geometry))
        deflection = CorrectedDeflection(self.crane, self.network, self.offsets)
        return Combined(inverse, deflection, self.n_corrections)(targets, payload, initial_strokes)


def prior(settings: AdaptationSettings) -> tuple[Array, Array]:
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


def _most_probable(
    crane: FlexibleCrane,
    network: Network,
    measurements: Measurements,
    settings: AdaptationSettings,
    start: Array,
) -> tuple[Array, Array]:
    """Offsets (n_offsets,) and their covariance, with the joint forces of the offsets `start`."""
    expected, deviation = prior(settings)
    strokes, n_dimensions = measurements.strokes, len(DIMENSIONS)
    known = replace(crane, geometry=corrected(crane.geometry, start[:n_dimensions]))
    share, fixed = displacements(known, network, strokes, measurements.payload)
    white = whitening(known, measurements, settings)
    offsets = start
    for _ in range(N_ITERATIONS):
        dimensions = offsets[:n_dimensions]
        tip = closed_tip(corrected(crane.geometry, dimensions), strokes)
        residual = measurements.tip - tip - fixed - share @ offsets[n_dimensions:]
        by_dimension = slope(crane.geometry, dimensions, strokes)
        slopes = white @ np.concatenate([by_dimension, share], axis=2) * deviation
        system = np.concatenate([slopes.reshape(-1, len(OFFSETS)), np.eye(len(OFFSETS))])
        right = np.concatenate(
            [(white @ residual[..., None]).ravel(), (expected - offsets) / deviation]
        )
        step = np.linalg.lstsq(system, right, rcond=None)[0]
        offsets = offsets + deviation * step
        if not np.isnan(step).any() and np.abs(step).max() < TOLERANCE:
            return offsets, np.outer(deviation, deviation) * np.linalg.inv(system.T @ system)
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
    play, spring = compliance(crane, strokes, payload)
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


def whitening(
    crane: FlexibleCrane, measurements: Measurements, settings: AdaptationSettings
) -> Array:
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
    less, more = (compliance(crane, strokes + d, payload).play.sum(axis=2) for d in (-doubt, doubt))
    scatter = np.concatenate([by_stroke, settings.play * (more - less)[..., None] / 2], axis=2)
    covariance = scatter @ scatter.transpose(0, 2, 1) + settings.measurement**2 * np.eye(2)
    return np.linalg.inv(np.linalg.cholesky(covariance))
