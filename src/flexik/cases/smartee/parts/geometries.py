"""How the closure of the SmartEE is conditioned with dimensions that were not published."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.smartee.parts.poses import POSE_FIELDS, geometry_of, values
from flexik.cases.smartee.section import Geometry, Machine
from flexik.datasets.parts import Work, Writer, table, whole
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
    own = machine.model_dump(include={"base_radius", "plate_radius"}) | {"height": height}
    named = {ASSUMED: own} | {name: other.model_dump() for name, other in others.items()}
    return whole(compared, machine=machine, lengths=named, random=random)


def compared(
    machine: Machine, lengths: Mapping[str, Mapping[str, float]], random: Path
) -> dict[str, Writer]:
    """A row GEOMETRY_FIELDS for the assumed dimensions, and for each of the others."""
    poses, found = values(read_table(random), POSE_FIELDS), []
    for name, given in lengths.items():
        radii = {key: given[key] for key in ("base_radius", "plate_radius")}
        geometry = replace(geometry_of(machine), **radii)
        raised = poses[:, :3] + [0.0, 0.0, given["height"] - lengths[ASSUMED]["height"]]
        solved = inverse(geometry, raised, rotation_zyz(poses[:, 3:]))
        reached = solved.status == REACHED
        numbers = conditions(geometry, solved.joints[reached])
        spread = (np.median(numbers), numbers.max()) if len(numbers) else (np.nan, np.nan)
        found.append((name, *radii.values(), given["height"], reached.mean(), *spread))
    columns = zip(GEOMETRY_FIELDS, zip(*found, strict=True), strict=True)
    return {".parquet": table({f.name: np.array(v) for f, v in columns}, GEOMETRY_FIELDS)}


def conditions(geometry: SmartEEGeometry, joints: Array) -> Array:
    """Condition numbers (n,) of the closure equations' Jacobian by the elbows at `joints`."""
    circles = elbow_circles(geometry, joints[..., :2])
    tips = leg_tips(circles, joints[..., 2])
    return np.linalg.cond(closure_jacobian(tips, leg_tip_velocities(circles, joints[..., 2])))
