"""The taught path, targets beside it, and random poses of every arm configuration."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from flexik import parameters
from flexik.errors import ParameterError
from flexik.mechanisms.fanuc import N_CONFIGURATIONS, canonical, configuration
from flexik.mechanisms.serial_arm import Array, Pose, SerialArm

# Joints drawn at once, and at most, until an arm configuration has its poses
_DRAW, _MAXIMUM_DRAWN = 50_000, 20_000_000


class TaughtPath(NamedTuple):
    """Samples of a path: share of its duration (n,), joints (n, 6) in rad, whether to test (n,)."""

    share: Array
    joints: Array
    is_test: NDArray[np.bool_]


def taught_path(arm: SerialArm, path: parameters.FanucPath) -> TaughtPath:
    """A smooth path in joint space through random via points, sampled at even intervals.

    A cubic spline at rest at both ends; test samples lie evenly among the training samples.
    Raises ParameterError if it leaves the limits of a joint.
    """
    low, high = np.array(path.region).T
    generator = np.random.default_rng(path.seed)
    via = generator.uniform(low, high, (path.n_via_points, len(low)))
    n = path.n_training + path.n_test
    share = np.linspace(0.0, 1.0, n)
    spline = CubicSpline(np.linspace(0.0, 1.0, path.n_via_points), via, bc_type="clamped")
    joints = np.asarray(spline(share))
    outside = (joints < np.array(arm.minimum)) | (joints > np.array(arm.maximum))
    if outside.any():
        joint = int(np.argmax(outside.any(axis=0))) + 1
        raise ParameterError(f"fanuc.path: the path of seed {path.seed} leaves limits of J{joint}")
    passed = np.floor(np.arange(n + 1) * path.n_test / n + 0.5)
    return TaughtPath(share, joints, np.diff(passed) > 0)


def beside(pose: Pose, distances: list[float], seed: int) -> Pose:
    """Poses moved by each of `distances`, m, in a random direction; orientation kept.

    Returns (n * distances) poses, all of the first distance first; a pose keeps its direction.
    """
    generator = np.random.default_rng(seed)
    direction = generator.normal(size=pose.position.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    position = np.concatenate([pose.position + distance * direction for distance in distances])
    return Pose(position, np.tile(pose.rotation, (len(distances), 1, 1)))


def random_joints(arm: SerialArm, number: int, n: int, generator: np.random.Generator) -> Array:
    """Joints (n, 6) in rad, uniform over the limits, of arm configuration `number`, canonical.

    Raises ParameterError if the configuration hardly occurs within the limits.
    """
    found: list[Array] = []
    n_found = n_drawn = 0
    while n_found < n:
        if n_drawn >= _MAXIMUM_DRAWN:
            raise ParameterError(
                f"fanuc.joints: {n_found} of {n_drawn} random joints are in arm configuration "
                f"{number}, expected {n}"
            )
        joints = generator.uniform(arm.minimum, arm.maximum, (_DRAW, arm.n_joints))
        joints = joints[configuration(arm, joints) == number]
        found.append(joints)
        n_found, n_drawn = n_found + len(joints), n_drawn + _DRAW
    return canonical(arm, np.concatenate(found)[:n])


def all_configurations(
    arm: SerialArm, n: int, seed: int, role: int
) -> tuple[NDArray[np.int64], Array]:
    """Configuration number (8 n,) and joints (8 n, 6) in rad, `n` random ones of each.

    `role` tells sets of the same seed apart.
    """
    numbers = np.repeat(np.arange(N_CONFIGURATIONS), n)
    joints = [
        random_joints(arm, number, n, np.random.default_rng((seed, role, number)))
        for number in range(N_CONFIGURATIONS)
    ]
    return numbers, np.concatenate(joints)
