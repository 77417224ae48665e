"""Errors of a measuring campaign, from its targets and from the points reached without load.

Rouvinen (1999), chapter 4.6: every point is approached with every payload, without compensation and
with it; table 4.2 has the errors from the targets, table 4.3 those from the points reached with
0 kg and compensation, which leave out what the rigid model has wrong.
"""

import numpy as np
import pandas as pd

from flexik.errors import DataError
from flexik.planar.measured.fields import MEASURED, TARGET

REFERENCE_METHOD, REFERENCE_PAYLOAD = "combined", 0.0  # of the points of reference


def campaign_errors(campaign: pd.DataFrame) -> pd.DataFrame:
    """Errors of the points reached, one row a measurement.

    Parameters
    ----------
    campaign
        Columns method, target_x, target_y, payload, measured_x and measured_y; every target with
        every payload under both methods.

    Returns
    -------
    DataFrame
        `campaign`, rows by method, point and payload, with point (0, 1, ... as the targets first
        come), error_x, error_y (target minus measured point) and error (its length); and
        reference_error_x, reference_error_y and reference_error, which count from the point that
        the compensated machine reached with 0 kg at the same target. SI units.

    Raises
    ------
    DataError
        If a condition is measured twice, or a target lacks its point of reference.
    """
    keys = ["method", *TARGET, "payload"]
    point = pd.factorize(pd.Series(list(map(tuple, campaign[TARGET].to_numpy()))))[0]
    table = campaign.assign(point=point.astype(np.int64))
    # `none` stands before `combined`
    table = table.assign(last=table["method"] == REFERENCE_METHOD)
    table = table.sort_values(["last", "point", "payload"], kind="stable", ignore_index=True)
    if table.duplicated(keys).any():
        raise DataError(f"campaign: conditions twice: {table[table.duplicated(keys)][keys]}")
    basis = table[table["last"] & (table["payload"] == REFERENCE_PAYLOAD)].set_index("point")
    if missing := sorted(set(table["point"]) - set(basis.index)):
        x, y = table.loc[table["point"] == missing[0], TARGET].iloc[0]
        raise DataError(
            f"campaign: expected the point reached at the target ({x:g}, {y:g}) m with "
            f"{REFERENCE_PAYLOAD:g} kg by {REFERENCE_METHOD!r}, found none"
        )
    reached = table[MEASURED].to_numpy()
    starts = {"": table[TARGET].to_numpy(), "reference_": basis.loc[table["point"], MEASURED]}
    for prefix, start in starts.items():
        away = np.asarray(start) - reached
        columns = [f"{prefix}error_x", f"{prefix}error_y", f"{prefix}error"]
        table[columns] = np.column_stack([away, np.hypot(*away.T)])
    return table.drop(columns="last")
