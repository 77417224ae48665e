"""The campaign: a crane is measured without and with compensation (thesis, chapter 4.6).

A crane as built is measured, or the campaign of a CSV file is taken. What a campaign in a file does
not have, targets and methods or strokes, is NaN and no text.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flexik.cases.crane.measured_section import Campaign
from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.parts.measured.campaign_file import own_campaign
from flexik.cases.crane.parts.measured.fields import CAMPAIGN
from flexik.cases.crane.parts.measured.nominal import approaches, read_network
from flexik.cases.crane.parts.measured.twins import measured_tips, twin_and_generator
from flexik.datasets.parts import Work, Writer, table, whole
from flexik.kinematics.machine_file import crane_geometry
from flexik.machines.planar import PlanarMachine
from flexik.positioning import combined
from flexik.positioning.method import Array


def prepare_own(*, machine: PlanarMachine, file: Path) -> Work:
    """The campaign of `file`."""
    found = own_campaign(file, crane_geometry(machine))
    columns = {field.name: found[field.name].to_numpy() for field in CAMPAIGN}
    return whole(written, columns=columns)


def prepare(
    *,
    machine: PlanarMachine,
    campaign: Campaign,
    method: combined.Settings,
    network: Path,
    constants: Path,
    sections: object,
) -> Work:
    """The campaign on a crane as built; `sections`, tables of the beams, are named by `machine`."""
    crane = flexible(machine, constants)
    strokes, query = approaches(crane, method, read_network(network), campaign)
    return whole(measure, crane=crane, campaign=campaign, strokes=strokes, query=query)


def measure(
    *, crane: FlexibleCrane, campaign: Campaign, strokes: Mapping[str, Array], query: Array
) -> Mapping[str, Writer]:
    """The table of the campaign on a crane as built."""
    twin, generator = twin_and_generator(crane, campaign.deviations, campaign.seed)
    tips = measured_tips(twin, strokes, query[:, 2], campaign.noise, generator)
    n = len(query)
    numbers = np.vstack([np.hstack([query, strokes[name], tips[name]]) for name in strokes])
    names = (field.name for field in CAMPAIGN[2:])
    columns = {
        "line": np.arange(1, len(numbers) + 1),
        "method": np.repeat(list(strokes), n),
        **dict(zip(names, numbers.T, strict=True)),
    }
    return written(columns=columns)


def written(*, columns: Mapping[str, Array]) -> Mapping[str, Writer]:
    """The table of `columns`."""
    print(f"{len(columns['line'])} measurements")
    return {".parquet": table(columns, CAMPAIGN)}
