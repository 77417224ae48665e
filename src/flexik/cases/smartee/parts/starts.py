"""Trainers from many initial weights, near the origin and far from it: the claim of the paper."""

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flexik.cases.smartee.parts.train import lesson, queries_and_answers
from flexik.datasets.parts import Work, json_file, whole
from flexik.learning.perceptron import Array, Network, Normalisation
from flexik.learning.starts import from_starts
from flexik.learning.training import Architecture
from flexik.parameters.trainers import Stopping


def prepare_starts(
    *,
    n_hidden: int,
    seed: int,
    success: float,
    trainers: Mapping[str, Stopping],
    spreads: Mapping[str, float],
    n_starts: int,
    rows: Path,
    judged: Path,
) -> Work:
    """Train with every trainer from every start of every spread."""
    inputs, outputs = queries_and_answers(judged)
    judge = functools.partial(peak, inputs=inputs, outputs=outputs)
    any_trainer = next(iter(trainers.values()))
    task = lesson(Architecture(n_hidden), any_trainer, seed, rows, judge=judge)
    return from_starts(task, trainers, spreads, n_starts, success)


def peak(network: Network, inputs: Array, outputs: Array) -> float:
    """Largest norm (rad) of the elbow errors."""
    return float(np.linalg.norm(network.predict(inputs) - outputs, axis=1).max())


def prepare_linear(*, rows: Path) -> Work:
    """The error of a network whose hidden units stay in their linear part."""
    error = linear_error(*queries_and_answers(rows))
    return whole(lambda: {".json": json_file({"mean_squared_error": error})})


def linear_error(inputs: Array, outputs: Array) -> float:
    """Mean squared error of the normalised `outputs` (n, q) by the best linear map of `inputs`."""
    normalised = Normalisation.from_data(outputs).to_unit(outputs)
    matrix = np.column_stack(
        [Normalisation.from_data(inputs).to_unit(inputs), np.ones(len(inputs))]
    )
    weights = np.linalg.lstsq(matrix, normalised, rcond=None)[0]
    return float(np.mean((matrix @ weights - normalised) ** 2))
