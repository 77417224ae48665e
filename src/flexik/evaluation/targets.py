"""Random targets that the loaded, flexible machine can reach, with the coordinates that do it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexik.errors import ParameterError
from flexik.evaluation.conditions import Array
from flexik.kinematics.manipulator import Manipulator
from flexik.kinematics.status import REACHED
from flexik.positioning.method import checked

FlexibleTip = Callable[[Array, Array], Array]

TOLERANCE = 1e-6  # m
N_ITERATIONS = 20  # 95 % of the targets of the crane take five or fewer


@dataclass(frozen=True)
class Targets:
    """Reachable targets.

    targets : (n, 2) in m.
    payload : (n,) in kg.
    values : (n, k) actuator coordinates in m or rad, which put the loaded tip on the targets.
    """

    targets: Array
    payload: Array
    values: Array

    def __post_init__(self) -> None:
        checked("targets", self.targets, None, 2)
        checked("payload", self.payload, len(self.targets))
        checked("values", self.values, len(self.targets), None)

    def __len__(self) -> int:
        return len(self.targets)


class TargetSolution(NamedTuple):
    """Coordinates (n, k), whether they reach (n,), and how far off the loaded tip is (n,) in m.

    A residual of NaN marks rows where the inverse or the equilibrium failed; a finite one of a row
    that is not reached, rows that did not converge. Those rows hold the values of their last pass.
    """

    values: Array
    reached: NDArray[np.bool_]
    residual: Array


def draw_candidates(
    n: int,
    lower: ArrayLike,
    upper: ArrayLike,
    payload: tuple[float, float],
    generator: np.random.Generator,
) -> tuple[Array, Array]:
    """Targets (n, 2) in m and payloads (n,) in kg, all uniform and independent.

    Rows are drawn one after the other: n and then m rows from one generator are those of n + m.

    Parameters
    ----------
    n
        Number of candidates.
    lower, upper
        Corners (2,) of the box of the targets, in m.
    payload
        Smallest and largest, in kg.
    generator
        Source of randomness.

    Raises
    ------
    ParameterError
        If a lower bound is above its upper one, or a payload is not finite.
    PositioningError
        If a corner is not finite or has another shape.
    """
    least = np.append(checked("lower", lower, 2), payload[0])
    most = np.append(checked("upper", upper, 2), payload[1])
    if not (np.isfinite(payload).all() and (least <= most).all()):
        raise ParameterError(f"{lower=}, {upper=}, {payload=}: expected lower <= upper, finite")
    drawn = least + (most - least) * generator.random((n, 3))
    return drawn[:, :2], drawn[:, 2]


def solve_targets(
    targets: Array,
    payload: Array,
    manipulator: Manipulator,
    flexible_tip: FlexibleTip,
    tolerance: float = TOLERANCE,
    n_iterations: int = N_ITERATIONS,
) -> TargetSolution:
    """Coordinates that put the loaded tip on `targets`, by fixed-point iteration of the deflection.

    The rigid inverse is asked for the target minus the deflection of the last pass, zero at first.
    The deflection changes by a few percent of a change of the tip, so that each pass gains one to
    two digits. A target that the rigid machine does not reach counts as not reached, although the
    loaded one may sag onto it: every method starts from the rigid inverse.

    Parameters
    ----------
    targets
        (n, 2) in m.
    payload
        (n,) in kg.
    manipulator
        One whose inverse treats each row alone makes each row of the result independent.
    flexible_tip
        Tip (n, 2) in m of the flexible machine at coordinates (n, k) under payload (n,) in kg; NaN
        where it has no equilibrium.
    tolerance
        Accepted distance between loaded tip and target, in m.
    n_iterations
        Passes at most.

    Raises
    ------
    PositioningError
        If targets or payload have another shape or are not finite.
    """
    targets = checked("targets", targets, None, 2)
    payload = checked("payload", payload, len(targets))
    values, deflection = np.zeros((len(targets), len(manipulator.lower))), np.zeros(targets.shape)
    residual = np.full(len(targets), np.nan)
    rows = np.arange(len(targets))
    for _ in range(n_iterations):
        solution = manipulator.inverse(
            targets[rows] - deflection[rows], values[rows], targets[rows]
        )
        solved = solution.status == REACHED
        residual[rows[~solved]] = np.nan
        rows = rows[solved]
        if not rows.size:
            break
        values[rows] = solution.values[solved]
        tip = flexible_tip(values[rows], payload[rows])
        deflection[rows] = tip - manipulator.forward(values[rows])
        residual[rows] = np.linalg.norm(tip - targets[rows], axis=1)
        rows = rows[residual[rows] >= tolerance]  # NaN leaves too
    return TargetSolution(values, residual < tolerance, residual)


def reachable_targets(
    targets: Array,
    payload: Array,
    manipulator: Manipulator,
    flexible_tip: FlexibleTip,
    tolerance: float = TOLERANCE,
    n_iterations: int = N_ITERATIONS,
) -> Targets:
    """Those of `targets` that `solve_targets` reaches, in their order; see there."""
    values, reached, _ = solve_targets(
        targets, payload, manipulator, flexible_tip, tolerance, n_iterations
    )
    return Targets(targets[reached], payload[reached], values[reached])
