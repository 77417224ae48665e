"""Train the networks of the taught path, and those of the whole workspace."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flexik.cases.fanuc.parts.learning import TaughtSamples, learn, percent, side_by_side
from flexik.cases.fanuc.parts.tables import (
    CONFIGURATION,
    CURVE_FIELDS,
    JOINT_FIELDS,
    PATH_FIELDS,
    POSE_FIELDS,
    START_FIELDS,
    arm_of,
    array,
)
from flexik.cases.fanuc.section import N_JOINTS, Section
from flexik.datasets.parts import Columns, Part, Work, Writer, stacked, table
from flexik.datasets.tables import read_table
from flexik.kinematics.pose_representation import INPUTS, OUTPUTS, joint_outputs, pose_inputs
from flexik.kinematics.serial_arm import Array, SerialArm, forward
from flexik.kinematics.spherical_wrist import canonical
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.stopping import StopReason
from flexik.learning.storage import network_file, packed, unpacked
from flexik.learning.training import Architecture, Attempt, Lesson, TrainingRecord, train
from flexik.parameters.trainers import BackPropagation, Stopping

ALL_JOINTS = tuple(range(1, 7))


def parts(section: Section) -> list[Part]:
    """A part for every network, or networks of one name."""
    found, samples = [], section.data / "samples"
    for name, network in section.networks.items():
        settings: dict[str, Any] = {
            "architecture": Architecture(network.sizes[0], network.activation),
            "seed": network.seed,
            "trainer": section.trainers[network.trainer],
        }
        if network.learns == "arm_configuration":
            settings["arm"] = arm_of(section.machine.joints)
            found.append(Part(name, prepare_poses, settings, {"poses": samples / "poses.parquet"}))
        else:
            settings |= {"learns": network.learns, "n_restarts": network.n_restarts}
            found.append(Part(name, prepare_path, settings, {"path": samples / "path.parquet"}))
    return found


def prepare_path(
    *,
    learns: str,
    architecture: Architecture,
    seed: int,
    trainer: Stopping,
    n_restarts: int,
    path: Path,
) -> Work:
    """Networks from position to joints, one for all or one each, which are joined into one.

    Files: the network of the median start, those of all starts, errors of the starts, and errors
    pass by pass. Starts learn together where the trainer can.
    """
    samples = TaughtSamples.of_table(read_table(path, PATH_FIELDS))
    groups = [ALL_JOINTS] if learns == "all_joints" else [(joint,) for joint in ALL_JOINTS]
    attempts = [
        samples.attempt(joints, architecture, trainer, seed, number)
        for number, joints in enumerate(groups * n_restarts)
    ]
    n = len(attempts) if isinstance(trainer, BackPropagation) else len(groups)
    items = [attempts[k : k + n] for k in range(0, len(attempts), n)]
    function = partial(train_starts, samples, len(groups))
    return Work(function, items, partial(_files, samples))


def train_starts(samples: TaughtSamples, n: int, attempts: Sequence[Attempt]) -> Columns:
    """Of every start k: network_k, packed; kept_k (6,); curves_k (2, passes + 1, 6).

    A start is `n` attempts, whose networks give all joints. Where one took fewer passes than
    another, its curve ends with nan.
    """
    learnt, found = learn(samples, attempts), dict[str, np.ndarray]()
    for first in range(0, len(learnt), n):
        start = attempts[first].restart // n
        networks, records, curves = zip(*learnt[first : first + n], strict=True)
        joined = side_by_side(networks)
        n_joints = [len(network.outputs) for network in networks]
        found |= {
            f"network_{start}": packed(joined, joined_record(records, start))["json"],
            f"kept_{start}": np.repeat([record.kept for record in records], n_joints),
            f"curves_{start}": np.concatenate(_padded(curves, axis=1), axis=2),
        }
    return found


def _padded(arrays: Sequence[Array], axis: int) -> list[Array]:
    """The arrays, those shorter along `axis` ending with nan."""
    n, padded = max(each.shape[axis] for each in arrays), []
    for each in arrays:
        width = [(0, 0)] * each.ndim
        width[axis] = (0, n - each.shape[axis])
        padded.append(np.pad(each, width, constant_values=np.nan))
    return padded


def joined_record(records: Sequence[TrainingRecord], start: int) -> TrainingRecord:
    """Record of networks that were joined.

    Errors are means over those that still learn, the pass kept is the last one that one of them
    keeps, the reason to stop that of the first that did not use all passes.
    """
    errors = _padded([np.array(record.errors) for record in records], axis=0)
    early = (r.stop_reason for r in records if r.stop_reason != StopReason.ITERATIONS)
    return replace(
        records[0],
        restart=start,
        stop_reason=next(early, StopReason.ITERATIONS),
        errors=tuple(np.nanmean(errors, axis=0).tolist()),
        kept=max(record.kept for record in records),
    )


def _files(samples: TaughtSamples, results: list[Columns]) -> Mapping[str, Writer]:
    found = {name: values for result in results for name, values in result.items()}
    starts, curves, pairs = [], [], []
    for start in range(len(found) // 3):
        network, record = trained({"json": found[f"network_{start}"]})
        pairs.append((network, record))
        starts.append(
            {
                "restart": np.full(N_JOINTS, start),
                "joint": np.array(ALL_JOINTS),
                "error_percent": samples.errors(network, percent)[1],
                "kept": found[f"kept_{start}"],
            }
        )
        errors = found[f"curves_{start}"]
        joint, iteration = np.nonzero(np.isfinite(errors[0].T))
        curves.append(
            {
                "restart": np.full(len(joint), start),
                "joint": joint + 1,
                "iteration": iteration,
                "training_error": errors[0, iteration, joint],
                "test_error": errors[1, iteration, joint],
            }
        )
    means = [each["error_percent"].mean() for each in starts]
    # of two in the middle the better
    median = int(np.argsort(means, kind="stable")[(len(means) - 1) // 2])
    for start, each in enumerate(starts):
        each["is_median"] = np.full(N_JOINTS, int(start == median))
    return {
        ".json": network_file([pairs[median]]),
        ".restarts.json": network_file(pairs),
        ".starts.parquet": table(stacked(starts, START_FIELDS), START_FIELDS),
        ".curves.parquet": table(stacked(curves, CURVE_FIELDS), CURVE_FIELDS),
    }


def prepare_poses(
    *, arm: SerialArm, architecture: Architecture, seed: int, trainer: Stopping, poses: Path
) -> Work:
    """One network an arm configuration, in the order of their numbers."""
    found = read_table(poses, POSE_FIELDS)
    items = [
        (workspace_lesson(arm, array(rows, JOINT_FIELDS), architecture, trainer, seed), number)
        for number, rows in found.groupby(CONFIGURATION.name)
    ]

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        pairs = [trained(result) for result in results]
        for number, (_, record) in enumerate(pairs):
            print(f"configuration {number}: mean squared error {record.errors[record.kept]:.3g}")
        return {".json": network_file(pairs)}

    return Work(train_workspace, items, finish)


def workspace_lesson(
    arm: SerialArm, joints: Array, architecture: Architecture, settings: Stopping, seed: int
) -> Lesson:
    """From poses at `joints` (n, 6), rad, to what stands for the joints."""
    return Lesson(
        pose_inputs(forward(arm, joints)),
        joint_outputs(arm, canonical(arm, joints)),
        [Quantity(*column) for column in INPUTS],
        [Quantity(*column) for column in OUTPUTS],
        architecture,
        settings,
        seed,
    )


def train_workspace(item: tuple[Lesson, int]) -> Columns:
    """The network of an arm configuration, packed; its number tells the start apart."""
    return packed(*train(*item))


def trained(arrays: Columns) -> tuple[Network, TrainingRecord]:
    """A network that was `packed`, and its record."""
    network, record = unpacked(arrays)
    assert network is not None
    return network, record
