"""Columns of the tables of a planar machine, by its drives."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field
from flexik.machines.planar import PlanarMachine

Array = NDArray[np.float64]
Fields = tuple[Field, ...]

KEPT, LEFT_OUT, FAILED = 0, 1, 2
PAYLOAD = Field("payload", "kg", "point mass at the tip")
RIGID = (
    Field("rigid_x", "m", "tip of the rigid machine, forward"),
    Field("rigid_y", "m", "tip of the rigid machine, up"),
)
TIP = (
    Field("tip_x", "m", "tip in static equilibrium; NaN where not solved"),
    Field("tip_y", "m", "tip in static equilibrium; NaN where not solved"),
)
STATUS = Field("status", "1", "0 kept, 1 left out (rigid tip behind the limit), 2 failed", "int64")
QUERY = (
    Field("target_x", "m", "target, forward"),
    Field("target_y", "m", "target, up"),
    PAYLOAD,
)


def coordinates(machine: PlanarMachine) -> Fields:
    """Strokes and angles, in the order of the drives."""
    return tuple(
        Field(f"{name}_angle", "rad", f"angle of the drive {name}")
        if drive.kind == "revolute"
        else Field(f"{name}_stroke", "m", f"stroke of the drive {name}")
        for name, drive in machine.drives.items()
    )


def inputs(machine: PlanarMachine) -> list[str]:
    """Names of coordinates and payload."""
    return [*(field.name for field in coordinates(machine)), PAYLOAD.name]


def sample_fields(machine: PlanarMachine) -> Fields:
    """Coordinates, payload, rigid and flexible tip, status."""
    return (*coordinates(machine), PAYLOAD, *RIGID, *TIP, STATUS)


def target_fields(machine: PlanarMachine) -> Fields:
    """A query, and coordinates that put the loaded tip on the target."""
    return (*QUERY, *coordinates(machine))


def kept(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of samples that were solved."""
    return table[table["status"] == KEPT].reset_index(drop=True)


def deflection(table: pd.DataFrame) -> Array:
    """Flexible minus rigid tip (n, 2) in m."""
    flexible, rigid = table[["tip_x", "tip_y"]], table[["rigid_x", "rigid_y"]]
    return flexible.to_numpy() - rigid.to_numpy()
