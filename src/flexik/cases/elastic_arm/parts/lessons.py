"""What the networks of the arm are trained with."""

from typing import Any

from flexik.cases.elastic_arm.parts.kinds import KINDS, LearningData, fields
from flexik.cases.elastic_arm.parts.readings import SELECTION, TRAINING
from flexik.cases.elastic_arm.section import Network, Section
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, Lesson
from flexik.parameters.trainers import Stopping


def described(section: Section, name: str, trainer: str) -> dict[str, dict[str, Any]]:
    """Settings and inputs of what trains network `name` by `trainer`."""
    network, samples = section.networks[name], section.data / "samples"
    shown = samples / f"readings.{network.readings}.parquet"
    return {
        "settings": {"network": network, "trainer": section.trainers[trainer]},
        "inputs": {"readings": samples / "readings.parquet", "shown": shown},
    }


def lesson(
    network: Network, n_hidden: tuple[int, ...], trainer: Stopping, data: LearningData
) -> Lesson:
    """Training of `network` with `n_hidden` units by the readings of `data`; none is held out."""
    kind = KINDS[network.learns]
    return Lesson(
        *data.of(TRAINING),
        quantities(fields(kind.inputs)),
        quantities(fields(kind.outputs)),
        Architecture(n_hidden, network.activation),
        trainer,
        network.seed,
        data.of(SELECTION),
    )
