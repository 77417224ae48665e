"""Sample the taught path of the six-joint arm, and random poses of every arm configuration.

Reads params.yaml: fanuc.joints, fanuc.path, fanuc.workspace (how many poses, seed).
Writes data/fanuc/path.parquet, training_poses.parquet and target_poses.parquet.
"""

from pathlib import Path

import numpy as np

from flexik import stage
from flexik.datasets.fanuc.samples import all_configurations, taught_path
from flexik.datasets.fanuc.tables import (
    PATH_FIELDS,
    POSE_FIELDS,
    joint_columns,
    path_checksum,
    poses_checksum,
)
from flexik.datasets.tables import write_table
from flexik.kinematics.serial_arm import SerialArm, forward
from flexik.parameters import load_parameters

DATA = Path("data/fanuc")


def main() -> None:
    """Run the stage."""
    fanuc = load_parameters().fanuc
    arm = SerialArm.from_rows([joint.model_dump() for joint in fanuc.joints])
    path = taught_path(arm, fanuc.path)
    position = forward(arm, path.joints).position
    columns = {
        "share": path.share,
        "is_test": path.is_test.astype(np.int64),
        **joint_columns(path.joints),
        **{name: np.ascontiguousarray(position[:, k]) for k, name in enumerate("xyz")},
    }
    write_table(DATA / "path.parquet", columns, PATH_FIELDS, path_checksum(fanuc))
    space = fanuc.workspace
    sets = {"training_poses": space.n_training, "target_poses": space.n_targets}
    for role, (name, n) in enumerate(sets.items()):
        numbers, joints = all_configurations(arm, n, space.seed, role)
        columns = {"configuration": numbers, **joint_columns(joints)}
        write_table(DATA / f"{name}.parquet", columns, POSE_FIELDS, poses_checksum(fanuc))


if __name__ == "__main__":
    stage.run(main)
