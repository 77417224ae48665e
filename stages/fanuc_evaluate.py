"""Command the joints that every method gives, and see where the end effector comes to stand.

Reads params.yaml: fanuc.joints, fanuc.path, fanuc.networks, fanuc.trainers, fanuc.workspace,
fanuc.refinement, fanuc.off_path; the networks, the path and the target poses in data/fanuc.
Writes data/fanuc/path_errors.parquet, off_path_errors.parquet and workspace_errors.parquet.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import stage
from flexik.datasets.fanuc.tables import (
    OFF_PATH_FIELDS,
    PATH_ERROR_FIELDS,
    POSE_FIELDS,
    WORKSPACE_FIELDS,
    evaluation_checksum,
    joints_of_rows,
    poses_checksum,
    read_path,
    write_frame,
)
from flexik.datasets.tables import read_table
from flexik.evaluation.fanuc.judging import errors_beside_path, errors_on_path, errors_on_targets
from flexik.kinematics.serial_arm import SerialArm
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.methods import (
    closed_form,
    interpolated,
    nearest_sample,
    path_networks,
    workspace_networks,
)
from flexik.positioning.fanuc.networks import load_path_networks, load_workspace_networks

DATA = Path("data/fanuc")


def main() -> None:
    """Run the stage."""
    fanuc = load_parameters().fanuc
    arm = SerialArm.from_rows([joint.model_dump() for joint in fanuc.joints])
    refinement = fanuc.refinement.model_dump()
    of_path = {
        name: path_networks(load_path_networks(DATA / "networks", fanuc, name))
        for name in fanuc.networks
    }
    known = load_workspace_networks(DATA / "workspace_networks", fanuc)
    whole = {"whole_workspace": workspace_networks(arm, known)}
    exact = {"closed_form": closed_form(arm)}
    training, test = read_path(DATA / "path.parquet", fanuc)
    taught = training[["x", "y", "z"]].to_numpy(), joints_of_rows(training)
    of_path |= {"nearest_sample": nearest_sample(*taught), "interpolated": interpolated(*taught)}
    joints, made_with = joints_of_rows(test), evaluation_checksum(fanuc)
    on_path = errors_on_path(arm, of_path | whole | exact, test["share"].to_numpy(), joints)
    write_frame(DATA / "path_errors.parquet", on_path, PATH_ERROR_FIELDS, made_with)
    path = pd.concat([training, test]).sort_values("share")
    beside = errors_beside_path(
        arm,
        of_path | whole,
        exact,
        joints_of_rows(path),
        np.flatnonzero(path["is_test"]),
        fanuc.off_path.distances,
        fanuc.off_path.seed,
        refinement,
    )
    write_frame(DATA / "off_path_errors.parquet", beside, OFF_PATH_FIELDS, made_with)
    poses = read_table(DATA / "target_poses.parquet", POSE_FIELDS, poses_checksum(fanuc))
    targets = errors_on_targets(
        arm, whole, exact, poses["configuration"].to_numpy(), joints_of_rows(poses), refinement
    )
    write_frame(DATA / "workspace_errors.parquet", targets, WORKSPACE_FIELDS, made_with)


if __name__ == "__main__":
    stage.run(main)
