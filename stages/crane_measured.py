"""Measure a crane under no compensation and under compensation, as in chapter 4.6 of the thesis.

Reads params.yaml: crane.measured.source, crane.measured.file, crane.measured.method,
crane.measured.points, crane.measured.payloads, crane.measured.noise, crane.measured.deviations,
crane.measured.seed, crane.geometry, crane.structure, the compensating method under crane.methods
(and crane.grid, crane.selection, networks and trainers to know which network belongs to it);
data/crane/calibration.json; its network; the file of crane.measured.
Writes data/crane/measured.parquet, a row for every measurement. What a campaign in a file does not
have, targets and methods or strokes, is NaN and no text.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane.provenance import campaign_checksum
from flexik.datasets.crane_measured.campaign import read_campaign
from flexik.datasets.crane_measured.fields import MEASURED_FIELDS
from flexik.datasets.tables import write_table
from flexik.errors import DataError
from flexik.evaluation.conditions import all_conditions
from flexik.mechanisms.crane import CraneGeometry, smallest_extension
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method

FOLDER = Path("data/crane")
# a sensor may say a little beyond the ends of its cylinder, m
STROKE_TOLERANCE = 0.01


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    if crane.measured.source == "file":
        geometry = CraneGeometry(**crane.geometry.model_dump())
        table = own_campaign(crane.measured.file, geometry)
    else:
        table = as_built(crane, stiffness)
    write_table(
        FOLDER / "measured.parquet",
        {field.name: table[field.name].to_numpy() for field in MEASURED_FIELDS},
        MEASURED_FIELDS,
        campaign_checksum(crane, stiffness),
    )
    print(f"{len(table)} measurements, {crane.measured.source.replace('_', ' ')}")


def own_campaign(file: str, geometry: CraneGeometry) -> pd.DataFrame:
    """Campaign in `file`, with NaN and no text for what it leaves out.

    Raises DataError if a target is not reached or a stroke is beyond its cylinder.
    """
    table = read_campaign(file)
    if "method" in table:
        targets = table[["target_x", "target_y"]].to_numpy()
        missed = np.isnan(smallest_extension(geometry, targets))
        if missed.any():
            x, y = targets[missed][0]
            raise DataError(f"{file}: the rigid crane does not reach the target ({x:g}, {y:g}) m")
    if STROKES[0] in table:
        for name, longest in zip(STROKES, geometry.stroke_maximum, strict=True):
            beyond = ~table[name].between(-STROKE_TOLERANCE, longest + STROKE_TOLERANCE)
            if beyond.any():
                raise DataError(
                    f"{file}: {name} {table.loc[beyond, name].iloc[0]:g} m, "
                    f"expected 0 to {longest:g} m"
                )
    unknown = {
        field.name: "" if field.dtype == "string" else np.nan
        for field in MEASURED_FIELDS
        if field.name not in table
    }
    return table.assign(**unknown)


def as_built(crane: parameters.Crane, stiffness: float) -> pd.DataFrame:
    """Campaign on the crane as built."""
    measured = crane.measured
    nominal = flexible_crane(crane, stiffness)
    twin = draw_twin(nominal, Magnitudes(**measured.deviations.model_dump()), measured.seed)
    generator = np.random.default_rng((measured.seed, 1))
    conditions = all_conditions(measured.points, measured.payloads)
    initial = initial_positions(nominal.geometry, conditions.targets)
    tables = []
    for name, label in (("none", "none"), ("combined", measured.method)):
        method = trained_method(crane, label, nominal.geometry, stiffness, FOLDER / "networks")
        strokes = method(conditions.targets, conditions.payload, initial).strokes
        tip = as_built_tips(twin, strokes, conditions.payload, generator)
        tip = tip + measured.noise * generator.standard_normal(tip.shape)
        columns = {
            "method": name,
            "target_x": conditions.targets[:, 0],
            "target_y": conditions.targets[:, 1],
            "payload": conditions.payload,
            **dict(zip(STROKES, strokes.T, strict=True)),
            "measured_x": tip[:, 0],
            "measured_y": tip[:, 1],
        }
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables)


if __name__ == "__main__":
    stage.run(main)
