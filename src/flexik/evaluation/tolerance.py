"""Positioning errors of an iterative method by the tolerance that ends its iteration.

As in Rouvinen 1999, chapters 4.2 and 4.3.
"""

from collections.abc import Callable, Iterable

import pandas as pd

from flexik.errors import DataError
from flexik.evaluation.conditions import Array, Conditions
from flexik.evaluation.errors import FlexibleTip, evaluate, statistics
from flexik.positioning.method import Method


def tolerance_study(
    method_of: Callable[[float], Method],
    tolerances: Iterable[float],
    conditions: Conditions,
    initial_strokes: Array,
    flexible_tip: FlexibleTip,
) -> pd.DataFrame:
    """Errors and iterations of `method_of(tolerance)` over `conditions`, for each tolerance.

    Parameters
    ----------
    method_of
        Method with a given tolerance; its diagnostics have `n_iterations`, whole numbers.
    tolerances
        In the method's own unit.
    conditions, initial_strokes, flexible_tip
        As `flexik.evaluation.errors.evaluate` takes them.

    Returns
    -------
    DataFrame
        A row a tolerance: tolerance, mean_error and max_error in m, mean_iterations,
        max_iterations, n_failed. Failed conditions count in all of them.

    Raises
    ------
    DataError
        If the diagnostics have no whole numbers `n_iterations`.
    PositioningError
        As `evaluate`.
    """
    rows = []
    for tolerance in tolerances:
        frame = evaluate(method_of(tolerance), conditions, initial_strokes, flexible_tip)
        if "n_iterations" not in frame or frame["n_iterations"].dtype.kind != "i":
            raise DataError(f"method with {tolerance=}: expected whole diagnostics n_iterations")
        found = statistics(frame)
        rows.append(
            {
                "tolerance": tolerance,
                "mean_error": found["mean_error"],
                "max_error": found["max_error"],
                "mean_iterations": float(frame["n_iterations"].mean()),
                "max_iterations": int(frame["n_iterations"].max()),
                "n_failed": found["n_failed"],
            }
        )
    return pd.DataFrame(rows)
