"""Correct the compensator by the measured campaign, and say which strokes it commands then.

Reads params.yaml: crane.measured.adaptation, crane.geometry, crane.structure, the compensating
method under crane.methods (and crane.measured, crane.grid, crane.selection, networks and trainers
to know which campaign and network belong to it); data/crane/calibration.json; its network;
data/crane/measured.parquet.
Writes to data/crane/identified/: offsets.parquet with the identified offsets of the nominal crane,
predictions.parquet with how well they predict each measured point from the other targets, and
commands.parquet with the strokes of the adapted compensator at all targets of the campaign. A
campaign without strokes identifies nothing, one without targets commands nothing: no rows.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane.provenance import campaign_checksum, identification_checksum
from flexik.datasets.crane_measured.campaign import TARGET
from flexik.datasets.crane_measured.fields import (
    COMMAND_FIELDS,
    MEASURED_FIELDS,
    OFFSET_FIELDS,
    PREDICTION_FIELDS,
)
from flexik.datasets.tables import Field, read_table, write_table
from flexik.evaluation.crane_measured.predictions import measurements, predictions
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method, trained_network
from flexik.positioning.crane_measured.adapted import (
    FACTORS,
    FEWEST,
    OFFSETS,
    AdaptationSettings,
    Adapted,
    Offsets,
    identify,
    prior,
)

FOLDER = Path("data/crane")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    made_with = campaign_checksum(crane, stiffness)
    campaign = read_table(FOLDER / "measured.parquet", MEASURED_FIELDS, made_with)
    adaptation = crane.measured.adaptation
    settings = AdaptationSettings(**adaptation.expected.model_dump())
    chosen = crane.methods[adaptation.method]
    network = trained_network(crane, chosen.network, stiffness, FOLDER / "networks")
    nominal = flexible_crane(crane, stiffness)
    offsets, found, points = None, pd.DataFrame(), pd.DataFrame()
    if campaign[STROKES[0]].notna().all() and len(campaign) >= FEWEST:
        points = predictions(nominal, network, campaign, settings)
        used = campaign[points["used"].to_numpy() == 1]
        used = used if len(used) >= FEWEST else campaign
        offsets = identify(nominal, network, measurements(used), settings)
        found = offset_table(offsets, settings)
    adapted = None
    if offsets is not None:
        adapted = Adapted(nominal, network, offsets, adaptation.n_corrections)
    commanded = commands(crane, stiffness, campaign, adapted)
    for name, fields, table in (
        ("offsets", OFFSET_FIELDS, found),
        ("predictions", PREDICTION_FIELDS, points),
        ("commands", COMMAND_FIELDS, commanded),
    ):
        write(name, fields, table, identification_checksum(crane, stiffness))
    if offsets is None:
        print("the campaign has no strokes, or too few rows: nothing is identified")
    else:
        used = f"{points['used'].sum()} of {len(points)} measurements are used"
        error = 1e3 * points["nominal_error"].mean()
        print(f"{used}; mean distance from the nominal crane {error:.1f} mm")


def offset_table(offsets: Offsets, settings: AdaptationSettings) -> pd.DataFrame:
    """Offsets before and after measuring."""
    expected, deviation = prior(settings)
    identified = offsets.values  # noqa: PD011 - no frame
    return pd.DataFrame(
        {
            "offset": OFFSETS,
            "unit": ["1" if name in FACTORS else "m" for name in OFFSETS],
            "expected": expected,
            "expected_deviation": deviation,
            "identified": [identified[name] for name in OFFSETS],
            "deviation": [offsets.deviations[name] for name in OFFSETS],
        }
    )


def commands(
    crane: parameters.Crane, stiffness: float, campaign: pd.DataFrame, adapted: Adapted | None
) -> pd.DataFrame:
    """Strokes at every target and payload of the campaign, without and with adaptation."""
    if adapted is None or campaign[TARGET].isna().any(axis=None):
        return pd.DataFrame()
    table = campaign[[*TARGET, "payload"]].drop_duplicates().sort_values([*TARGET, "payload"])
    targets, payload = table[TARGET].to_numpy(), table["payload"].to_numpy()
    geometry = adapted.crane.geometry
    initial = initial_positions(geometry, targets)
    label = crane.measured.adaptation.method
    methods = {
        "none": trained_method(crane, "none", geometry, stiffness, FOLDER / "networks"),
        "nominal": trained_method(crane, label, geometry, stiffness, FOLDER / "networks"),
        "adapted": adapted,
    }
    for name, method in methods.items():
        command = method(targets, payload, initial)
        columns = zip(STROKES, command.strokes.T, strict=True)
        table = table.assign(**{f"{name}_{stroke}": values for stroke, values in columns})
    return table.assign(status=command.status)


def write(name: str, fields: tuple[Field, ...], table: pd.DataFrame, made_with: str) -> None:
    """Write `table`, or no rows where it has none."""
    path = FOLDER / "identified" / f"{name}.parquet"
    empty = {"string": np.array([], dtype=str), "int64": np.array([], dtype=np.int64)}
    columns = {
        field.name: table[field.name].to_numpy()
        if len(table)
        else empty.get(field.dtype, np.array([]))
        for field in fields
    }
    write_table(path, columns, fields, made_with)


if __name__ == "__main__":
    stage.run(main)
