"""Errors of a method on conditions as one long table, and the statistics published of them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field
from flexik.errors import DataError
from flexik.evaluation.conditions import Array, Conditions
from flexik.kinematics.status import REACHED, STATUS_MEANING
from flexik.positioning.method import Columns, Method, checked

FlexibleTip = Callable[[Array, Array], Array]

GROUP = Field("point", "1", "number of the point, path or pose, from 0", "int64")
STATUS = Field("status", "1", "0 reached, else see flexik.kinematics.status", "int64")
# What `tip_judge` finds
TIP_ERRORS = (
    Field("achieved_x", "m", "tip of the flexible model at the commanded coordinates"),
    Field("achieved_y", "m", "tip of the flexible model at the commanded coordinates"),
    Field("error_x", "m", "desired minus achieved"),
    Field("error_y", "m", "desired minus achieved"),
    Field("error", "m", "length of the error"),
)
# An answer this far beyond its limit is round-off, m or rad
LIMIT_TOLERANCE = 1e-9

STATISTICS: dict[str, Callable[[pd.DataFrame], float]] = {
    "max_abs_dx": lambda frame: frame["error_x"].abs().max(),
    "max_abs_dy": lambda frame: frame["error_y"].abs().max(),
    "max_error": lambda frame: frame["error"].max(),
    "mean_abs_dx": lambda frame: frame["error_x"].abs().mean(),
    "mean_abs_dy": lambda frame: frame["error_y"].abs().mean(),
    "mean_error": lambda frame: frame["error"].mean(),
}


class Judge(Protocol):
    """Errors of answers."""

    def __call__(self, query: Array, values: Array) -> Mapping[str, NDArray]:
        """Columns (m,) of Columns.errors at `query` (m, p) for `values` (m, k)."""
        ...


def tip_judge(flexible_tip: FlexibleTip) -> Judge:
    """Judge of planar machines: desired minus achieved tip (Rouvinen 1999, figure 4.3).

    `flexible_tip` gives the tip (m, 2) in m at coordinates (m, k) under payload (m,) in kg. Raises
    PositioningError if a tip is not finite.
    """

    def judge(query: Array, values: Array) -> dict[str, NDArray]:
        achieved = checked("achieved tip", flexible_tip(values, query[:, 2]), len(query), 2)
        error = query[:, :2] - achieved
        found = [*achieved.T, *error.T, np.hypot(*error.T)]
        return {field.name: column for field, column in zip(TIP_ERRORS, found, strict=True)}

    return judge


def evaluate(
    method: Method, conditions: Conditions, judge: Judge, columns: Columns
) -> dict[str, NDArray]:
    """Columns (m,) of the long table, a row a condition in their order; failed rows are rows too.

    point, those of `columns`.query and .answer, those of `judge`, status, and the method's
    diagnostics; SI units. Raises DataError if one does not fit the others, see `check`.
    """
    answer = method(conditions.query, conditions.current)
    errors = judge(conditions.query, answer.values)
    table = {
        GROUP.name: conditions.group,
        **_named(columns.query, conditions.query),
        **_named(columns.answer, answer.values),
        **{field.name: errors[field.name] for field in columns.errors},
        STATUS.name: answer.status,
    }
    if shared := table.keys() & answer.diagnostics.keys():
        raise DataError(f"diagnostics {sorted(shared)} have the names of columns")
    table |= answer.diagnostics
    check(pd.DataFrame(table), columns)
    return table


def fields_of(table: Mapping[str, NDArray], columns: Columns) -> list[Field]:
    """Fields of the columns of `evaluate`; whole numbers among the diagnostics are counts."""
    known = [GROUP, *columns.query, *columns.answer, *columns.errors, STATUS]
    names = {field.name for field in known}
    return known + [
        Field(name, "1", f"{name} of the method", "int64")
        if np.asarray(values).dtype.kind == "i"
        else Field(name, columns.diagnostic_unit, f"{name} of the method")
        for name, values in table.items()
        if name not in names
    ]


def check(frame: pd.DataFrame, columns: Columns) -> None:
    """Raise DataError unless the rows of `frame` are those of a long table of `columns`.

    Queries are finite; answers that are reached are finite and within their limits; their errors
    are finite and not negative; every status has a meaning.
    """
    expected = [GROUP, *columns.query, *columns.answer, *columns.errors, STATUS]
    if missing := [field.name for field in expected if field.name not in frame]:
        raise DataError(f"errors: expected columns {missing} too, got {list(frame)}")
    reached = frame[STATUS.name] == REACHED
    answers = frame[[field.name for field in columns.answer]]
    outside = (answers < np.array(columns.lower) - LIMIT_TOLERANCE) | (
        answers > np.array(columns.upper) + LIMIT_TOLERANCE
    )
    wrong: dict[str, Any] = {
        "query not finite": ~np.isfinite(frame[[field.name for field in columns.query]]),
        "status unknown": ~frame[[STATUS.name]].isin(list(STATUS_MEANING)),
        "answer not finite": ~np.isfinite(answers[reached]),
        "answer beyond its limits": outside[reached],
        "error negative or not finite": ~(frame.loc[reached, ["error"]] < np.inf)
        | (frame.loc[reached, ["error"]] < 0.0),
    }
    for what, where in wrong.items():
        if (rows := where.any(axis=1)).any():
            raise DataError(f"errors: {what} in row {rows.idxmax()}")


def _named(fields: Sequence[Field], values: Array) -> dict[str, Array]:
    return {field.name: column for field, column in zip(fields, values.T, strict=True)}


def statistics(frame: pd.DataFrame) -> dict[str, float]:
    """STATISTICS of the errors in `frame`, in m, then `n_conditions` and `n_failed`."""
    values = {name: float(statistic(frame)) for name, statistic in STATISTICS.items()}
    return values | {
        "n_conditions": len(frame),
        "n_failed": int((frame["status"] != REACHED).sum()),
    }


def workspace_statistics(frame: pd.DataFrame) -> dict[str, float]:
    """Mean, percentiles and maximum of the errors in `frame`, in m; failed rows are included.

    Keys mean_error, median_error, p95_error, p99_error (interpolated linearly between rows),
    max_error, n_targets, n_failed.
    """
    error = frame["error"]
    return {
        "mean_error": float(error.mean()),
        "median_error": float(error.median()),
        "p95_error": float(error.quantile(0.95)),
        "p99_error": float(error.quantile(0.99)),
        "max_error": float(error.max()),
        "n_targets": len(frame),
        "n_failed": int((frame["status"] != REACHED).sum()),
    }
