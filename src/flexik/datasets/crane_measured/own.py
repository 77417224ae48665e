"""A campaign of one's own as the table that a crane as built would give."""

import numpy as np
import pandas as pd

from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane_measured.campaign import LARGEST_ERROR, TARGET, read_campaign
from flexik.datasets.crane_measured.fields import MEASURED_FIELDS
from flexik.errors import DataError
from flexik.kinematics.crane import CraneGeometry, forward, smallest_extension

# a sensor may say a little beyond the ends of its cylinder, m
STROKE_TOLERANCE = 0.01


def own_campaign(file: str, geometry: CraneGeometry) -> pd.DataFrame:
    """Campaign in `file` with MEASURED_FIELDS, NaN and no text for what it leaves out.

    Raises DataError, naming the line, as `read_campaign` does, and if the rigid crane of `geometry`
    does not reach a target, a stroke is beyond its cylinder, or a tip was measured far from where
    its strokes put the rigid crane.
    """
    table = read_campaign(file)
    if "method" in table:
        missed = np.isnan(smallest_extension(geometry, table[TARGET].to_numpy()))
        if missed.any():
            line, x, y = table.loc[missed, ["line", *TARGET]].iloc[0]
            raise DataError(
                f"{file}, line {line:g}: the rigid crane does not reach the target ({x:g}, {y:g}) m"
            )
    if STROKES[0] in table:
        _check_strokes(file, table, geometry)
    unknown = {
        field.name: "" if field.dtype == "string" else np.nan
        for field in MEASURED_FIELDS
        if field.name not in table
    }
    return table.assign(**unknown)


def _check_strokes(file: str, table: pd.DataFrame, geometry: CraneGeometry) -> None:
    for name, longest in zip(STROKES, geometry.stroke_maximum, strict=True):
        beyond = ~table[name].between(-STROKE_TOLERANCE, longest + STROKE_TOLERANCE)
        if beyond.any():
            line, stroke = table.loc[beyond, ["line", name]].iloc[0]
            raise DataError(
                f"{file}, line {line:g}: {name} {stroke:g} m, expected 0 to {longest:g} m"
            )
    strokes = np.clip(table[list(STROKES)].to_numpy(), 0.0, geometry.stroke_maximum)
    away = np.linalg.norm(
        table[["measured_x", "measured_y"]].to_numpy() - forward(geometry, strokes), axis=1
    )
    if (away > LARGEST_ERROR).any():
        row = int(np.argmax(away > LARGEST_ERROR))
        raise DataError(
            f"{file}, line {table['line'].iloc[row]}: expected a point within {LARGEST_ERROR:g} m "
            f"of where these strokes put the rigid crane, got one {away[row]:.3g} m away"
        )
