"""How the networks of the six-joint arm learn; each function can run in a process of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd

from flexik.datasets.fanuc.tables import joints_of_rows
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.stopping import Stopping
from flexik.learning.training import Architecture, TrainingRecord, train
from flexik.kinematics.fanuc import canonical
from flexik.kinematics.pose_representation import INPUTS, OUTPUTS, joint_outputs, pose_inputs
from flexik.kinematics.serial_arm import Array, SerialArm, forward

POSITION = tuple(Quantity(name, "m") for name in ("x", "y", "z"))


@dataclass(frozen=True, eq=False)
class TaughtSamples:
    """Positions (n, 3) in m and joints (n, 6) in rad to train with, and (m, 3), (m, 6) to test."""

    positions: Array
    joints: Array
    test_positions: Array
    test_joints: Array

    @classmethod
    def of_tables(cls, training: pd.DataFrame, test: pd.DataFrame) -> Self:
        """Of tables of datasets.fanuc.tables.PATH_FIELDS."""
        columns = list("xyz")
        return cls(
            training[columns].to_numpy(),
            joints_of_rows(training),
            test[columns].to_numpy(),
            joints_of_rows(test),
        )

    @property
    def ranges(self) -> Array:
        """Range of each joint along the path (6,), rad: what errors are told in shares of."""
        return np.ptp(np.concatenate([self.joints, self.test_joints]), axis=0)


@dataclass(frozen=True, eq=False)
class PathTask:
    """One network of a taught path: which joints (numbers from 1) it gives, and how it learns.

    restart : tells starts of the same seed apart
    """

    samples: TaughtSamples
    joints: tuple[int, ...]
    architecture: Architecture
    settings: Stopping
    seed: int
    restart: int


def train_path(task: PathTask, watch: bool = True) -> tuple[Network, TrainingRecord, pd.DataFrame]:
    """Train the network of `task`.

    Returns
    -------
    network, record : of learning.training.train
    curves : columns joint, iteration, training_error, test_error; root mean square errors over
        the range of the joint; empty unless `watch`
    """
    columns = np.array(task.joints) - 1
    samples, ranges = task.samples, task.samples.ranges[columns]
    rows: list[Array] = []

    def observe(network: Network) -> None:
        pairs = (
            (samples.positions, samples.joints),
            (samples.test_positions, samples.test_joints),
        )
        errors = (network.predict(inputs) - outputs[:, columns] for inputs, outputs in pairs)
        rows.append(np.array([np.sqrt(np.mean(error**2, axis=0)) / ranges for error in errors]))

    network, record = train(
        samples.positions,
        samples.joints[:, columns],
        task.architecture,
        task.settings,
        task.seed,
        POSITION,
        [Quantity(f"joint_{joint}", "rad") for joint in task.joints],
        restart=task.restart,
        observer=observe if watch else None,
    )
    curves = [
        {
            "joint": joint,
            "iteration": iteration,
            "training_error": float(row[0, k]),
            "test_error": float(row[1, k]),
        }
        for k, joint in enumerate(task.joints)
        for iteration, row in enumerate(rows)
    ]
    return network, record, pd.DataFrame(curves)


def error_percent(network: Network, samples: TaughtSamples, joints: tuple[int, ...]) -> Array:
    """Total error of each of `joints` (numbers from 1) on the test samples, in percent.

    The mean absolute error over the range of the joint along the path, times 100.
    """
    columns = np.array(joints) - 1
    found = network.predict(samples.test_positions)
    return percent(found, samples.test_joints[:, columns], samples.ranges[columns])


def percent(found: Array, expected: Array, ranges: Array) -> Array:
    """Mean absolute difference of columns (n, k) over `ranges` (k,), times 100."""
    return 100.0 * np.abs(found - expected).mean(axis=0) / ranges


@dataclass(frozen=True, eq=False)
class WorkspaceTask:
    """The network of arm configuration `number`, from joints (n, 6) in rad of it."""

    arm: SerialArm
    number: int
    joints: Array
    architecture: Architecture
    settings: Stopping
    seed: int


def train_workspace(task: WorkspaceTask) -> tuple[Network, TrainingRecord]:
    """Train the network of `task`: pose to what stands for the joints."""
    return train(
        pose_inputs(forward(task.arm, task.joints)),
        joint_outputs(task.arm, canonical(task.arm, task.joints)),
        task.architecture,
        task.settings,
        task.seed,
        [Quantity(*column) for column in INPUTS],
        [Quantity(*column) for column in OUTPUTS],
        restart=task.number,
    )


def start_rows(
    tasks: Sequence[PathTask], trained: Sequence[tuple[Network, TrainingRecord, pd.DataFrame]]
) -> pd.DataFrame:
    """Columns START_FIELDS without the network's name: a row a start and joint.

    The median start: of the starts in the order of their mean error over the joints the middle
    one, of two in the middle the better.
    """
    n_groups = len({task.joints for task in tasks})
    rows = [
        (task.restart // n_groups, joint, error, record.kept)
        for task, (network, record, _) in zip(tasks, trained, strict=True)
        for joint, error in zip(
            task.joints, error_percent(network, task.samples, task.joints), strict=True
        )
    ]
    frame = pd.DataFrame(rows, columns=["restart", "joint", "error_percent", "kept"])
    order = frame.groupby("restart")["error_percent"].mean().sort_values(kind="stable").index
    median = order[(len(order) - 1) // 2]
    return frame.assign(is_median=(frame["restart"] == median).astype(np.int64))


def path_tasks(
    samples: TaughtSamples,
    groups: Sequence[tuple[int, ...]],
    architecture: Architecture,
    settings: Stopping,
    seed: int,
    n_restarts: int,
) -> list[PathTask]:
    """Networks that give `groups` of joints, all of one start before those of the next."""
    return [
        PathTask(samples, joints, architecture, settings, seed, start * len(groups) + k)
        for start in range(n_restarts)
        for k, joints in enumerate(groups)
    ]


def study_row(task: PathTask) -> dict[str, float | int | str]:
    """Columns of a study, for one joint: both errors, the pass kept and why training stopped."""
    network, record, _ = train_path(task, watch=False)
    column = np.array(task.joints) - 1
    found = network.predict(task.samples.positions)
    expected, ranges = task.samples.joints[:, column], task.samples.ranges[column]
    return {
        "training_percent": float(percent(found, expected, ranges)[0]),
        "error_percent": float(error_percent(network, task.samples, task.joints)[0]),
        "kept": record.kept,
        "stop_reason": str(record.stop_reason),
    }
