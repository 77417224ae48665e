"""Speed and memory of generating crane samples, beside two other ways.

(a) Exudyn's own processing.ParameterVariation with one model for every vector.
(b) The published figure of Rouvinen 1999: about 4000 equilibria in 25 CPU minutes.

Speed: flexik and (a) solve the whole grid of table 4.1; in each repeat all ways follow one another,
so that a busy machine is busy for all of them, and ratios are taken within a repeat. The tips of
every run are compared. Memory: two grids of very different size, each in fresh processes.

    python benchmarks/generate.py [--quick] [--speed-only]

Reads params.yaml and, if there is one, data/crane/calibration.json. Writes reports/benchmarks/
generate.csv, .md and .json.
"""

import argparse
import os
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd
import table_grid
from generate_memory import measure_memory
from generate_speed import COMPARED, N_PROCESSES, WAYS, measure_speed, measure_steps
from threadpoolctl import threadpool_limits

from flexik import stage
from flexik.files import read_json, write_json
from flexik.reporting.tables import write_table

OUTPUT = Path("reports/benchmarks/generate")
N_REPEATS = 5

TARGET_RATE = 1000.0  # equilibria a second a core
TARGET_RATIO = 3.0  # beside (a)
# (b): one process of a DEC Alpha 600
PUBLISHED_SAMPLES, PUBLISHED_SECONDS = 4000, 25 * 60.0

DECIMALS = {
    "time (s)": 2,
    "per second": 1,
    "per CPU second": 1,
    "times (a)": 2,
    "peak main (MB)": 1,
    "peak worker (MB)": 1,
}


def table(figures: dict[str, float]) -> pd.DataFrame:
    """All runs as rows; what was not measured stays empty."""
    rows: list[dict[str, Any]] = []
    for name, (label, n_processes, _) in WAYS.items():
        rows.append(
            {
                "way": label,
                "processes": n_processes,
                "equilibria": int(figures["n_kept"]),
                "time (s)": figures[f"seconds_{name}"],
                "per second": figures[f"rate_{name}"],
                "per CPU second": figures.get(f"rate_cpu_{name}"),
                "times (a)": figures.get(f"ratio_{name}"),
            }
        )
    rows.append(
        {
            "way": "(b) published",
            "processes": 1,
            "equilibria": PUBLISHED_SAMPLES,
            "time (s)": PUBLISHED_SECONDS,
            "per second": figures["rate_published"],
            "per CPU second": figures["rate_published"],
        }
    )
    for size in ("small", "large"):
        memory = f"memory_{size}_"
        rows.append(
            {
                "way": f"flexik, grid of {figures[memory + 'n_samples']:.0f} vectors",
                "processes": N_PROCESSES,
                "equilibria": int(figures[memory + "n_kept"]),
                "time (s)": figures[memory + "seconds"],
                "per second": figures[memory + "rate"],
                "peak main (MB)": figures[memory + "main_mb"],
                "peak worker (MB)": figures[memory + "worker_mb"],
            }
        )
    return pd.DataFrame(rows)


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
        f"Ground spring {table_grid.spring_stiffness():.6g} N m/rad; exudyn {version('exudyn')}, "
        f"numpy {version('numpy')}, joblib {version('joblib')}; one BLAS thread a process.",
    ]


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description="Speed and memory of generating crane samples.")
    parser.add_argument("--quick", action="store_true", help="40500 instead of 405000 vectors")
    parser.add_argument(
        "--speed-only", action="store_true", help="keep the memory figures of the last run"
    )
    arguments = parser.parse_args()
    kept: dict[str, float] = {}
    if arguments.speed_only:
        last = read_json(OUTPUT.with_suffix(".json"))
        kept = {name: value for name, value in last.items() if name.startswith("memory_")}
    print(f"load of this machine at the start: {os.getloadavg()[0]:.2f}")
    figures: dict[str, float] = {"rate_published": PUBLISHED_SAMPLES / PUBLISHED_SECONDS}
    with threadpool_limits(limits=1):
        figures |= measure_speed(table_grid.grid(), N_REPEATS)
        figures |= measure_steps(table_grid.grid())
    print(f"load after the speed part: {os.getloadavg()[0]:.2f}")
    figures |= kept or measure_memory(N_PROCESSES, arguments.quick)
    caption = "Generating crane samples: static equilibria a second and peak memory."
    write_table(OUTPUT, table(figures), DECIMALS, caption, notes(figures))
    write_json(OUTPUT.with_suffix(".json"), figures)
    print(OUTPUT.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    stage.run(main)
