"""The one free constant of the flexible crane, fitted to a published mean error."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from flexik.errors import ParameterError, SolverError
from flexik.evaluation.errors import statistics


@dataclass(frozen=True)
class Calibration:
    """Fitted ground spring in N m/rad, and the errors (frame of `evaluate`) it leaves."""

    spring_stiffness: float
    errors: pd.DataFrame


def fit_spring(
    uncompensated: Callable[[float], pd.DataFrame],
    mean_error: float,
    stiffness_range: tuple[float, float],
) -> Calibration:
    """Find the spring with which the mean uncompensated error equals `mean_error`.

    Parameters
    ----------
    uncompensated
        Frame of `evaluate` for method `none`, from the stiffness in N m/rad.
    mean_error
        In m.
    stiffness_range
        Bracket in N m/rad; a stiffer spring sags less.

    Raises
    ------
    ParameterError
        If the mean error is not met within the range; the errors at both ends are named.
    """

    def excess(log_stiffness: float) -> float:
        return statistics(uncompensated(float(np.exp(log_stiffness))))["mean_error"] - mean_error

    low, high = np.log(stiffness_range)
    try:
        ends = excess(low), excess(high)
    except SolverError as error:
        raise ParameterError(f"calibration.stiffness_range: at its ends {error}") from None
    if ends[0] * ends[1] > 0:
        found = " and ".join(f"{1e3 * (mean_error + end):.2f} mm" for end in ends)
        raise ParameterError(
            f"calibration.stiffness_range: mean errors of {found} at its ends "
            f"do not enclose {1e3 * mean_error:.2f} mm"
        )
    # a compliance, so nearly linear in 1/k; brentq needs about eight evaluations
    stiffness = float(np.exp(brentq(excess, low, high, xtol=1e-9)))
    # six digits: what depends on the machine lies below
    stiffness = float(f"{stiffness:.6g}")
    return Calibration(stiffness, uncompensated(stiffness))
