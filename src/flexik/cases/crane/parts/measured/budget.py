"""What each deviation of a crane as built does to its errors: the campaign on many such cranes."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.cases.crane.measured_section import Budget, Campaign
from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.parts.measured.errors import campaign_errors
from flexik.cases.crane.parts.measured.fields import BUDGET, MEASURED
from flexik.cases.crane.parts.measured.nominal import approaches, read_network
from flexik.cases.crane.parts.measured.twins import measured_tips, twin_and_generator
from flexik.datasets.parts import Columns, Work, Writer, stacked, table
from flexik.learning.storage import load_restarts
from flexik.machines.deviations import Magnitudes
from flexik.machines.planar import PlanarMachine
from flexik.positioning import combined
from flexik.positioning.method import Array

# the spread of play belongs to the play
BELONGS = {"play_spread": "play"}


@dataclass(frozen=True, eq=False)
class Study:
    """What all cranes share; the campaign is measured at the query (n, 3)."""

    crane: FlexibleCrane
    campaign: Campaign
    query: Array


@dataclass(frozen=True, eq=False)
class Item:
    """A crane by its number, with these kinds of deviations; strokes (n, 3) in m by method."""

    number: int
    kinds: Mapping[tuple[str, float], Magnitudes]
    strokes: Mapping[str, Array]


def prepare(
    *,
    machine: PlanarMachine,
    campaign: Campaign,
    budget: Budget,
    method: combined.Settings,
    network: Path,
    constants: Path,
    sections: object,
    restarts: Path | None = None,
) -> Work:
    """A table of BUDGET, an item a crane with all its kinds of deviations.

    `.restarts.parquet` is one of cranes without deviations, each compensated by the network of
    another of the `restarts` of which `network` is the best; `twin` is the restart.
    """
    crane, given = flexible(machine, constants), campaign.deviations
    strokes, query = approaches(crane, method, read_network(network), campaign)
    items = [Item(k, kinds(given, budget.factor), strokes) for k in range(budget.n_cranes)]
    others = {} if restarts is None else load_restarts(restarts)
    perfect = {kind: sizes for kind, sizes in items[0].kinds.items() if kind[0] == "none"}
    for number, other in others.items():
        items.append(Item(number, perfect, approaches(crane, method, other, campaign)[0]))

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        tables = {".parquet": results[: budget.n_cranes]}
        tables[".restarts.parquet"] = results[budget.n_cranes :]
        return {ending: table(stacked(found, BUDGET), BUDGET) for ending, found in tables.items()}

    return Work(functools.partial(errors_of, Study(crane, campaign, query)), items, finish)


def kinds(given: Magnitudes, factor: float) -> dict[tuple[str, float], Magnitudes]:
    """No deviation, all, each alone (factor 0), and each `factor` times as large among all."""
    sizes = given.model_dump()
    none = dict.fromkeys(sizes, 0.0)
    found = {("none", 1.0): none, ("all", 1.0): sizes}
    for name in sizes:
        if name not in BELONGS:
            own = {key: size for key, size in sizes.items() if BELONGS.get(key, key) == name}
            found[name, 0.0] = none | own
            found[name, factor] = sizes | {name: factor * sizes[name]}
    return {kind: given.model_copy(update=changed) for kind, changed in found.items()}


def errors_of(study: Study, item: Item) -> Columns:
    """Errors of the campaign on a crane, from targets and points of reference."""
    campaign, strokes = study.campaign, item.strokes
    x, y, payload = np.tile(study.query, (len(strokes), 1)).T
    conditions = {"target_x": x, "target_y": y, "payload": payload}
    method = np.repeat(list(strokes), len(study.query))
    tables = []
    for (deviation, factor), magnitudes in item.kinds.items():
        twin, generator = twin_and_generator(study.crane, magnitudes, campaign.seed + item.number)
        tips = measured_tips(twin, strokes, study.query[:, 2], campaign.noise, generator)
        measured = dict(zip(MEASURED, np.concatenate(list(tips.values())).T, strict=True))
        errors = campaign_errors(pd.DataFrame({"method": method, **conditions, **measured}))
        tables.append(errors.assign(deviation=deviation, factor=factor, twin=item.number))
    found = pd.concat(tables)
    return {field.name: found[field.name].to_numpy() for field in BUDGET}
