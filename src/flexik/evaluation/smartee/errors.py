"""Errors of the direct kinematics of the SmartEE, and the poses they are looked at.

Source: De Luca, Mattone and Sciandrone, equations 5 to 7 and the orientation error after them.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.smartee.poses import geometry_of, in_box
from flexik.datasets.tables import Field
from flexik.mechanisms.smartee import (
    SmartEEGeometry,
    complete_direct,
    inverse,
    rotation_zyz,
)
from flexik.mechanisms.smartee_newton import solve_elbows
from flexik.mechanisms.status import REACHED
from flexik.positioning.smartee.direct import centre_elbows

Array = NDArray[np.float64]

ERROR_FIELDS = (
    Field("method", "1", "a network, centre or previous: where Newton starts", "string"),
    Field("n_steps", "1", "Newton steps from there", "int64"),
    Field("poses", "1", "name of the set of poses", "string"),
    Field("number", "1", "number of the pose in its set, from 0", "int64"),
    Field("extent", "1", "largest coordinate of the pose, in half extents of the box"),
    Field("elbow_error", "rad", "norm of the error of the three elbows, equation 5"),
    Field("position_error", "m", "distance of computed and true position, equation 7"),
    Field("orientation_error", "rad", "norm of the angles between the z axes and the x axes"),
)
NEWTON_FIELDS = (
    *ERROR_FIELDS[2:5],
    Field("status", "1", "codes of mechanisms.smartee_newton.STATUS_MEANING", "int64"),
    Field("n_steps", "1", "Newton steps made", "int64"),
    Field("elbow_error", "rad", "norm of the error of the three elbows, equation 5"),
)
OUTSIDE = "outside"
ERRORS = ("elbow_error", "position_error", "orientation_error")


def errors(
    geometry: SmartEEGeometry, poses: Array, actuated: Array, expected: Array, elbows: Array
) -> dict[str, Array]:
    """The three errors (n,) by name, of `elbows` (n, 3) where `expected` (n, 3) are right.

    Parameters
    ----------
    poses : (n, 6) in m and rad, x, y, z and ZYZ Euler angles
    actuated : (n, 3, 2) joints of the poses, rad
    """
    position, rotation = complete_direct(geometry, actuated, elbows)
    truth = rotation_zyz(poses[:, 3:])
    # of z (a) and x (n), as published
    angles = [angle(rotation[:, :, k], truth[:, :, k]) for k in (2, 0)]
    return {
        "elbow_error": np.linalg.norm(elbows - expected, axis=1),
        "position_error": np.linalg.norm(position - poses[:, :3], axis=1),
        "orientation_error": np.hypot(*angles),
    }


def angle(one: Array, other: Array) -> Array:
    """Angle (n,) between vectors (n, 3); the arc cosine would lose digits of a small one."""
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.arctan2(across, np.einsum("ni,ni->n", one, other))


def error_table(
    smartee: parameters.SmartEE,
    label: tuple[str, int, str],
    poses: Array,
    joints: Array,
    elbows: Array,
) -> pd.DataFrame:
    """Rows of ERROR_FIELDS: a method, by its `elbows` (n, 3), at `poses` (n, 6).

    Parameters
    ----------
    label : method, n_steps and poses of ERROR_FIELDS
    joints : (n, 3, 3) of the poses
    """
    found = errors(geometry_of(smartee), poses, joints[..., :2], joints[..., 2], elbows)
    columns = dict(zip(("method", "n_steps", "poses"), label, strict=True))
    columns["number"] = np.arange(len(poses))
    columns["extent"] = extent_of(smartee.workspace, poses)
    return pd.DataFrame({**columns, **found})


def newton_table(
    smartee: parameters.SmartEE, name: str, poses: Array, joints: Array
) -> pd.DataFrame:
    """Rows of NEWTON_FIELDS: Newton from the centre, until it converges, at `poses` (n, 6).

    Raises ParameterError when the centre of the workspace is not reached.
    """
    geometry, newton = geometry_of(smartee), smartee.newton
    start = centre_elbows(geometry, smartee.workspace)
    found = solve_elbows(geometry, joints[..., :2], start, newton.tolerance, newton.n_steps)
    return pd.DataFrame(
        {
            "poses": name,
            "number": np.arange(len(poses)),
            "extent": extent_of(smartee.workspace, poses),
            "status": found.status,
            "n_steps": found.n_steps,
            "elbow_error": np.linalg.norm(found.elbows - joints[..., 2], axis=1),
        }
    )


def extent_of(workspace: parameters.SmartEEWorkspace, poses: Array) -> Array:
    """Largest coordinate (n,) of `poses` (n, 6), in half extents: inside the box at most 1."""
    zero, one = in_box(workspace, np.zeros((1, 6))), in_box(workspace, np.ones((1, 6)))
    return np.abs((poses - zero) / (one - zero)).max(axis=1)


def outside_poses(
    smartee: parameters.SmartEE,
) -> tuple[Array, Array, int]:
    """Poses (n, 6) whose extent is uniform up to smartee.outside.extent, their joints (n, 3, 3).

    The third result counts poses that the legs do not reach; they are left out.
    """
    outside = smartee.outside
    generator = np.random.default_rng(outside.seed)
    shares = generator.uniform(-1.0, 1.0, (outside.n_poses, 6))
    extents = generator.uniform(0.0, outside.extent, (outside.n_poses, 1))
    shares *= extents / np.abs(shares).max(axis=1, keepdims=True)
    poses = in_box(smartee.workspace, shares)
    found = inverse(geometry_of(smartee), poses[:, :3], rotation_zyz(poses[:, 3:]))
    kept = found.status == REACHED
    return poses[kept], found.joints[kept], int((~kept).sum())
