"""The number of hidden neurons by selection error: networks of many sizes, several starts each.

As in Rouvinen 1999, chapter 2.4.5: the training error falls with the size, the error on data that
the training does not see falls and then rises again; the size at its minimum is the right one.
A size is the number of neurons of the one hidden layer, or of each of several.
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

# Neurons of the hidden layer, or of each of several
Size = int | tuple[int, ...]


def study_fields(n_layers: int) -> tuple[Field, ...]:
    """Columns of a study of networks with `n_layers` hidden layers: FIELDS where it is one.

    Of several layers, n_hidden_1, n_hidden_2 and so on stand in place of n_hidden.
    """
    if n_layers == 1:
        return FIELDS
    layers = (
        Field(f"n_hidden_{k}", "1", f"neurons in hidden layer {k}", "int64")
        for k in range(1, n_layers + 1)
    )
    return (*layers, *FIELDS[1:])


def layer_columns(table: pd.DataFrame) -> list[str]:
    """Those columns of `table` that tell the neurons of a layer, from the inputs on."""
    return [name for name in table.columns if str(name).startswith("n_hidden")]


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
    sizes: Sequence[Size],
    n_restarts: int,
    parameters_checksum: str,
    key: str,
    settings: ParallelSettings,
    description: str,
) -> int:
    """Train every size from every start, in parallel, into the Parquet table `path`.

    Its columns are `study_fields`. A run is the restart of the same number of `train_best` with
    that size. Killed and run again it goes on where it was; returns the number of runs that were
    there. See `compute_table`. Raises TrainingError if sizes differ in their number of layers.
    """
    path = Path(path)
    numbers = {len(_layers(size)) for size in sizes}
    if len(numbers) != 1:
        raise TrainingError(f"sizes {list(sizes)}: expected as many hidden layers in each")
    fields = study_fields(numbers.pop())
    runs = [(n_hidden, restart) for n_hidden in sizes for restart in range(n_restarts)]
    function = functools.partial(_run, study)
    folder = path.parent / f".{path.stem}_parts"
    return compute_table(
        path, function, runs, fields, parameters_checksum, key, settings, description, folder
    )


def by_size(runs: pd.DataFrame) -> pd.DataFrame:
    """Rows of a study, a row for every size.

    Columns n_hidden (of several layers n_hidden_1 and so on), best_restart (by selection error),
    its training_error and selection_error, median_selection_error and worst_selection_error over
    the restarts, n_failed. A size whose restarts all failed holds NaN.
    """
    rows = []
    columns = layer_columns(runs)
    for size, group in runs.groupby(columns):
        errors = group["selection_error"].to_numpy()
        usable = np.isfinite(errors)
        row = {**dict(zip(columns, size, strict=True)), "n_failed": int((~usable).sum())}
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


def choose_layers(sizes: pd.DataFrame, tolerance: float = 0.0) -> tuple[int, ...]:
    """The smallest size whose selection error is within `tolerance` (relative) of the least.

    The smallest has the fewest neurons in all layers, and of equals the fewest in the first. Raises
    TrainingError if every run of every size failed.
    """
    if "selection_error" not in sizes or not np.isfinite(sizes["selection_error"]).any():
        raise TrainingError("size selection: every run failed")
    allowed = sizes["selection_error"] <= (1.0 + tolerance) * sizes["selection_error"].min()
    rows = sizes.loc[allowed, layer_columns(sizes)].to_numpy(dtype=np.int64).tolist()
    return tuple(min(rows, key=lambda row: (sum(row), *row)))


def choose(sizes: pd.DataFrame, tolerance: float = 0.0) -> int:
    """As `choose_layers`, of networks with one hidden layer."""
    (n_hidden,) = choose_layers(sizes, tolerance)
    return n_hidden


def read_layers(path: Path | str) -> tuple[int, ...]:
    """The chosen n_hidden, number or list, in the JSON file `path`; DataError if there is none."""
    chosen = read_json(path)
    n_hidden = chosen.get("n_hidden") if isinstance(chosen, dict) else None
    layers = n_hidden if isinstance(n_hidden, list) and n_hidden else [n_hidden]
    if not all(isinstance(n, int) and n >= 1 for n in layers):
        raise DataError(f"{path}: expected a positive integer n_hidden, got {n_hidden!r}")
    return tuple(layers)


def read_choice(path: Path | str) -> int:
    """As `read_layers`, of a network with one hidden layer."""
    layers = read_layers(path)
    if len(layers) != 1:
        raise DataError(f"{path}: expected one hidden layer, got {list(layers)}")
    return layers[0]


def _layers(size: Size) -> tuple[int, ...]:
    return size if isinstance(size, tuple) else (size,)


def _run(study: Study, run: tuple[Size, int]) -> dict[str, np.ndarray]:
    n_hidden, restart = run
    layers = _layers(n_hidden)
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
            *layers,
            restart,
            float(np.sqrt(record.errors[record.kept])),
            record.selection_error,
            len(record.errors) - 1,
            str(record.stop_reason),
        )
    except TrainingError:
        row = (*layers, restart, np.nan, np.nan, 0, FAILED)
    fields = study_fields(len(layers))
    return {field.name: np.array([value]) for field, value in zip(fields, row, strict=True)}
