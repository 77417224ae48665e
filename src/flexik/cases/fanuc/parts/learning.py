"""How networks of the taught path learn: many at once where the trainer allows it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

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

JOINT_NAMES = [field.name for field in JOINT_FIELDS]


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

    def attempt(
        self,
        joints: Sequence[int],
        architecture: Architecture,
        settings: Stopping,
        seed: int,
        restart: int,
    ) -> Attempt:
        """One start of a network that gives `joints`, numbers from 1."""
        columns = [joint - 1 for joint in joints]
        lesson = Lesson(
            self.positions,
            self.joints[:, columns],
            quantities(POSITION_FIELDS),
            quantities([JOINT_FIELDS[column] for column in columns]),
            architecture,
            settings,
            seed,
        )
        return Attempt(lesson, restart)

    def errors(self, network: Network, measure: Callable[[Array, Array, Array], Array]) -> Array:
        """`measure` of the joints of `network` on training and on test samples, (2, joints)."""
        columns = [JOINT_NAMES.index(quantity.name) for quantity in network.outputs]
        pairs = (self.positions, self.joints), (self.test_positions, self.test_joints)
        ranges = self.ranges[columns]
        return np.array([measure(network.predict(x), y[:, columns], ranges) for x, y in pairs])


def percent(found: Array, expected: Array, ranges: Array) -> Array:
    """Total error: mean absolute difference of columns (n, k) over `ranges` (k,), times 100."""
    return 100.0 * np.abs(found - expected).mean(axis=0) / ranges


def root_mean_square(found: Array, expected: Array, ranges: Array) -> Array:
    """Root mean square difference of columns (n, k) over `ranges` (k,)."""
    return np.sqrt(np.mean((found - expected) ** 2, axis=0)) / ranges


class Learnt(NamedTuple):
    """A network and, pass by pass, its root mean square errors `curves` (2, passes + 1, joints)."""

    network: Network
    record: TrainingRecord
    curves: Array


def learn(samples: TaughtSamples, attempts: Sequence[Attempt]) -> list[Learnt]:
    """Train networks of one architecture and kind of trainer, with `TaughtSamples.errors`.

    Raises TrainingError if one comes to nothing.
    """
    curves: list[list[Array]] = [[] for _ in attempts]

    def observed(k: int) -> Attempt:
        see = lambda network: curves[k].append(samples.errors(network, root_mean_square))  # noqa: E731
        return replace(attempts[k], observer=see)

    found = attempt_together([observed(k) for k in range(len(attempts))])
    learnt = []
    for made, (network, record), errors in zip(attempts, found, curves, strict=True):
        if network is None:
            raise no_network(made.lesson, [record])
        learnt.append(Learnt(network, record, np.stack(errors, axis=1)))
    return learnt


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
