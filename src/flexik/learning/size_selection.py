"""The number of hidden neurons by selection error: networks of many sizes, several starts each.

As in Rouvinen 1999, chapter 2.4.5: the training error falls with the size, the error on data that
the training does not see falls and then rises again; the size at its minimum is the right one.
A size is the number of neurons of the one hidden layer, or of each of several.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.parts import Columns, Work, Writer, json_file, stacked, table
from flexik.datasets.tables import Field
from flexik.errors import DataError, TrainingError
from flexik.files import read_json
from flexik.learning.training import Architecture, Lesson, train

FIELDS = (
    Field("n_hidden", "1", "neurons in the hidden layer", "int64"),
    Field("restart", "1", "number of the start, from 0", "int64"),
    Field("training_error", "1", "root mean square of the normalised output errors"),
    Field("selection_error", "1", "the same on the selection data; NaN where the run failed"),
    Field("n_iterations", "1", "iterations made", "int64"),
    Field("stop_reason", "1", "why the run ended", "string"),
)
FAILED = "failed"

# Neurons of every hidden layer
Size = tuple[int, ...]


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


def select(
    lesson: Lesson, sizes: Sequence[Size], n_restarts: int, tolerance: float | None = 0.0
) -> Work:
    """Train `lesson` in every size from every start.

    The files are a row a run (.parquet, columns `study_fields`) and the chosen n_hidden (.json),
    the latter unless `tolerance` is None. A run is the restart of the same number of a network of
    that size.

    Parameters
    ----------
    sizes : of as many hidden layers each; TrainingError if not
    tolerance : as for `choose_layers`
    """
    if len({len(size) for size in sizes}) != 1:
        raise TrainingError(f"sizes {list(sizes)}: expected as many hidden layers in each")
    fields = study_fields(len(sizes[0]))

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        columns = stacked(results, fields)
        files = {".parquet": table(columns, fields)}
        if tolerance is not None:
            chosen = choose_layers(by_size(pd.DataFrame(columns)), tolerance)
            n_hidden = chosen[0] if len(chosen) == 1 else list(chosen)
            files[".json"] = json_file({"n_hidden": n_hidden})
        return files

    runs = [(size, restart) for size in sizes for restart in range(n_restarts)]
    return Work(functools.partial(_run, lesson), runs, finish)


def _run(lesson: Lesson, run: tuple[Size, int]) -> Columns:
    size, restart = run
    try:
        architecture = Architecture(size, lesson.architecture.activation)
        _, record = train(replace(lesson, architecture=architecture), restart)
        found = record.selection_error
        errors = record.training_error, np.nan if found is None else found
        row = (*size, restart, *errors, len(record.errors) - 1, str(record.stop_reason))
    except TrainingError:
        row = (*size, restart, np.nan, np.nan, 0, FAILED)
    fields = study_fields(len(size))
    return {field.name: np.array([value]) for field, value in zip(fields, row, strict=True)}


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


def read_layers(path: Path | str) -> tuple[int, ...]:
    """The chosen n_hidden, number or list, in the JSON file `path`; DataError if there is none."""
    chosen = read_json(path)
    n_hidden = chosen.get("n_hidden") if isinstance(chosen, dict) else None
    layers = n_hidden if isinstance(n_hidden, list) and n_hidden else [n_hidden]
    if not all(isinstance(n, int) and n >= 1 for n in layers):
        raise DataError(f"{path}: expected a positive integer n_hidden, got {n_hidden!r}")
    return tuple(layers)
