"""Train networks of many sizes; the selection error chooses."""

from pathlib import Path

from flexik.cases.elastic_arm.parts.kinds import learning_data
from flexik.cases.elastic_arm.parts.lessons import described, lesson
from flexik.cases.elastic_arm.section import Network, Section
from flexik.datasets.parts import Part, Work
from flexik.learning.size_selection import select
from flexik.parameters.trainers import Stopping


def parts(section: Section) -> list[Part]:
    """A part for every network whose size is to be chosen."""
    return [
        Part(name, prepare, **described(section, name, network.select.trainer))
        for name, network in section.networks.items()
        if network.is_selected
    ]


def prepare(*, network: Network, trainer: Stopping, readings: Path, shown: Path) -> Work:
    """A size from one start is an item."""
    sizes, data = network.sizes, learning_data(network.learns, readings, shown)
    common = lesson(network, sizes[0], trainer, data)
    return select(common, sizes, network.select.n_restarts, network.select.tolerance)
