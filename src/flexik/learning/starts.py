"""Trainers from many starts, near the origin of the weights and far from it.

The question of De Luca, Mattone and Sciandrone, section 3.1: do local minima far from the origin
stop a trainer, and does a fading weight penalty help?
"""

import functools
import itertools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from flexik.datasets.parts import Columns, Work, rows
from flexik.datasets.tables import Field
from flexik.errors import TrainingError
from flexik.learning.training import Lesson, train
from flexik.parameters.trainers import Stopping

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


def from_starts(
    lesson: Lesson,
    trainers: Mapping[str, Stopping],
    spreads: Mapping[str, float],
    n_starts: int,
    success: float,
) -> Work:
    """Train `lesson`, which has a judge, with every trainer from every start of every spread.

    The file is a table of FIELDS; all trainers have the same starts.

    Parameters
    ----------
    trainers, spreads : settings, and spreads of the initial weights, by name
    success : mean squared error of the normalised outputs at which a start counts as successful
    """
    runs = [(*names, k) for names in itertools.product(trainers, spreads) for k in range(n_starts)]
    function = functools.partial(_run, lesson, dict(trainers), dict(spreads), success)
    return Work(function, runs, rows(*FIELDS))


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


def _run(
    lesson: Lesson,
    trainers: Mapping[str, Stopping],
    spreads: Mapping[str, float],
    success: float,
    run: tuple[str, str, int],
) -> Columns:
    trainer, spread, start = run
    try:
        own = replace(lesson, settings=trainers[trainer], spread=spreads[spread])
        _, record = train(own, start)
    except TrainingError:
        values = (np.nan, 0, NO_SUCCESS, np.nan, FAILED)
    else:
        errors = np.array(record.errors)
        low = np.flatnonzero(errors <= success)
        first = int(low[0]) if low.size else NO_SUCCESS
        judged = np.nan if record.selection_error is None else record.selection_error
        values = (float(errors.min()), len(errors) - 1, first, judged, str(record.stop_reason))
    row = (trainer, spread, start, *values)
    return {field.name: np.array([value]) for field, value in zip(FIELDS, row, strict=True)}
