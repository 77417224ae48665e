"""Which parameters made which data: checksums that a file carries and its reader expects."""

from collections.abc import Sequence

from flexik import parameters
from flexik.errors import ParameterError
from flexik.files import checksum, file_checksum
from flexik.parameters import parameters_checksum


def calibration_checksum(crane: parameters.Crane) -> str:
    """Checksum of what the ground spring is fitted with: the model and the test conditions."""
    return checksum(
        parameters_checksum([crane.geometry, crane.structure, crane.evaluation, crane.calibration]),
        *_section_checksums(crane),
    )


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
    networks = crane.all_networks
    if name not in networks:
        raise ParameterError(f"crane: there is no network {name!r} ({', '.join(networks)})")
    network = networks[name]
    sections: list[parameters.Section] = [network, crane.trainers[network.trainer]]
    if name in crane.studies:
        sections.append(crane.trainers[crane.studies[name].select.trainer])
    parts = [
        grid_checksum(crane, spring_stiffness),
        selection_checksum(crane, spring_stiffness),
        parameters_checksum(sections),
    ]
    if isinstance(network, parameters.ModularNetwork | parameters.SelectedModularNetwork):
        parts.append(network_checksum(crane, spring_stiffness, network.rigid))
    return checksum(*parts)


def query_checksum(crane: parameters.Crane, label: str) -> str:
    """Checksum of the settings that the time of a query of method `label` depends on."""
    if label == "none":
        return parameters_checksum([crane.geometry])
    method = crane.methods[label]
    sections: list[parameters.Section] = [
        crane.geometry,
        method,
        crane.all_networks[method.network],
    ]
    return parameters_checksum(sections)


def fitting_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the networks on a thinned grid."""
    sections: list[parameters.Section] = [crane.fitting, crane.trainers[crane.fitting.trainer]]
    return checksum(grid_checksum(crane, spring_stiffness), parameters_checksum(sections))


def evaluation_checksum(crane: parameters.Crane, spring_stiffness: float, label: str) -> str:
    """Checksum of everything that determines the errors of method `label`."""
    sections: list[parameters.Section] = [crane.evaluation]
    return checksum(*_method_parts(crane, spring_stiffness, label, sections))


def targets_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the random targets of the workspace."""
    return checksum(
        _model_checksum(crane, spring_stiffness),
        parameters_checksum([crane.workspace]),
        repr(crane.grid.minimum_tip_x),
    )


def workspace_checksum(crane: parameters.Crane, spring_stiffness: float, label: str) -> str:
    """Checksum of everything that determines the errors of method `label` over the workspace."""
    sections: list[parameters.Section] = []
    targets = targets_checksum(crane, spring_stiffness)
    return checksum(targets, *_method_parts(crane, spring_stiffness, label, sections))


def tolerance_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the tolerance study."""
    sections: list[parameters.Section] = [crane.evaluation, crane.tolerance_study]
    parts = [parameters_checksum(sections)]
    for label in crane.tolerance_study.methods:
        parts += _method_parts(crane, spring_stiffness, label, [])
    return checksum(*parts)


def campaign_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines the measured campaign."""
    measured = crane.measured
    if measured.source == "file":
        return checksum(file_checksum(measured.file))
    parts = _method_parts(crane, spring_stiffness, measured.method, [measured.deviations])
    given = (measured.points, measured.payloads, measured.noise, measured.seed)
    return checksum(*parts, repr(given))


def budget_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines what each deviation does."""
    measured = crane.measured
    sections = [measured.deviations, measured.budget]
    parts = _method_parts(crane, spring_stiffness, measured.method, sections)
    given = (measured.points, measured.payloads, measured.noise, measured.seed)
    return checksum(*parts, repr(given))


def identification_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines what is identified from the campaign."""
    adaptation = crane.measured.adaptation
    parts = _method_parts(crane, spring_stiffness, adaptation.method, [adaptation.expected])
    campaign = campaign_checksum(crane, spring_stiffness)
    return checksum(campaign, *parts, repr(adaptation.n_corrections))


def adaptation_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of everything that determines what few measurements give on many cranes."""
    measured = crane.measured
    sections = [measured.deviations, measured.adaptation]
    parts = _method_parts(crane, spring_stiffness, measured.adaptation.method, sections)
    parts += _method_parts(crane, spring_stiffness, measured.method, [])
    return checksum(*parts, repr(measured.noise))


def _method_parts(
    crane: parameters.Crane,
    spring_stiffness: float,
    label: str,
    sections: Sequence[parameters.Section],
) -> list[str]:
    """Parts of a checksum: the flexible model, `sections`, and method `label`."""
    parts = [_model_checksum(crane, spring_stiffness), parameters_checksum(sections)]
    if label != "none":
        method = crane.methods[label]
        parts += [
            parameters_checksum([method]),
            network_checksum(crane, spring_stiffness, method.network),
        ]
    return parts


def _model_checksum(crane: parameters.Crane, spring_stiffness: float) -> str:
    """Checksum of the flexible model, section tables included."""
    return checksum(
        parameters_checksum([crane.geometry, crane.structure]),
        repr(spring_stiffness),
        *_section_checksums(crane),
    )


def _section_checksums(crane: parameters.Crane) -> list[str]:
    beams = crane.structure.beams
    return [file_checksum(getattr(beams, name).section) for name in type(beams).model_fields]
