"""Training of small perceptrons: time to equal error beside other packages, cost of a step, memory.

Races: the crane's deflection and direct networks with 14, 30 and 60 hidden units. All trainers
have the same Nguyen-Widrow starts, normalised data, float64, one core, and one error measure: the
root mean square of the normalised output errors over all samples. Cost: a whole step of the
accelerated trainer, beside its operations at the rate of dgemm in the same run; large samples are
what a trained network gives for random inputs. Study: networks of 4 to 40 hidden units.

    python benchmarks/training.py [--quick]

Needs `make repro` for data/crane; the extra `benchmark` brings the peers, a row says which is not
installed. Writes reports/benchmarks/training.csv, .md and .json and training_cost.csv and .md;
--quick writes nothing.
"""

from machine import LOAD_BEFORE, pinned_pool, remark

# isort: split
import argparse
import math
import os
import statistics
import time
from pathlib import Path
from typing import Any

import pandas as pd
from training_cost import (
    MAIN_SIZE,
    N_ITERATIONS,
    SAMPLES,
    SIZES,
    STUDY_RESTARTS,
    STUDY_SIZES,
    measure_memory,
    measure_steps,
    measure_study,
)
from training_peers import PEERS
from training_race import (
    LABELS,
    OURS,
    PUBLISHED,
    QUICK_RACES,
    RACES,
    Race,
    Runs,
    run_race,
    speedups,
)

from flexik import stage
from flexik.files import write_json
from flexik.reporting.tables import Table

OUTPUT = Path("reports/benchmarks/training")
N_PROCESSES = 2

TARGET_SPEEDUP = 50.0
TARGET_STUDY = 120.0  # s
TARGET_MEMORY = 500.0  # MB above the data
TARGET_GROWTH = 1.3
TARGET_FLOOR = 3.0

Results = list[tuple[Race, dict[str, Runs]]]

DECIMALS = {
    "target 1": 4,
    "to 1 (s)": 3,
    "target 2": 4,
    "to 2 (s)": 3,
    "least error": 5,
    "times flexik to 1": 1,
    "times flexik to 2": 1,
}
COST_DECIMALS = {"step (ms)": 2, "per sample (us)": 3, "floor (ms)": 2}


def race_table(results: Results) -> pd.DataFrame:
    """A row for every race and trainer: medians over its starts."""
    rows: list[dict[str, Any]] = []
    for race, runs in results:
        for name, label in LABELS.items():
            entry = runs[name]
            row: dict[str, Any] = {
                "network": race.network,
                "hidden": race.n_hidden,
                "trainer": label,
                "starts": len(entry.best),
            }
            for k, target in enumerate(("loose", "tight"), start=1):
                seconds, own = getattr(entry, f"to_{target}"), getattr(runs[OURS], f"to_{target}")
                ratios = [a / b for a, b in zip(seconds, own, strict=False)]
                row |= {
                    f"target {k}": getattr(race, target),
                    f"to {k} (s)": _median(seconds),
                    f"times flexik to {k}": _median(ratios),
                }
            row |= {"least error": _median(entry.best), "remark": _remark(race, name, entry)}
            rows.append(row)
    return pd.DataFrame(rows)


def _median(values: list[float]) -> float | None:
    median = statistics.median(values) if values else math.inf
    return median if math.isfinite(median) else None


def _remark(race: Race, name: str, entry: Runs) -> str:
    if entry.remark or not entry.best or name in (OURS, PUBLISHED):
        return entry.remark
    missed = sum(math.isinf(seconds) for seconds in entry.to_tight)
    return f"{missed} of {len(entry.best)} not in {race.limit:.0f} s" if missed else ""


def cost_table(figures: dict[str, float], samples: tuple[int, ...]) -> pd.DataFrame:
    """A row for every size and number of samples."""
    cells = [(samples[0], h) for h in SIZES] + [(n, MAIN_SIZE) for n in samples[1:]]
    rows = []
    for n, h in cells:
        step = f"step_{h}_{n}_"
        rows.append(
            {
                "hidden": h,
                "samples": n,
                "step (ms)": 1e3 * figures[step + "seconds"],
                "per sample (us)": 1e6 * figures[step + "seconds"] / n,
                "per sample, times the fewest": figures[step + "growth"],
                "floor (ms)": 1e3 * figures[step + "floor_seconds"],
                "times floor": figures[step + "floor_ratio"],
            }
        )
    return pd.DataFrame(rows)


def figures_of(results: Results) -> dict[str, float]:
    """Flat figures of the races; the headline is the worse network at MAIN_SIZE."""
    figures: dict[str, float] = {}
    for race, runs in results:
        for target in ("loose", "tight"):
            ratios = speedups(race, runs, f"to_{target}")
            figures[f"speedup_{race.name}_{target}"] = statistics.median(ratios)
            figures[f"speedup_{race.name}_{target}_lowest"] = min(ratios)
            for name in LABELS:
                if (seconds := _median(getattr(runs[name], f"to_{target}"))) is not None:
                    figures[f"seconds_{race.name}_{target}_{name}"] = seconds
    main = [race for race, _ in results if race.n_hidden == MAIN_SIZE]
    figures["speedup_vs_best_peer"] = min(figures[f"speedup_{race.name}_tight"] for race in main)
    return figures


