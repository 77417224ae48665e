"""Rigid kinematics of the PATU 655 log crane, in closed form and vectorised.

Plane of the boom: x forward, y up, origin on the ground at the slew axis. Actuator coordinates are
the strokes of the lift, jib and extension cylinders, in m. Source: Rouvinen 1999, appendix A; the
points follow its MATLAB code (the table printed above it pairs the A-C and B-D components oddly).
The code rounds |GI| to 0.2581 m; here |GI| is the length of the vector GI itself, because the
flexible model puts its pins at the same points. The tips differ from the code's by under 0.5 mm
(0.2 mm for jib strokes up to 0.58 m).
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.manipulator import Array, RigidSolution, arc_cosine, limited

Vector = tuple[float, float]
# A stroke this far outside its limits is round-off of a target on the border, m
STROKE_TOLERANCE = 1e-10


@dataclass(frozen=True)
class CraneGeometry:
    """Dimensions in m. Frames: `ground`; `lift` (origin B, x along the arm); `jib` (origin G).

    lift_pivot, lift_cylinder_base : B and C in the ground frame.
    lift_cylinder_head, jib_pivot, rocker_pivot, jib_cylinder_base : D, G, F, E in the lift frame.
    coupler_pin, extension_start : I and J in the jib frame; the tip lies `stroke` farther along x.
    lift_cylinder_length, jib_cylinder_length : |CD| and |EH| at zero stroke.
    rocker_length, coupler_length : |FH| and |HI|.
    stroke_maximum : longest strokes of lift, jib and extension cylinder; the shortest are zero.
    """

    lift_pivot: Vector
    lift_cylinder_base: Vector
    lift_cylinder_head: Vector
    jib_pivot: Vector
    rocker_pivot: Vector
    jib_cylinder_base: Vector
    coupler_pin: Vector
    extension_start: Vector
    lift_cylinder_length: float
    jib_cylinder_length: float
    rocker_length: float
    coupler_length: float
    stroke_maximum: tuple[float, float, float]


class CranePose(NamedTuple):
    """Pins and the tip in the ground frame, each (n, 2) in m; absolute angles (n,) in rad."""

    lift_cylinder_base: Array
    lift_pivot: Array
    lift_cylinder_head: Array
    jib_pivot: Array
    rocker_pivot: Array
    jib_cylinder_base: Array
    rocker_head: Array
    coupler_pin: Array
    extension_start: Array
    tip: Array
    lift_angle: Array
    jib_angle: Array


def pose(geometry: CraneGeometry, strokes: Array) -> CranePose:
    """Pins, tip and link angles of the rigid crane at `strokes` (n, 3) in m.

    Strokes that the linkage cannot assemble give NaN; within the stroke limits none do.
    """
    strokes = np.atleast_2d(np.asarray(strokes, dtype=float))
    lift_angle = _lift_angle(geometry, strokes[:, 0])
    relative_angle, rocker_head = _jib_angle(geometry, strokes[:, 1])
    jib_angle = lift_angle + relative_angle

    pivot = np.broadcast_to(np.array(geometry.lift_pivot), (len(strokes), 2))
    from_lift = partial(placed, pivot, lift_angle)
    jib_pivot = from_lift(geometry.jib_pivot)
    from_jib = partial(placed, jib_pivot, jib_angle)
    return CranePose(
        lift_cylinder_base=np.broadcast_to(np.array(geometry.lift_cylinder_base), pivot.shape),
        lift_pivot=pivot,
        lift_cylinder_head=from_lift(geometry.lift_cylinder_head),
        jib_pivot=jib_pivot,
        rocker_pivot=from_lift(geometry.rocker_pivot),
        jib_cylinder_base=from_lift(geometry.jib_cylinder_base),
        rocker_head=from_lift(rocker_head),
        coupler_pin=from_jib(geometry.coupler_pin),
        extension_start=from_jib(geometry.extension_start),
        tip=from_jib(_tip_in_jib(geometry, strokes[:, 2])),
        lift_angle=lift_angle,
        jib_angle=jib_angle,
    )


def check_assembly(geometry: CraneGeometry, n_steps: int = 201) -> None:
    """Raise ParameterError unless the linkage closes over the strokes of lift and jib cylinder."""
    steps = np.linspace(0.0, 1.0, n_steps)[:, None]
    for number, name in enumerate(("lift", "jib")):
        strokes = steps * np.eye(3)[number] * geometry.stroke_maximum
        broken = np.isnan(pose(geometry, strokes).tip).any(axis=1)
        if broken.any():
            stroke = strokes[np.argmax(broken), number]
            raise ParameterError(f"the linkage does not close at a {name} stroke of {stroke:.3g} m")


def forward(geometry: CraneGeometry, strokes: Array) -> Array:
    """Tip (n, 2) in m of the rigid crane at `strokes` (n, 3) in m."""
    return pose(geometry, strokes).tip


def inverse(geometry: CraneGeometry, targets: Array, extension: Array | float) -> RigidSolution:
    """Lift and jib strokes that put the rigid tip on `targets` (n, 2), at `extension` (n,), in m.

    The distance from lift pivot to tip is greatest near a jib stroke of 0.02 m (arm stretched) and
    least near 0.77 m (arm folded); outside that interval a second jib stroke gives the same
    distance. The branch inside is taken, the one outside only where the first needs a stroke that
    the cylinders do not have.
    """
    targets = np.atleast_2d(np.asarray(targets, dtype=float))
    extension = np.broadcast_to(np.asarray(extension, dtype=float), targets.shape[:1])
    inside, outside = (_inverse_branch(geometry, targets, extension, s) for s in (-1.0, 1.0))
    return inside.but(~inside.reached & outside.reached, outside)


def smallest_extension(
    geometry: CraneGeometry, targets: Array, at_least: Array | float = 0.0
) -> Array:
    """Smallest extension stroke >= `at_least` with which the rigid tip reaches `targets` (n, 2).

    The rule of Rouvinen's appendix B without its rounded limits: the set of extensions that reach
    a target begins where another stroke meets its limit or the arm its fold, so those extensions
    are the only candidates. Returns (n,) in m, NaN where no extension reaches.
    """
    targets = np.atleast_2d(np.asarray(targets, dtype=float))
    n = len(targets)
    lowest = np.broadcast_to(np.asarray(at_least, dtype=float), (n,))
    candidates = np.column_stack([lowest, *_extension_borders(geometry, targets)])
    longest = geometry.stroke_maximum[2]
    with np.errstate(invalid="ignore"):
        allowed = (candidates >= lowest[:, None] - STROKE_TOLERANCE) & (
            candidates <= longest + STROKE_TOLERANCE
        )
    candidates = np.clip(candidates, lowest[:, None], longest)
    candidates = np.sort(np.where(allowed, candidates, np.nan), axis=1)  # NaN sorts last
    smallest = np.full(n, np.nan)
    for column in candidates.T:
        open_rows = np.isnan(smallest) & ~np.isnan(column)
        if not open_rows.any():
            continue
        reached = inverse(geometry, targets[open_rows], column[open_rows]).reached
        smallest[np.flatnonzero(open_rows)[reached]] = column[open_rows][reached]
    return smallest


def inverse_with_smallest_extension(
    geometry: CraneGeometry, targets: Array, at_least: Array | float = 0.0
) -> RigidSolution:
    """Strokes (n, 3) for `targets` (n, 2) with the smallest extension >= `at_least`, in m."""
    extension = smallest_extension(geometry, targets, at_least)
    return inverse(geometry, targets, np.where(np.isnan(extension), at_least, extension))


def placed(origin: Array, angle: Array, point: Vector | Array) -> Array:
    """`point` (n, 2) or (2,) of a body whose frame lies at `origin` (n, 2) and `angle` (n,)."""
    return origin + rotate(angle, np.asarray(point, dtype=float))


def rotate(angle: Array, vectors: Array) -> Array:
    """Rotate `vectors` (n, 2) or (2,) by `angle` (n,) in rad, counter-clockwise."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _from(origin: Vector, point: Vector) -> Vector:
    return (point[0] - origin[0], point[1] - origin[1])


