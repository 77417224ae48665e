"""Trainers from many initial weights, near the origin and far from it: the claim of the paper.

Reads params.yaml: parallel, smartee.starts and its trainers under smartee.trainers (and
smartee.geometry, smartee.workspace, smartee.poses to know which data belong to it); the poses of
smartee_generate to train on and the validation poses.
Writes data/smartee/starts.parquet, a row for every run, and data/smartee/sensitivity.parquet, the
same for other constants of a trainer with a penalty.
"""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.smartee.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    read_poses,
    values,
)
from flexik.datasets.smartee.provenance import starts_checksum
from flexik.learning.perceptron import Network, quantities
from flexik.learning.starts import StartStudy, run_starts
from flexik.learning.stopping import Stopping
from flexik.learning.training import Architecture, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/smartee")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    smartee = given.smartee
    starts = smartee.starts
    train_on = read_poses(DATA / "poses", smartee, starts.poses)
    judge_by = read_poses(DATA / "poses", smartee, "validation")
    chosen = {name: smartee.trainers[name].model_dump() for name in starts.trainers}
    study = StartStudy(
        values(train_on, ACTUATED_FIELDS),
        values(train_on, ELBOW_FIELDS),
        Architecture(starts.n_hidden, "tanh"),
        {name: trainer_settings(options.pop("kind"), options) for name, options in chosen.items()},
        starts.spreads,
        starts.success,
        starts.seed,
        quantities(ACTUATED_FIELDS),
        quantities(ELBOW_FIELDS),
        functools.partial(
            peak,
            inputs=values(judge_by, ACTUATED_FIELDS),
            outputs=values(judge_by, ELBOW_FIELDS),
        ),
    )
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    other, sensitivity = other_constants(smartee), starts.sensitivity
    spread = {sensitivity.spread: starts.spreads[sensitivity.spread]}
    for file, part, n_starts in (
        ("starts", study, starts.n_starts),
        ("sensitivity", replace(study, trainers=other, spreads=spread), sensitivity.n_starts),
    ):
        n_found = run_starts(
            DATA / f"{file}.parquet",
            part,
            n_starts,
            starts_checksum(smartee),
            "smartee.starts",
            settings,
            file,
        )
        if n_found:
            print(f"{file}: {n_found} runs were there already")


def other_constants(smartee: parameters.SmartEE) -> dict[str, Stopping]:
    """Settings with every pair of penalty and decrease, by the pair."""
    sensitivity = smartee.starts.sensitivity
    options = smartee.trainers[sensitivity.trainer].model_dump()
    kind = options.pop("kind")
    return {
        f"{penalty:g}, {decrease:g}": trainer_settings(
            kind, options | {"penalty": penalty, "penalty_decrease": decrease}
        )
        for penalty in sensitivity.penalties
        for decrease in sensitivity.penalty_decreases
    }


def peak(network: Network, inputs: np.ndarray, outputs: np.ndarray) -> float:
    """Largest norm (rad) of the elbow errors."""
    return float(np.linalg.norm(network.predict(inputs) - outputs, axis=1).max())


if __name__ == "__main__":
    stage.run(main)
