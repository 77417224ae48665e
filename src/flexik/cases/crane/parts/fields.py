"""Columns of the crane's tables."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field

STROKE_FIELDS = tuple(
    Field(f"{name}_stroke", "m", f"stroke of the drive {name}")
    for name in ("lift", "jib", "extension")
)
STROKES = tuple(field.name for field in STROKE_FIELDS)


def on_line(
    table: pd.DataFrame, jib: float, extension: float, payload: float | None = None
) -> NDArray[np.bool_]:
    """Whether a row (n,) has these strokes, m, and this payload, kg, if any."""
    on = np.isclose(table["jib_stroke"], jib) & np.isclose(table["extension_stroke"], extension)
    return on if payload is None else on & np.isclose(table["payload"], payload)
