"""Kinematics of the SmartEE, a plate on three articulated legs: closed forms, vectorised.

Base frame: z up, origin in the middle of the leg bases. Leg j stands at 0, 120, 240 deg about z
and has three joints: theta1 (pitch) and theta2 (roll about the axis of the first link), which are
actuated, and the passive elbow theta3. A ball joint ties its tip to the plate, at the same angle
on a circle about the plate's centre. Source: De Luca, Mattone and Sciandrone, "Direct kinematics
of articulated parallel manipulators using neural networks", equation 1 and appendix.

Two slips of the print are put right: the leg frame is turned by -pi/2 about x (the printed -pi lays
the legs flat at zero angles), and the base of a leg stands off the origin.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.errors import ParameterError
from flexik.kinematics.status import OUT_OF_REACH, REACHED

Array = NDArray[np.float64]

N_LEGS = 3
LEG_ANGLES = 2.0 * np.pi / 3.0 * np.arange(N_LEGS)


@dataclass(frozen=True)
class SmartEEGeometry:
    """Dimensions in m.

    Attributes
    ----------
    first_link, second_link : L1 and L2
    base_radius : of the circle of the leg bases
    plate_radius : of the circle of the ball joints about the centre of the plate

    Raises
    ------
    ParameterError
        When a length is not positive.
    """

    first_link: float
    second_link: float
    base_radius: float
    plate_radius: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0:
                raise ParameterError(f"SmartEE geometry: {name}={value}, expected a length above 0")

    @property
    def side(self) -> float:
        """Distance of two ball joints, |AB| = |BC| = |CA|."""
        return float(np.sqrt(3.0)) * self.plate_radius


class Inverse(NamedTuple):
    """Joint angles of given poses.

    Attributes
    ----------
    joints : (n, 3, 3) in rad, [leg, joint]: theta1, theta2, theta3; NaN where a leg cannot reach
    status : (n,) REACHED or OUT_OF_REACH
    """

    joints: Array
    status: NDArray[np.int64]


class ElbowCircles(NamedTuple):
    """Where the leg tips can be at given actuated joints: circles about the elbows.

    The tip of a leg is centre + radius (cos theta3 along + sin theta3 across).

    Attributes
    ----------
    centre : (n, 3, 3) of each leg's elbow, m, base frame
    along, across : (n, 3, 3), orthogonal unit vectors: of the first link, and across it
    radius : L2
    """

    centre: Array
    along: Array
    across: Array
    radius: float


def elbow_circles(geometry: SmartEEGeometry, actuated: Array) -> ElbowCircles:
    """Circles of the leg tips at `actuated` joints (n, 3, 2), theta1 and theta2 of every leg."""
    sine, cosine = np.sin(actuated), np.cos(actuated)
    s1, s2, c1, c2 = sine[..., 0], sine[..., 1], cosine[..., 0], cosine[..., 1]
    along = _from_leg_frames(s1, -c1, np.zeros_like(s1))
    across = _from_leg_frames(c1 * c2, s1 * c2, s2)
    centre = geometry.first_link * along
    centre += base_points(geometry)
    return ElbowCircles(centre, along, across, geometry.second_link)


def leg_tips(circles: ElbowCircles, elbows: Array) -> Array:
    """Tips (n, 3, 3) of the legs, [leg, coordinate], in m, at `elbows` theta3 (n, 3)."""
    cosine, sine = np.cos(elbows)[..., None], np.sin(elbows)[..., None]
    return circles.centre + circles.radius * (cosine * circles.along + sine * circles.across)


def leg_tip_velocities(circles: ElbowCircles, elbows: Array) -> Array:
    """Derivatives (n, 3, 3) of the tips by theta3 of their own leg, m/rad."""
    cosine, sine = np.cos(elbows)[..., None], np.sin(elbows)[..., None]
    return circles.radius * (cosine * circles.across - sine * circles.along)


def base_points(geometry: SmartEEGeometry) -> Array:
    """Bases (3, 3) of the legs, [leg, coordinate], m."""
    return geometry.base_radius * _directions()


def rotation_zyz(angles: Array) -> Array:
    """Rotation matrices (n, 3, 3) Rz(a) Ry(b) Rz(c) of Euler angles (n, 3), rad."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [ca * cb * cc - sa * sc, -ca * cb * sc - sa * cc, ca * sb],
        [sa * cb * cc + ca * sc, -sa * cb * sc + ca * cc, sa * sb],
        [-sb * cc, sb * sc, cb],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def plate_points(geometry: SmartEEGeometry, position: Array, rotation: Array) -> Array:
    """Ball joints (n, 3, 3), [leg, coordinate], of a plate at `position` (n, 3) and `rotation`."""
    return position[:, None, :] + geometry.plate_radius * (_directions() @ rotation.mT)


