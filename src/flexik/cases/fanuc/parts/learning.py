"""How networks of the taught path learn: many at once where the trainer allows it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd
from scipy.linalg import block_diag

from flexik.cases.fanuc.parts.tables import JOINT_FIELDS, POSITION_FIELDS, array
from flexik.kinematics.serial_arm import Array
from flexik.learning.perceptron import Network, Normalisation, quantities
from flexik.learning.training import (
    Architecture,
    Attempt,
    Lesson,
    TrainingRecord,
    attempt_together,
    no_network,
)
from flexik.parameters.trainers import Stopping


@dataclass(frozen=True, eq=False)
class TaughtSamples:
    """Positions (n, 3) in m and joints (n, 6) in rad to train with, and (m, 3), (m, 6) to test."""

    positions: Array
    joints: Array
    test_positions: Array
    test_joints: Array

    @classmethod
    def of_table(cls, path: pd.DataFrame) -> Self:
        """Of a table of PATH_FIELDS."""
        is_test = path["is_test"] == 1
        parts = (
            array(rows, fields)
            for rows in (path[~is_test], path[is_test])
            for fields in (POSITION_FIELDS, JOINT_FIELDS)
        )
        return cls(*parts)

    @property
    def ranges(self) -> Array:
        """Range of each joint along the path (6,), rad: what errors are told in shares of."""
        return np.ptp(np.concatenate([self.joints, self.test_joints]), axis=0)


@dataclass(frozen=True, eq=False)
class Run:
    """One network: which joints (numbers from 1) it gives, and how it learns.

    restart : tells starts of the same seed apart
    """

    joints: tuple[int, ...]
    architecture: Architecture
    settings: Stopping
    seed: int
    restart: int

    @property
    def columns(self) -> list[int]:
        """Columns of the joints."""
        return [joint - 1 for joint in self.joints]


@dataclass(frozen=True, eq=False)
class Learnt:
    """What a run gave.

    curves : (2, passes + 1, joints), root mean square errors on training and test samples over the
        range of the joint
    """

    network: Network
    record: TrainingRecord
    curves: Array


def learn(samples: TaughtSamples, runs: Sequence[Run]) -> list[Learnt]:
    """Train the networks of `runs`, of one architecture and kind of trainer.

    Raises TrainingError if one comes to nothing.
    """
    curves: list[list[Array]] = [[] for _ in runs]

    def attempt(k: int) -> Attempt:
        run = runs[k]
        lesson = Lesson(
            samples.positions,
            samples.joints[:, run.columns],
            quantities(POSITION_FIELDS),
            quantities([JOINT_FIELDS[column] for column in run.columns]),
            run.architecture,
            run.settings,
            run.seed,
        )
        observe = lambda network: curves[k].append(_errors(network, samples, run.columns))  # noqa: E731
        return Attempt(lesson, run.restart, observe)

    attempts = [attempt(k) for k in range(len(runs))]
    found = attempt_together(attempts)
    learnt = []
    for k, (network, record) in enumerate(found):
        if network is None:
            raise no_network(attempts[k].lesson, [record])
        learnt.append(Learnt(network, record, np.stack(curves[k], axis=1)))
    return learnt


def _errors(network: Network, samples: TaughtSamples, columns: list[int]) -> Array:
    pairs = (samples.positions, samples.joints), (samples.test_positions, samples.test_joints)
    errors = (network.predict(inputs) - outputs[:, columns] for inputs, outputs in pairs)
    ranges = samples.ranges[columns]
    return np.array([np.sqrt(np.mean(error**2, axis=0)) / ranges for error in errors])


def side_by_side(networks: Sequence[Network]) -> Network:
    """One network with the outputs of `networks`, which have the same inputs and one hidden layer.

    Their hidden layers stand side by side; a weight from one to the output of another is 0.
    """
    first, last = networks[0], [each.weights[1] for each in networks]
    hidden = np.vstack([each.weights[0] for each in networks])
    biases = np.concatenate([matrix[:, -1] for matrix in last])
    output = np.column_stack([block_diag(*(matrix[:, :-1] for matrix in last)), biases])
    scales = [each.output_normalisation for each in networks]
    normalisation = Normalisation(
        np.concatenate([scale.minimum for scale in scales]),
        np.concatenate([scale.maximum for scale in scales]),
    )
    outputs = tuple(quantity for each in networks for quantity in each.outputs)
    where = first.input_normalisation, normalisation, first.inputs, outputs
    return Network((hidden, output), first.activation, *where)


def percent(found: Array, expected: Array, ranges: Array) -> Array:
    """Total error: mean absolute difference of columns (n, k) over `ranges` (k,), times 100."""
    return 100.0 * np.abs(found - expected).mean(axis=0) / ranges