def notes(figures: dict[str, float], results: Results, samples: tuple[int, ...]) -> list[str]:
    """What the tables mean and whether the goals are met."""

    def verdict(met: bool) -> str:
        return "met" if met else "NOT met"

    f, growth = figures, figures[f"step_{MAIN_SIZE}_{samples[-1]}_growth"]
    main = [race for race, _ in results if race.n_hidden == MAIN_SIZE]
    by_network = "; ".join(
        f"{race.network} {f[f'speedup_{race.name}_tight']:.0f} (lowest of {race.n_starts} starts "
        f"{f[f'speedup_{race.name}_tight_lowest']:.0f}; to target 1 "
        f"{f[f'speedup_{race.name}_loose']:.0f})"
        for race in main
    )
    speedup, study, memory = (
        f["speedup_vs_best_peer"],
        f["study_seconds"],
        f["memory_above_data_mb"],
    )
    return [
        f"Goal {TARGET_SPEEDUP:.0f} times the fastest other package to target 2 at {MAIN_SIZE} "
        f"hidden: {by_network}; {verdict(speedup >= TARGET_SPEEDUP)} in the worse network.",
        f"Goal {f['study_networks']:.0f} networks (100 iterations each) in {TARGET_STUDY:.0f} s on "
        f"{N_PROCESSES} cores: {study:.0f} s, {verdict(study <= TARGET_STUDY)}.",
        f"Goal {TARGET_MEMORY:.0f} MB above the data at {samples[-1]} samples: {memory:.0f} MB "
        f"(data {f['memory_data_mb']:.0f} MB), {verdict(memory < TARGET_MEMORY)}.",
        f"Goal cost per sample at {samples[-1]} samples within {TARGET_GROWTH} times that at "
        f"{samples[0]}: {growth:.2f}, {verdict(growth <= TARGET_GROWTH)}.",
        f"Goal {TARGET_FLOOR:.0f} times the floor, a whole step at {MAIN_SIZE} hidden with the "
        f"number of samples least in its favour: {f['floor_ratio']:.1f}, "
        f"{verdict(f['floor_ratio'] <= TARGET_FLOOR)}. Floor: the operations a step needs at the "
        f"rate of dgemm in this run, {f['dgemm_gflops']:.0f} Gflop/s; tanh is not counted in it.",
        "Targets: the error the published schedule reaches in 30 iterations, and in 300 (60 "
        "hidden: 100). Medians over the starts; 'times flexik' are medians of ratios from one "
        "start. Ours is the median of runs before each peer. Empty: not reached in time; where no "
        "package gets there, its time limit counts as that of the fastest, a lower bound.",
        "Packages keep their defaults but for stopping rules. Their imports and compiling (JAX) "
        "are not counted, nor is asking them for their error. SciPy has an analytic Jacobian. "
        "MLPRegressor takes no start: the weights are put in as those of an earlier fit, and it is "
        "fitted on whenever it ends. Adam: batches of 128, rate 0.003. A package that misses "
        "target 2 from the first start does not run from the others. OpenBLAS has the kernels that "
        "the stages fix, torch those for AVX2 and its own choice of MKL's.",
        f"Cost: runs of {N_ITERATIONS} iterations, normalisation and rejected trials included; "
        "samples are a trained network's outputs for random inputs, no equilibria.",
        _remark_on_machine(),
    ]


def _remark_on_machine() -> str:
    return remark(N_PROCESSES, *sorted({"numpy"} | {peer.package for peer in PEERS.values()}))


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description="Training beside other packages; cost; memory.")
    parser.add_argument("--quick", action="store_true", help="a few minutes; writes no files")
    quick = parser.parse_args().quick
    races = QUICK_RACES if quick else RACES
    samples = SAMPLES[:2] if quick else SAMPLES
    started, figures = time.perf_counter(), {"load_start": LOAD_BEFORE}
    figures |= measure_study(STUDY_SIZES, 1 if quick else STUDY_RESTARTS, N_PROCESSES)
    print(f"study: {figures['study_seconds']:.1f} s", flush=True)
    with pinned_pool(1) as pool:
        figures |= pool.submit(measure_steps, 3, samples).result()
        figures |= pool.submit(measure_memory, samples[-1]).result()
    figures["floor_ratio"] = max(figures[f"step_{MAIN_SIZE}_{n}_floor_ratio"] for n in samples)
    figures[f"memory_mb_{samples[-1] // 1000}k"] = figures["memory_above_data_mb"]
    with pinned_pool(N_PROCESSES) as pool:
        # submitted one by one, for map would hand them out in blocks
        futures = [pool.submit(run_race, race) for race in races]
        results = [(race, future.result()) for race, future in zip(races, futures, strict=True)]
    figures |= figures_of(results)
    figures |= {"load_end": os.getloadavg()[0], "total_seconds": time.perf_counter() - started}
    race = Table(race_table(results), DECIMALS)
    cost = Table(cost_table(figures, samples), COST_DECIMALS)
    captions = (
        "Training the crane's networks: seconds to two errors, from equal starts.",
        "A step of the accelerated trainer: cost by size and samples.",
    )
    remarks = notes(figures, results, samples)
    if not quick:
        race.write(OUTPUT, captions[0], remarks)
        cost.write(OUTPUT.with_name(f"{OUTPUT.name}_cost"), captions[1], [_remark_on_machine()])
        write_json(OUTPUT.with_suffix(".json"), figures)
    print(race.markdown(captions[0], remarks))
    print(cost.markdown(captions[1]))
    print(f"{figures['total_seconds']:.0f} s in all")


if __name__ == "__main__":
    stage.run(main)
