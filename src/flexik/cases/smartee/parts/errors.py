"""Errors of the direct kinematics of the SmartEE.

Source: De Luca, Mattone and Sciandrone, equations 5 to 7 and the orientation error after them.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.smartee.parts.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    POSE_FIELDS,
    actuated_of,
    values,
)
from flexik.datasets.tables import Field
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import Judge
from flexik.kinematics.smartee import SmartEEGeometry, complete_direct, rotation_zyz
from flexik.kinematics.smartee_newton import wrapped
from flexik.positioning.method import Columns

Array = NDArray[np.float64]

COLUMNS = Columns(
    query=ACTUATED_FIELDS,
    answer=ELBOW_FIELDS,
    errors=(
        Field("error", "rad", "norm of the error of the three elbows, equation 5"),
        Field("position_error", "m", "distance of computed and true position, equation 7"),
        Field("orientation_error", "rad", "norm of the arc cosines of z and x axes, as printed"),
        Field("angle_error", "rad", "norm of the angles between the z axes and the x axes"),
    ),
    lower=(-np.pi,) * 3,
    upper=(0.0,) * 3,
    diagnostic_unit="1",
)


def conditions_of(rows: pd.DataFrame, centre: Array) -> Conditions:
    """What a method is asked about the poses of `rows`, from the elbows (3,) at the centre."""
    query = values(rows, ACTUATED_FIELDS)
    return Conditions(query, np.tile(centre, (len(rows), 1)), rows["pose"].to_numpy())


def judge_of(geometry: SmartEEGeometry, rows: pd.DataFrame) -> Judge:
    """Judge, see evaluation.errors, of elbows for all the poses of `rows`."""
    poses, expected = values(rows, POSE_FIELDS), values(rows, ELBOW_FIELDS)

    def judge(query: Array, values: Array) -> dict[str, Array]:
        return errors(geometry, poses, actuated_of(query), expected, values)

    return judge


def errors(
    geometry: SmartEEGeometry, poses: Array, actuated: Array, expected: Array, elbows: Array
) -> dict[str, Array]:
    """The errors (n,) by name, of `elbows` (n, 3) where `expected` (n, 3) are right.

    orientation_error is the printed one: a is n x s of equation 6, which is shorter than 1 where
    elbows that are off leave n and s not quite orthogonal, so the arc cosine counts that as well.
    angle_error takes the unit vector along a.

    Parameters
    ----------
    poses : (n, 6) in m and rad, x, y, z and ZYZ Euler angles
    actuated : (n, 3, 2) joints of the poses, rad
    """
    position, rotation = complete_direct(geometry, actuated, elbows)
    truth = rotation_zyz(poses[:, 3:])
    # of z (a) and x (n)
    angles = [angle(rotation[:, :, k], truth[:, :, k]) for k in (2, 0)]
    n, s = rotation[:, :, 0], rotation[:, :, 1]
    return {
        # angles a turn apart are the same
        "error": np.linalg.norm(wrapped(elbows - expected), axis=1),
        "position_error": np.linalg.norm(position - poses[:, :3], axis=1),
        "orientation_error": np.hypot(printed_angle(angles[0], n, s), angles[1]),
        "angle_error": np.hypot(*angles),
    }


def printed_angle(between: Array, n: Array, s: Array) -> Array:
    """arccos(a . (n x s)) (n,), n x s as long as it is, of the angle `between` a and n x s.

    Written with sines of halves: the arc cosine itself would lose digits of a small one.
    """
    product = np.einsum("ni,ni->n", n, s)
    length = np.sqrt(np.maximum(1.0 - product**2, 0.0))
    # 1 - length cos(between) = (1 - length) + 2 length sin(between / 2)^2
    lacking = product**2 / (1.0 + length) + 2.0 * length * np.sin(0.5 * between) ** 2
    return 2.0 * np.arcsin(np.sqrt(np.minimum(0.5 * lacking, 1.0)))


def angle(one: Array, other: Array) -> Array:
    """Angle (n,) between vectors (n, 3); the arc cosine would lose digits of a small one."""
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.arctan2(across, np.einsum("ni,ni->n", one, other))
