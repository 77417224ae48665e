"""The campaign: a machine is measured without and with compensation (thesis, chapter 4.6).

A machine as built is measured, or the campaign of a CSV file is taken. What a campaign in a file
does not have, targets and methods or coordinates, is NaN and no text.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flexik.datasets.parts import Work, Writer, table, whole
from flexik.learning.storage import load_network
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.planar.machine import flexible
from flexik.planar.measured.campaign_file import own_campaign
from flexik.planar.measured.fields import campaign_fields
from flexik.planar.measured.nominal import approaches
from flexik.planar.measured.section import Campaign
from flexik.planar.measured.twins import measured_tips, twin_and_generator
from flexik.positioning import combined
from flexik.positioning.method import Array


def prepare_own(*, machine: PlanarMachine, file: Path) -> Work:
    """The campaign of `file`."""
    found = own_campaign(file, machine)
    columns = {field.name: found[field.name].to_numpy() for field in campaign_fields(machine)}
    return whole(written, machine=machine, columns=columns)


def prepare(
    *,
    machine: PlanarMachine,
    campaign: Campaign,
    method: combined.Settings,
    network: Path,
    sections: object,
    constants: Path | None = None,
) -> Work:
    """The campaign on a machine as built; `machine` names `sections`, the tables of its beams."""
    strokes, query = approaches(machine, method, load_network(network)[0], campaign)
    nominal = flexible(machine, constants)
    return whole(measure, nominal=nominal, campaign=campaign, strokes=strokes, query=query)


def measure(
    *, nominal: FlexibleMachine, campaign: Campaign, strokes: Mapping[str, Array], query: Array
) -> Mapping[str, Writer]:
    """The table of the campaign on a machine as built."""
    twin, generator = twin_and_generator(nominal, campaign.deviations, campaign.seed)
    tips = measured_tips(twin, strokes, query[:, 2], campaign.noise, generator)
    n = len(query)
    numbers = np.vstack([np.hstack([query, strokes[name], tips[name]]) for name in strokes])
    names = (field.name for field in campaign_fields(nominal.machine)[2:])
    columns = {
        "line": np.arange(1, len(numbers) + 1),
        "method": np.repeat(list(strokes), n),
        **dict(zip(names, numbers.T, strict=True)),
    }
    return written(machine=nominal.machine, columns=columns)


def written(*, machine: PlanarMachine, columns: Mapping[str, Array]) -> Mapping[str, Writer]:
    """The table of `columns`."""
    print(f"{len(columns['line'])} measurements")
    return {".parquet": table(columns, campaign_fields(machine))}
