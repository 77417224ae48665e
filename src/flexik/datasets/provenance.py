"""Which parameters made which data: checksums that a file carries and its reader expects."""

from flexik import parameters
from flexik.errors import ParameterError
from flexik.files import checksum
from flexik.parameters import parameters_checksum


def grid_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the training grid."""
    return checksum(
        parameters_checksum([crane.geometry, crane.structure, crane.grid]), repr(spring_stiffness)
    )


def selection_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the selection set."""
    return checksum(grid_checksum(crane, spring_stiffness), parameters_checksum([crane.selection]))


def network_checksum(crane: parameters.Crane, spring_stiffness: float, name: str) -> str:
    """Checksum of everything that determines network `name`."""
    network = crane.any_network(name)
    if network is None:
        raise ParameterError(f"crane.networks: there is no {name!r}")
    return checksum(selection_checksum(crane, spring_stiffness), parameters_checksum([network]))


def evaluation_checksum(crane: parameters.Crane, spring_stiffness: float, label: str) -> str:
    """Checksum of everything that determines the errors of method `label`."""
    parts = [
        parameters_checksum([crane.geometry, crane.structure, crane.evaluation]),
        repr(spring_stiffness),
    ]
    if label != "none":
        method = crane.methods[label]
        parts += [
            parameters_checksum([method]),
            network_checksum(crane, spring_stiffness, method.network),
        ]
    return checksum(*parts)
