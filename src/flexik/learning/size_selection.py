"""The number of hidden neurons by selection error: networks of many sizes, several starts each.

As in Rouvinen 1999, chapter 2.4.5: the training error falls with the size, the error on data that
the training does not see falls and then rises again; the size at its minimum is the right one.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.resumable import compute_table
from flexik.datasets.tables import Field
from flexik.errors import DataError, TrainingError
from flexik.files import read_json
from flexik.learning.perceptron import Array, Quantity
from flexik.learning.stopping import Stopping
from flexik.learning.training import Architecture, Judge, train

FIELDS = (
    Field("n_hidden", "1", "neurons in the hidden layer", "int64"),
    Field("restart", "1", "number of the start, from 0", "int64"),
    Field("training_error", "1", "root mean square of the normalised output errors"),
    Field("selection_error", "1", "the same on the selection data; NaN where the run failed"),
    Field("n_iterations", "1", "iterations made", "int64"),
    Field("stop_reason", "1", "why the run ended", "string"),
)
FAILED = "failed"


@dataclass(frozen=True, eq=False)
class Study:
    """What all runs of a study share; the fields are those of learning.training.train."""

    inputs: Array
    outputs: Array
    selection_inputs: Array
    selection_outputs: Array
    architecture: Architecture
    settings: Stopping
    seed: int
    input_quantities: Sequence[Quantity]
    output_quantities: Sequence[Quantity]
    judge: Judge | None = None


def run_study(
    path: Path | str,
    study: Study,
    sizes: Sequence[int],
    n_restarts: int,
    parameters_checksum: str,
    key: str,
    settings: ParallelSettings,
    description: str,
) -> int:
    """Train every size from every start, in parallel, into the Parquet table `path` of FIELDS.

    A run is the restart of the same number of `train_best` with that size. Killed and run again it
    goes on where it was; returns the number of runs that were there. See `compute_table`.
    """
    path = Path(path)
    runs = [(n_hidden, restart) for n_hidden in sizes for restart in range(n_restarts)]
    function = functools.partial(_run, study)
    folder = path.parent / f".{path.stem}_parts"
    return compute_table(
        path, function, runs, FIELDS, parameters_checksum, key, settings, description, folder
    )


def by_size(runs: pd.DataFrame) -> pd.DataFrame:
    """Rows of FIELDS, a row for every size.

    Columns n_hidden, best_restart (by selection error), its training_error and selection_error,
    median_selection_error and worst_selection_error over the restarts, n_failed. A size whose
    restarts all failed holds NaN.
    """
    rows = []
    for n_hidden, group in runs.groupby("n_hidden"):
        errors = group["selection_error"].to_numpy()
        usable = np.isfinite(errors)
        row = {"n_hidden": n_hidden, "n_failed": int((~usable).sum())}
        if usable.any():
            best = group.iloc[int(np.nanargmin(errors))]
            row |= {
                "best_restart": int(best["restart"]),
                "training_error": best["training_error"],
                "selection_error": best["selection_error"],
                "median_selection_error": np.median(errors[usable]),
                "worst_selection_error": errors[usable].max(),
            }
        rows.append(row)
    return pd.DataFrame(rows)


def choose(sizes: pd.DataFrame, tolerance: float = 0.0) -> int:
    """The smallest n_hidden whose selection error is within `tolerance` (relative) of the least.

    Raises TrainingError if every run of every size failed.
    """
    if "selection_error" not in sizes or not np.isfinite(sizes["selection_error"]).any():
        raise TrainingError("size selection: every run failed")
    allowed = sizes["selection_error"] <= (1.0 + tolerance) * sizes["selection_error"].min()
    return int(sizes.loc[allowed, "n_hidden"].min())


def read_choice(path: Path | str) -> int:
    """The chosen n_hidden in the JSON file `path`; raises DataError if there is none."""
    chosen = read_json(path)
    n_hidden = chosen.get("n_hidden") if isinstance(chosen, dict) else None
    if not isinstance(n_hidden, int) or n_hidden < 1:
        raise DataError(f"{path}: expected a positive integer n_hidden, got {n_hidden!r}")
    return n_hidden


def _run(study: Study, run: tuple[int, int]) -> dict[str, np.ndarray]:
    n_hidden, restart = run
    try:
        _, record = train(
            study.inputs,
            study.outputs,
            replace(study.architecture, n_hidden=n_hidden),
            study.settings,
            study.seed,
            study.input_quantities,
            study.output_quantities,
            (study.selection_inputs, study.selection_outputs),
            restart,
            study.judge,
        )
        row = (
            n_hidden,
            restart,
            float(np.sqrt(record.errors[record.kept])),
            record.selection_error,
            len(record.errors) - 1,
            str(record.stop_reason),
        )
    except TrainingError:
        row = (n_hidden, restart, np.nan, np.nan, 0, FAILED)
    return {field.name: np.array([value]) for field, value in zip(FIELDS, row, strict=True)}
