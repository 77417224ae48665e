"""Checksums of the parameters behind each table of the elastic arm."""

from flexik import parameters
from flexik.files import checksum
from flexik.parameters import parameters_checksum


def model_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of the flexible model and where its gauges sit."""
    stations = (arm.gauges.deflection_stations, arm.gauges.strain_stations)
    return checksum(parameters_checksum([arm.geometry, arm.structure]), repr(stations))


def readings_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of everything that determines the readings and what gauges show of them."""
    return checksum(model_checksum(arm), parameters_checksum([arm.gauges, arm.readings]))


def network_checksum(arm: parameters.ElasticArm, name: str) -> str:
    """Checksum of everything that determines network `name`."""
    network = arm.all_networks[name]
    sections: list[parameters.Section] = [network, arm.trainers[network.trainer]]
    if isinstance(network, parameters.SelectedArmNetwork):
        sections.append(arm.trainers[network.select.trainer])
    return checksum(readings_checksum(arm), parameters_checksum(sections))


def fit_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of everything that determines the fit of the networks given gauges."""
    return checksum(*(network_checksum(arm, name) for name in arm.gauge_networks))


def splits_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of everything that determines the fit by other divisions of the readings."""
    own = network_checksum(arm, arm.splits.network)
    return checksum(own, parameters_checksum([arm.splits]))


def targets_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of everything that determines the random targets."""
    return checksum(model_checksum(arm), parameters_checksum([arm.readings, arm.workspace]))


def evaluation_checksum(arm: parameters.ElasticArm, label: str) -> str:
    """Checksum of everything that determines the errors of method `label`."""
    parts = [targets_checksum(arm)]
    if label != "none":
        method = arm.methods[label]
        parts += [parameters_checksum([method]), network_checksum(arm, method.network)]
    return checksum(*parts)


def payload_error_checksum(arm: parameters.ElasticArm) -> str:
    """Checksum of everything that determines the errors where the payload is told wrongly."""
    return checksum(*(evaluation_checksum(arm, label) for label in arm.methods))
