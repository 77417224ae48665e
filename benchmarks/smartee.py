"""Times of the SmartEE's direct kinematics and of the trainers in its study of initial weights.

    python benchmarks/smartee.py [query | training]

Without an argument both. Needs `make repro` for data/smartee. Writes
reports/benchmarks/smartee.csv (microseconds a pose, alone and in a batch, for every way to the
elbows) and reports/benchmarks/smartee_training.csv (seconds a run of the study takes, and what
runs of many times its iterations come to), each with a Markdown file. One core a process.
"""

import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits
from training_race import pinned_pool

from flexik import parameters, stage
from flexik.datasets.smartee.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    geometry_of,
    joints_in,
    read_poses,
    values,
)
from flexik.datasets.smartee.provenance import (
    network_checksum,
    query_checksum,
    training_time_checksum,
)
from flexik.errors import DataError, FlexikError
from flexik.learning.perceptron import quantities
from flexik.learning.storage import load_network
from flexik.learning.training import Architecture, train, trainer_settings
from flexik.parameters import load_parameters
from flexik.positioning.smartee.direct import (
    Direct,
    by_network,
    centre_elbows,
    from_centre,
    solved_from_centre,
)
from flexik.reporting.tables import markdown, write_table

DATA = Path("data/smartee")
OUTPUT = Path("reports/benchmarks")
N_SINGLE = 300
N_REPEATS = 5
N_BATCHES = 15
# Starts of a long run, and how many times the iterations of the study it has
N_LONG, LONG = 4, 10
SOLVED = -1  # n_steps of Newton's method until it converges


def query() -> pd.DataFrame:
    """Microseconds of every way to the elbows; medians of repeats in which all follow one another.

    Newton steps from the previous pose cost what those from the centre cost.
    """
    smartee = load_parameters().smartee
    try:
        methods = ways(smartee)
        actuated = joints_in(read_poses(DATA / "poses", smartee, "random"))[..., :2]
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    seconds: dict[tuple[str, int], list[tuple[float, float]]] = {label: [] for label in methods}
    with threadpool_limits(1):
        for _ in range(N_REPEATS):
            for label, method in methods.items():
                seconds[label].append((alone(method, actuated), together(method, actuated)))
    rows = [
        {
            "method": name,
            "n_steps": n_steps,
            "microseconds_single": 1e6 * statistics.median(pair[0] for pair in pairs),
            "microseconds_batched": 1e6 * statistics.median(pair[1] for pair in pairs),
            "n_batched": len(actuated),
            "settings": query_checksum(smartee),
        }
        for (name, n_steps), pairs in seconds.items()
    ]
    return pd.DataFrame(rows)


def ways(smartee: parameters.SmartEE) -> dict[tuple[str, int], Direct]:
    """Every start and number of Newton steps; SOLVED: until it converges."""
    geometry, newton = geometry_of(smartee), smartee.newton
    found: dict[tuple[str, int], Direct] = {}
    for name in smartee.networks:
        path = DATA / "networks" / f"{name}.json"
        network, _ = load_network(path, network_checksum(smartee, name))
        for n_steps in range(newton.network_steps + 1):
            found[name, n_steps] = by_network(geometry, network, n_steps)
    start = centre_elbows(geometry, smartee.workspace)
    for n_steps in range(1, newton.shown_steps + 1):
        found["centre", n_steps] = from_centre(geometry, start, n_steps)
    found["centre", SOLVED] = solved_from_centre(geometry, start, newton.tolerance, newton.n_steps)
    return found


def alone(method: Direct, actuated: np.ndarray) -> float:
    """Median seconds of a call with one pose."""
    seconds = []
    for k in range(N_SINGLE):
        started = time.perf_counter()
        method(actuated[k : k + 1])
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds)


def together(method: Direct, actuated: np.ndarray) -> float:
    """Median seconds of a call with all poses, over their number."""
    seconds = []
    for _ in range(N_BATCHES):
        started = time.perf_counter()
        method(actuated)
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds) / len(actuated)


def training() -> pd.DataFrame:
    """Seconds and errors of runs of the study, and of runs of LONG times their iterations."""
    smartee = load_parameters().smartee
    runs = [
        (trainer, spread, start)
        for trainer in smartee.starts.trainers
        for spread in smartee.starts.spreads
        for start in range(N_LONG)
    ]
    with pinned_pool(1) as pool:
        rows = pd.DataFrame(list(pool.map(run_both, runs)))
    grouped = rows.groupby(["trainer", "spread"], sort=False)
    table = grouped[["seconds", "error", "long_seconds", "long_error"]].median().reset_index()
    table.insert(2, "n_starts", N_LONG)
    table.insert(3, "long_factor", LONG)
    table["settings"] = [training_time_checksum(smartee, name) for name in table["trainer"]]
    return table


def run_both(run: tuple[str, str, int]) -> dict[str, object]:
    """A run with the iterations of the study, and one with LONG times as many."""
    smartee = load_parameters().smartee
    trainer, spread, start = run
    table = read_poses(DATA / "poses", smartee, smartee.starts.poses)
    options = smartee.trainers[trainer].model_dump()
    settings = trainer_settings(options.pop("kind"), options)
    row: dict[str, object] = {"trainer": trainer, "spread": spread}
    for prefix, factor in (("", 1), ("long_", LONG)):
        _, record = train(
            values(table, ACTUATED_FIELDS),
            values(table, ELBOW_FIELDS),
            Architecture(smartee.starts.n_hidden, "tanh"),
            replace(settings, n_iterations=factor * settings.n_iterations),
            smartee.starts.seed,
            quantities(ACTUATED_FIELDS),
            quantities(ELBOW_FIELDS),
            restart=start,
            spread=smartee.starts.spreads[spread],
        )
        row |= {f"{prefix}seconds": record.seconds, f"{prefix}error": min(record.errors)}
    print(row, flush=True)
    return row


QUERY_NOTES = (
    f"single: median of {N_SINGLE} calls with one pose; batched: median of {N_BATCHES} "
    f"calls with the random poses, over their number; medians of {N_REPEATS} repeats. n_steps "
    f"{SOLVED}: until it converges.",
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
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    chosen = sys.argv[1:] or list(PARTS)
    if unknown := [name for name in chosen if name not in PARTS]:
        raise FlexikError(f"usage: benchmarks/smartee.py [{' | '.join(PARTS)}], not {unknown[0]}")
    for name in chosen:
        function, file, remarks, decimals = PARTS[name]
        before = os.getloadavg()[0]
        table = function()
        load = (
            f"Load of the machine {before:.1f} at the start, {os.getloadavg()[0]:.1f} at the end."
        )
        notes = [*remarks, load]
        write_table(OUTPUT / file, table, decimals, f"SmartEE: {name}.", notes)
        print(markdown(table, decimals, f"SmartEE: {name}.", notes))


if __name__ == "__main__":
    stage.run(main)