def _arg(vector: Vector) -> float:
    return float(np.arctan2(vector[1], vector[0]))


def _wrap(angle: Array) -> Array:
    """Angle in (-pi, pi]."""
    return np.angle(np.exp(1j * angle))


def _opposite_angle(a: float | Array, b: float | Array, c: float | Array) -> Array:
    """Angle between sides `a` and `b` of a triangle whose third side is `c`."""
    return arc_cosine(np.asarray((a**2 + b**2 - c**2) / (2 * a * b)))


def _opposite_side(a: float, b: float, angle: Array) -> Array:
    """Third side (n,); negative where the angle is: beyond half a turn there is no assembly."""
    side = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(angle))
    return np.where(angle >= 0, side, -side)


def _tip_in_jib(geometry: CraneGeometry, extension: Array) -> Array:
    start = geometry.extension_start
    return np.stack([start[0] + extension, np.full_like(extension, start[1])], axis=-1)


def _lift_angle(geometry: CraneGeometry, stroke: Array) -> Array:
    base = _from(geometry.lift_pivot, geometry.lift_cylinder_base)
    head = geometry.lift_cylinder_head
    length = geometry.lift_cylinder_length + stroke
    opening = _opposite_angle(np.hypot(*base), np.hypot(*head), length)
    return _arg(base) + opening - _arg(head)


def _lift_stroke(geometry: CraneGeometry, lift_angle: Array) -> Array:
    base = _from(geometry.lift_pivot, geometry.lift_cylinder_base)
    head = geometry.lift_cylinder_head
    opening = _wrap(lift_angle + _arg(head) - _arg(base))
    length = _opposite_side(np.hypot(*base), np.hypot(*head), opening)
    return length - geometry.lift_cylinder_length


