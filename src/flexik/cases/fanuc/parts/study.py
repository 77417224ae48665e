"""The network of one joint in several sizes and with several learning factors."""

from dataclasses import dataclass
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


@dataclass(frozen=True, eq=False)
class Item:
    """Starts of one shape, and the value of each."""

    samples: TaughtSamples
    values: list[float]
    attempts: list[Attempt]


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
    by_size: dict[tuple[int, ...], Item] = {}
    for value in values:
        size = (int(value),) if varied == "n_hidden" else n_hidden
        factor = value if varied == "learning_factor" else trainer.learning_rate
        settings = trainer.but(learning_rate=factor, minimum_rate=factor)
        item = by_size.setdefault(size, Item(samples, [], []))
        for restart in range(n_restarts):
            item.values.append(float(value))
            architecture = Architecture(size, activation)
            attempt = samples.attempt((joint,), architecture, settings, seed, restart)
            item.attempts.append(attempt)
    return Work(errors_of, list(by_size.values()), rows(*STUDY_FIELDS))


def errors_of(item: Item) -> Columns:
    """Columns STUDY_FIELDS."""
    learnt = learn(item.samples, item.attempts)
    errors = np.array([item.samples.errors(each.network, percent)[:, 0] for each in learnt])
    columns = (
        item.values,
        [attempt.restart for attempt in item.attempts],
        *errors.T,
        [each.record.kept for each in learnt],
        [str(each.record.stop_reason) for each in learnt],
    )
    return {f.name: np.array(values) for f, values in zip(STUDY_FIELDS, columns, strict=True)}
