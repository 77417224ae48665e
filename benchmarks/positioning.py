"""Time a positioning query takes, for every method of params.yaml: alone, and in a batch.

Only the commanding is timed: targets, payloads and current strokes in, strokes out. One core.

    python benchmarks/positioning.py

Needs `make repro` for data/crane. Writes reports/benchmarks/positioning.csv and .md.
"""

from machine import pinned_pool, remark

# isort: split
import math
import statistics
import time
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.cases.case import load
from flexik.cases.crane.report_results import query_key
from flexik.errors import DataError
from flexik.evaluation.conditions import Conditions
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.planar.conditions import at_points, at_targets
from flexik.planar.methods import method_of
from flexik.positioning.method import Method
from flexik.reporting.tables import Table

OUTPUT = Path("reports/benchmarks/positioning")
N_REPEATS = 3
N_WARM_UP = 3  # queries

DECIMALS = {"microseconds_single": 1, "microseconds_batched": 2}
MICROSECONDS = 1e6


@dataclass(frozen=True, eq=False)
class Case:
    """A method and what it is asked, one at a time and at once."""

    method: Method
    single: Conditions
    batch: Conditions


def cases() -> dict[str, Case]:
    """All methods by name; raises DataError naming what `make repro` has to make."""
    section = load("crane")
    manipulator = CraneManipulator(section.geometry)
    try:
        targets = section.data / "samples/workspace.parquet"
        batch = at_targets(targets, section.machine, manipulator)
        methods = {name: method_of(section, name) for name in section.methods}
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    single = at_points(section.conditions["published"], manipulator)
    return {
        name: Case(method, single, batch[: section.methods[name].n_targets])
        for name, method in methods.items()
    }


def seconds_single(method: Method, asked: Conditions) -> float:
    """Median over `asked` of the seconds of a call with one of them."""
    rows = asked.chunks(1)
    for row in rows[:N_WARM_UP]:
        method(row.query, row.current)
    seconds = []
    for row in rows:
        started = time.perf_counter()
        method(row.query, row.current)
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds)


def seconds_batched(method: Method, asked: Conditions) -> float:
    """Seconds of a call with all `asked`, over their number; nan without any."""
    if not len(asked):
        return math.nan
    started = time.perf_counter()
    method(asked.query, asked.current)
    return (time.perf_counter() - started) / len(asked)


def measure() -> pd.DataFrame:
    """A row for every method; for one process with one core.

    In each repeat all methods follow one another: a machine that is busy is so for all.
    """
    known, section = cases(), load("crane")
    seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in known}
    for repeat in range(N_REPEATS):
        for name, case in known.items():
            alone = seconds_single(case.method, case.single)
            seconds[name].append((alone, seconds_batched(case.method, case.batch)))
        print(f"positioning, repeat {repeat + 1} of {N_REPEATS}", flush=True)
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
                "settings": query_key(section, name),
            }
        )
    return pd.DataFrame(rows)


def notes() -> list[str]:
    """What the table means."""
    return [
        "From targets, payloads and current strokes to commanded strokes; no flexible model.",
        "single: one target a call, the median over the n_single test conditions; searches "
        "that take many steps for few targets hardly show in it. batched: one call with the first "
        "n_batched random targets, the time over their number; those searches show.",
        f"Medians of {N_REPEATS} repeats, in each of which all methods follow one another, after "
        f"{N_WARM_UP} queries.",
        remark(1, "numpy", "pymoo"),
    ]


def main() -> None:
    """Measure and report."""
    started = time.perf_counter()
    with pinned_pool(1) as pool:
        table = pool.submit(measure).result()
    caption = "Microseconds of a positioning query, for every method."
    remarks = notes()
    Table(table, DECIMALS).write(OUTPUT, caption, remarks)
    print(Table(table, DECIMALS).markdown(caption, remarks))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    stage.run(main)
