"""Which parameters of the SmartEE made which data."""

from flexik import parameters
from flexik.errors import ParameterError
from flexik.files import checksum
from flexik.parameters import parameters_checksum


def poses_checksum(smartee: parameters.SmartEE, name: str) -> str:
    """Checksum of everything that determines the poses `name`."""
    return parameters_checksum([smartee.geometry, smartee.workspace, smartee.poses[name]])


def network_checksum(smartee: parameters.SmartEE, name: str) -> str:
    """Checksum of everything that determines network `name`."""
    if name not in smartee.networks:
        known = ", ".join(smartee.networks)
        raise ParameterError(f"smartee: there is no network {name!r} ({known})")
    network = smartee.networks[name]
    return checksum(
        poses_checksum(smartee, network.poses),
        poses_checksum(smartee, "selection"),
        parameters_checksum([network, smartee.trainers[network.trainer]]),
    )


def starts_checksum(smartee: parameters.SmartEE) -> str:
    """Checksum of everything that determines the study of initial weights."""
    starts = smartee.starts
    return checksum(
        poses_checksum(smartee, starts.poses),
        poses_checksum(smartee, "validation"),
        parameters_checksum(
            [
                starts,
                *(smartee.trainers[name] for name in starts.trainers),
                smartee.trainers[starts.sensitivity.trainer],
            ]
        ),
    )


def sizes_checksum(smartee: parameters.SmartEE, poses: str) -> str:
    """Checksum of everything that determines the study of sizes on the rows of `poses`."""
    sizes = smartee.sizes
    return checksum(
        poses_checksum(smartee, poses),
        poses_checksum(smartee, "selection"),
        parameters_checksum([sizes, smartee.trainers[sizes.trainer]]),
    )


def evaluation_checksum(smartee: parameters.SmartEE) -> str:
    """Checksum of everything that determines the errors of the direct kinematics."""
    return checksum(
        *(network_checksum(smartee, name) for name in smartee.networks),
        *(poses_checksum(smartee, name) for name in ("validation", "random")),
        parameters_checksum([smartee.newton, smartee.path, smartee.outside]),
    )


def query_checksum(smartee: parameters.SmartEE) -> str:
    """Checksum of what the time of a query depends on."""
    return parameters_checksum([smartee.geometry, smartee.newton, *smartee.networks.values()])


def training_time_checksum(smartee: parameters.SmartEE, trainer: str) -> str:
    """Checksum of what the time of a run of the study of initial weights depends on."""
    starts = smartee.starts
    data = smartee.poses[starts.poses]
    return checksum(parameters_checksum([smartee.trainers[trainer], data]), repr(starts.n_hidden))
