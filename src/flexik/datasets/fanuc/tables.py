"""Tables of the six-joint arm, and which parameters made them."""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.tables import Field, read_table, write_table
from flexik.files import checksum
from flexik.kinematics.serial_arm import Array
from flexik.parameters import parameters_checksum

JOINTS = tuple(f"joint_{k}" for k in range(1, 7))
_JOINT_FIELDS = tuple(Field(name, "rad", "joint angle") for name in JOINTS)
_COMMANDED = tuple(
    Field(f"commanded_{k}", "rad", "joint angle the method commands") for k in range(1, 7)
)
COMMANDED = tuple(field.name for field in _COMMANDED)
_POSITION = tuple(Field(name, "m", "end effector, base frame") for name in ("x", "y", "z"))
_ERRORS = (
    Field("position_error", "m", "distance of the end effector from its target"),
    Field("orientation_error", "rad", "angle of the end effector to its target"),
    Field("within_limits", "1", "1 if all commanded joints lie in their limits", "int64"),
    Field("in_configuration", "1", "1 if they are in the arm configuration asked for", "int64"),
)
_NUMBER = Field("configuration", "1", "number of the arm configuration, 0 to 7", "int64")
_METHOD = Field("method", "1", "name of the method", "string")
_STEPS = Field("n_steps", "1", "damped Newton steps after the method", "int64")

PATH_FIELDS = (
    Field("share", "1", "share of the path's duration"),
    Field("is_test", "1", "1: test sample, 0: training sample", "int64"),
    *_JOINT_FIELDS,
    *_POSITION,
)
POSE_FIELDS = (_NUMBER, *_JOINT_FIELDS)
_RESTART = Field("restart", "1", "number of the start, from 0", "int64")
CURVE_FIELDS = (
    Field("network", "1", "name of the networks", "string"),
    _RESTART,
    Field("joint", "1", "number of the joint", "int64"),
    Field("iteration", "1", "passes over the data, 0: before training", "int64"),
    Field("training_error", "1", "root mean square error over the joint's range on the path"),
    Field("test_error", "1", "the same on the test samples"),
)
START_FIELDS = (
    Field("network", "1", "name of the networks", "string"),
    _RESTART,
    Field("joint", "1", "number of the joint", "int64"),
    Field("error_percent", "1", "mean error on the test samples over the joint's range, percent"),
    Field("kept", "1", "pass with the least training error, whose weights are kept", "int64"),
    Field("is_median", "1", "1: of the start whose mean error is the median one", "int64"),
)
STUDY_FIELDS = (
    Field("varied", "1", "n_hidden or learning_factor", "string"),
    Field("value", "1", "its value"),
    _RESTART,
    Field("training_percent", "1", "mean error over the joint's range on the path, percent"),
    Field("error_percent", "1", "the same on the test samples"),
    Field("kept", "1", "pass with the least training error, whose weights are kept", "int64"),
    Field("stop_reason", "1", "why the training ended", "string"),
)
PATH_ERROR_FIELDS = (
    _METHOD,
    Field("share", "1", "share of the path's duration"),
    *_JOINT_FIELDS,
    *_COMMANDED,
    *_ERRORS,
)
OFF_PATH_FIELDS = (
    _METHOD,
    Field("distance", "m", "distance of the target from the path"),
    _STEPS,
    *_ERRORS,
)
WORKSPACE_FIELDS = (
    _METHOD,
    _NUMBER,
    _STEPS,
    Field(
        "singular_value",
        "m",
        "smallest of the Jacobian, orientation rows times the orientation length; 0: singular pose",
    ),
    Field("singular", "1", "1 if the closed form flags the pose as singular", "int64"),
    *_ERRORS,
)


def path_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of everything that determines the taught path."""
    return parameters_checksum([*fanuc.joints, fanuc.path])


def poses_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of everything that determines the random poses."""
    space = fanuc.workspace
    return checksum(
        parameters_checksum([*fanuc.joints]), repr((space.n_training, space.n_targets, space.seed))
    )


def network_checksum(fanuc: parameters.Fanuc, name: str) -> str:
    """Checksum of everything that determines the path networks `name`."""
    network = fanuc.networks[name]
    made_with = parameters_checksum([network, fanuc.trainers[network.trainer]])
    return checksum(path_checksum(fanuc), made_with)


def study_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of everything that determines the study of sizes and learning factors."""
    study = fanuc.study
    sections = [study, fanuc.networks[study.network], fanuc.trainers[study.trainer]]
    return checksum(path_checksum(fanuc), parameters_checksum(sections))


def workspace_network_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of everything that determines the networks of the whole workspace."""
    space = fanuc.workspace
    made_with = parameters_checksum([space, fanuc.trainers[space.trainer]])
    return checksum(poses_checksum(fanuc), made_with)


def evaluation_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of everything that determines the errors of the methods."""
    return checksum(
        *(network_checksum(fanuc, name) for name in fanuc.networks),
        workspace_network_checksum(fanuc),
        parameters_checksum([fanuc.refinement, fanuc.off_path]),
    )


def joints_of_rows(table: pd.DataFrame) -> Array:
    """Joints (n, 6) in rad of a table."""
    return table[list(JOINTS)].to_numpy()


def joint_columns(joints: Array, names: tuple[str, ...] = JOINTS) -> dict[str, Array]:
    """Columns by name of joints (n, 6) in rad."""
    return {name: np.ascontiguousarray(joints[:, k]) for k, name in enumerate(names)}


def write_frame(
    path: Path | str, frame: pd.DataFrame, fields: tuple[Field, ...], parameters_checksum: str
) -> None:
    """Write `frame`, whose columns are `fields` in any order, as `write_table` does."""
    columns = {field.name: frame[field.name].to_numpy() for field in fields}
    write_table(path, columns, fields, parameters_checksum)


def read_path(path: Path | str, fanuc: parameters.Fanuc) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Training and test samples of the taught path; raises DataError as read_table does."""
    table = read_table(path, PATH_FIELDS, path_checksum(fanuc))
    is_test = table["is_test"].to_numpy() == 1
    return table[~is_test], table[is_test]


def query_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of what the time of a query depends on: arm, networks' sizes, Newton steps."""
    space = fanuc.workspace
    sizes = [
        (name, network.outputs, network.n_hidden, network.activation)
        for name, network in fanuc.networks.items()
    ]
    sections = [*fanuc.joints, fanuc.refinement]
    shapes = (sizes, fanuc.path.n_training, space.n_hidden, space.activation)
    return checksum(parameters_checksum(sections), repr(shapes))


def growth_checksum(fanuc: parameters.Fanuc) -> str:
    """Checksum of what networks of other sizes and passes share with those of the workspace."""
    space = fanuc.workspace
    trainer = fanuc.trainers[space.trainer].model_copy(update={"n_iterations": 1})
    sections = [trainer, fanuc.refinement, fanuc.success]
    made_with = parameters_checksum(sections)
    return checksum(poses_checksum(fanuc), made_with, repr((space.activation, space.seed)))
