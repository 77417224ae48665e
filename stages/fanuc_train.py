"""Train the networks of one configuration on the taught path: position to joint angles.

Usage: fanuc_train.py NETWORK, a name under fanuc.networks.
Reads params.yaml: parallel, the section of NETWORK, its trainer under fanuc.trainers (and
fanuc.joints, fanuc.path to know which data belong to it); data/fanuc/path.parquet.
Writes data/fanuc/networks/NETWORK/joints_JOINTS.json, one network a joint or one for all six, and
their errors pass by pass, data/fanuc/curves/NETWORK.parquet.
"""

from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.datasets.fanuc.tables import (
    CURVE_FIELDS,
    joints_of_rows,
    network_checksum,
    read_path,
    write_frame,
)
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.errors import ParameterError, TrainingError
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, trainer_settings
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.networks import file_name, groups
from flexik.positioning.fanuc.training import PathTask, TaughtSamples, train_path

DATA = Path("data/fanuc")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    fanuc, name = given.fanuc, stage.argument("NETWORK")
    if name not in fanuc.networks:
        known = ", ".join(fanuc.networks)
        raise ParameterError(f"fanuc: there is no network {name!r} ({known})")
    network = fanuc.networks[name]
    training, test = read_path(DATA / "path.parquet", fanuc)
    samples = TaughtSamples(
        training[["x", "y", "z"]].to_numpy(),
        joints_of_rows(training),
        test[["x", "y", "z"]].to_numpy(),
        joints_of_rows(test),
    )
    trainer = fanuc.trainers[network.trainer].model_dump()
    settings = trainer_settings(trainer.pop("kind"), trainer)
    architecture = Architecture(network.n_hidden, network.activation)
    tasks = [
        PathTask(samples, joints, architecture, settings, network.seed, restart)
        for restart, joints in enumerate(groups(network.outputs))
    ]
    workers = from_environment(ParallelSettings(**given.parallel.model_dump()))
    made_with, curves = network_checksum(fanuc, name), []
    try:
        results = list(parallel_map(train_path, tasks, workers, f"train {name}"))
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    for task, (trained, record, curve) in zip(tasks, results, strict=True):
        save_network(DATA / "networks" / name / file_name(task.joints), trained, record, made_with)
        curves.append(curve.assign(network=name))
    frame = pd.concat(curves, ignore_index=True)
    write_frame(DATA / "curves" / f"{name}.parquet", frame, CURVE_FIELDS, made_with)


if __name__ == "__main__":
    stage.run(main)
