"""Measure a crane under no compensation and under compensation, as in chapter 4.6 of the thesis.

Reads params.yaml: crane.measured, crane.geometry, crane.structure, the compensating method under
crane.methods (and crane.grid, crane.selection, networks and trainers to know which network belongs
to it); data/crane/calibration.json; its network; the file of crane.measured.
Writes data/crane/measured.parquet, a row for every method, point and payload.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane.provenance import measured_checksum, network_checksum
from flexik.datasets.crane_measured.campaign import read_campaign
from flexik.datasets.crane_measured.fields import MEASURED_FIELDS
from flexik.datasets.tables import write_table
from flexik.errors import DataError
from flexik.evaluation.conditions import all_conditions
from flexik.learning.storage import load_network
from flexik.mechanisms.crane import CraneGeometry, inverse_with_smallest_extension
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.crane.assembly import crane_method, uncompensated
from flexik.positioning.crane.initial import initial_positions

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
        measured_checksum(crane, stiffness),
    )
    print(f"{len(table)} measurements, {crane.measured.source.replace('_', ' ')}")


def own_campaign(file: str, geometry: CraneGeometry) -> pd.DataFrame:
    """Campaign in `file`; strokes that it leaves out are those of the rigid crane.

    Raises DataError if it lacks the targets or a stroke is beyond its cylinder.
    """
    table = read_campaign(file)
    if missing := [name for name in ("method", "target_x", "target_y") if name not in table]:
        raise DataError(f"{file}: the tables of errors need {', '.join(missing)} too")
    if STROKES[0] not in table:
        targets = table[["target_x", "target_y"]].to_numpy()
        solution = inverse_with_smallest_extension(geometry, targets)
        if not solution.reached.all():
            x, y = targets[~solution.reached][0]
            raise DataError(f"{file}: the rigid crane does not reach the target ({x:g}, {y:g}) m")
        table = table.assign(**dict(zip(STROKES, solution.strokes.T, strict=True)))
    for name, longest in zip(STROKES, geometry.stroke_maximum, strict=True):
        beyond = ~table[name].between(-STROKE_TOLERANCE, longest + STROKE_TOLERANCE)
        if beyond.any():
            raise DataError(
                f"{file}: {name} {table.loc[beyond, name].iloc[0]:g} m, expected 0 to {longest:g} m"
            )
    return table


def as_built(crane: parameters.Crane, stiffness: float) -> pd.DataFrame:
    """Campaign on the crane as built."""
    measured = crane.measured
    nominal = flexible_crane(crane, stiffness)
    twin = draw_twin(nominal, Magnitudes(**measured.deviations.model_dump()), measured.seed)
    generator = np.random.default_rng((measured.seed, 1))
    chosen = crane.methods[measured.method]
    network, _ = load_network(
        FOLDER / "networks" / f"{chosen.network}.json",
        network_checksum(crane, stiffness, chosen.network),
    )
    methods = {
        "none": uncompensated(nominal.geometry),
        "combined": crane_method(chosen, nominal.geometry, network),
    }
    conditions = all_conditions(measured.points, measured.payloads)
    initial = initial_positions(nominal.geometry, conditions.targets)
    tables = []
    for name, method in methods.items():
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
