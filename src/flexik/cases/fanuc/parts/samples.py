"""The taught path, targets beside it, and random poses of every arm configuration."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from flexik.cases.fanuc.section import Path
from flexik.errors import ParameterError
from flexik.kinematics.serial_arm import Array, Pose, SerialArm
from flexik.kinematics.spherical_wrist import admissible, canonical, configuration
from flexik.positioning.interpolated import nearest_on

# Joints drawn at once, and at most, until an arm configuration has its poses
_DRAW, _MAXIMUM_DRAWN = 50_000, 20_000_000
# Directions tried for a target beside the path, and the share by which its distance from the path
# may fall short: the path is known by straight segments
_DIRECTIONS, SHORTER = 20, 0.01


class TaughtPath(NamedTuple):
    """Samples of a path: share of its duration (n,), joints (n, 6) in rad, whether to test (n,)."""

    share: Array
    joints: Array
    is_test: NDArray[np.bool_]


def taught_path(arm: SerialArm, path: Path) -> TaughtPath:
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
        raise ParameterError(f"the path of seed {path.seed} leaves limits of J{joint}")
    passed = np.floor(np.arange(n + 1) * path.n_test / n + 0.5)
    return TaughtPath(share, joints, np.diff(passed) > 0)


class Beside(NamedTuple):
    """Targets beside a path: pose, row (n,) of the sample moved, distance (n,) from the path, m."""

    pose: Pose
    row: NDArray[np.int64]
    distance: Array


def beside(path: Pose, rows: NDArray[np.int64], distances: list[float], seed: int) -> Beside:
    """Samples `rows` of `path` moved by each of `distances`, m, away from the path.

    In a random direction at right angles to the path; orientation kept. Of _DIRECTIONS tries the
    first is taken whose distance from all of the path is the length of the move (to SHORTER); a
    sample that has none at a distance is left out there.
    """
    generator = np.random.default_rng(seed)
    tangent = np.gradient(path.position, axis=0)[rows]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    direction = generator.normal(size=(len(rows), _DIRECTIONS, 3))
    direction -= np.sum(direction * tangent[:, None], axis=2, keepdims=True) * tangent[:, None]
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    moved, chosen, lengths = [], [], []
    for distance in distances:
        waiting, position = np.ones(len(rows), dtype=bool), path.position[rows]
        for k in range(_DIRECTIONS):
            some = np.flatnonzero(waiting)
            there = path.position[rows[some]] + distance * direction[some, k]
            apart = nearest_on(path.position, there).distance >= (1.0 - SHORTER) * distance
            position[some[apart]] = there[apart]
            waiting[some[apart]] = False
        moved.append(position[~waiting])
        chosen.append(rows[~waiting])
        lengths.append(np.full(len(chosen[-1]), distance))
    row = np.concatenate(chosen)
    return Beside(Pose(np.concatenate(moved), path.rotation[row]), row, np.concatenate(lengths))


def random_joints(arm: SerialArm, number: int, n: int, generator: np.random.Generator) -> Array:
    """Joints (n, 6) in rad, uniform over the limits, of arm configuration `number`.

    Canonical, but for joints that their limits keep off that turn. Raises ParameterError if the
    configuration hardly occurs within the limits.
    """
    found: list[Array] = []
    n_found = n_drawn = 0
    while n_found < n:
        if n_drawn >= _MAXIMUM_DRAWN:
            raise ParameterError(
                f"{n_found} of {n_drawn} random joints are in arm configuration "
                f"{number}, expected {n}"
            )
        joints = generator.uniform(arm.minimum, arm.maximum, (_DRAW, arm.n_joints))
        joints = joints[configuration(arm, joints) == number]
        found.append(joints)
        n_found, n_drawn = n_found + len(joints), n_drawn + _DRAW
    return admissible(arm, canonical(arm, np.concatenate(found)[:n]))
