"""Columns of the crane's tables, and what they say of its machine."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field

Array = NDArray[np.float64]

STROKES = ("lift_stroke", "jib_stroke", "extension_stroke")
INPUTS = (*STROKES, "payload")
KEPT, LEFT_OUT, FAILED = 0, 1, 2
SAMPLE_FIELDS = (
    Field("lift_stroke", "m", "stroke of the lift cylinder"),
    Field("jib_stroke", "m", "stroke of the jib cylinder"),
    Field("extension_stroke", "m", "stroke of the extension cylinder"),
    Field("payload", "kg", "point mass at the tip"),
    Field("rigid_x", "m", "tip of the rigid crane, forward of the slew axis"),
    Field("rigid_y", "m", "tip of the rigid crane, above ground"),
    Field("tip_x", "m", "tip in static equilibrium; NaN where not solved"),
    Field("tip_y", "m", "tip in static equilibrium; NaN where not solved"),
    Field("status", "1", "0 kept, 1 left out (rigid tip behind the limit), 2 failed", "int64"),
)
QUERY_FIELDS = (
    Field("target_x", "m", "target, forward of the slew axis"),
    Field("target_y", "m", "target, above ground"),
    Field("payload", "kg", "point mass at the tip"),
)
TARGET_FIELDS = (
    *QUERY_FIELDS,
    *(Field(name, "m", "puts the loaded tip on the target") for name in STROKES),
)


def kept(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of samples that were solved."""
    return table[table["status"] == KEPT].reset_index(drop=True)


def deflection(table: pd.DataFrame) -> Array:
    """Flexible minus rigid tip (n, 2) in m."""
    flexible, rigid = table[["tip_x", "tip_y"]], table[["rigid_x", "rigid_y"]]
    return flexible.to_numpy() - rigid.to_numpy()


def on_line(
    table: pd.DataFrame, jib: float, extension: float, payload: float | None = None
) -> NDArray[np.bool_]:
    """Whether a row (n,) has these strokes, m, and this payload, kg, if any."""
    on = np.isclose(table["jib_stroke"], jib) & np.isclose(table["extension_stroke"], extension)
    return on if payload is None else on & np.isclose(table["payload"], payload)
