"""One network again by other divisions of the readings, since one decides little.

Which readings on the border of the range are held out moves R. The main division, samples.seed,
stays the one of the other stages.
"""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts.kinds import LearningData, learning_data
from flexik.cases.elastic_arm.parts.lessons import described, lesson
from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT, divide
from flexik.cases.elastic_arm.section import Network, Samples, Section
from flexik.datasets.parts import Part, Work, rows
from flexik.datasets.tables import Field
from flexik.errors import TrainingError
from flexik.evaluation.regression import correlation
from flexik.learning.training import train_best
from flexik.parameters.trainers import Stopping

FIELDS = (
    Field("seed", "1", "of the division of the readings", "int64"),
    *(Field(f"r_{name}", "1", f"R of {name} on its held-out readings") for name in ANGLES),
)


def part(section: Section) -> Part:
    """R on the held-out readings of every division."""
    splits = section.studies.splits
    of = described(section, splits.network, section.networks[splits.network].trainer)
    settings = {**of["settings"], "samples": section.samples, "seeds": splits.seeds}
    return Part("splits", prepare, settings, of["inputs"])


def prepare(
    *,
    network: Network,
    trainer: Stopping,
    samples: Samples,
    seeds: list[int],
    readings: Path,
    shown: Path,
) -> Work:
    """A division is an item."""
    data = learning_data(network.learns, readings, shown)
    return Work(functools.partial(_r, network, trainer, samples, data), seeds, rows(*FIELDS))


def _r(
    network: Network, trainer: Stopping, samples: Samples, data: LearningData, seed: int
) -> Mapping[str, NDArray]:
    """R on the held-out readings of the division by `seed`, trained as in the main one."""
    part = divide(len(data.inputs), samples.selection_share, samples.held_out_share, seed)
    data = replace(data, part=part)
    try:
        best = train_best(lesson(network, network.sizes[0], trainer, data), network.n_restarts)[0]
    except TrainingError as error:
        raise TrainingError(f"division {seed}: {error}") from None
    inputs, angles = data.of(HELD_OUT)
    r = correlation(angles, best.predict(inputs))
    return {"seed": np.array([seed])} | {f"r_{name}": r[[k]] for k, name in enumerate(ANGLES)}
