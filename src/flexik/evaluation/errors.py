"""Errors of a method on conditions as one long table, and the statistics published of them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

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


def statistics_without(frame: pd.DataFrame, points: ArrayLike) -> dict[str, float]:
    """Return `statistics` of `frame` without all rows of the target `points` (k, 2) in m.

    Raises DataError if a point is no target of the frame (exactly), or nothing is left.
    """
    left = np.ones(len(frame), dtype=bool)
    for x, y in checked("points", points, None, 2):
        of_point = ((frame["target_x"] == x) & (frame["target_y"] == y)).to_numpy()
        if not of_point.any():
            raise DataError(f"expected the target ({x:g}, {y:g}) m among the errors, found none")
        left &= ~of_point
    if not left.any():
        raise DataError("no error is left without the points that are left out")
    return statistics(frame[left])


def worst_points(frame: pd.DataFrame, n: int = 2) -> Array:
    """Coordinates (n, 2) in m of the targets with the largest errors, worst first.

    The error of a target is the largest over its payloads; equal ones come by their coordinates.
    Raises DataError if there are fewer targets.
    """
    largest = frame.groupby(["target_x", "target_y"])["error"].max()
    if len(largest) < n:
        raise DataError(f"expected {n} target points or more, found {len(largest)}")
    return np.array(largest.nlargest(n).index.to_list(), dtype=float).reshape(n, 2)


def comparison(
    by_method: Mapping[str, Mapping[str, float]],
    published: pd.DataFrame,
    column_of: Mapping[str, str | None] | None = None,
) -> pd.DataFrame:
    """STATISTICS of methods beside the published ones, in mm.

    Parameters
    ----------
    by_method
        Results of `statistics` (m) by label.
    published
        A column `statistic` and a column (mm) for every published method.
    column_of
        Published column of a label where it is not the label itself, as for two variants of one
        method; None where nothing is published.

    Returns
    -------
    DataFrame
        Rows STATISTICS; columns `label` and `label published`, NaN where nothing is published, for
        every label.

    Raises
    ------
    DataError
        If a published statistic or column is missing.
    """
    table = published.set_index("statistic")
    if missing := [name for name in STATISTICS if name not in table.index]:
        raise DataError(f"published errors: expected the statistics {missing} too")
    columns = {}
    for label, values in by_method.items():
        column = (column_of or {}).get(label, label)
        if column is not None and column not in table.columns:
            raise DataError(f"published errors: no column {column!r}, found {list(table.columns)}")
        columns[label] = [1e3 * values[name] for name in STATISTICS]
        columns[f"{label} published"] = (
            [np.nan] * len(STATISTICS)
            if column is None
            else table.loc[list(STATISTICS), column].tolist()
        )
    return pd.DataFrame(columns, index=pd.Index(list(STATISTICS), name="statistic"))
