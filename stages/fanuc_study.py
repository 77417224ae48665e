"""Train the network of one joint in several sizes and with several learning factors.

Reads params.yaml: parallel, fanuc.study, fanuc.networks, fanuc.trainers (and fanuc.joints,
fanuc.path to know which data belong to it); data/fanuc/path.parquet.
Writes data/fanuc/study.parquet. The learning factor stays what it is: it is the least the trainer
may come down to as well.
"""

from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.datasets.fanuc.tables import (
    STUDY_FIELDS,
    read_path,
    study_checksum,
    write_frame,
)
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.learning.training import Architecture, trainer_settings
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.training import PathTask, TaughtSamples, study_row

DATA = Path("data/fanuc")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    fanuc = given.fanuc
    study, network = fanuc.study, fanuc.networks[fanuc.study.network]
    training, test = read_path(DATA / "path.parquet", fanuc)
    samples = TaughtSamples.of_tables(training, test)
    trainer = fanuc.trainers[study.trainer].model_dump()
    kind, factor = trainer.pop("kind"), trainer["learning_rate"]
    cases = [("n_hidden", float(n), n, factor) for n in study.n_hidden]
    cases += [("learning_factor", each, network.n_hidden, each) for each in study.learning_factors]
    # the size and the factor of the others stand in both series and are trained once
    tasks = {}
    for n_hidden, rate in dict.fromkeys(case[2:] for case in cases):
        settings = trainer_settings(kind, trainer | {"learning_rate": rate, "minimum_rate": rate})
        architecture = Architecture(n_hidden, network.activation)
        for restart in range(study.n_restarts):
            task = PathTask(samples, (study.joint,), architecture, settings, network.seed, restart)
            tasks[n_hidden, rate, restart] = task
    workers = from_environment(ParallelSettings(**given.parallel.model_dump()))
    results = parallel_map(study_row, list(tasks.values()), workers, "study")
    found = dict(zip(tasks, results, strict=True))
    rows = [
        {"varied": varied, "value": value, "restart": k} | found[n_hidden, rate, k]
        for varied, value, n_hidden, rate in cases
        for k in range(study.n_restarts)
    ]
    frame = pd.DataFrame(rows)
    write_frame(DATA / "study.parquet", frame, STUDY_FIELDS, study_checksum(fanuc))


if __name__ == "__main__":
    stage.run(main)
