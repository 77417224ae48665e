"""The part of every network: a perceptron, or what stands in place of one."""

from flexik.datasets.parts import Part
from flexik.parameters.networks import Regressor, TorchModule
from flexik.planar import train, train_module, train_regressor
from flexik.planar.section import PlanarSection


def parts(section: PlanarSection) -> list[Part]:
    """A part a network."""
    return [part(section, name) for name in section.networks]


def part(section: PlanarSection, name: str) -> Part:
    """The part of network `name`."""
    network = section.networks[name]
    if isinstance(network, Regressor):
        return train_regressor.part(section, name)
    if isinstance(network, TorchModule):
        return train_module.part(section, name)
    return train.part(section, name, name, section.data / "networks")
