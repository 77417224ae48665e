"""What the report of the SmartEE is made from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.smartee.poses import POSE_FIELDS, geometry_of, joints_in, values
from flexik.errors import DataError
from flexik.evaluation.smartee.errors import ERRORS
from flexik.kinematics.smartee import (
    SmartEEGeometry,
    closure_jacobian,
    elbow_circles,
    inverse,
    leg_tip_velocities,
    leg_tips,
    rotation_zyz,
)
from flexik.kinematics.smartee_newton import CONVERGED
from flexik.kinematics.status import REACHED
from flexik.parameters.smartee import PUBLISHED, OtherGeometry
from flexik.reporting.style import require

# Errors by the name they have in metrics and in the file of published peaks
QUANTITIES = dict(zip(("elbow", "position", "orientation"), ERRORS, strict=True))
# Unit of tables and figures by published unit, and what the latter is in it
UNITS = {"rad": ("mrad", 1e3), "mm": ("mm", 1.0)}
PUBLISHED_UNITS = {"elbow": "rad", "position": "mm", "orientation": "rad"}
# What is smaller is rounding, rad
ROUNDING = 1e-12
# Elbows farther than this from the right ones, after Newton steps, belong to another pose, rad
RIGHT = 1e-6
# SI unit in the published one
FACTORS = {"rad": 1.0, "mm": 1e3}


@dataclass(frozen=True)
class Results:
    """What the stages found; SI units.

    errors, newton : ERROR_FIELDS and NEWTON_FIELDS of evaluation.smartee.errors.
    starts : FIELDS of learning.starts.
    sensitivity : the same; trainer is the pair of constants.
    linear_error : of the best linear map of the rows of `starts`, see linear_error there.
    sizes, sizes_beside : frames of learning.size_selection.by_size.
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
    sensitivity: pd.DataFrame
    linear_error: float
    sizes: pd.DataFrame
    sizes_beside: pd.DataFrame
    training: pd.DataFrame
    random: pd.DataFrame
    published: pd.DataFrame
    query_times: pd.DataFrame
    training_times: pd.DataFrame

    def __post_init__(self) -> None:
        require("published peaks", self.published.index, QUANTITIES)
        for quantity, expected in PUBLISHED_UNITS.items():
            unit, peak = self.unit(quantity), self.published_peak(quantity)
            if unit != expected:
                raise DataError(
                    f"published peaks: {quantity} has unit {unit!r}, expected {expected}"
                )
            if not 0.0 < peak < np.inf:
                raise DataError(f"published peaks: {quantity} is {peak:g}, expected a peak above 0")

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

    def n_wrong(self, n_steps: int, poses: str) -> tuple[int, int, int]:
        """How often PUBLISHED and fixed steps are wrong, how often unnoticed, and false alarms.

        What is noticed has a status that is not CONVERGED.
        """
        table = self.of(PUBLISHED, n_steps, poses)
        wrong, noticed = ~(table["elbow_error"] <= RIGHT), table["status"] != CONVERGED
        return int(wrong.sum()), int((wrong & ~noticed).sum()), int((~wrong & noticed).sum())

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
        return conditions(geometry_of(self.smartee), joints_in(self.random))

    def conditions_of(self, other: OtherGeometry) -> tuple[float, np.ndarray]:
        """Share of the random poses that legs of `other` dimensions reach, conditions there."""
        changed = {"base_radius": other.base_radius, "plate_radius": other.plate_radius}
        geometry = replace(geometry_of(self.smartee), **changed)
        poses = values(self.random, POSE_FIELDS).copy()
        poses[:, 2] += other.height - self.smartee.workspace.centre[2]
        found = inverse(geometry, poses[:, :3], rotation_zyz(poses[:, 3:]))
        reached = found.status == REACHED
        return float(reached.mean()), conditions(geometry, found.joints[reached])


def conditions(geometry: SmartEEGeometry, joints: np.ndarray) -> np.ndarray:
    """Condition numbers (n,) of the closure equations' Jacobian by the elbows at `joints`."""
    circles = elbow_circles(geometry, joints[..., :2])
    tips = leg_tips(circles, joints[..., 2])
    return np.linalg.cond(closure_jacobian(tips, leg_tip_velocities(circles, joints[..., 2])))


def right(table: pd.DataFrame) -> pd.Series:
    """Rows with the elbows of their pose, and a status that says so."""
    return (table["status"] == CONVERGED) & (table["elbow_error"] <= RIGHT)


def scientific(value: float) -> str:
    """Three digits; what is below ROUNDING is not told apart, NaN is empty."""
    if np.isnan(value):
        return ""
    return f"{value:.2e}" if value >= ROUNDING else f"< {ROUNDING:.0e}"


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
