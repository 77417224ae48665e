"""What a training step costs: by samples and hidden size, beside the floating-point floor.

Also its memory for 400000 samples, and the time of a study of 370 networks. Started by itself with
the path of a sample and the hidden size, this script trains once and prints its memory as JSON
(Linux only, as the benchmark of the generation).
"""

from machine import MEGABYTE, memory

# isort: split
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from training_data import (
    OURS,
    SEED,
    Array,
    crane_lesson,
    endless,
    run_ours,
    teacher_sample,
)

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import Part, Work, make
from flexik.learning.size_selection import select

SAMPLES = (4_000, 40_000, 400_000)
SIZES = (14, 30, 60)
MAIN_SIZE = 30
N_ITERATIONS = 10
DGEMM_SIZE = 1000

STUDY_SIZES = tuple(range(4, 41))
STUDY_RESTARTS, STUDY_ITERATIONS = 10, 100


def step_flops(n: int, p: int, h: int, q: int) -> float:
    """Additions and multiplications that one accepted step needs, without those for tanh.

    Half of the products of the symmetric J^T J, each distinct one of two inputs once for two
    hidden units, and the output block once for the refit and the next step; forward pass, second
    derivative and J^T r of the acceleration; Cholesky factor with the output block eliminated.
    """
    c, k, m = p + 1, h + 1, h * (p + 1)
    gram = h * (h + 1) / 2 * c * (c + 1) / 2 + m * k + k * (k + 1) / 2 + q * (m + k)
    passes = (m + q * k) + (m + 2 * q * h) + (q * k + q * h + m)
    factor = k**3 / 3 + q * m * k**2 + q * k * m**2 + m**3 / 3
    return 2 * n * (gram + passes) + factor


def dgemm_rate() -> float:
    """Floating-point operations a second of a large matrix product, the best of three."""
    a = np.random.default_rng(SEED).normal(size=(DGEMM_SIZE, DGEMM_SIZE))
    times = []
    for _ in range(3):
        started = time.perf_counter()
        a @ a
        times.append(time.perf_counter() - started)
    return 2 * DGEMM_SIZE**3 / min(times)


def measure_steps(n_repeats: int, samples: tuple[int, ...]) -> dict[str, float]:
    """Medians of seconds a step and its ratio to the floor, flat; for one process with one core.

    Seconds a step are those of a whole run of N_ITERATIONS, with normalisation and rejected
    trials, divided by their number. Samples vary at MAIN_SIZE, sizes at the fewest samples.
    """
    inputs, outputs = teacher_sample(max(samples))
    cells = sorted({(n, MAIN_SIZE) for n in samples} | {(samples[0], h) for h in SIZES})
    found: dict[str, list[float]] = {"dgemm_gflops": []}
    for repeat in range(n_repeats):
        rate = dgemm_rate()
        found["dgemm_gflops"].append(rate / 1e9)
        per_sample = {}
        for n, h in cells:
            # short runs vary more, so there are more of them
            n_runs = max(1, min(5, 20_000 // n))
            settings = endless(OURS, n_iterations=N_ITERATIONS)
            runs = [run_ours(inputs[:n], outputs[:n], h, settings) for _ in range(n_runs)]
            seconds = float(np.median([used / (len(errors) - 1) for _, errors, used in runs]))
            floor = step_flops(n, inputs.shape[1], h, outputs.shape[1]) / rate
            per_sample[n, h] = seconds / n
            values = {
                "seconds": seconds,
                "floor_seconds": floor,
                "floor_ratio": seconds / floor,
                "growth": per_sample[n, h] / per_sample.get((samples[0], h), per_sample[n, h]),
            }
            for name, value in values.items():
                found.setdefault(f"step_{h}_{n}_{name}", []).append(value)
        print(f"cost, repeat {repeat + 1} of {n_repeats}: dgemm {rate / 1e9:.1f} Gflop/s")
    return {name: float(np.median(values)) for name, values in found.items()}


def measure_memory(n_samples: int) -> dict[str, float]:
    """Memory in MB of training with `n_samples`, above that of the process holding the data."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sample.npy"
        np.save(path, np.hstack(teacher_sample(n_samples)))
        command = [sys.executable, __file__, str(path), str(MAIN_SIZE)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return {f"memory_{name}": value for name, value in json.loads(done.stdout).items()}


def measure_study(sizes: tuple[int, ...], n_restarts: int, n_processes: int) -> dict[str, float]:
    """Seconds of a study of the deflection network, with its table and the start of processes."""
    settings = {"sizes": [(size,) for size in sizes], "n_restarts": n_restarts}
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        make(folder, [Part("study", _study, settings)], ParallelSettings(n_processes))
    seconds = time.perf_counter() - started
    return {"study_seconds": seconds, "study_networks": len(sizes) * n_restarts}


def _study(*, sizes: list[tuple[int, ...]], n_restarts: int) -> Work:
    settings = endless(OURS, n_iterations=STUDY_ITERATIONS)
    return select(replace(crane_lesson("deflection"), settings=settings), sizes, n_restarts, None)


def _train_and_report(path: Path, n_hidden: int) -> dict[str, float]:
    columns: Array = np.load(path)
    inputs, outputs = columns[:, :-2].copy(), columns[:, -2:].copy()
    del columns
    # loads what loads late, and its few samples leave the peak alone
    run_ours(inputs[:1000], outputs[:1000], n_hidden, OURS(n_iterations=2))
    before = memory("VmRSS")
    run_ours(inputs, outputs, n_hidden, OURS(n_iterations=3))
    data = (inputs.nbytes + outputs.nbytes) / MEGABYTE
    # the peak is that of the process since its start: never less than what training took
    return {"above_data_mb": memory("VmHWM") - before, "data_mb": data}


if __name__ == "__main__":
    print(json.dumps(_train_and_report(Path(sys.argv[1]), int(sys.argv[2]))))
