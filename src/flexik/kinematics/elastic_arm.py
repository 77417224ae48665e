"""Planar arm of two links, rigid and with the deformation of its links, vectorised.

Vertical plane: x forward, y up, origin in the first joint. Actuator coordinates are the joint
angles theta_1 (of link 1 from x) and theta_2 (of link 2 from link 1), in rad. Source: Al-Khafaji
and Jweeg 2017, equations 10 to 46.

A link under load has six deformation variables in both, in the order of the paper's network:
dy, dx and dphi of link 1, then of link 2. dx along the link and dy across it move the end of the
link away from its rigid place, dphi turns it (equation 18).
"""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.manipulator import Array, RigidSolution, arc_cosine, limited
from flexik.parameters.model import Interval

DEFORMATION = ("dy_1", "dx_1", "dphi_1", "dy_2", "dx_2", "dphi_2")

# An angle this far outside its limits is round-off of a target on the border, rad
ANGLE_TOLERANCE = 1e-10


@dataclass(frozen=True)
class ArmGeometry:
    """Lengths of the two links in m, and the interval of each joint angle in rad.

    A kinematics.manipulator.Manipulator, whose actuator coordinates are the joint angles.
    """

    lengths: tuple[float, float]
    limits: tuple[Interval, Interval]

    @property
    def lower(self) -> Array:
        """Least joint angles (2,) in rad."""
        return np.array([low for low, _ in self.limits])

    @property
    def upper(self) -> Array:
        """Largest joint angles (2,) in rad."""
        return np.array([high for _, high in self.limits])

    def forward(self, values: Array) -> Array:
        """Tip (n, 2) in m of the rigid arm at angles (n, 2) in rad."""
        values = np.atleast_2d(values)
        return flexible_forward(self, values, np.zeros((len(values), 6)))

    def inverse(
        self, targets: Array, current: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """Exact inverse on the elbow that `inverse_by_rule` chooses for the original target.

        So a correction of some millimetres does not turn the elbow over. Where the corrected target
        is not reached with this elbow, the rule is asked again, which reaches what either elbow
        reaches. The rule leaves nothing to choose: the current angles serve unreached rows only.
        """
        solution = inverse_by_rule(self, targets)
        if original_targets is not None:
            original = np.nan_to_num(inverse_by_rule(self, original_targets).values)
            same = inverse(self, targets, elbow(original))
            solution = solution.but(same.reached, same)
        return solution.or_current(current)

    def branch(self, values: Array) -> Array:
        """Side of the elbow (n, 1) at angles (n, 2)."""
        return elbow(values)[:, None]


def flexible_forward(geometry: ArmGeometry, angles: Array, deformation: Array) -> Array:
    """Tip (n, 2) in m at `angles` (n, 2) in rad with `deformation` (n, 6) in m and rad.

    Equations 44 and 45, whose products of sines and cosines are those of the sum
    theta_1 + theta_2 + dphi_1; dphi_2 turns the tip without moving it.
    """
    theta_1, theta_2 = np.atleast_2d(angles).T
    dy_1, dx_1, dphi_1, dy_2, dx_2, _ = np.atleast_2d(deformation).T
    a_1, a_2 = geometry.lengths
    return _turned(theta_1, a_1 + dx_1, dy_1) + _turned(
        theta_1 + theta_2 + dphi_1, a_2 + dx_2, dy_2
    )


def elbow(angles: Array) -> Array:
    """Side of the elbow (n,): 1 where theta_2 >= 0 (elbow below the line to the tip), else -1."""
    return np.where(np.atleast_2d(angles)[:, 1] >= 0.0, 1.0, -1.0)


def inverse(geometry: ArmGeometry, targets: Array, elbow: Array | float) -> RigidSolution:
    """Angles that put the rigid tip on `targets` (n, 2) in m with `elbow` (n,), 1 or -1."""
    targets = np.atleast_2d(np.asarray(targets, dtype=float))
    x, y = targets.T
    a_1, a_2 = geometry.lengths
    cosine = (x**2 + y**2 - a_1**2 - a_2**2) / (2 * a_1 * a_2)
    theta_2 = elbow * arc_cosine(cosine)
    theta_1 = np.arctan2(y, x) - np.arctan2(a_2 * np.sin(theta_2), a_1 + a_2 * np.cos(theta_2))
    # the turn that lies within the limits, if one does
    low = geometry.limits[0][0] - ANGLE_TOLERANCE
    theta_1 = low + np.mod(theta_1 - low, 2 * np.pi)
    angles = np.column_stack([theta_1, theta_2])
    return limited(angles, geometry.lower, geometry.upper, ANGLE_TOLERANCE)


def inverse_by_rule(geometry: ArmGeometry, targets: Array) -> RigidSolution:
    """Angles for `targets` (n, 2) in m on the elbow that a rule chooses.

    The rule takes the elbow whose angles lie farther inside their limits, relative to half the
    range of each joint, and theta_2 >= 0 of equals. So it reaches what either elbow reaches.
    """
    first, second = (inverse(geometry, targets, side) for side in (1.0, -1.0))
    middle, half = (geometry.lower + geometry.upper) / 2, (geometry.upper - geometry.lower) / 2
    with np.errstate(invalid="ignore"):
        first_off, second_off = (
            np.max(np.abs(solution.values - middle) / half, axis=1) for solution in (first, second)
        )
        return first.but(second_off < first_off, second)


def _turned(angle: Array, along: Array, across: Array) -> Array:
    """Vectors (n, 2) of components `along` and `across` an axis at `angle` (n,) in rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * along - s * across, s * along + c * across])
