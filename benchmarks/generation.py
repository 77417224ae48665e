"""Speed and memory of generating crane samples, beside two other ways.

(a) Exudyn's own processing.ParameterVariation with one model for every vector.
(b) The published figure of Rouvinen 1999: about 4000 equilibria in 25 CPU minutes.

Speed: flexik and (a) solve the whole grid of table 4.1; in each repeat all ways follow one another,
so that a busy machine is busy for all of them, and ratios are taken within a repeat. The tips of
every run are compared. Memory: two grids of very different size, each in fresh processes.

    python benchmarks/generation.py [--quick]

Needs the crane's calibration (`make repro`). Writes reports/benchmarks/generate.csv, .md and .json;
--quick takes a minute, smaller grids, and writes nothing.
"""

import machine

# isort: split
import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from generation_runs import (
    TIPS,
    Asked,
    flexik_tips,
    generated,
    grid,
    measure_memory,
    model,
    parameter_variation,
)
from joblib.externals.loky import get_reusable_executor
from threadpoolctl import threadpool_limits

from flexik import stage
from flexik.cases.case import load
from flexik.errors import FlexikError
from flexik.files import write_json
from flexik.kinematics.manipulator import Array
from flexik.multibody.model import PlanarModel
from flexik.planar.fields import KEPT, inputs
from flexik.reporting.tables import Table

OUTPUT = Path("reports/benchmarks/generate")
N_REPEATS, N_PROCESSES = 5, 2
QUICK_GRID = {"lift": 5, "jib": 5, "extension": 3, "payload": 10}
TIP_TOLERANCE = 1e-6  # m

TARGET_RATE = 1000.0  # equilibria a second a core
TARGET_RATIO = 3.0  # beside (a)
# (b): one process of a DEC Alpha 600
PUBLISHED_SAMPLES, PUBLISHED_SECONDS = 4000, 25 * 60.0

# By name in the .json: a name for people, the number of processes and the function. The order
# counts: flexik_cold starts the worker processes, which flexik_2 finds
WAYS: dict[str, tuple[str, int, Callable[[Asked, int], Array]]] = {
    "flexik_1": ("flexik", 1, flexik_tips),
    "variation_1": ("(a) ParameterVariation", 1, parameter_variation),
    "flexik_cold": ("flexik, processes started anew", N_PROCESSES, flexik_tips),
    "flexik_2": ("flexik, processes there", N_PROCESSES, flexik_tips),
    "variation_2": ("(a) ParameterVariation", N_PROCESSES, parameter_variation),
}
COMPARED = {"flexik_1": "variation_1", "flexik_cold": "variation_2", "flexik_2": "variation_2"}

# Columns of the table: the figure in the .json, of a way or a grid, and decimals
COLUMNS = {
    "equilibria": ("n_kept", 0),
    "time (s)": ("seconds", 2),
    "per second": ("rate", 1),
    "per CPU second": ("rate_cpu", 1),
    "times (a)": ("ratio", 2),
    "peak main (MB)": ("main_mb", 1),
    "peak worker (MB)": ("worker_mb", 1),
}


def measure_speed(asked: Asked, n_repeats: int) -> dict[str, float]:
    """Medians over `n_repeats` of all ways, flat; raises FlexikError if their tips differ."""
    table = generated(asked, 1)
    expected, n, worst = table[TIPS].to_numpy(), int((table["status"] == KEPT).sum()), 0.0
    seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in WAYS}
    for repeat in range(n_repeats):
        get_reusable_executor().shutdown(wait=True)  # the pool of flexik_cold must not be there
        for name, (_, n_processes, function) in WAYS.items():
            wall, cpu = time.perf_counter(), time.process_time()
            tips = function(asked, n_processes)
            seconds[name].append((time.perf_counter() - wall, time.process_time() - cpu))
            worst = max(worst, largest_difference(name, tips, expected))
            print(f"repeat {repeat + 1}: {name} {n / seconds[name][-1][0]:.0f} a second")
    figures: dict[str, float] = {
        "n_vectors": len(table),
        "n_kept": n,
        "n_repeats": n_repeats,
        "largest_tip_difference": worst,
    }
    for name, runs in seconds.items():
        wall, cpu = np.transpose(runs)
        figures[f"seconds_{name}"] = float(np.median(wall))
        figures[f"rate_{name}"] = float(np.median(n / wall))
        figures[f"rate_{name}_slowest"] = float(np.min(n / wall))
        figures[f"rate_{name}_fastest"] = float(np.max(n / wall))
        if WAYS[name][1] == 1:
            figures[f"rate_cpu_{name}"] = float(np.median(n / cpu))
        if name in COMPARED:
            ratios = np.array([other for other, _ in seconds[COMPARED[name]]]) / wall
            figures[f"ratio_{name}"] = float(np.median(ratios))
            figures[f"ratio_{name}_lowest"] = float(np.min(ratios))
    return figures | measure_steps(table)


