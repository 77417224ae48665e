"""Trained networks of the arm: those of all starts."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.section import Network, Section
from flexik.datasets.tables import Field
from flexik.learning import perceptron
from flexik.learning.storage import load_network, load_restarts

NETWORK = Field("network", "1", "name of the network", "string")
RESTART = (
    Field("restart", "1", "number of the start, from 0", "int64"),
    Field("chosen", "1", "1: of the least selection error, else 0", "int64"),
)


@dataclass(frozen=True, eq=False)
class Trained:
    """Network `name` from one of its starts; `is_chosen`: the one of least selection error."""

    name: str
    settings: Network
    restart: int
    is_chosen: bool
    network: perceptron.Network

    @property
    def row(self) -> dict[str, NDArray]:
        """Columns (1,) of NETWORK and RESTART."""
        return {
            "network": np.array([self.name]),
            "restart": np.array([self.restart]),
            "chosen": np.array([int(self.is_chosen)]),
        }


def files_of(section: Section, name: str) -> dict[str, Path]:
    """Files of network `name`, as inputs of a part."""
    networks = section.data / "networks"
    return {"chosen": networks / f"{name}.json", "all": networks / f"{name}.restarts.json"}


def restarts(name: str, settings: Network, files: Mapping[str, Path]) -> list[Trained]:
    """Networks of all starts of network `name` that gave one."""
    chosen = load_network(files["chosen"])[1].restart
    return [
        Trained(name, settings, restart, restart == chosen, network)
        for restart, network in load_restarts(files["all"]).items()
    ]
