"""Trainers from many starts, near the origin of the weights and far from it.

The question of De Luca, Mattone and Sciandrone, section 3.1: do local minima far from the origin
stop a trainer, and does a fading weight penalty help?
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.resumable import compute_table
from flexik.datasets.tables import Field
from flexik.errors import TrainingError
from flexik.learning.perceptron import Array, Quantity
from flexik.learning.stopping import Stopping
from flexik.learning.training import Architecture, Judge, train

FIELDS = (
    Field("trainer", "1", "name of the trainer", "string"),
    Field("spread", "1", "name of the spread of the initial weights", "string"),
    Field("start", "1", "number of the start, from 0", "int64"),
    Field("error", "1", "least mean squared error of the normalised outputs; NaN: failed"),
    Field("n_iterations", "1", "iterations made", "int64"),
    Field("success_iteration", "1", "first iteration with success, or -1", "int64"),
    Field("judged", "1", "what the judge says of the network; NaN: failed"),
    Field("stop_reason", "1", "why the run ended", "string"),
)
FAILED = "failed"
NO_SUCCESS = -1


@dataclass(frozen=True, eq=False)
class StartStudy:
    """What all runs of a study share.

    Attributes
    ----------
    inputs, outputs, architecture, seed, input_quantities, output_quantities, judge : of
        learning.training.train
    trainers : settings by name
    spreads : of the initial weights, by name
    success : mean squared error of the normalised outputs at which a start counts as successful
    """

    inputs: Array
    outputs: Array
    architecture: Architecture
    trainers: Mapping[str, Stopping]
    spreads: Mapping[str, float]
    success: float
    seed: int
    input_quantities: Sequence[Quantity]
    output_quantities: Sequence[Quantity]
    judge: Judge


def run_starts(
    path: Path | str,
    study: StartStudy,
    n_starts: int,
    parameters_checksum: str,
    key: str,
    settings: ParallelSettings,
    description: str,
) -> int:
    """Train with every trainer from every start of every spread into the table `path` of FIELDS.

    All trainers have the same starts. Killed and run again it goes on where it was; returns the
    number of runs that were there. See `compute_table`.
    """
    path = Path(path)
    runs = [
        (trainer, spread, start)
        for trainer in study.trainers
        for spread in study.spreads
        for start in range(n_starts)
    ]
    function = functools.partial(_run, study)
    folder = path.parent / f".{path.stem}_parts"
    return compute_table(
        path, function, runs, FIELDS, parameters_checksum, key, settings, description, folder
    )


def by_trainer(runs: pd.DataFrame) -> pd.DataFrame:
    """Rows of FIELDS, a row for every trainer and spread, in the order of the table.

    Columns trainer, spread, n_starts, success_share; least, median and largest error; and the
    medians median_judged and median_success_iteration (NaN without any success), n_failed.
    """
    rows = []
    for (trainer, spread), group in runs.groupby(["trainer", "spread"], sort=False):
        errors = group["error"].to_numpy()
        usable = errors[np.isfinite(errors)]
        successful = group.loc[group["success_iteration"] != NO_SUCCESS, "success_iteration"]
        rows.append(
            {
                "trainer": trainer,
                "spread": spread,
                "n_starts": len(group),
                "success_share": len(successful) / len(group),
                "least_error": usable.min() if usable.size else np.nan,
                "median_error": np.median(usable) if usable.size else np.nan,
                "largest_error": usable.max() if usable.size else np.nan,
                "median_judged": group["judged"].median(),
                "median_success_iteration": successful.median(),
                "n_failed": len(group) - usable.size,
            }
        )
    return pd.DataFrame(rows)


def _run(study: StartStudy, run: tuple[str, str, int]) -> dict[str, np.ndarray]:
    trainer, spread, start = run
    try:
        _, record = train(
            study.inputs,
            study.outputs,
            study.architecture,
            study.trainers[trainer],
            study.seed,
            study.input_quantities,
            study.output_quantities,
            restart=start,
            judge=study.judge,
            spread=study.spreads[spread],
        )
    except TrainingError:
        values = (np.nan, 0, NO_SUCCESS, np.nan, FAILED)
    else:
        errors = np.array(record.errors)
        low = np.flatnonzero(errors <= study.success)
        first = int(low[0]) if low.size else NO_SUCCESS
        reason = str(record.stop_reason)
        judged = np.nan if record.selection_error is None else record.selection_error
        values = (float(errors.min()), len(errors) - 1, first, float(judged), reason)
    row = (trainer, spread, start, *values)
    return {field.name: np.array([value]) for field, value in zip(FIELDS, row, strict=True)}
