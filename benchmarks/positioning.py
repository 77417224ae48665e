"""Time a positioning query takes, for every method of params.yaml: alone, and in a batch.

Only the commanding is timed: targets, payloads and current strokes in, strokes out. One core.

    python benchmarks/positioning.py

Needs `make repro` for data/crane. Writes reports/benchmarks/positioning.csv and .md.
"""

import math
import os
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from training_race import pinned_pool

from flexik import stage
from flexik.datasets.crane.evaluations import TARGET_FIELDS
from flexik.datasets.crane.provenance import query_checksum, targets_checksum
from flexik.datasets.tables import read_table
from flexik.errors import DataError
from flexik.evaluation.conditions import Conditions, all_conditions, random_conditions
from flexik.kinematics.crane import CraneGeometry
from flexik.multibody.crane.assembly import read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method
from flexik.positioning.method import Method
from flexik.reporting.tables import markdown, write_table

DATA = Path("data/crane")
OUTPUT = Path("reports/benchmarks/positioning")
N_REPEATS = 3
N_WARM_UP = 3  # queries

DECIMALS = {"microseconds_single": 1, "microseconds_batched": 2}
MICROSECONDS = 1e6


@dataclass(frozen=True, eq=False)
class Queries:
    """Targets (n, 2) in m, payload (n,) in kg, current strokes (n, 3) in m."""

    targets: NDArray[np.float64]
    payload: NDArray[np.float64]
    strokes: NDArray[np.float64]

    @classmethod
    def of(cls, conditions: Conditions, geometry: CraneGeometry) -> "Queries":
        """Queries from the initial positions the evaluation has."""
        strokes = initial_positions(geometry, conditions.targets)
        return cls(conditions.targets, conditions.payload, strokes)

    def __len__(self) -> int:
        return len(self.targets)


@dataclass(frozen=True, eq=False)
class Case:
    """A method and what it is asked, one at a time and at once."""

    method: Method
    single: Queries
    batch: Queries


def cases() -> dict[str, Case]:
    """All methods by name, `none` first; raises DataError naming what `make repro` has to make."""
    crane = load_parameters().crane
    geometry = CraneGeometry(**crane.geometry.model_dump())
    try:
        stiffness = read_spring_stiffness(DATA / "calibration.json")
        made_with = targets_checksum(crane, stiffness)
        table = read_table(DATA / "targets.parquet", TARGET_FIELDS, made_with)
        methods = {
            name: trained_method(crane, name, geometry, stiffness, DATA / "networks")
            for name in ("none", *crane.methods)
        }
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    conditions = all_conditions(crane.evaluation.points, crane.evaluation.payloads)
    single = Queries.of(conditions, geometry)
    found = {}
    for name, method in methods.items():
        limited = name in crane.methods
        rows = table.head(crane.methods[name].n_workspace_targets) if limited else table
        batch = random_conditions(rows[["target_x", "target_y"]], rows["payload"])
        found[name] = Case(method, single, Queries.of(batch, geometry))
    return found


def seconds_single(method: Method, queries: Queries) -> float:
    """Median over `queries` of the seconds of a call with one of them."""
    rows = [
        (queries.targets[one], queries.payload[one], queries.strokes[one])
        for one in (slice(k, k + 1) for k in range(len(queries)))
    ]
    for row in rows[:N_WARM_UP]:
        method(*row)
    seconds = []
    for row in rows:
        started = time.perf_counter()
        method(*row)
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds)


def seconds_batched(method: Method, queries: Queries) -> float:
    """Seconds of a call with all `queries`, over their number; nan without any."""
    if not len(queries):
        return math.nan
    started = time.perf_counter()
    method(queries.targets, queries.payload, queries.strokes)
    return (time.perf_counter() - started) / len(queries)


def measure() -> pd.DataFrame:
    """A row for every method; for one process with one core.

    In each repeat all methods follow one another: a machine that is busy is so for all.
    """
    with threadpool_limits(1):
        known = cases()
        seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in known}
        for repeat in range(N_REPEATS):
            for name, case in known.items():
                alone = seconds_single(case.method, case.single)
                seconds[name].append((alone, seconds_batched(case.method, case.batch)))
            print(f"positioning, repeat {repeat + 1} of {N_REPEATS}", flush=True)
    crane = load_parameters().crane
    rows = []
    for name, pairs in seconds.items():
        alone, batched = (
            MICROSECONDS * statistics.median(each) for each in zip(*pairs, strict=True)
        )
        rows.append(
            {
                "method": name,
                "microseconds_single": alone,
                "microseconds_batched": batched,
                "n_single": len(known[name].single),
                "n_batched": len(known[name].batch),
                "settings": query_checksum(crane, name),
            }
        )
    return pd.DataFrame(rows)


def notes(load: Mapping[str, float]) -> list[str]:
    """What the table means."""
    return [
        "From targets, payloads and current strokes to commanded strokes; no flexible model.",
        "single: one target a call, the median over the n_single test conditions; searches "
        "that take many steps for few targets hardly show in it. batched: one call with the first "
        "n_batched random targets, the time over their number; those searches show.",
        f"Medians of {N_REPEATS} repeats, in each of which all methods follow one another, after "
        f"{N_WARM_UP} queries. One core, one BLAS thread; numpy {version('numpy')}, pymoo "
        f"{version('pymoo')}; load of the machine {load['start']:.1f} at the start, "
        f"{load['end']:.1f} at the end, of which this benchmark is up to 1.",
    ]


def main() -> None:
    """Measure and report."""
    # before the process imports NumPy
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    started, load = time.perf_counter(), {"start": os.getloadavg()[0]}
    with pinned_pool(1) as pool:
        table = pool.submit(measure).result()
    load["end"] = os.getloadavg()[0]
    caption = "Microseconds of a positioning query, for every method."
    remarks = notes(load)
    write_table(OUTPUT, table, DECIMALS, caption, remarks)
    print(markdown(table, DECIMALS, caption, remarks))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    stage.run(main)
