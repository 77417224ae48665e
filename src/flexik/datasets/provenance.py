"""Which parameters made which data: checksums that a file carries and its reader expects."""

from flexik import parameters
from flexik.errors import ParameterError
from flexik.files import checksum, file_checksum
from flexik.parameters import parameters_checksum


def grid_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the training grid."""
    return checksum(_model_checksum(crane, spring_stiffness), parameters_checksum([crane.grid]))


def selection_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the selection set."""
    return checksum(
        _model_checksum(crane, spring_stiffness),
        parameters_checksum([crane.selection]),
        repr(crane.grid.minimum_tip_x),
    )


def network_checksum(crane: parameters.Crane, spring_stiffness: float, name: str) -> str:
    """Checksum of everything that determines network `name`."""
    network = crane.any_network(name)
    if network is None:
        raise ParameterError(f"crane.networks: there is no {name!r}")
    return checksum(
        grid_checksum(crane, spring_stiffness),
        selection_checksum(crane, spring_stiffness),
        parameters_checksum([network]),
    )


def evaluation_checksum(crane: parameters.Crane, spring_stiffness: float, label: str) -> str:
    """Checksum of everything that determines the errors of method `label`."""
    parts = [
        _model_checksum(crane, spring_stiffness),
        parameters_checksum([crane.evaluation]),
    ]
    if label != "none":
        method = crane.methods[label]
        parts += [
            parameters_checksum([method]),
            network_checksum(crane, spring_stiffness, method.network),
        ]
    return checksum(*parts)


def _model_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of the flexible model, section tables included."""
    beams = crane.structure.beams
    tables = [getattr(beams, name).section for name in type(beams).model_fields]
    return checksum(
        parameters_checksum([crane.geometry, crane.structure]),
        repr(spring_stiffness),
        *(file_checksum(table) for table in tables),
    )
