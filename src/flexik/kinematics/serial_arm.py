"""Kinematics of a serial arm of revolute joints, vectorised over poses.

Standard Denavit-Hartenberg convention: link i is a turn by theta_i = joint_i + offset_i about z, a
shift by d_i along z and by a_i along x, and a turn by alpha_i about x.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SerialArm:
    """Denavit-Hartenberg table and joint limits; a number for each of the n_joints joints.

    offset, alpha : rad; d, a : m
    minimum, maximum : least and largest joint angle, rad
    """

    offset: tuple[float, ...]
    d: tuple[float, ...]
    a: tuple[float, ...]
    alpha: tuple[float, ...]
    minimum: tuple[float, ...]
    maximum: tuple[float, ...]

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.d)


class Pose(NamedTuple):
    """Where the end effector is: position (n, 3) in m, rotation matrix (n, 3, 3)."""

    position: Array
    rotation: Array

    def rows(self, choice: NDArray[np.int64] | NDArray[np.bool_] | slice) -> "Pose":
        """Some of the poses."""
        return Pose(self.position[choice], self.rotation[choice])


class Frames(NamedTuple):
    """Base frame and the frame behind each joint: origins (n, n_joints + 1, 3) in m, rotations."""

    origin: Array
    rotation: Array

    @property
    def end(self) -> Pose:
        """Pose of the end effector, the last frame."""
        return Pose(self.origin[:, -1], self.rotation[:, -1])


def frames(arm: SerialArm, joints: Array) -> Frames:
    """Frames of all links at `joints` (n, n_joints) in rad, in the base frame."""
    joints = np.atleast_2d(np.asarray(joints, dtype=float))
    n = len(joints)
    origin = np.zeros((n, arm.n_joints + 1, 3))
    rotation = np.zeros((n, arm.n_joints + 1, 3, 3))
    rotation[:, 0] = np.eye(3)
    for i in range(arm.n_joints):
        theta = joints[:, i] + arm.offset[i]
        before = rotation[:, i]
        c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
        ca, sa = np.cos(arm.alpha[i]), np.sin(arm.alpha[i])
        # columns of before @ Rz(theta) @ Rx(alpha)
        x = c * before[:, :, 0] + s * before[:, :, 1]
        across = c * before[:, :, 1] - s * before[:, :, 0]
        z = before[:, :, 2]
        rotation[:, i + 1] = np.stack([x, ca * across + sa * z, ca * z - sa * across], axis=-1)
        origin[:, i + 1] = origin[:, i] + arm.d[i] * z + arm.a[i] * x
    return Frames(origin, rotation)


def forward(arm: SerialArm, joints: Array) -> Pose:
    """Pose of the end effector at `joints` (n, n_joints) in rad."""
    return frames(arm, joints).end


def jacobian(arm: SerialArm, joints: Array) -> Array:
    """Geometric Jacobian (n, 6, n_joints) at `joints` (n, n_joints) in rad.

    Rows: velocity of the end effector in m/rad, then its angular velocity in rad/rad; base frame.
    """
    return _jacobian(frames(arm, joints))


def smallest_singular_value(arm: SerialArm, joints: Array, orientation_length: float) -> Array:
    """Smallest singular value (n,) in m of the Jacobian at `joints` (n, n_joints) in rad.

    Orientation rows count `orientation_length`, m, a radian. 0 where the arm is singular.
    """
    scaled = jacobian(arm, joints)
    scaled[:, 3:] *= orientation_length
    return np.asarray(np.linalg.svd(scaled, compute_uv=False)[:, -1], dtype=np.float64)


def _jacobian(found: Frames) -> Array:
    axes = found.rotation[:, :-1, :, 2]
    arms = found.origin[:, -1:] - found.origin[:, :-1]
    return np.concatenate([np.cross(axes, arms), axes], axis=2).swapaxes(1, 2)


def rotation_vector(rotation: Array) -> Array:
    """Axis times angle (n, 3) in rad, angle at most pi, of rotation matrices (n, 3, 3).

    By way of the quaternion, whose largest component is found first (Shepperd 1978): exact for
    the smallest angles and for half a turn.
    """
    r = rotation
    x, y, z = (r[:, k, k] for k in range(3))
    products = np.empty((len(r), 4, 4))  # 4 q q^T, q = (cos, sin times axis) of half the angle
    for k, square in enumerate((1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z)):
        products[:, k, k] = square
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[:, 0, 1 + i] = products[:, 1 + i, 0] = r[:, k, j] - r[:, j, k]
        products[:, 1 + i, 1 + j] = products[:, 1 + j, 1 + i] = r[:, i, j] + r[:, j, i]
    largest = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    quaternion = products[np.arange(len(r)), largest]
    quaternion = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    quaternion = np.where(quaternion[:, :1] < 0.0, -quaternion, quaternion)
    sine = np.linalg.norm(quaternion[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(sine, quaternion[:, 0])
    # angle / sine tends to 2
    factor = np.divide(angle, sine, out=np.full_like(angle, 2.0), where=sine > 0.0)
    return factor[:, None] * quaternion[:, 1:]


def pose_difference(target: Pose, achieved: Pose) -> tuple[Array, Array]:
    """Target minus achieved: position (n, 3) in m, rotation vector (n, 3) in rad, base frame."""
    turn = target.rotation @ achieved.rotation.swapaxes(1, 2)
    return target.position - achieved.position, rotation_vector(turn)


def pose_errors(target: Pose, achieved: Pose) -> tuple[Array, Array]:
    """Distance (n,) in m and angle (n,) in rad between two poses."""
    shift, turn = pose_difference(target, achieved)
    return np.linalg.norm(shift, axis=1), np.linalg.norm(turn, axis=1)


def refine(
    arm: SerialArm,
    target: Pose,
    joints: Array,
    n_steps: int,
    damping: float,
    orientation_length: float,
) -> Array:
    """Joints (n, n_joints) in rad after damped Newton steps from `joints` towards `target`.

    A step solves (J^T J + (damping + |e|^2 / 2) I) step = J^T e (Sugihara 2011): far from the
    target and near a singular pose it stays short, close to the target it is Newton's. Steps end
    at the joint limits.

    Parameters
    ----------
    n_steps : Newton steps, 0 returns the joints within their limits
    damping : least damping, m2
    orientation_length : m an error of a radian counts for
    """
    low, high = np.array(arm.minimum), np.array(arm.maximum)
    joints = np.clip(joints, low, high)
    identity = np.eye(arm.n_joints)
    for _ in range(n_steps):
        found = frames(arm, joints)
        shift, turn = pose_difference(target, found.end)
        error = np.concatenate([shift, orientation_length * turn], axis=1)
        derivative = _jacobian(found)
        derivative[:, 3:] *= orientation_length
        transposed = derivative.swapaxes(1, 2)
        damped = damping + 0.5 * np.sum(error**2, axis=1)
        system = transposed @ derivative + damped[:, None, None] * identity
        step = np.linalg.solve(system, transposed @ error[:, :, None])[:, :, 0]
        joints = np.clip(joints + step, low, high)
    return joints
