"""What the report of the SmartEE is made from."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.smartee.poses import geometry_of, joints_in
from flexik.evaluation.smartee.errors import ERRORS
from flexik.mechanisms.smartee import (
    closure_jacobian,
    elbow_circles,
    leg_tip_velocities,
    leg_tips,
)
from flexik.reporting.style import require

# Errors by the name they have in metrics and in the file of published peaks
QUANTITIES = dict(zip(("elbow", "position", "orientation"), ERRORS, strict=True))
# Unit of tables and figures by published unit, and what the latter is in it
UNITS = {"rad": ("mrad", 1e3), "mm": ("mm", 1.0)}
# SI unit in the published one
FACTORS = {"rad": 1.0, "mm": 1e3}


@dataclass(frozen=True)
class Results:
    """What the stages found; SI units.

    errors, newton : ERROR_FIELDS and NEWTON_FIELDS of evaluation.smartee.errors.
    starts : FIELDS of learning.starts.
    sizes : frame of learning.size_selection.by_size.
    training : a row for every restart of every network; network, and those of restarts_csv.
    random : the random poses, FIELDS of datasets.smartee.poses.
    published : unit and peak by quantity of QUANTITIES.
    query_times : microseconds_single and microseconds_batched by method and n_steps, measured by a
        benchmark with the parameters there are now; may be empty.
    training_times : seconds, long_factor, long_seconds, long_error by trainer and spread; likewise.
    """

    smartee: parameters.SmartEE
    errors: pd.DataFrame
    newton: pd.DataFrame
    starts: pd.DataFrame
    sizes: pd.DataFrame
    training: pd.DataFrame
    random: pd.DataFrame
    published: pd.DataFrame
    query_times: pd.DataFrame
    training_times: pd.DataFrame

    def __post_init__(self) -> None:
        require("published peaks", self.published.index, QUANTITIES)

    def of(self, method: str, n_steps: int, poses: str) -> pd.DataFrame:
        """Rows of `errors` of a method on a set of poses."""
        table = self.errors
        rows = (
            (table["method"] == method) & (table["n_steps"] == n_steps) & (table["poses"] == poses)
        )
        return table[rows]

    def peak(self, method: str, n_steps: int, poses: str, quantity: str) -> float:
        """Largest error, in the published unit; NaN when a step failed somewhere."""
        values = self.of(method, n_steps, poses)[QUANTITIES[quantity]].to_numpy()
        return float(self.factor(quantity) * values.max()) if values.size else np.nan

    def factor(self, quantity: str) -> float:
        """Published unit of `quantity` in its SI unit."""
        return FACTORS[self.unit(quantity)]

    def unit(self, quantity: str) -> str:
        """Unit of the published peak."""
        return str(self.published["unit"].to_dict()[quantity])

    def shown(self, quantity: str) -> tuple[str, float]:
        """Unit of tables and figures, and what the published unit is in it."""
        return UNITS[self.unit(quantity)]

    def published_peak(self, quantity: str) -> float:
        """In its unit."""
        return float(self.published["peak"].to_dict()[quantity])

    def condition_numbers(self) -> np.ndarray:
        """Of the closure equations' Jacobian by the elbows, at the random poses."""
        joints = joints_in(self.random)
        circles = elbow_circles(geometry_of(self.smartee), joints[..., :2])
        elbows = joints[..., 2]
        tips, velocities = leg_tips(circles, elbows), leg_tip_velocities(circles, elbows)
        return np.linalg.cond(closure_jacobian(tips, velocities))


def current(
    table: pd.DataFrame, made_with: Mapping[str, str] | str, name: str = ""
) -> pd.DataFrame:
    """Rows of a benchmark's `table` that were measured with the parameters there are now.

    Parameters
    ----------
    made_with : checksum of the settings, or one by the value of column `name`
    """
    if isinstance(made_with, str):
        return table[table["settings"] == made_with]
    expected = [made_with.get(value) for value in table[name]]
    return table[table["settings"] == np.array(expected, dtype=object)]
