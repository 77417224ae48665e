"""Correct the compensator by the measured campaign, and say which strokes it commands then."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from flexik.cases.crane.measured_section import Expected
from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.parts.measured.adapted import (
    FACTORS,
    FEWEST,
    OFFSETS,
    Adapted,
    Offsets,
    identify,
    prior,
)
from flexik.cases.crane.parts.measured.fields import (
    CAMPAIGN,
    COMMANDS,
    PREDICTIONS,
    STROKES,
    TARGET,
)
from flexik.cases.crane.parts.measured.fields import OFFSETS as OFFSET_FIELDS
from flexik.cases.crane.parts.measured.nominal import (
    compensating,
    read_network,
    uncompensated,
)
from flexik.cases.crane.parts.measured.predictions import measurements, predictions
from flexik.datasets.parts import Work, Writer, stacked, table, whole
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.machines.planar import PlanarMachine
from flexik.positioning import combined
from flexik.positioning.method import Method, Network


def prepare(
    *,
    machine: PlanarMachine,
    expected: Expected,
    n_corrections: int,
    method: combined.Settings,
    campaign: Path,
    network: Path,
    constants: Path,
    sections: object,
) -> Work:
    """Tables of identified offsets, of predictions and of commands.

    The offsets are those of the nominal crane, the predictions those of each measured point from
    the other targets; the commands are strokes at all targets of the campaign. A campaign without
    strokes identifies nothing, one without targets commands nothing: no rows.
    """
    return whole(
        identified,
        crane=flexible(machine, constants),
        network=read_network(network),
        campaign=read_table(campaign, CAMPAIGN),
        expected=expected,
        n_corrections=n_corrections,
        method=method,
    )


def identified(
    *,
    crane: FlexibleCrane,
    network: Network,
    campaign: pd.DataFrame,
    expected: Expected,
    n_corrections: int,
    method: combined.Settings,
) -> Mapping[str, Writer]:
    """See `prepare`."""
    offsets, commanded, points = pd.DataFrame(), pd.DataFrame(), pd.DataFrame()
    if campaign[STROKES[0]].notna().all() and len(campaign) >= FEWEST:
        points = predictions(crane, network, campaign, expected)
        used = campaign[points["used"].to_numpy() == 1]
        used = used if len(used) >= FEWEST else campaign
        found = identify(crane, network, measurements(used), expected)
        offsets = offset_table(found, expected)
        adapted = Adapted(crane, network, found, n_corrections)
        commanded = commands(crane, compensating(crane, method, network), adapted, campaign)
        print(f"{points['used'].sum()} of {len(points)} measurements are used")
    else:
        print("the campaign has no strokes, or too few rows: nothing is identified")
    return {
        ".parquet": _table(offsets, OFFSET_FIELDS),
        ".predictions.parquet": _table(points, PREDICTIONS),
        ".commands.parquet": _table(commanded, COMMANDS),
    }


def offset_table(offsets: Offsets, settings: Expected) -> pd.DataFrame:
    """Offsets before and after measuring."""
    expected, deviation = prior(settings)
    return pd.DataFrame(
        {
            "offset": OFFSETS,
            "unit": ["1" if name in FACTORS else "m" for name in OFFSETS],
            "expected": expected,
            "expected_deviation": deviation,
            "identified": offsets.values,
            "deviation": offsets.deviations,
        }
    )


def commands(
    crane: FlexibleCrane, nominal: Method, adapted: Adapted, campaign: pd.DataFrame
) -> pd.DataFrame:
    """Strokes at every target and payload of the campaign, without and with adaptation."""
    if campaign[TARGET].isna().any(axis=None):
        return pd.DataFrame()
    keys = [*TARGET, "payload"]
    table = campaign[keys].drop_duplicates().sort_values(keys)
    query = table.to_numpy()
    current = CraneManipulator(crane.geometry).initial_positions(query[:, :2])
    methods = {"none": uncompensated(crane), "nominal": nominal, "adapted": adapted}
    for name, method in methods.items():
        answer = method(query, current)
        table[[f"{name}_{stroke}" for stroke in STROKES]] = answer.values
    return table.assign(status=answer.status)


def _table(frame: pd.DataFrame, fields: tuple[Field, ...]) -> Writer:
    """Writer of `frame`, or of no rows."""
    columns = [{str(name): frame[name].to_numpy() for name in frame}] if len(frame) else []
    return table(stacked(columns, fields), fields)
