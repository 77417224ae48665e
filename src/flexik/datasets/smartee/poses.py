"""Poses of the SmartEE and the joint angles that belong to them: what is learnt and judged by."""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.smartee.provenance import poses_checksum
from flexik.datasets.tables import Field, read_table, write_table
from flexik.errors import DataError, ParameterError
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


def geometry_of(smartee: parameters.SmartEE) -> SmartEEGeometry:
    """Dimensions of params.yaml."""
    return SmartEEGeometry(**smartee.geometry.model_dump())


def in_box(workspace: parameters.SmartEEWorkspace, shares: Array) -> Array:
    """Poses (n, 6) of x, y, z, ZYZ angles at `shares` (n, 6) of the half extents of the box."""
    half = np.array([*workspace.half_lengths, *workspace.half_angles])
    return np.array([*workspace.centre, 0.0, 0.0, 0.0]) + shares * half


def joints_of(geometry: SmartEEGeometry, poses: Array, what: str) -> Array:
    """Joint angles (n, 3, 3), [leg, joint], of `poses` (n, 6).

    Raises ParameterError naming `what` and the first pose that the legs do not reach.
    """
    found = inverse(geometry, poses[:, :3], rotation_zyz(poses[:, 3:]))
    missed = found.status != REACHED
    if missed.any():
        number = int(np.argmax(missed))
        pose = ", ".join(f"{value:.4g}" for value in poses[number])
        raise ParameterError(
            f"{what}: the legs do not reach {missed.sum()} of {len(poses)} poses, first pose "
            f"{number} ({pose}; m and rad)"
        )
    return found.joints


def images(joints: Array) -> Array:
    """The six images (6, n, 3, 3) of `joints` (n, 3, 3), in the order of LEG_PERMUTATIONS."""
    permuted = []
    for legs, reflected in LEG_PERMUTATIONS:
        image = joints[:, legs, :]
        if reflected:
            image[..., 1] *= -1.0
        permuted.append(image)
    return np.stack(permuted)


def draw(smartee: parameters.SmartEE, name: str) -> tuple[Array, Array]:
    """Poses (n, 6) of the set `name` and their joint angles (n, 3, 3).

    Raises ParameterError when the legs do not reach one of them.
    """
    chosen = smartee.poses[name]
    generator = np.random.default_rng(chosen.seed)
    shares = generator.uniform(-chosen.extent, chosen.extent, (chosen.n_poses, 6))
    poses = in_box(smartee.workspace, shares)
    return poses, joints_of(geometry_of(smartee), poses, f"smartee.poses.{name}")


def generate(path: Path | str, smartee: parameters.SmartEE, name: str) -> int:
    """Write the set `name` to `path`; returns its number of rows. A pose's images are together.

    Raises ParameterError as `draw` does.
    """
    poses, drawn = draw(smartee, name)
    joints = images(drawn) if smartee.poses[name].permutations == "legs" else drawn[None]
    k, n = joints.shape[:2]
    rows = joints.swapaxes(0, 1).reshape(n * k, N_LEGS, 3)
    columns: dict[str, np.ndarray] = {
        "pose": np.repeat(np.arange(n), k),
        "permutation": np.tile(np.arange(k), n),
    }
    values = np.column_stack([np.repeat(poses, k, axis=0), *_in_columns(rows)])
    columns |= dict(zip((field.name for field in FIELDS[2:]), values.T, strict=True))
    write_table(path, columns, FIELDS, poses_checksum(smartee, name))
    return n * k


def path_name(n_samples: int) -> str:
    """Name of the path of `n_samples` among the sets of poses."""
    return f"path_{n_samples}"


def path_poses(smartee: parameters.SmartEE, n_samples: int) -> tuple[Array, Array]:
    """Poses (n, 6) along the path of smartee.path, which closes, and their joints (n, 3, 3).

    Every coordinate swings over the whole box, as often as its entry of `cycles` says.
    """
    phase = 2.0 * np.pi * np.arange(n_samples)[:, None] / n_samples
    poses = in_box(smartee.workspace, np.sin(phase * np.array(smartee.path.cycles)))
    return poses, joints_of(geometry_of(smartee), poses, "smartee.path")


def corner_poses(smartee: parameters.SmartEE) -> tuple[Array, Array]:
    """The 64 corners (64, 6) of the box and their joints (64, 3, 3).

    Raises ParameterError when the legs do not reach one of them.
    """
    poses = in_box(smartee.workspace, np.array(list(itertools.product((-1.0, 1.0), repeat=6))))
    return poses, joints_of(geometry_of(smartee), poses, "smartee.workspace: corners")


def read_poses(folder: Path, smartee: parameters.SmartEE, name: str) -> pd.DataFrame:
    """Table of FIELDS of the set `name` in `folder`; DataError when made with other parameters."""
    return read_table(folder / f"{name}.parquet", FIELDS, poses_checksum(smartee, name))


def values(table: pd.DataFrame, fields: Sequence[Field]) -> Array:
    """Columns `fields` (n, k) of `table`."""
    return table[[field.name for field in fields]].to_numpy()


def joints_in(table: pd.DataFrame) -> Array:
    """Joint angles (n, 3, 3), [leg, joint], of a `table` of FIELDS."""
    elbows = values(table, ELBOW_FIELDS)[..., None]
    return np.concatenate([actuated_of(values(table, ACTUATED_FIELDS)), elbows], axis=2)


def inputs_of(actuated: Array) -> Array:
    """Network inputs (n, 6), in the order of ACTUATED_FIELDS, of joints (n, 3, 2)."""
    return actuated.swapaxes(1, 2).reshape(len(actuated), 2 * N_LEGS)


def actuated_of(inputs: Array) -> Array:
    """Actuated joints (n, 3, 2), [leg, joint], of network inputs (n, 6)."""
    if inputs.ndim != 2 or inputs.shape[1] != 2 * N_LEGS:
        raise DataError(f"network inputs have shape {inputs.shape}, expected (n, {2 * N_LEGS})")
    return inputs.reshape(len(inputs), 2, N_LEGS).swapaxes(1, 2)


def _in_columns(joints: Array) -> tuple[Array, Array]:
    return inputs_of(joints[..., :2]), joints[..., 2]
