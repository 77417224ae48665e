"""Train the networks of one configuration on the taught path: position to joint angles.

Usage: fanuc_train.py NETWORK, a name under fanuc.networks.
Reads params.yaml: parallel, the section of NETWORK, its trainer under fanuc.trainers (and
fanuc.joints, fanuc.path to know which data belong to it); data/fanuc/path.parquet.
Writes the errors of all starts, data/fanuc/starts/NETWORK.parquet, and pass by pass,
data/fanuc/curves/NETWORK.parquet; the networks of the median start,
data/fanuc/networks/NETWORK/joints_JOINTS.json, one a joint or one for all six.
"""

from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.datasets.fanuc.tables import (
    CURVE_FIELDS,
    START_FIELDS,
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
from flexik.positioning.fanuc.training import TaughtSamples, path_tasks, start_rows, train_path

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
    samples = TaughtSamples.of_tables(training, test)
    trainer = fanuc.trainers[network.trainer].model_dump()
    settings = trainer_settings(trainer.pop("kind"), trainer)
    architecture = Architecture(network.n_hidden, network.activation)
    each = groups(network.outputs)
    tasks = path_tasks(samples, each, architecture, settings, network.seed, network.n_restarts)
    workers = from_environment(ParallelSettings(**given.parallel.model_dump()))
    made_with, curves = network_checksum(fanuc, name), []
    try:
        results = list(parallel_map(train_path, tasks, workers, f"train {name}"))
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    starts = start_rows(tasks, results).assign(network=name)
    (median,) = starts.loc[starts["is_median"] == 1, "restart"].unique()
    for task, (trained, record, curve) in zip(tasks, results, strict=True):
        start = task.restart // len(each)
        if start == median:
            path = DATA / "networks" / name / file_name(task.joints)
            save_network(path, trained, record, made_with)
        curves.append(curve.assign(network=name, restart=start))
    write_frame(DATA / "starts" / f"{name}.parquet", starts, START_FIELDS, made_with)
    frame = pd.concat(curves, ignore_index=True)
    write_frame(DATA / "curves" / f"{name}.parquet", frame, CURVE_FIELDS, made_with)


if __name__ == "__main__":
    stage.run(main)
