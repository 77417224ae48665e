"""Train one network an arm configuration on random poses of the whole workspace, in parallel.

Reads params.yaml: parallel, fanuc.workspace, its trainer under fanuc.trainers (and fanuc.joints);
data/fanuc/training_poses.parquet.
Writes data/fanuc/workspace_networks/configuration_NUMBER.json.
"""

from pathlib import Path

from flexik import stage
from flexik.datasets.fanuc.tables import (
    POSE_FIELDS,
    joints_of_rows,
    poses_checksum,
    workspace_network_checksum,
)
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.tables import read_table
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, trainer_settings
from flexik.kinematics.fanuc import N_CONFIGURATIONS
from flexik.kinematics.serial_arm import SerialArm
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.training import WorkspaceTask, train_workspace

DATA = Path("data/fanuc")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    fanuc = given.fanuc
    space = fanuc.workspace
    arm = SerialArm.from_rows([joint.model_dump() for joint in fanuc.joints])
    poses = read_table(DATA / "training_poses.parquet", POSE_FIELDS, poses_checksum(fanuc))
    trainer = fanuc.trainers[space.trainer].model_dump()
    settings = trainer_settings(trainer.pop("kind"), trainer)
    architecture = Architecture(tuple(space.n_hidden), space.activation)
    tasks = [
        WorkspaceTask(
            arm,
            number,
            joints_of_rows(poses[poses["configuration"] == number]),
            architecture,
            settings,
            space.seed,
        )
        for number in range(N_CONFIGURATIONS)
    ]
    workers = from_environment(ParallelSettings(**given.parallel.model_dump()))
    made_with = workspace_network_checksum(fanuc)
    results = parallel_map(train_workspace, tasks, workers, "train whole workspace")
    for task, (network, record) in zip(tasks, results, strict=True):
        path = DATA / "workspace_networks" / f"configuration_{task.number}.json"
        save_network(path, network, record, made_with)
        print(f"configuration {task.number}: mean squared error {record.errors[record.kept]:.3g}")


if __name__ == "__main__":
    stage.run(main)
