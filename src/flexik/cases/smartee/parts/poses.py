"""Poses of the SmartEE and the joint angles that belong to them: what is learnt and judged by."""

import itertools

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.smartee.section import (
    Box,
    Machine,
    OutsidePoses,
    PathPoses,
    Poses,
    RandomPoses,
    Section,
)
from flexik.datasets.tables import Field
from flexik.errors import ParameterError
from flexik.kinematics.smartee import N_LEGS, SmartEEGeometry, inverse, rotation_zyz
from flexik.kinematics.status import REACHED

Array = NDArray[np.float64]

POSE_FIELDS = (
    Field("x", "m", "position of the plate's centre"),
    Field("y", "m", "position of the plate's centre"),
    Field("z", "m", "position of the plate's centre"),
    Field("alpha", "rad", "first ZYZ Euler angle of the plate"),
    Field("beta", "rad", "second ZYZ Euler angle of the plate"),
    Field("gamma", "rad", "third ZYZ Euler angle of the plate"),
)
ACTUATED_FIELDS = tuple(
    Field(f"theta{joint}_leg{leg}", "rad", meaning)
    for joint, meaning in ((1, "pitch of the first link"), (2, "roll about the first link"))
    for leg in range(1, N_LEGS + 1)
)
ELBOW_FIELDS = tuple(
    Field(f"theta3_leg{leg}", "rad", "elbow, passive") for leg in range(1, N_LEGS + 1)
)
# A row of a set with permutations has the joint angles of an image of its pose
FIELDS = (
    Field("pose", "1", "number of the drawn pose, from 0", "int64"),
    Field("permutation", "1", "0: as drawn, else number of the image of LEG_PERMUTATIONS", "int64"),
    *POSE_FIELDS,
    *ACTUATED_FIELDS,
    *ELBOW_FIELDS,
)

# Order of the legs in an image, and whether it is a reflection. Turning the base by a third of a
# turn permutes the legs cyclically; exchanging two legs reflects it, which turns theta2 round. A
# plain exchange, as the paper has it, violates the closure by some centimetres.
LEG_PERMUTATIONS = (
    ((0, 1, 2), False),
    ((1, 2, 0), False),
    ((2, 0, 1), False),
    ((0, 2, 1), True),
    ((2, 1, 0), True),
    ((1, 0, 2), True),
)


def geometry_of(machine: Machine) -> SmartEEGeometry:
    """Dimensions of the machine file."""
    return SmartEEGeometry(**machine.model_dump())


def table(machine: Machine, box: Box, poses: Poses, what: str) -> dict[str, NDArray]:
    """Columns FIELDS of a set of poses and their joint angles; a pose's images are together.

    Poses outside the box that the legs do not reach are left out; raises ParameterError naming
    `what` when they do not reach another.
    """
    drawn, joints = reached(machine, box, poses, what)
    numbers = np.flatnonzero(np.isfinite(joints).all(axis=(1, 2)))
    drawn, joints = drawn[numbers], joints[numbers]
    legs = isinstance(poses, RandomPoses) and poses.permutations == "legs"
    images_of = images(joints) if legs else joints[None]
    k, n = images_of.shape[:2]
    rows = images_of.swapaxes(0, 1).reshape(n * k, N_LEGS, 3)
    whole = np.column_stack([np.repeat(drawn, k, axis=0), inputs_of(rows[..., :2]), rows[..., 2]])
    columns = {"pose": np.repeat(numbers, k), "permutation": np.tile(np.arange(k), n)}
    return columns | dict(zip((field.name for field in FIELDS[2:]), whole.T, strict=True))


