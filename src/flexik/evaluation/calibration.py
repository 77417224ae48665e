"""Free constants of a flexible machine: one from a mean error, or some from measured tips."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from flexik.errors import ParameterError, SolverError
from flexik.evaluation.errors import statistics

Array = NDArray[np.float64]
Range = tuple[float, float]

# Standard deviation of the logarithm of a constant from which on a campaign does not tell it
UNTOLD = 0.5
# To what the equilibria are computed, m; steps of central differences, in shares of the ranges
PRECISION, STEP = 1e-7, 3e-3
# A constant this near to an end of its range is at it, in shares of the range
END = 1e-3


@dataclass(frozen=True)
class Fit:
    """Constants by key, their standard deviations where data are left over, and what is left.

    rms_distance : root mean square distance of measured and modelled tips, m.
    """

    constants: dict[str, float]
    deviations: dict[str, float] | None
    rms_distance: float


def fit_mean_error(
    uncompensated: Callable[[float], pd.DataFrame], mean_error: float, key: str, limits: Range
) -> float:
    """The constant `key` with which the mean uncompensated error equals `mean_error`, six digits.

    Parameters
    ----------
    uncompensated
        Frame of `evaluate` for method `none`, from the constant.
    mean_error
        In m.
    limits
        Bracket of the constant.

    Raises
    ------
    ParameterError
        If the mean error is not met within the limits; the errors at both ends are named.
    """

    def excess(logarithm: float) -> float:
        return statistics(uncompensated(float(np.exp(logarithm))))["mean_error"] - mean_error

    low, high = np.log(limits)
    try:
        ends = excess(low), excess(high)
    except SolverError as error:
        raise ParameterError(f"calibration.ranges.{key}: at its ends {error}") from None
    if ends[0] * ends[1] > 0:
        found = " and ".join(f"{1e3 * (mean_error + end):.2f} mm" for end in ends)
        raise ParameterError(
            f"calibration.ranges.{key}: mean errors of {found} at its ends "
            f"do not enclose {1e3 * mean_error:.2f} mm"
        )
    # a compliance, so nearly linear in 1/k; brentq needs about eight evaluations
    return _rounded(float(np.exp(brentq(excess, low, high, xtol=1e-9))))


def fit_campaign(
    predicted: Callable[[Mapping[str, float]], Array], measured: Array, ranges: Mapping[str, Range]
) -> Fit:
    """Constants by least squares on the tips `measured` (n, 2) in m.

    Parameters
    ----------
    predicted
        Tips (n, 2) in m, from the constants by key.
    ranges
        Where they are looked for.

    Raises
    ------
    ParameterError
        In one line that names the constants, where there are fewer coordinates of tips than
        constants, where they do not tell a constant, or the best one lies at an end of its range.
    """
    names, (low, high) = list(ranges), np.log(np.array(list(ranges.values()))).T
    if measured.size < len(names):
        raise ParameterError(
            f"calibration.campaign: {measured.size} coordinates of tips are too few for "
            f"{len(names)} constants"
        )

    # from 1 to 2 over the range of the logarithm, so that steps are shares of it
    def constants(x: Array) -> dict[str, float]:
        logarithms = low + (x - 1.0) * (high - low)
        return dict(zip(names, np.exp(logarithms).tolist(), strict=True))

    def residuals(x: Array) -> Array:
        return (predicted(constants(x)) - measured).ravel()

    middle = np.full(len(names), 1.5)
    try:
        found = least_squares(residuals, middle, "3-point", (1.0, 2.0), diff_step=0 * middle + STEP)
    except SolverError as error:
        raise ParameterError(f"calibration.ranges: {error}") from None
    n_left = measured.size - len(names)
    spread = np.sqrt(2.0 * found.cost / n_left) if n_left else 0.0
    # a hair of the normal matrix keeps a constant without any effect from dividing by zero
    slopes = found.jac / (high - low)
    normal = slopes.T @ slopes + 1e-24 * np.eye(len(names))
    deviations = max(spread, PRECISION) * np.sqrt(np.diag(np.linalg.inv(normal)))
    best = constants(found.x)
    if untold := [name for name, s in zip(names, deviations, strict=True) if not s < UNTOLD]:
        raise ParameterError(
            f"calibration.campaign: does not tell {', '.join(untold)}; expected poses and payloads "
            "that differ more, or known values"
        )
    for name, x in zip(names, found.x, strict=True):
        if not 1.0 + END < x < 2.0 - END:
            raise ParameterError(
                f"calibration.ranges.{name}: the best value lies at an end, {best[name]:.6g}"
            )
    errors = {name: best[name] * float(s) for name, s in zip(names, deviations, strict=True)}
    distance = float(np.sqrt(2.0 * found.cost / len(measured)))
    values = {name: _rounded(value) for name, value in best.items()}
    return Fit(values, errors if n_left else None, distance)


def _rounded(value: float) -> float:
    """To six digits: what depends on the computer lies below."""
    return float(f"{value:.6g}")
