"""What the report of the SmartEE is made from: frames in SI units, and numbers found in them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee.section import BEST, PUBLISHED, RESTARTS, Section
from flexik.datasets.tables import read_csv, read_table
from flexik.errors import DataError
from flexik.files import read_json
from flexik.learning.size_selection import by_size
from flexik.reporting.style import MM, require

BENCHMARKS = Path("reports/benchmarks")
TIMES = ("n_steps", "microseconds_single", "microseconds_batched")
TRAINING_TIMES = ("n_starts", "long_factor", "seconds", "long_seconds", "long_error")
PUBLISHED_FILE = Path("data/reference/smartee/peaks.csv")
# Errors by the name they have in metrics and in the file of published peaks
QUANTITIES = {"elbow": "error", "position": "position_error", "orientation": "orientation_error"}
# Published unit, and the SI unit in it
UNITS = {"elbow": ("rad", 1.0), "position": ("mm", MM), "orientation": ("rad", 1.0)}
# Quantities of tables, in thousandths of SI units
LABELS = {"elbow": "elbow (mrad)", "position": "position (mm)", "orientation": "orientation (mrad)"}
# The published peaks, and a tenth of them, are the goals of the two networks
GOALS = {PUBLISHED: 1.0, BEST: 10.0}
# Newton steps after a network that the sentences are about
STEPS = 2
# What is smaller is rounding, rad
ROUNDING = 1e-12


@dataclass(frozen=True)
class Results:
    """What the stages found.

    errors : conditions, method, and the columns of parts.evaluate
    restarts : network, and RESTART_FIELDS of parts.evaluate
    training : network, and a row for every restart
    starts, sensitivity : FIELDS of learning.starts; trainer of the latter is the pair of constants
    linear_error : see parts.starts
    sizes : poses, and columns of learning.size_selection.by_size
    geometries : GEOMETRY_FIELDS of parts.geometries
    published : peak by quantity of QUANTITIES, SI units
    query_times : microseconds_single and microseconds_batched by method and n_steps, measured by a
        benchmark with the parameters there are now; may be empty
    training_times : seconds, long_factor, long_seconds, long_error by trainer and spread; likewise
    """

    section: Section
    errors: pd.DataFrame
    restarts: pd.DataFrame
    training: pd.DataFrame
    starts: pd.DataFrame
    sensitivity: pd.DataFrame
    linear_error: float
    sizes: pd.DataFrame
    geometries: pd.DataFrame
    published: Mapping[str, float]
    query_times: pd.DataFrame
    training_times: pd.DataFrame

    @cached_property
    def groups(self) -> dict[tuple[str, int, str], pd.DataFrame]:
        """Rows of `errors` by method, n_steps and conditions."""
        groups: Any = self.errors.groupby(["method", "n_steps", "conditions"], sort=False)
        return dict(iter(groups))

    def peak(self, method: str, n_steps: int, conditions: str, column: str = "error") -> float:
        """Largest error, SI units; NaN when a step failed somewhere, or there is no row."""
        rows = self.groups.get((method, n_steps, conditions), self.errors[:0])
        return float(rows[column].to_numpy().max()) if len(rows) else np.nan

    def over_restarts(self, network: str, conditions: str, column: str) -> pd.Series:
        """Largest error of the network of every restart, SI units."""
        table = self.restarts
        return table[(table["network"] == network) & (table["conditions"] == conditions)][column]


def read(section: Section) -> Results:
    """Read what the stages and the benchmarks left; raises DataError if something is missing."""
    data, studies = section.data, section.studies
    errors = {
        (name, conditions): read_table(data / f"errors/{conditions}/{name}.parquet")
        for name, method in section.methods.items()
        for conditions in method.conditions or section.conditions
    }
    training = {name: pd.read_csv(data / f"networks/{name}.restarts.csv") for name in GOALS}
    restarts = {name: read_table(data / f"errors/{RESTARTS}/{name}.parquet") for name in GOALS}

    def study(name: str) -> pd.DataFrame:
        return read_table(data / f"studies/{name}.parquet")

    starts = [study(f"starts_{name}") for name in studies.starts.trainers]
    sizes = {poses: by_size(study(f"sizes_{poses}")) for poses in studies.sizes.poses}
    linear = read_json(data / "studies/linear.json")
    keys, names = ("method", "n_steps"), ("trainer", "spread")
    query_times = read_csv(BENCHMARKS / "smartee.csv", TIMES, ("method", "settings"), keys)
    file = BENCHMARKS / "smartee_training.csv"
    training_times = read_csv(file, TRAINING_TIMES, (*names, "settings"), names)
    return Results(
        section=section,
        errors=_named(errors, "method", "conditions"),
        restarts=_named(restarts, "network"),
        training=_named(training, "network"),
        starts=pd.concat(starts, ignore_index=True),
        sensitivity=study("sensitivity"),
        linear_error=float(linear["mean_squared_error"]),
        sizes=_named(sizes, "poses"),
        geometries=study("geometries"),
        published=published_peaks(read_csv(PUBLISHED_FILE, ("peak",), ("quantity", "unit"))),
        query_times=current(query_times, lambda _: section.query_key),
        training_times=current(training_times, lambda row: section.training_key(row["trainer"])),
    )


def _named(frames: Mapping[Any, pd.DataFrame], *columns: str) -> pd.DataFrame:
    """All `frames` below each other, with columns of their keys."""
    whole = pd.concat(frames, names=list(columns))
    return whole.reset_index(level=list(columns)).reset_index(drop=True)


def published_peaks(table: pd.DataFrame) -> dict[str, float]:
    """Peaks in SI units by quantity; raises DataError if one is missing, or cannot be."""
    require("published peaks", table["quantity"].tolist(), QUANTITIES)
    rows = table.set_index("quantity").to_dict("index")
    for quantity, (expected, _) in UNITS.items():
        unit, peak = rows[quantity]["unit"], rows[quantity]["peak"]
        if unit != expected or not 0.0 < peak < np.inf:
            raise DataError(
                f"published peaks: {quantity} is {peak:g} {unit}, expected above 0 in {expected}"
            )
    return {quantity: rows[quantity]["peak"] / factor for quantity, (_, factor) in UNITS.items()}


def current(table: pd.DataFrame, key: Callable[[dict], str | None]) -> pd.DataFrame:
    """Rows of a benchmark's `table` that were measured with the settings there are now."""
    kept = [row["settings"] == key(row) for row in table.to_dict("records")]
    return table[np.array(kept, dtype=bool)]


def scientific(value: float) -> str:
    """Three digits; what is below ROUNDING is not told apart, NaN is empty."""
    if np.isnan(value):
        return ""
    return f"{value:.2e}" if value >= ROUNDING else f"< {ROUNDING:.0e}"
