"""Train every network from several starts; the selection readings choose among them."""

from pathlib import Path

from flexik.cases.elastic_arm.parts.kinds import learning_data
from flexik.cases.elastic_arm.parts.lessons import described, lesson
from flexik.cases.elastic_arm.section import Network, Section
from flexik.datasets.parts import Part, Work
from flexik.learning.fit import fit
from flexik.learning.size_selection import read_layers
from flexik.parameters.trainers import Stopping


def parts(section: Section) -> list[Part]:
    """A part a network; of one whose size is chosen, the choice is an input."""
    found = []
    for name, network in section.networks.items():
        of = described(section, name, network.trainer)
        if network.is_selected:
            of["inputs"]["size"] = section.data / f"sizes/{name}.json"
        found.append(Part(name, prepare, **of))
    return found


def prepare(
    *, network: Network, trainer: Stopping, readings: Path, shown: Path, size: Path | None = None
) -> Work:
    """A start is an item."""
    n_hidden = network.sizes[0] if size is None else read_layers(size)
    data = learning_data(network.learns, readings, shown)
    return fit(lesson(network, n_hidden, trainer, data), network.n_restarts)
