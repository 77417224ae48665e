"""Methods with the networks that the pipeline trained."""

from pathlib import Path

from flexik import parameters
from flexik.datasets.crane.provenance import network_checksum
from flexik.errors import ParameterError
from flexik.learning import perceptron
from flexik.learning.storage import load_network
from flexik.kinematics.crane import CraneGeometry
from flexik.positioning.crane.assembly import crane_method, uncompensated
from flexik.positioning.method import Method


def trained_method(
    crane: parameters.Crane,
    label: str,
    geometry: CraneGeometry,
    spring_stiffness: float,
    folder: Path,
) -> Method:
    """Method `label` of params.yaml (or `none`) with its network from `folder`.

    Raises ParameterError if there is no such method, DataError if its network is missing, damaged
    or made with other parameters.
    """
    if label == "none":
        return uncompensated(geometry)
    if label not in crane.methods:
        raise ParameterError(f"crane.methods: there is no {label!r} ({', '.join(crane.methods)})")
    network = trained_network(crane, crane.methods[label].network, spring_stiffness, folder)
    return crane_method(crane.methods[label], geometry, network)


def trained_network(
    crane: parameters.Crane, name: str, spring_stiffness: float, folder: Path
) -> perceptron.Network:
    """Network `name` from `folder`; raises DataError as `trained_method` does."""
    made_with = network_checksum(crane, spring_stiffness, name)
    return load_network(folder / f"{name}.json", made_with)[0]
