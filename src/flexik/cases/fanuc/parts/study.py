"""The network of one joint in several sizes and with several learning factors."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from flexik.cases.fanuc.parts.learning import TaughtSamples, learn, percent
from flexik.cases.fanuc.parts.tables import PATH_FIELDS, STUDY_FIELDS
from flexik.cases.fanuc.section import Section
from flexik.datasets.parts import Columns, Part, Work, rows
from flexik.datasets.tables import read_table
from flexik.learning.training import Architecture, Attempt
from flexik.parameters.trainers import BackPropagation


def parts(section: Section) -> list[Part]:
    """Studies of the number of hidden neurons and of the learning factor."""
    found = []
    for name in ("n_hidden", "learning_factor"):
        study = getattr(section.studies, name)
        network = section.networks[study.network]
        settings = {
            "varied": name,
            "values": study.values,
            "joint": study.joint,
            "n_restarts": study.n_restarts,
            "n_hidden": network.sizes[0],
            "activation": network.activation,
            "seed": network.seed,
            "trainer": section.trainers[network.trainer].but(n_iterations=study.n_iterations),
        }
        found.append(Part(name, prepare, settings, {"path": section.data / "samples/path.parquet"}))
    return found


def prepare(
    *,
    varied: str,
    values: list[float],
    joint: int,
    n_restarts: int,
    n_hidden: tuple[int, ...],
    activation: str,
    seed: int,
    trainer: BackPropagation,
    path: Path,
) -> Work:
    """All starts of all values; those of one size learn together.

    The learning factor stays what it is: it is the least the trainer may come down to as well.
    """
    samples = TaughtSamples.of_table(read_table(path, PATH_FIELDS))
    by_size: dict[tuple[int, ...], list[tuple[float, Attempt]]] = {}
    for value in values:
        size = (int(value),) if varied == "n_hidden" else n_hidden
        factor = value if varied == "learning_factor" else trainer.learning_rate
        settings = trainer.but(learning_rate=factor, minimum_rate=factor)
        for restart in range(n_restarts):
            given = Architecture(size, activation), settings, seed, restart
            attempt = samples.attempt((joint,), *given)
            by_size.setdefault(size, []).append((float(value), attempt))
    return Work(partial(errors_of, samples), list(by_size.values()), rows(*STUDY_FIELDS))


def errors_of(samples: TaughtSamples, item: Sequence[tuple[float, Attempt]]) -> Columns:
    """Columns STUDY_FIELDS of starts of one shape, and the value of each."""
    values, attempts = zip(*item, strict=True)
    learnt = learn(samples, attempts)
    errors = np.array([samples.errors(each.network, percent)[:, 0] for each in learnt])
    columns = (
        values,
        [attempt.restart for attempt in attempts],
        *errors.T,
        [each.record.kept for each in learnt],
        [str(each.record.stop_reason) for each in learnt],
    )
    return {f.name: np.array(column) for f, column in zip(STUDY_FIELDS, columns, strict=True)}