def reached(machine: Machine, box: Box, poses: Poses, what: str) -> tuple[Array, Array]:
    """Poses (n, 6) of a set, joints (n, 3, 3), NaN beyond reach; see `table`."""
    drawn = in_box(box, shares(poses))
    found = inverse(geometry_of(machine), drawn[:, :3], rotation_zyz(drawn[:, 3:]))
    missed = found.status != REACHED
    if missed.any() and not isinstance(poses, OutsidePoses):
        number = int(np.argmax(missed))
        pose = ", ".join(f"{value:.4g}" for value in drawn[number])
        raise ParameterError(
            f"{what}: the legs do not reach {missed.sum()} of {len(drawn)} poses, first pose "
            f"{number} ({pose}; m and rad)"
        )
    return drawn, found.joints


def in_box(box: Box, values: Array) -> Array:
    """Poses (n, 6) of x, y, z, ZYZ angles at `values` (n, 6) in half extents of the box."""
    half = np.array([*box.half_lengths, *box.half_angles])
    return np.array([*box.centre, 0.0, 0.0, 0.0]) + values * half


def shares(poses: Poses) -> Array:
    """Poses (n, 6) of a set in half extents of the box."""
    if isinstance(poses, RandomPoses):
        generator = np.random.default_rng(poses.seed)
        return generator.uniform(-poses.extent, poses.extent, (poses.n_poses, 6))
    if isinstance(poses, OutsidePoses):
        generator = np.random.default_rng(poses.seed)
        values = generator.uniform(-1.0, 1.0, (poses.n_poses, 6))
        extents = generator.uniform(0.0, poses.extent, (poses.n_poses, 1))
        return values * (extents / np.abs(values).max(axis=1, keepdims=True))
    if isinstance(poses, PathPoses):
        phase = 2.0 * np.pi * np.arange(poses.n_samples)[:, None] / poses.n_samples
        return np.sin(phase * np.array(poses.cycles))
    return np.array(list(itertools.product((-1.0, 1.0), repeat=6)))


def extent_of(box: Box, poses: Array) -> Array:
    """Largest coordinate (n,) of `poses` (n, 6), in half extents: inside the box at most 1."""
    zero, one = in_box(box, np.zeros((1, 6))), in_box(box, np.ones((1, 6)))
    return np.abs((poses - zero) / (one - zero)).max(axis=1)


def images(joints: Array) -> Array:
    """The six images (6, n, 3, 3) of `joints` (n, 3, 3), in the order of LEG_PERMUTATIONS."""
    permuted = []
    for legs, reflected in LEG_PERMUTATIONS:
        image = joints[:, legs, :]
        if reflected:
            image[..., 1] *= -1.0
        permuted.append(image)
    return np.stack(permuted)


def centre_elbows(machine: Machine, box: Box) -> Array:
    """Elbows (3,) at the centre of the box, the plate level; NaN when out of reach."""
    return inverse(geometry_of(machine), np.array([box.centre]), np.eye(3)[None]).joints[0, :, 2]


def check_reach(section: Section) -> None:
    """Raise ParameterError when the legs do not reach the box's centre, or a pose of a set."""
    box = section.samples.box
    if np.isnan(centre_elbows(section.machine, box)).any():
        key = f"{section.name}.samples.box.centre"
        raise ParameterError(f"params.yaml: {key}: the legs do not reach it")
    for key, poses in section.sets.items():
        reached(section.machine, box, poses, f"params.yaml: {section.name}.{key}")


def values(rows: pd.DataFrame, fields: tuple[Field, ...]) -> Array:
    """Columns `fields` (n, k) of `rows`."""
    return rows[[field.name for field in fields]].to_numpy()


def inputs_of(actuated: Array) -> Array:
    """Queries (n, 6), in the order of ACTUATED_FIELDS, of joints (n, 3, 2)."""
    return actuated.swapaxes(1, 2).reshape(len(actuated), 2 * N_LEGS)


def actuated_of(inputs: Array) -> Array:
    """Actuated joints (n, 3, 2), [leg, joint], of queries (n, 6)."""
    return inputs.reshape(len(inputs), 2, N_LEGS).swapaxes(1, 2)