def _jib_angle(geometry: CraneGeometry, stroke: Array) -> tuple[Array, Array]:
    """Jib angle relative to the lift arm (n,), and H in the lift frame (n, 2)."""
    pivot = np.array(geometry.jib_pivot)
    rocker_pivot = np.array(geometry.rocker_pivot)
    base = _from(geometry.rocker_pivot, geometry.jib_cylinder_base)
    length = geometry.jib_cylinder_length + stroke
    # H lies above the arm: clockwise from the direction F -> E
    rocker_angle = _arg(base) - _opposite_angle(np.hypot(*base), geometry.rocker_length, length)
    rocker_head = rocker_pivot + geometry.rocker_length * _unit(rocker_angle)
    to_head = rocker_head - pivot
    distance = np.hypot(to_head[:, 0], to_head[:, 1])
    radius = float(np.hypot(*geometry.coupler_pin))
    # I lies on the far side of the line G -> H, seen from F: clockwise
    side = _opposite_angle(distance, radius, geometry.coupler_length)
    pin_angle = np.arctan2(to_head[:, 1], to_head[:, 0]) - side
    return _wrap(pin_angle - _arg(geometry.coupler_pin)), rocker_head


def _jib_stroke(geometry: CraneGeometry, relative_angle: Array) -> Array:
    pivot = np.array(geometry.jib_pivot)
    rocker_pivot = np.array(geometry.rocker_pivot)
    radius = float(np.hypot(*geometry.coupler_pin))
    pin = pivot + radius * _unit(relative_angle + _arg(geometry.coupler_pin))
    to_pin = pin - rocker_pivot
    distance = np.hypot(to_pin[:, 0], to_pin[:, 1])
    # the mirror image of the forward assembly: H counter-clockwise of F -> I
    side = _opposite_angle(distance, geometry.rocker_length, geometry.coupler_length)
    rocker_angle = np.arctan2(to_pin[:, 1], to_pin[:, 0]) + side
    base = _from(geometry.rocker_pivot, geometry.jib_cylinder_base)
    opening = _wrap(_arg(base) - rocker_angle)
    length = _opposite_side(np.hypot(*base), geometry.rocker_length, opening)
    return length - geometry.jib_cylinder_length


def _unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _inverse_branch(
    geometry: CraneGeometry, targets: Array, extension: Array, sign: float
) -> RigidSolution:
    pivot, jib_pivot = np.array(geometry.lift_pivot), geometry.jib_pivot
    from_pivot = targets - pivot
    tip = _tip_in_jib(geometry, extension)
    arm, outer = float(np.hypot(*jib_pivot)), np.hypot(tip[:, 0], tip[:, 1])
    reach = np.hypot(from_pivot[:, 0], from_pivot[:, 1])
    with np.errstate(invalid="ignore"):
        bend = arc_cosine((reach**2 - arm**2 - outer**2) / (2 * arm * outer))
    tip_direction = np.arctan2(tip[:, 1], tip[:, 0])
    relative_angle = _wrap(_arg(jib_pivot) - tip_direction + sign * bend)
    tip_in_lift = np.array(jib_pivot) + rotate(relative_angle, tip)
    lift_angle = np.arctan2(from_pivot[:, 1], from_pivot[:, 0]) - np.arctan2(
        tip_in_lift[:, 1], tip_in_lift[:, 0]
    )
    strokes = np.column_stack(
        [_lift_stroke(geometry, lift_angle), _jib_stroke(geometry, relative_angle), extension]
    )
    return limited(strokes, np.zeros(3), np.array(geometry.stroke_maximum), STROKE_TOLERANCE)


def _extension_borders(geometry: CraneGeometry, targets: Array) -> list[Array]:
    """Extensions (n,) at which a target meets a limit of lift or jib, or the fold; may be NaN."""
    start = geometry.extension_start
    from_pivot = targets - np.array(geometry.lift_pivot)
    reach = np.hypot(from_pivot[:, 0], from_pivot[:, 1])
    arm = float(np.hypot(*geometry.jib_pivot))

    def extension_of_radius(radius: Array) -> Array:
        with np.errstate(invalid="ignore"):
            return np.sqrt(radius**2 - start[1] ** 2) - start[0]

    borders = [extension_of_radius(reach - arm)]
    for limit in (0.0, geometry.stroke_maximum[0]):
        angle = _lift_angle(geometry, np.full(len(targets), limit))
        to_tip = from_pivot - rotate(angle, np.array(geometry.jib_pivot))
        borders.append(extension_of_radius(np.hypot(to_tip[:, 0], to_tip[:, 1])))
    for limit in (0.0, geometry.stroke_maximum[1]):
        angle = _jib_angle(geometry, np.array([limit]))[0]
        along = rotate(angle, np.array([[1.0, 0.0]]))[0]
        fixed = np.array(geometry.jib_pivot) + rotate(angle, np.array([start]))[0]
        # |fixed + s along| = reach
        half = float(fixed @ along)
        with np.errstate(invalid="ignore"):
            root = np.sqrt(half**2 - float(fixed @ fixed) + reach**2)
        borders.append(-half + root)
    return borders
