"""Direct kinematics of the SmartEE: the closure equations solved for the elbows by Newton's method.

The classical rival of the network of De Luca, Mattone and Sciandrone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.kinematics.smartee import (
    Array,
    ElbowCircles,
    SmartEEGeometry,
    closure,
    closure_derivatives,
    elbow_circles,
    leg_tip_velocities,
    leg_tips,
)
from flexik.kinematics.status import NOT_CONVERGED, OTHER_BRANCH, REACHED, SINGULAR

# Determinant below which the closure equations are singular; 1 is for tips that move straight
# apart
_SINGULAR = 1e-12


class Direct(NamedTuple):
    """Elbows at given actuated joints.

    Attributes
    ----------
    elbows : (n, 3) in rad; where the status is not REACHED those of the last step that was finite
    status : (n,) of kinematics.status; OTHER_BRANCH: an elbow outside (-pi, 0)
    n_steps : (n,) Newton steps made
    residual : (n,) largest closure error over the squared side of the plate
    """

    elbows: Array
    status: NDArray[np.int64]
    n_steps: NDArray[np.int64]
    residual: Array


def newton_steps(geometry: SmartEEGeometry, actuated: Array, elbows: Array, n_steps: int) -> Array:
    """Elbows (n, 3) after `n_steps` Newton steps from `elbows`; NaN after a singular one.

    Parameters
    ----------
    actuated : (n, 3, 2) in rad, theta1 and theta2 of every leg
    elbows : (n, 3) in rad
    """
    circles = elbow_circles(geometry, actuated)
    for _ in range(n_steps):
        tips = leg_tips(circles, elbows)
        elbows = elbows - _step(circles, elbows, tips, geometry.side)
    return elbows


def solve_elbows(
    geometry: SmartEEGeometry,
    actuated: Array,
    elbows: Array,
    tolerance: float = 1e-13,
    n_steps: int = 50,
) -> Direct:
    """Elbows that close the mechanism at `actuated` joints (n, 3, 2), from `elbows` (n, 3) or (3,).

    Parameters
    ----------
    tolerance : largest closure error over the squared side of the plate of a converged row
    n_steps : at most; rows that converge sooner rest
    """
    n = len(actuated)
    circles = elbow_circles(geometry, actuated)
    elbows = np.array(np.broadcast_to(elbows, (n, 3)), dtype=np.float64)
    status, steps = np.full(n, NOT_CONVERGED), np.zeros(n, dtype=np.int64)
    residual = np.full(n, np.nan)
    open_rows = np.arange(n)
    for step in range(n_steps + 1):
        part = _rows(circles, open_rows)
        tips = leg_tips(part, elbows[open_rows])
        errors = np.abs(closure(tips, geometry.side)).max(axis=1)
        residual[open_rows] = errors / geometry.side**2
        going_on = residual[open_rows] > tolerance
        status[open_rows[~going_on]] = REACHED
        if step == n_steps or not going_on.any():
            break
        rows = open_rows[going_on]
        change = _step(_rows(part, going_on), elbows[rows], tips[going_on], geometry.side)
        regular = np.isfinite(change).all(axis=1)
        status[rows[~regular]] = SINGULAR
        open_rows = rows[regular]
        elbows[open_rows] -= change[regular]
        steps[open_rows] += 1
    # angles a turn apart are the same elbow
    elbows = wrapped(elbows)
    other = (status == REACHED) & (elbows >= 0.0).any(axis=1)
    status[other] = OTHER_BRANCH
    return Direct(elbows, status, steps, residual)


def closed(
    geometry: SmartEEGeometry, actuated: Array, elbows: Array, tolerance: float
) -> tuple[NDArray[np.int64], Array]:
    """Status (n,) of `elbows` (n, 3) however they were found, and their residual (n,), see Direct.

    Elbows of a singular step are NaN and SINGULAR, their residual NaN.
    """
    tips = leg_tips(elbow_circles(geometry, actuated), elbows)
    residual = np.abs(closure(tips, geometry.side)).max(axis=1) / geometry.side**2
    status = np.where(residual <= tolerance, REACHED, NOT_CONVERGED)
    status[np.isnan(residual)] = SINGULAR
    status[(status == REACHED) & (wrapped(elbows) >= 0.0).any(axis=1)] = OTHER_BRANCH
    return status, residual


def wrapped(angles: Array) -> Array:
    """`angles` (rad) in [-pi, pi)."""
    return np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi


def _step(circles: ElbowCircles, elbows: Array, tips: Array, side: float) -> Array:
    """Solution (n, 3) of the linearised closure equations, NaN where they are singular.

    Equation j holds the elbows of legs j and j + 1 alone, so the solution is written out.
    """
    own, following = closure_derivatives(tips, leg_tip_velocities(circles, elbows))
    (a1, a2, a3), (b1, b2, b3), (f1, f2, f3) = own.T, following.T, closure(tips, side).T
    determinant = a1 * a2 * a3 + b1 * b2 * b3
    least = _SINGULAR * (2.0 * side * circles.radius) ** 3
    determinant = np.where(np.abs(determinant) > least, determinant, np.nan)
    step = (
        a2 * a3 * f1 - b1 * a3 * f2 + b1 * b2 * f3,
        b2 * b3 * f1 + a1 * a3 * f2 - a1 * b2 * f3,
        b1 * b3 * f2 + a1 * a2 * f3 - a2 * b3 * f1,
    )
    return np.stack(step, axis=1) / determinant[:, None]


def _rows(circles: ElbowCircles, rows: NDArray[np.int64] | NDArray[np.bool_]) -> ElbowCircles:
    return ElbowCircles(
        circles.centre[rows], circles.along[rows], circles.across[rows], circles.radius
    )
