"""Networks of the six-joint arm on disk."""

from pathlib import Path

from flexik import parameters
from flexik.datasets.fanuc.tables import network_checksum, workspace_network_checksum
from flexik.learning.perceptron import Network
from flexik.learning.storage import load_network
from flexik.kinematics.fanuc import N_CONFIGURATIONS

ALL_JOINTS = tuple(range(1, 7))


def groups(outputs: str) -> list[tuple[int, ...]]:
    """Joints (numbers from 1) of every network: one each, or all six of one."""
    return [ALL_JOINTS] if outputs == "all_joints" else [(joint,) for joint in ALL_JOINTS]


def file_name(joints: tuple[int, ...]) -> str:
    """File of the network that gives `joints`."""
    return f"joints_{''.join(map(str, joints))}.json"


def load_path_networks(
    folder: Path, fanuc: parameters.Fanuc, name: str
) -> dict[tuple[int, ...], Network]:
    """Path networks `name` by the joints each gives; raises DataError as load_network does."""
    made_with = network_checksum(fanuc, name)
    return {
        joints: load_network(folder / name / file_name(joints), made_with)[0]
        for joints in groups(fanuc.networks[name].outputs)
    }


def load_workspace_networks(folder: Path, fanuc: parameters.Fanuc) -> dict[int, Network]:
    """Networks of the whole workspace by the number of the arm configuration."""
    made_with = workspace_network_checksum(fanuc)
    return {
        number: load_network(folder / f"configuration_{number}.json", made_with)[0]
        for number in range(N_CONFIGURATIONS)
    }
