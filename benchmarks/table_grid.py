"""What the benchmarks of the crane share: the model, the grid of table 4.1 and one run over it."""

import functools
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.crane.grid import FIELDS, GridParts, axis, generate
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.tables import read_table
from flexik.files import read_json
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import FlexibleCrane
from flexik.parameters import Crane, load_parameters

CALIBRATION = Path("data/crane/calibration.json")
# N m/rad, about what the calibration gives: a benchmark must not need the pipeline to have run
STIFFNESS_WITHOUT_CALIBRATION = 8.45e6
CHECKSUM = "benchmark"


@functools.cache
def parameters() -> Crane:
    """Section `crane` of params.yaml."""
    return load_parameters().crane


def spring_stiffness() -> float:
    """Stiffness of the ground spring in N m/rad: the calibrated one, if there is one."""
    if not CALIBRATION.exists():
        return STIFFNESS_WITHOUT_CALIBRATION
    return float(read_json(CALIBRATION)["spring_stiffness"])


@functools.cache
def model() -> FlexibleCrane:
    """Return the crane of params.yaml, read once a process."""
    return flexible_crane(parameters(), spring_stiffness())


def grid(n_values: dict[str, int] | None = None) -> GridParts:
    """Return the grid of table 4.1, or its ranges cut into `n_values` by name of the axis."""
    axes = {name: axis(**getattr(parameters().grid, name).model_dump()) for name in GridParts.AXES}
    for name, n in (n_values or {}).items():
        axes[name] = np.linspace(axes[name][0], axes[name][-1], n)
    return GridParts(**axes)


def write(path: Path, parts: GridParts, n_workers: int, description: str = "") -> None:
    """Solve `parts` into the Parquet table `path`, as the pipeline does."""
    minimum_tip_x = parameters().grid.minimum_tip_x
    settings = ParallelSettings(n_workers)
    generate(path, model(), parts, minimum_tip_x, CHECKSUM, CHECKSUM, settings, description)


def read(path: Path) -> pd.DataFrame:
    """Table made by `write`."""
    return read_table(path, FIELDS, CHECKSUM)


def run(parts: GridParts, n_workers: int) -> pd.DataFrame:
    """Table of `parts`, written and read back."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "grid.parquet"
        write(path, parts, n_workers)
        return read(path)
