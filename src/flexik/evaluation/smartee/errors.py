"""Errors of the direct kinematics of the SmartEE, and the poses they are looked at.

Source: De Luca, Mattone and Sciandrone, equations 5 to 7 and the orientation error after them.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.smartee.poses import geometry_of, in_box
from flexik.datasets.tables import Field
from flexik.learning.perceptron import Normalisation
from flexik.kinematics.smartee import (
    SmartEEGeometry,
    complete_direct,
    inverse,
    rotation_zyz,
)
from flexik.kinematics.smartee_newton import closed, solve_elbows, wrapped
from flexik.kinematics.status import REACHED
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
    Field("orientation_error", "rad", "norm of the arc cosines of z and x axes, as printed"),
    Field("angle_error", "rad", "norm of the angles between the z axes and the x axes"),
    Field("status", "1", "codes of kinematics.smartee_newton.STATUS_MEANING", "int64"),
    Field("residual", "1", "largest closure error over the squared side of the plate"),
)
NEWTON_FIELDS = (
    *ERROR_FIELDS[2:5],
    Field("status", "1", "codes of kinematics.smartee_newton.STATUS_MEANING", "int64"),
    Field("n_steps", "1", "Newton steps made", "int64"),
    Field("residual", "1", "largest closure error over the squared side of the plate"),
    Field("elbow_error", "rad", "norm of the error of the three elbows, equation 5"),
)
# Sets of poses that are made here
OUTSIDE, CORNERS = "outside", "corners"
ERRORS = ("elbow_error", "position_error", "orientation_error")


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
        "elbow_error": elbow_error(elbows, expected),
        "position_error": np.linalg.norm(position - poses[:, :3], axis=1),
        "orientation_error": np.hypot(printed_angle(angles[0], n, s), angles[1]),
        "angle_error": np.hypot(*angles),
    }


def elbow_error(elbows: Array, expected: Array) -> Array:
    """Norm (n,) of the differences of elbows (n, 3), rad; angles a turn apart are the same."""
    return np.linalg.norm(wrapped(elbows - expected), axis=1)


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
    geometry, actuated = geometry_of(smartee), joints[..., :2]
    found = errors(geometry, poses, actuated, joints[..., 2], elbows)
    columns = dict(zip(("method", "n_steps", "poses"), label, strict=True))
    columns["number"] = np.arange(len(poses))
    columns["extent"] = extent_of(smartee.workspace, poses)
    accepted = smartee.newton.accepted
    columns["status"], columns["residual"] = closed(geometry, actuated, elbows, accepted)
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
            "residual": found.residual,
            "elbow_error": elbow_error(found.elbows, joints[..., 2]),
        }
    )


def extent_of(workspace: parameters.SmartEEWorkspace, poses: Array) -> Array:
    """Largest coordinate (n,) of `poses` (n, 6), in half extents: inside the box at most 1."""
    zero, one = in_box(workspace, np.zeros((1, 6))), in_box(workspace, np.ones((1, 6)))
    return np.abs((poses - zero) / (one - zero)).max(axis=1)


def linear_error(inputs: Array, outputs: Array) -> float:
    """Mean squared error of the normalised `outputs` (n, q) by the best linear map of `inputs`.

    What a network comes to whose hidden units all stay in their linear part.
    """
    normalised = Normalisation.from_data(outputs).to_unit(outputs)
    matrix = np.column_stack(
        [Normalisation.from_data(inputs).to_unit(inputs), np.ones(len(inputs))]
    )
    weights = np.linalg.lstsq(matrix, normalised, rcond=None)[0]
    return float(np.mean((matrix @ weights - normalised) ** 2))


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
