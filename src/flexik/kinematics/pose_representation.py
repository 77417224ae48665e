"""Poses and joints of an arm with a spherical wrist as numbers that a network can learn.

No angle among them: an angle jumps where it wraps, and joints 1, 4 and 6 have none where the arm is
singular. What is learnt instead is continuous over all of one arm configuration.
"""

import numpy as np
from numpy.typing import NDArray

from flexik.kinematics.serial_arm import Array, Pose, SerialArm, frames
from flexik.kinematics.spherical_wrist import SHOULDER, WRIST, configuration, wrapped

# Name and unit of each column
INPUTS = (
    *((name, "m") for name in ("x", "y", "z")),
    *((f"r{row}{column}", "1") for row in (1, 2, 3) for column in (1, 2, 3)),
)
OUTPUTS = (
    *(("wrist_x", "m"), ("wrist_y", "m"), ("joint_2", "rad"), ("joint_3", "rad")),
    *(("sin5_cos4", "1"), ("sin5_sin4", "1"), ("cos5", "1")),
    *(("sin5_cos6", "1"), ("sin5_sin6", "1")),
)


def pose_inputs(pose: Pose) -> Array:
    """Columns INPUTS (n, 12) of n poses: position, and all nine elements of the rotation matrix.

    The matrix is continuous everywhere, which no three angles and no quaternion are (Zhou et al.
    2019).
    """
    return np.hstack([pose.position, pose.rotation.reshape(-1, 9)])


def queries(pose: Pose, number: NDArray[np.int64]) -> Array:
    """Rows (n, 13) that methods are asked: columns INPUTS, and the arm configuration `number`."""
    return np.column_stack([pose_inputs(pose), number.astype(np.float64)])


def asked(query: Array) -> tuple[Pose, NDArray[np.int64]]:
    """Poses, and numbers (n,) of arm configurations, of rows of `queries`."""
    return Pose(query[:, :3], query[:, 3:12].reshape(-1, 3, 3)), query[:, 12].astype(np.int64)


def joint_outputs(arm: SerialArm, joints: Array) -> Array:
    """Columns OUTPUTS (n, 9) of canonical `joints` (n, 6) in rad.

    Direction 1 is that of the horizontal wrist centre, times its distance from axis 1, and
    directions 4 and 6 are times |sin(joint 5)|: all three shrink to nothing where the joint is
    free.
    """
    theta = joints + np.array(arm.offset)
    back = (configuration(arm, joints) & SHOULDER) > 0
    centre = frames(arm, joints).origin[:, 4]
    sine = np.abs(np.sin(theta[:, 4]))
    return np.column_stack(
        [
            np.where(back[:, None], -centre[:, :2], centre[:, :2]),
            joints[:, 1:3],
            sine * np.cos(theta[:, 3]),
            sine * np.sin(theta[:, 3]),
            np.cos(theta[:, 4]),
            sine * np.cos(theta[:, 5]),
            sine * np.sin(theta[:, 5]),
        ]
    )


def joints_of(arm: SerialArm, outputs: Array, number: NDArray[np.int64] | int) -> Array:
    """Joints (n, 6) in rad of the columns OUTPUTS (n, 9), for arm configuration `number` (n,).

    Joints 1, 4 and 6 are on the turn around 0; limits are not applied.
    """
    side = np.where(np.asarray(number) & WRIST, -1.0, 1.0)
    x, y, joint_2, joint_3, x4, y4, cosine, x6, y6 = np.asarray(outputs).T
    theta_1, theta_4, theta_6 = np.arctan2(y, x), np.arctan2(y4, x4), np.arctan2(y6, x6)
    theta_5 = side * np.arctan2(np.hypot(x4, y4), cosine)
    offset = arm.offset
    return np.column_stack(
        [
            wrapped(theta_1 - offset[0]),
            joint_2,
            joint_3,
            wrapped(theta_4 - offset[3]),
            theta_5 - offset[4],
            wrapped(theta_6 - offset[5]),
        ]
    )
