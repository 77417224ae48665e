"""How the closure of the SmartEE is conditioned with dimensions that were not published."""

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.smartee.parts.poses import POSE_FIELDS, geometry_of, values
from flexik.cases.smartee.section import Geometry, Machine
from flexik.datasets.parts import Work, rows
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.smartee import (
    SmartEEGeometry,
    closure_jacobian,
    elbow_circles,
    inverse,
    leg_tip_velocities,
    leg_tips,
    rotation_zyz,
)
from flexik.kinematics.status import REACHED

Array = NDArray[np.float64]

GEOMETRY_FIELDS = (
    Field("name", "1", "of the dimensions", "string"),
    Field("base_radius", "m", "circle of the leg bases"),
    Field("plate_radius", "m", "circle of the ball joints"),
    Field("height", "m", "of the centre of the box"),
    Field("reached_share", "1", "share of the random poses that the legs reach"),
    Field("median_condition", "1", "of the closure equations' Jacobian by the elbows, there"),
    Field("largest_condition", "1", "of the closure equations' Jacobian by the elbows, there"),
)
ASSUMED = "assumed here"


def prepare_geometries(
    *, machine: Machine, height: float, others: Mapping[str, Geometry], random: Path
) -> Work:
    """How the closure is conditioned with other dimensions, at the same poses about the height."""
    radii = machine.model_dump(include={"base_radius", "plate_radius"})
    named = {ASSUMED: Geometry(height=height, **radii), **others}
    poses = values(read_table(random), POSE_FIELDS)
    function = functools.partial(_conditioned, machine, poses, height)
    return Work(function, list(named.items()), rows(*GEOMETRY_FIELDS))


def _conditioned(
    machine: Machine, poses: Array, height: float, item: tuple[str, Geometry]
) -> dict[str, NDArray]:
    name, given = item
    radii = given.model_dump(exclude={"height"})
    geometry = geometry_of(machine.model_copy(update=radii))
    raised = poses[:, :3] + [0.0, 0.0, given.height - height]
    solved = inverse(geometry, raised, rotation_zyz(poses[:, 3:]))
    reached = solved.status == REACHED
    numbers = conditions(geometry, solved.joints[reached])
    spread = (np.median(numbers), numbers.max()) if len(numbers) else (np.nan, np.nan)
    row = (name, *radii.values(), given.height, reached.mean(), *spread)
    return {f.name: np.array([value]) for f, value in zip(GEOMETRY_FIELDS, row, strict=True)}


def conditions(geometry: SmartEEGeometry, joints: Array) -> Array:
    """Condition numbers (n,) of the closure equations' Jacobian by the elbows at `joints`."""
    circles = elbow_circles(geometry, joints[..., :2])
    tips = leg_tips(circles, joints[..., 2])
    return np.linalg.cond(closure_jacobian(tips, leg_tip_velocities(circles, joints[..., 2])))
