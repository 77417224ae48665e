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
from flexik.datasets.crane_measured.fields import MEASURED_FIELDS
from flexik.datasets.crane_measured.own import own_campaign
from flexik.datasets.tables import write_table
from flexik.evaluation.conditions import all_conditions
from flexik.kinematics.crane import CraneGeometry
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method

FOLDER = Path("data/crane")


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
    table = pd.concat(tables)
    return table.assign(line=np.arange(1, len(table) + 1))


if __name__ == "__main__":
    stage.run(main)
