"""The six-joint arm, and the columns of its tables."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from flexik.cases.fanuc.section import Joint
from flexik.datasets.tables import Field
from flexik.kinematics.pose_representation import INPUTS
from flexik.kinematics.serial_arm import Array, SerialArm

JOINT_FIELDS = tuple(Field(f"joint_{k}", "rad", "joint angle") for k in range(1, 7))
COMMANDED_FIELDS = tuple(
    Field(f"commanded_{k}", "rad", "joint angle the method commands") for k in range(1, 7)
)
# What methods are asked, see kinematics.pose_representation.queries
QUERY_FIELDS = (
    *(Field(name, unit, "end effector, base frame") for name, unit in INPUTS),
    Field("asked_configuration", "1", "number of the arm configuration, 0 to 7"),
)
POSITION_FIELDS = QUERY_FIELDS[:3]
CONFIGURATION = Field("configuration", "1", "number of the arm configuration, 0 to 7", "int64")
PATH_FIELDS = (
    Field("share", "1", "share of the path's duration"),
    Field("is_test", "1", "1: test sample, 0: training sample", "int64"),
    *JOINT_FIELDS,
    *POSITION_FIELDS,
)
POSE_FIELDS = (CONFIGURATION, *JOINT_FIELDS)
OFF_PATH_FIELDS = (Field("distance", "m", "of the target from the path"), *QUERY_FIELDS)
RANDOM_FIELDS = (
    *POSE_FIELDS,
    *QUERY_FIELDS,
    Field(
        "singular_value",
        "m",
        "smallest of the Jacobian, orientation rows times the orientation length; 0: singular pose",
    ),
    Field("singular", "1", "1 if the closed form flags the pose as singular", "int64"),
)

STEPS = Field("n_steps", "1", "damped Newton steps after the method", "int64")
ERROR_FIELDS = (
    Field("error", "m", "distance of the end effector from its target"),
    Field("orientation_error", "rad", "angle of the end effector to its target"),
    Field("in_configuration", "1", "1 if in the arm configuration asked for", "int64"),
)
RESTART = Field("restart", "1", "number of the start, from 0", "int64")
CURVE_FIELDS = (
    RESTART,
    Field("joint", "1", "number of the joint", "int64"),
    Field("iteration", "1", "passes over the data, 0: before training", "int64"),
    Field("training_error", "1", "root mean square error over the joint's range on the path"),
    Field("test_error", "1", "the same on the test samples"),
)
START_FIELDS = (
    RESTART,
    Field("joint", "1", "number of the joint", "int64"),
    Field("error_percent", "1", "mean error on the test samples over the joint's range, percent"),
    Field("kept", "1", "pass with the least training error, whose weights are kept", "int64"),
    Field("is_median", "1", "1: of the start whose mean error is the median one", "int64"),
)
STUDY_FIELDS = (
    Field("value", "1", "of what is varied"),
    RESTART,
    Field("training_percent", "1", "mean error over the joint's range on the path, percent"),
    Field("error_percent", "1", "the same on the test samples"),
    Field("kept", "1", "pass with the least training error, whose weights are kept", "int64"),
    Field("stop_reason", "1", "why the training ended", "string"),
)


def arm_of(joints: Sequence[Joint]) -> SerialArm:
    """The arm of the machine file."""
    columns = ((name, tuple(getattr(j, name) for j in joints)) for name in Joint.model_fields)
    return SerialArm(**dict(columns))


def named(fields: Sequence[Field], values: Array) -> dict[str, Array]:
    """Columns by name of `values` (n, k)."""
    columns = np.ascontiguousarray(np.transpose(values))
    return {field.name: column for field, column in zip(fields, columns, strict=True)}


def array(frame: pd.DataFrame, fields: Sequence[Field]) -> Array:
    """Columns `fields` of `frame` (n, k)."""
    return frame[[field.name for field in fields]].to_numpy()
