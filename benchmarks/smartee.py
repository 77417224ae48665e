"""Times of the SmartEE's direct kinematics and of the trainers in its study of initial weights.

    python benchmarks/smartee.py [query | training]

Without an argument both. Needs `make repro` for data/smartee. Writes
reports/benchmarks/smartee.csv (microseconds a pose, alone and in a batch, for every way to the
elbows) and reports/benchmarks/smartee_training.csv (seconds a run of the study takes, and what
runs of many times its iterations come to), each with a Markdown file. On one core.
"""

from machine import remark

# isort: split
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.cases.case import load
from flexik.cases.smartee.parts.errors import conditions_of
from flexik.cases.smartee.parts.methods import trained
from flexik.cases.smartee.parts.poses import centre_elbows
from flexik.cases.smartee.parts.train import lesson
from flexik.cases.smartee.section import PREVIOUS, RANDOM
from flexik.datasets.tables import read_table
from flexik.errors import DataError, FlexikError
from flexik.evaluation.conditions import Conditions
from flexik.learning.training import Architecture, train
from flexik.positioning.method import Method
from flexik.reporting.tables import Table

OUTPUT = Path("reports/benchmarks")
N_SINGLE = 300
N_REPEATS = 5
N_BATCHES = 15
# Starts of a long run, and how many times the iterations of the study it has
N_LONG, LONG = 4, 10


def query() -> pd.DataFrame:
    """Microseconds of every way to the elbows; medians of repeats in which all follow one another.

    Newton steps from the previous pose cost what those from the centre cost.
    """
    section = load("smartee")
    labels = [
        (name, n_steps)
        for name, method in section.methods.items()
        for n_steps in method.n_steps
        if name != PREVIOUS
    ]
    try:
        methods = {label: trained(section, *label) for label in labels}
        poses = read_table(section.data / f"samples/{RANDOM}.parquet")
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    asked = conditions_of(poses, centre_elbows(section.machine, section.samples.box))
    seconds: dict[tuple[str, int], list[tuple[float, float]]] = {label: [] for label in labels}
    for _ in range(N_REPEATS):
        for label, method in methods.items():
            seconds[label].append((alone(method, asked), together(method, asked)))
    rows = [
        {
            "method": name,
            "n_steps": n_steps,
            "microseconds_single": 1e6 * statistics.median(pair[0] for pair in pairs),
            "microseconds_batched": 1e6 * statistics.median(pair[1] for pair in pairs),
            "n_batched": len(asked),
            "settings": section.query_key,
        }
        for (name, n_steps), pairs in seconds.items()
    ]
    return pd.DataFrame(rows)


def alone(method: Method, asked: Conditions) -> float:
    """Median seconds of a call with one pose."""
    seconds = []
    for k in range(N_SINGLE):
        query, current = asked.query[k : k + 1], asked.current[k : k + 1]
        started = time.perf_counter()
        method(query, current)
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds)


def together(method: Method, asked: Conditions) -> float:
    """Median seconds of a call with all poses, over their number."""
    seconds = []
    for _ in range(N_BATCHES):
        started = time.perf_counter()
        method(asked.query, asked.current)
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds) / len(asked)


def training() -> pd.DataFrame:
    """Seconds and errors of runs of the study, and of runs of LONG times their iterations."""
    section = load("smartee")
    starts = section.studies.starts
    runs = [
        (trainer, spread, start)
        for trainer in starts.trainers
        for spread in starts.spreads
        for start in range(N_LONG)
    ]
    rows = pd.DataFrame([run_both(run) for run in runs])
    grouped = rows.groupby(["trainer", "spread"], sort=False)
    table = grouped[["seconds", "error", "long_seconds", "long_error"]].median().reset_index()
    table.insert(2, "n_starts", N_LONG)
    table.insert(3, "long_factor", LONG)
    table["settings"] = [section.training_key(name) for name in table["trainer"]]
    return table


def run_both(run: tuple[str, str, int]) -> dict[str, object]:
    """A run with the iterations of the study, and one with LONG times as many."""
    section = load("smartee")
    starts, (trainer, spread, start) = section.studies.starts, run
    settings = section.trainers[trainer]
    rows = section.data / f"samples/{starts.poses}.parquet"
    task = replace(
        lesson(Architecture(starts.n_hidden), settings, starts.seed, rows),
        spread=starts.spreads[spread],
    )
    row: dict[str, object] = {"trainer": trainer, "spread": spread}
    for prefix, factor in (("", 1), ("long_", LONG)):
        more = settings.but(n_iterations=factor * settings.n_iterations)
        started = time.perf_counter()
        _, record = train(replace(task, settings=more), start)
        seconds = time.perf_counter() - started
        row |= {f"{prefix}seconds": seconds, f"{prefix}error": min(record.errors)}
    print(row, flush=True)
    return row


QUERY_NOTES = (
    f"single: median of {N_SINGLE} calls with one pose; batched: median of {N_BATCHES} "
    f"calls with the random poses, over their number; medians of {N_REPEATS} repeats. newton: "
    "until it converges.",
)
TRAINING_NOTES = (
    f"Medians of {N_LONG} starts. long: runs of {LONG} times the iterations of the study. Errors: "
    "mean squares of the normalised outputs.",
)
PARTS: dict[str, tuple[Callable[[], pd.DataFrame], str, tuple[str, ...], dict[str, int]]] = {
    "query": (
        query,
        "smartee",
        QUERY_NOTES,
        {"microseconds_single": 0, "microseconds_batched": 2},
    ),
    "training": (
        training,
        "smartee_training",
        TRAINING_NOTES,
        {"seconds": 2, "error": 9, "long_seconds": 2, "long_error": 9},
    ),
}


def main() -> None:
    """Measure and report."""
    chosen = sys.argv[1:] or list(PARTS)
    if unknown := [name for name in chosen if name not in PARTS]:
        raise FlexikError(f"usage: benchmarks/smartee.py [{' | '.join(PARTS)}], not {unknown[0]}")
    for name in chosen:
        function, file, remarks, decimals = PARTS[name]
        table = Table(function(), decimals)
        notes = [*remarks, remark(1, "numpy", "scipy")]
        table.write(OUTPUT / file, f"SmartEE: {name}.", notes)
        print(table.markdown(f"SmartEE: {name}.", notes))


if __name__ == "__main__":
    stage.run(main)
