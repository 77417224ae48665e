"""Ways to generate crane samples on the grid of table 4.1, and the memory that flexik's takes.

Started by itself, with the numbers of values on the lift, jib, extension and payload axis and of
processes, this script generates one grid and prints what it took as JSON (Linux only).
"""

import machine

# isort: split
import functools
import json
import multiprocessing
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
from exudyn.processing import ParameterVariation

from flexik.cases.case import load
from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.datasets import parallel
from flexik.datasets.parts import Part, make
from flexik.datasets.tables import read_table
from flexik.errors import SolverError
from flexik.kinematics.crane import forward
from flexik.kinematics.manipulator import Array
from flexik.multibody.model import PlanarModel
from flexik.parameters.networks import Axis
from flexik.planar.constants import model_inputs
from flexik.planar.fields import sample_fields
from flexik.planar.samples import axis, counts, parts

# Values on the axes: 4050 vectors as in table 4.1, ten times and 100 times as many
SMALL = {"lift": 9, "jib": 9, "extension": 5, "payload": 10}
TEN_TIMES = {"lift": 18, "jib": 18, "extension": 5, "payload": 25}
HUNDRED_TIMES = {"lift": 18, "jib": 18, "extension": 50, "payload": 25}
TIPS = ["tip_x", "tip_y"]

# A grid of samples, axes by name
Asked = dict[str, Axis]


@functools.cache
def model() -> FlexibleCrane:
    """Return the crane of params.yaml on the calibrated spring, read once a process."""
    section = load("crane")
    return flexible(section.machine, model_inputs(section)["constants"])


def grid(n_values: Mapping[str, int]) -> Asked:
    """Return the grid of params.yaml, its ranges cut into `n_values` by name of the axis."""
    given = load("crane").samples.grid
    axes = {name: given[name] for name in n_values}
    steps = {k: (axes[k].maximum - axes[k].minimum) / (n - 1) for k, n in n_values.items()}
    cut = {name: axes[name].model_copy(update={"increment": step}) for name, step in steps.items()}
    return given | cut


def generated(asked: Asked, n_processes: int) -> pd.DataFrame:
    """Table of the pipeline's part `grid` for the grid `asked`, written and read back."""
    part = next(part for part in parts(load("crane")) if part.name == "grid")
    part = Part(part.name, part.prepare, {**part.settings, "drawn": asked}, part.inputs)
    with (
        tempfile.TemporaryDirectory() as folder,
        # processes also where the work is too small for their start
        patch.object(parallel, "START_SECONDS", 0.0),
    ):
        make(folder, [part], parallel.ParallelSettings(n_processes))
        return read_table(
            Path(folder) / f"{part.name}.parquet", sample_fields(load("crane").machine)
        )


def flexik_tips(asked: Asked, n_processes: int) -> Array:
    """Tips (n, 2) in m by this package."""
    return generated(asked, n_processes)[TIPS].to_numpy()


def parameter_variation(asked: Asked, n_processes: int) -> Array:
    """Tips (n, 2) in m by Exudyn's processing, in the order of `flexik_tips`."""
    # extension slowest, payload fastest: the last parameter varies first
    order = ("extension", "lift", "jib", "payload")
    _, values = ParameterVariation(
        one_model_per_vector,
        {name: axis(**dict(asked[name])).tolist() for name in order},
        useMultiProcessing=n_processes > 1,
        numberOfThreads=n_processes,
        showProgress=False,
    )
    return np.array(values)


def one_model_per_vector(parameter_set: dict[str, Any]) -> tuple[float, float]:
    """Tip in m: builds a model, solves it once; NaN if it is left out or fails."""
    strokes = np.array([parameter_set[name] for name in ("lift", "jib", "extension")])
    if forward(model().geometry, strokes[None])[0, 0] < load("crane").samples.minimum_tip_x:
        return np.nan, np.nan
    try:
        system = PlanarModel.placed(model(), strokes)
        system.solve(parameter_set["payload"])
    except SolverError:
        return np.nan, np.nan
    x, y = system.tip()
    return float(x), float(y)


def measure_memory(n_processes: int, quick: bool) -> dict[str, float]:
    """Peaks in MB of the main process and of the largest worker for both grids, flat."""
    figures: dict[str, float] = {}
    for label, n_values in (("small", SMALL), ("large", TEN_TIMES if quick else HUNDRED_TIMES)):
        command = [sys.executable, __file__, *map(str, n_values.values()), str(n_processes)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        found = json.loads(done.stdout.splitlines()[-1])
        figures |= {f"memory_{label}_{name}": value for name, value in found.items()}
    for process in ("main_mb", "worker_mb"):
        growth = figures[f"memory_large_{process}"] - figures[f"memory_small_{process}"]
        figures[f"memory_growth_{process}"] = growth
    return figures


def what_it_took(asked: Asked, n_processes: int) -> dict[str, float]:
    """Counts, seconds and peaks in MB of generating one grid in this process and others."""
    start = time.perf_counter()
    found = counts(generated(asked, n_processes))
    seconds = time.perf_counter() - start
    main_mb = machine.memory("VmHWM")
    # the pool of joblib outlives the run for a while
    children = multiprocessing.active_children()
    workers = [machine.memory("VmHWM", child.pid) for child in children if child.pid]
    if len(workers) < n_processes:
        raise RuntimeError(f"{len(workers)} of {n_processes} worker processes left to be asked")
    took = {"seconds": seconds, "rate": found["n_kept"] / seconds}
    return {**found, **took, "main_mb": main_mb, "worker_mb": max(workers)}


if __name__ == "__main__":
    *n_values, n_processes = map(int, sys.argv[1:])
    asked = grid(dict(zip([*load("crane").machine.drives, "payload"], n_values, strict=True)))
    print(json.dumps(what_it_took(asked, n_processes)))
