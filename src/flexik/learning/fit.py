"""A network from several starts as divided work: a start is an item, the selection error chooses.

Rare starts generalise badly, so the training error does not choose.
"""

import functools
from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from flexik.datasets.parts import Columns, Work, Writer, text_file
from flexik.learning.perceptron import Network
from flexik.learning.storage import network_file, packed, unpacked
from flexik.learning.training import Lesson, TrainingRecord, attempt, best


def fit(
    lesson: Lesson, n_restarts: int, finished: Callable[[Network], Network] | None = None
) -> Work:
    """Train `lesson` from `n_restarts` starts.

    The files are the chosen network (.json), the networks of all usable restarts (.restarts.json)
    and a row a restart (.restarts.csv).

    Parameters
    ----------
    finished : makes of a trained network what is written, for example joins it to another
    """

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        runs = [unpacked(result) for result in results]
        network, record, records = best(lesson, runs)
        table = restarts_csv(records, network.n_hidden)
        usable = [(found, made) for found, made in runs if found is not None]
        if finished is not None:
            network, usable = finished(network), [(finished(f), made) for f, made in usable]
        return {
            ".json": network_file([(network, record)]),
            ".restarts.json": network_file(usable),
            ".restarts.csv": text_file(table),
        }

    return Work(functools.partial(_restart, lesson), range(n_restarts), finish)


def _restart(lesson: Lesson, restart: int) -> Columns:
    return packed(*attempt(lesson, restart))


def restarts_csv(records: Sequence[TrainingRecord], n_hidden: int | tuple[int, ...]) -> str:
    """CSV, a row a restart; errors are root mean squares of normalised outputs."""
    rows = [
        {
            "restart": record.restart,
            "n_hidden": n_hidden,
            "trainer": record.trainer,
            "n_iterations": max(len(record.errors) - 1, 0),
            "training_error": record.training_error,
            "selection_error": record.selection_error,
            "stop_reason": record.stop_reason,
        }
        for record in records
    ]
    return pd.DataFrame(rows).to_csv(index=False)
