"""Positioning errors of a method, and the six statistics published of them.

Error = desired minus achieved tip; achieved by the flexible model at the commanded strokes
(Rouvinen 1999, figure 4.3 and table 4.1).
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from flexik.errors import DataError
from flexik.evaluation.conditions import Array, Conditions
from flexik.positioning.method import REACHED, Method, checked

FlexibleTip = Callable[[Array, Array], Array]
CRANE_STROKES = ("lift_stroke", "jib_stroke", "extension_stroke")

STATISTICS: dict[str, Callable[[pd.DataFrame], float]] = {
    "max_abs_dx": lambda frame: frame["error_x"].abs().max(),
    "max_abs_dy": lambda frame: frame["error_y"].abs().max(),
    "max_error": lambda frame: frame["error"].max(),
    "mean_abs_dx": lambda frame: frame["error_x"].abs().mean(),
    "mean_abs_dy": lambda frame: frame["error_y"].abs().mean(),
    "mean_error": lambda frame: frame["error"].mean(),
}


def evaluate(
    method: Method,
    conditions: Conditions,
    initial_strokes: Array,
    flexible_tip: FlexibleTip,
    stroke_names: Sequence[str] = CRANE_STROKES,
) -> pd.DataFrame:
    """Errors of `method`, one row a condition in their order; failed rows are rows too.

    Parameters
    ----------
    method
        Method to judge.
    conditions
        Targets and payloads, m of them.
    initial_strokes
        Current strokes (m, 3), m, of each condition.
    flexible_tip
        Tip (m, 2) in m at strokes (m, 3) in m under payload (m,) in kg.
    stroke_names
        Column names of the actuator coordinates.

    Returns
    -------
    DataFrame
        Columns point, target_x, target_y, payload, the strokes, achieved_x, achieved_y, error_x,
        error_y, error, status (codes of positioning.method.STATUS_MEANING), and the method's
        diagnostics. SI units.

    Raises
    ------
    PositioningError
        If an array does not fit the conditions or a tip is not finite.
    """
    n = len(conditions)
    initial_strokes = checked("initial strokes", initial_strokes, n, len(stroke_names))
    command = method(conditions.targets, conditions.payload, initial_strokes)
    strokes = checked("commanded strokes", command.strokes, n, len(stroke_names))
    achieved = checked("achieved tip", flexible_tip(strokes, conditions.payload), n, 2)
    error = conditions.targets - achieved
    columns = {
        "point": conditions.point_index,
        "target_x": conditions.targets[:, 0],
        "target_y": conditions.targets[:, 1],
        "payload": conditions.payload,
        **dict(zip(stroke_names, strokes.T, strict=True)),
        "achieved_x": achieved[:, 0],
        "achieved_y": achieved[:, 1],
        "error_x": error[:, 0],
        "error_y": error[:, 1],
        "error": np.hypot(error[:, 0], error[:, 1]),
        "status": command.status,
    }
    if shared := columns.keys() & command.diagnostics.keys():
        raise DataError(f"diagnostics {sorted(shared)} have the names of columns")
    return pd.DataFrame(columns | command.diagnostics)


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