def inverse(geometry: SmartEEGeometry, position: Array, rotation: Array) -> Inverse:
    """Joint angles of given poses, in closed form, a leg at a time.

    Of the solutions of a leg, the one with theta3 < 0 (the elbow outside) and |theta2| < pi/2, to
    which the joints are limited.

    Parameters
    ----------
    position : (n, 3) of the plate's centre, m
    rotation : (n, 3, 3) from the plate frame to the base frame
    """
    x, y, z = _in_leg_frames(geometry, plate_points(geometry, position, rotation))
    first, second = geometry.first_link, geometry.second_link
    c3 = (x * x + y * y + z * z - first**2 - second**2) / (2.0 * first * second)
    with np.errstate(invalid="ignore", divide="ignore"):
        s3 = -np.sqrt(1.0 - c3 * c3)
        s2 = z / (second * s3)
        c2 = np.sqrt(1.0 - s2 * s2)
        # along the first link and across it, in the plane that theta1 turns
        a, b = first + second * c3, second * c2 * s3
        theta1 = np.arctan2(a * x + b * y, b * x - a * y)
        joints = np.stack([theta1, np.arctan2(s2, c2), np.arctan2(s3, c3)], axis=-1)
    # a stretched leg (s3 = 0) has no theta2
    reached = (np.isfinite(joints).all(axis=-1) & (s3 < 0.0)).all(axis=1)
    joints[~reached] = np.nan
    return Inverse(joints, np.where(reached, REACHED, OUT_OF_REACH))


def pose(tips: Array) -> tuple[Array, Array]:
    """Position (n, 3) and rotation (n, 3, 3) of the plate from leg `tips` (n, 3, 3).

    Equation 6, which also holds for tips that violate the closure: the barycentre, n through the
    first tip, s along the line from the third to the second, a = n x s (the print says a x s).
    The columns of the rotation are n, s, a; those of violated closure are not quite orthogonal.
    """
    position = tips.mean(axis=1)
    n = _unit(tips[:, 0] - position)
    s = _unit(tips[:, 1] - tips[:, 2])
    return position, np.stack([n, s, np.cross(n, s)], axis=-1)


def complete_direct(
    geometry: SmartEEGeometry, actuated: Array, elbows: Array
) -> tuple[Array, Array]:
    """Position (n, 3) and rotation (n, 3, 3) at `actuated` joints (n, 3, 2) and `elbows` (n, 3)."""
    return pose(leg_tips(elbow_circles(geometry, actuated), elbows))


def closure(tips: Array, side: float) -> Array:
    """Left sides (n, 3) of the closure equations 1, m^2: 0 where the tips fit a plate of `side`."""
    difference = tips - np.roll(tips, -1, axis=1)
    return np.einsum("nij,nij->ni", difference, difference) - side * side


def closure_jacobian(tips: Array, velocities: Array) -> Array:
    """Derivatives (n, 3, 3) of the closure equations by the three elbows, m^2/rad.

    Parameters
    ----------
    tips, velocities : of `leg_tips` and `leg_tip_velocities`
    """
    own, following = closure_derivatives(tips, velocities)
    jacobian = np.zeros_like(tips)
    legs = np.arange(N_LEGS)
    jacobian[:, legs, legs] = own
    jacobian[:, legs, (legs + 1) % N_LEGS] = following
    return jacobian


def closure_derivatives(tips: Array, velocities: Array) -> tuple[Array, Array]:
    """Derivatives (n, 3) of equation j by the elbow of leg j, and by that of the next leg.

    There are no others: an equation ties two legs.
    """
    difference = 2.0 * (tips - np.roll(tips, -1, axis=1))
    own = np.einsum("nij,nij->ni", difference, velocities)
    following = np.einsum("nij,nij->ni", difference, np.roll(velocities, -1, axis=1))
    return own, -following


def _directions() -> Array:
    """Unit vectors (3, 3) from the middle to the legs."""
    return np.column_stack([np.cos(LEG_ANGLES), np.sin(LEG_ANGLES), np.zeros(N_LEGS)])


def _from_leg_frames(x: Array, y: Array, z: Array) -> Array:
    """Vectors (n, 3, 3), base frame, of components (n, 3) in the leg frames: Rz(phi) Rx(-pi/2)."""
    c, s = np.cos(LEG_ANGLES), np.sin(LEG_ANGLES)
    return np.stack([c * x - s * z, s * x + c * z, -y], axis=-1)


def _in_leg_frames(geometry: SmartEEGeometry, points: Array) -> tuple[Array, Array, Array]:
    """Components (n, 3) of `points` (n, 3, 3) from the base of each leg, in its leg frame."""
    c, s = np.cos(LEG_ANGLES), np.sin(LEG_ANGLES)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return c * x + s * y - geometry.base_radius, -z, c * y - s * x


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