def largest_difference(name: str, tips: Array, expected: Array) -> float:
    """Largest tip distance in m; raises FlexikError if it, or what is solved, is not the same."""
    if not np.array_equal(np.isnan(tips), np.isnan(expected)):
        raise FlexikError(f"{name}: other samples are solved or left out than by flexik")
    difference = float(np.nanmax(np.linalg.norm(tips - expected, axis=1)))
    if difference > TIP_TOLERANCE:
        raise FlexikError(f"{name}: tips differ by {difference:.3g} m, above {TIP_TOLERANCE} m")
    return difference


def measure_steps(table: pd.DataFrame, n_vectors: int = 200) -> dict[str, float]:
    """Where (a) spends its time: median milliseconds to build, place and solve a model."""
    rows = table.loc[table["status"] == KEPT, inputs(load("crane").machine)].sample(
        n_vectors, random_state=0
    )
    times = []
    for *strokes, payload in rows.to_numpy():
        values, crane = np.array(strokes), model()
        poses = crane.linkage.poses(values[None])
        start = time.perf_counter()
        system = PlanarModel(crane, crane.touched(poses)[0])
        built = time.perf_counter()
        system.place(values, poses[0])
        placed = time.perf_counter()
        system.solve(float(payload))
        times.append([built - start, placed - built, time.perf_counter() - placed])
    medians = 1e3 * np.median(times, axis=0)
    return dict(zip(("build_ms", "place_ms", "solve_ms"), medians.tolist(), strict=True))


def table_of(figures: dict[str, float]) -> pd.DataFrame:
    """All runs as rows; what was not measured stays empty."""
    runs = [(label, n, f"{{}}_{name}") for name, (label, n, _) in WAYS.items()]
    runs.append(("(b) published", 1, "{}_published"))
    for size in ("small", "large"):
        label = f"flexik, grid of {figures[f'memory_{size}_n_samples']:.0f} vectors"
        runs.append((label, N_PROCESSES, f"memory_{size}_{{}}"))
    rows = [
        {"way": label, "processes": n_processes}
        | {title: figures.get(key.format(source)) for title, (source, _) in COLUMNS.items()}
        for label, n_processes, key in runs
    ]
    frame = pd.DataFrame(rows)
    frame["equilibria"] = frame["equilibria"].fillna(figures["n_kept"]).astype(int)
    return frame


def notes(figures: dict[str, float]) -> list[str]:
    """What the table means and whether the goals are met."""

    def verdict(value: float, goal: float) -> str:
        return "met" if value >= goal else "NOT met"

    f = figures
    per_core, lowest = f["rate_flexik_1"], min(f[f"ratio_{name}"] for name in COMPARED)
    return [
        f"Goal {TARGET_RATE:.0f} equilibria a second a core: {per_core:.0f} "
        f"({f['rate_flexik_1_slowest']:.0f} to {f['rate_flexik_1_fastest']:.0f}), "
        f"{verdict(per_core, TARGET_RATE)}; {per_core / f['rate_published']:.0f} times (b).",
        f"Goal {TARGET_RATIO:.0f} times (a) on the same cores: {lowest:.1f} in the least "
        f"favourable row, {verdict(lowest, TARGET_RATIO)}.",
        f"Goal memory flat: {f['memory_large_n_samples'] / f['memory_small_n_samples']:.0f} times "
        f"the vectors add {f['memory_growth_main_mb']:.1f} MB to the main process and "
        f"{f['memory_growth_worker_mb']:.1f} MB to the largest worker.",
        f"Medians of {f['n_repeats']:.0f} repeats over all {f['n_vectors']:.0f} vectors of table "
        f"4.1, of which {f['n_kept']:.0f} are equilibria and the others left out by rule; flexik's "
        "time includes its files. 'times (a)' is the median ratio within a repeat.",
        f"Tips of all ways agree within {f['largest_tip_difference']:.1e} m.",
        f"A vector of (a) takes {f['build_ms']:.2f} ms to build the model, {f['place_ms']:.2f} ms "
        f"to place and assemble it, {f['solve_ms']:.2f} ms to solve it from the unloaded pose.",
        machine.remark(N_PROCESSES, "exudyn", "numpy", "joblib"),
    ]


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description="Speed and memory of generating crane samples.")
    parser.add_argument("--quick", action="store_true", help="smaller grids; writes no files")
    quick = parser.parse_args().quick
    figures: dict[str, float] = {
        "n_kept_published": PUBLISHED_SAMPLES,
        "seconds_published": PUBLISHED_SECONDS,
        "rate_published": PUBLISHED_SAMPLES / PUBLISHED_SECONDS,
    }
    figures["rate_cpu_published"] = figures["rate_published"]
    with threadpool_limits(limits=1):
        figures |= measure_speed(grid(QUICK_GRID if quick else {}), 1 if quick else N_REPEATS)
    figures |= measure_memory(N_PROCESSES, quick)
    caption = "Generating crane samples: static equilibria a second and peak memory."
    decimals = {title: digits for title, (_, digits) in COLUMNS.items() if digits}
    table, shown = Table(table_of(figures), decimals), (caption, notes(figures))
    if not quick:
        table.write(OUTPUT, *shown)
        write_json(OUTPUT.with_suffix(".json"), figures)
    print(table.markdown(*shown))


if __name__ == "__main__":
    stage.run(main)
