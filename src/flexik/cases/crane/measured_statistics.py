"""Statistics over many cranes as built."""

import pandas as pd

from flexik.datasets.crane_measured.campaign import METHODS, TARGET
from flexik.errors import DataError

PERCENTILE = 0.95
ERRORS = ("error", "reference_error")


def adaptation_statistics(errors: pd.DataFrame) -> pd.DataFrame:
    """Errors, in m, of every method and number of points on every twin.

    Parameters
    ----------
    errors
        Columns method, n_measurements (0: not adapted), twin and error (m), a row for every judged
        target.

    Returns
    -------
    DataFrame
        Columns method, n_measurements, twin, mean_error, p95_error and max_error, methods in their
        order, then sorted; the percentile is that of the targets of one twin, interpolated linearly
        between rows.

    Raises
    ------
    DataError
        If there is no row, or a twin lacks a number of measurements that another has.
    """
    groups = errors.groupby(["method", "n_measurements", "twin"], sort=False)["error"]
    table = groups.agg(
        mean_error="mean", p95_error=lambda error: error.quantile(PERCENTILE), max_error="max"
    )
    counts = table.groupby(["method", "n_measurements"]).size()
    if table.empty or (counts != errors["twin"].nunique()).any():
        raise DataError(f"adaptation: expected every number of every twin, found {dict(counts)}")
    order = {name: k for k, name in enumerate(errors["method"].unique())}
    return table.reset_index().sort_values(
        ["method", "n_measurements", "twin"],
        key=lambda column: column.map(order) if column.name == "method" else column,
        ignore_index=True,
    )


def budget_statistics(budget: pd.DataFrame) -> pd.DataFrame:
    """Mean errors, in m, of every crane over its campaign.

    Parameters
    ----------
    budget
        BUDGET_FIELDS of datasets.crane_measured.fields.

    Returns
    -------
    DataFrame
        Columns deviation, factor and twin, in their order; none and combined (from the targets),
        none_reference and combined_reference.
    """
    keys = ["deviation", "factor", "twin"]
    columns = {}
    for error, end in zip(ERRORS, ("", "_reference"), strict=True):
        for method in METHODS:
            rows = budget[budget["method"] == method]
            columns[f"{method}{end}"] = rows.groupby(keys, sort=False)[error].mean()
    return pd.DataFrame(columns).reset_index()


def worse_shares(budget: pd.DataFrame, deviation: str) -> pd.DataFrame:
    """Share of the cranes on which compensation makes a point worse.

    By the mean error of the point over its payloads; cranes with `deviation` (all, none, ...).

    Returns
    -------
    DataFrame
        Columns target_x, target_y, error and reference_error: the shares by either error; from the
        points of reference over the payloads but the lightest, which is the reference itself.
    """
    rows = budget[budget["deviation"] == deviation]
    loaded = rows[rows["payload"] > rows["payload"].min()]
    found = {}
    for error, kept in zip(ERRORS, (rows, loaded), strict=True):
        means = [
            kept[kept["method"] == method].groupby([*TARGET, "twin"], sort=False)[error].mean()
            for method in METHODS
        ]
        found[error] = (means[1] > means[0]).groupby(level=TARGET, sort=False).mean()
    return pd.DataFrame(found).reset_index()
