"""The arm of the machine file, written down once more, and poses to test it with."""

from pathlib import Path

import numpy as np

from flexik.cases import case as cases
from flexik.kinematics.serial_arm import SerialArm, forward, pose_errors
from flexik.parameters.reading import read_yaml

ROOT = Path(__file__).parents[1]
FILES = {name: read_yaml(ROOT / name) for name in ("params.yaml", "data/machines/fanuc.yaml")}

LIMITS = np.deg2rad([[-180, -90, -160, -360, -125, -360], [180, 135, 280, 360, 125, 360]])
ARM = SerialArm(
    offset=(0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0),
    d=(0.565, 0.0, 0.0, -1.016, 0.0, -0.175),
    a=(0.15, 0.87, 0.17, 0.0, 0.0, 0.0),
    alpha=(-np.pi / 2, np.pi, -np.pi / 2, np.pi / 2, -np.pi / 2, np.pi),
    minimum=tuple(LIMITS[0]),
    maximum=tuple(LIMITS[1]),
)


def random_joints(n, seed=0):
    return np.random.default_rng(seed).uniform(*LIMITS, (n, 6))


def within_limits(arm, joints):
    return ((joints >= arm.minimum) & (joints <= arm.maximum)).all(axis=-1)


def largest_error(pose, joints, arm=ARM):
    """Largest distance in m or angle in rad between poses and those at `joints`."""
    return max(error.max() for error in pose_errors(pose, forward(arm, joints)))


def section(data, machine=FILES["data/machines/fanuc.yaml"]):
    """The section of changed contents of params.yaml."""
    known = {"params.yaml": data, "data/machines/fanuc.yaml": machine}
    read, cases._read = cases._read, lambda file: known[str(file)]
    try:
        return cases.load("fanuc")
    finally:
        cases._read = read


SECTION = section(FILES["params.yaml"])
