"""Sample the taught path and random poses of every arm configuration, and draw the targets."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flexik.cases.fanuc.parts.samples import beside, random_joints, taught_path
from flexik.cases.fanuc.parts.tables import (
    CONFIGURATION,
    JOINT_FIELDS,
    OFF_PATH_FIELDS,
    PATH_FIELDS,
    POSE_FIELDS,
    POSITION_FIELDS,
    QUERY_FIELDS,
    RANDOM_FIELDS,
    arm_of,
    array,
    named,
)
from flexik.cases.fanuc.section import Section
from flexik.datasets.parts import Columns, Part, Work, Writer, rows, table, whole
from flexik.datasets.tables import read_table
from flexik.kinematics.pose_representation import queries
from flexik.kinematics.serial_arm import SerialArm, forward, smallest_singular_value
from flexik.kinematics.spherical_wrist import N_CONFIGURATIONS, configuration, inverse

TRAINING, TARGETS = 0, 1


def parts(section: Section) -> list[Part]:
    """The path and poses to learn from; a table of targets for every set of conditions."""
    arm, samples, asked = arm_of(section.machine.joints), section.samples, section.conditions
    path = {"path": section.data / "samples/path.parquet"}
    training = {"n": samples.n_poses, "seed": samples.seed, "role": TRAINING, "length": None}
    targets = {
        "n": asked.random_poses.n_targets,
        "seed": asked.random_poses.seed,
        "role": TARGETS,
        "length": asked.refinement.orientation_length,
    }
    off_path = asked.off_path.model_dump()
    return [
        Part("path", prepare_path, {"arm": arm, "path": samples.path}),
        Part("poses", prepare_poses, {"arm": arm, **training}),
        Part("conditions/path", prepare_test, {"arm": arm}, path),
        Part("conditions/off_path", prepare_beside, {"arm": arm, **off_path}, path),
        Part("conditions/random_poses", prepare_poses, {"arm": arm, **targets}),
    ]


def prepare_path(*, arm: SerialArm, path: Any) -> Work:
    """The taught path."""

    def sample() -> Mapping[str, Writer]:
        found = taught_path(arm, path)
        columns = {
            "share": found.share,
            "is_test": found.is_test.astype(np.int64),
            **named(JOINT_FIELDS, found.joints),
            **named(POSITION_FIELDS, forward(arm, found.joints).position),
        }
        return {".parquet": table(columns, PATH_FIELDS)}

    return whole(sample)


def prepare_poses(*, arm: SerialArm, n: int, seed: int, role: int, length: float | None) -> Work:
    """Random joints of every arm configuration; with their poses if `length` is given.

    `role` tells sets of the same seed apart, `length` is the orientation length of `RANDOM_FIELDS`.
    """
    fields = POSE_FIELDS if length is None else RANDOM_FIELDS
    function = partial(random_poses, arm, n, (seed, role), length)
    return Work(function, range(N_CONFIGURATIONS), rows(*fields))


def random_poses(
    arm: SerialArm, n: int, seed: tuple[int, int], length: float | None, number: int
) -> Columns:
    """Columns of arm configuration `number`."""
    joints = random_joints(arm, number, n, np.random.default_rng((*seed, number)))
    numbers = np.full(n, number)
    found = {CONFIGURATION.name: numbers, **named(JOINT_FIELDS, joints)}
    if length is not None:
        target = forward(arm, joints)
        flagged = inverse(arm, target).singular[:, number]
        found |= named(QUERY_FIELDS, queries(target, numbers)) | {
            "singular_value": smallest_singular_value(arm, joints, length),
            "singular": flagged.astype(np.int64),
        }
    return found


def prepare_test(*, arm: SerialArm, path: Path) -> Work:
    """Test samples of the path, in their order."""

    def ask() -> Mapping[str, Writer]:
        samples = read_table(path, PATH_FIELDS)
        test = samples[samples["is_test"] == 1]
        joints = array(test, JOINT_FIELDS)
        query = queries(forward(arm, joints), configuration(arm, joints))
        columns = {f.name: test[f.name].to_numpy() for f in PATH_FIELDS} | named(
            QUERY_FIELDS, query
        )
        return {".parquet": table(columns, (*PATH_FIELDS, *QUERY_FIELDS[3:]))}

    return whole(ask)


def prepare_beside(*, arm: SerialArm, distances: list[float], seed: int, path: Path) -> Work:
    """Targets beside the test samples of the path.

    Left out are those that the arm configuration of the path does not reach, and those nearer to
    another part of the path.
    """

    def ask() -> Mapping[str, Writer]:
        samples = read_table(path, PATH_FIELDS)
        joints = array(samples, JOINT_FIELDS)
        tested = np.flatnonzero(samples["is_test"])
        found = beside(forward(arm, joints), tested, distances, seed)
        number = configuration(arm, joints)[found.row]
        reached = inverse(arm, found.pose).reached[np.arange(len(number)), number]
        query = queries(found.pose.rows(reached), number[reached])
        columns = {"distance": found.distance[reached], **named(QUERY_FIELDS, query)}
        return {".parquet": table(columns, OFF_PATH_FIELDS)}

    return whole(ask)
