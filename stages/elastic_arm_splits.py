"""Divide the readings in other ways and train one network again by each.

One division decides little: which readings on the border of the range are held out moves R. The
main division, elastic_arm.readings.seed, stays the one of the other stages.
Reads params.yaml: parallel, elastic_arm.splits, elastic_arm.networks and elastic_arm.trainers (and
elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges, elastic_arm.readings to know which
data belong to it); the tables of elastic_arm_generate.
Writes data/elastic_arm/splits.parquet, R on the held-out readings of every division.
"""

import functools
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.elastic_arm.learning import KINDS, SPLIT_FIELDS, divided, read_all
from flexik.datasets.elastic_arm.provenance import splits_checksum
from flexik.datasets.elastic_arm.readings import columns_of, divide
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.tables import write_table
from flexik.errors import TrainingError
from flexik.evaluation.regression import correlation
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, train_best, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    arm, seeds = given.elastic_arm, given.elastic_arm.splits.seeds
    inputs, outputs, _ = read_all(DATA, arm, arm.splits.network)
    workers = from_environment(ParallelSettings(**given.parallel.model_dump()))
    function = functools.partial(fit, arm, inputs, outputs)
    r = np.array(list(parallel_map(function, seeds, workers, "elastic_arm splits")))
    write_table(
        DATA / "splits.parquet",
        columns_of([np.array(seeds), r], SPLIT_FIELDS),
        SPLIT_FIELDS,
        splits_checksum(arm),
    )
    for seed, (r_1, r_2) in zip(seeds, r, strict=True):
        print(f"{arm.splits.network}, division {seed}: held-out R {r_1:.6f} and {r_2:.6f}")


def fit(
    arm: parameters.ElasticArm, inputs: np.ndarray, outputs: np.ndarray, seed: int
) -> np.ndarray:
    """R (2,) on the held-out readings of the division by `seed`, trained as in the main one."""
    network, readings = arm.networks[arm.splits.network], arm.readings
    part = divide(len(inputs), readings.selection_share, readings.held_out_share, seed)
    data, (held_out, angles) = divided(inputs, outputs, part)
    kind, trainer = KINDS[network.kind], arm.trainers[network.trainer].model_dump()
    try:
        best, _, _ = train_best(
            data.inputs,
            data.outputs,
            data.selection_inputs,
            data.selection_outputs,
            Architecture(tuple(network.n_hidden), network.activation),
            trainer_settings(trainer.pop("kind"), trainer),
            network.seed,
            network.n_restarts,
            quantities(kind.inputs),
            quantities(kind.outputs),
        )
    except TrainingError as error:
        raise TrainingError(f"elastic_arm.splits, seed {seed}: {error}") from None
    return correlation(angles, best.predict(held_out))


if __name__ == "__main__":
    stage.run(main)
