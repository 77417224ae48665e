"""Correct the compensator by the measured campaign, and say what it commands then."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from flexik.datasets.parts import Work, Writer, stacked, table, whole
from flexik.datasets.tables import Field, read_table
from flexik.learning.storage import load_network
from flexik.machines.deviations import Expected
from flexik.machines.planar import PlanarMachine
from flexik.planar.machine import flexible
from flexik.planar.measured.adapted import FEWEST, Adapted, Nominal, Offsets, identify
from flexik.planar.measured.fields import (
    OFFSETS,
    PREDICTIONS,
    TARGET,
    campaign_fields,
    command_fields,
    values_of,
)
from flexik.planar.measured.nominal import asked, compensating, uncompensated
from flexik.planar.measured.predictions import measurements, predictions
from flexik.positioning import combined
from flexik.positioning.method import Method


def prepare(
    *,
    machine: PlanarMachine,
    expected: Expected,
    n_corrections: int,
    method: combined.Settings,
    campaign: Path,
    network: Path,
    sections: object,
    constants: Path | None = None,
) -> Work:
    """Tables of identified offsets, of predictions and of commands.

    The offsets are those of the nominal machine, the predictions those of each measured point from
    the other targets; the commands are coordinates at all targets of the campaign. A campaign
    without coordinates identifies nothing, one without targets commands nothing: no rows.
    """
    return whole(
        identified,
        nominal=Nominal(flexible(machine, constants), load_network(network)[0], expected),
        campaign=read_table(campaign, campaign_fields(machine)),
        n_corrections=n_corrections,
        method=method,
    )


def identified(
    *,
    nominal: Nominal,
    campaign: pd.DataFrame,
    n_corrections: int,
    method: combined.Settings,
) -> Mapping[str, Writer]:
    """See `prepare`."""
    offsets, commanded, points = pd.DataFrame(), pd.DataFrame(), pd.DataFrame()
    machine = nominal.machine
    if campaign[values_of(machine)[0]].notna().all() and len(campaign) >= FEWEST:
        points = predictions(nominal, campaign)
        used = campaign[points["used"].to_numpy() == 1]
        used = used if len(used) >= FEWEST else campaign
        found = identify(nominal, measurements(nominal, used))
        offsets = offset_table(nominal, found)
        before = compensating(machine, method, nominal.network)
        adapted = Adapted(nominal, found, n_corrections)
        commanded = commands(machine, before, adapted, campaign)
        print(f"{points['used'].sum()} of {len(points)} measurements are used")
    else:
        print("the campaign has no coordinates, or too few rows: nothing is identified")
    return {
        ".parquet": _table(offsets, OFFSETS),
        ".predictions.parquet": _table(points, PREDICTIONS),
        ".commands.parquet": _table(commanded, command_fields(machine)),
    }


def offset_table(nominal: Nominal, offsets: Offsets) -> pd.DataFrame:
    """Offsets before and after measuring."""
    columns = ["offset", "unit", "expected", "expected_deviation"]
    found = pd.DataFrame(nominal.offsets).set_axis(columns, axis=1)
    return found.assign(identified=offsets.values, deviation=offsets.deviations)


def commands(
    machine: PlanarMachine, nominal: Method, adapted: Adapted, campaign: pd.DataFrame
) -> pd.DataFrame:
    """Coordinates at every target and payload of the campaign, without and with adaptation."""
    if campaign[TARGET].isna().any(axis=None):
        return pd.DataFrame()
    keys = [*TARGET, "payload"]
    table = campaign[keys].drop_duplicates().sort_values(keys)
    query = table.to_numpy()
    methods = {"none": uncompensated(machine), "nominal": nominal, "adapted": adapted}
    for name, method in methods.items():
        answer = asked(machine, method, query)
        table[[f"{name}_{column}" for column in values_of(machine)]] = answer.values
    return table.assign(status=answer.status)


def _table(frame: pd.DataFrame, fields: tuple[Field, ...]) -> Writer:
    """Writer of `frame`, or of no rows."""
    columns = [{str(name): frame[name].to_numpy() for name in frame}] if len(frame) else []
    return table(stacked(columns, fields), fields)
