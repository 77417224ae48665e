"""What each deviation of a machine as built does to its errors: the campaign on many of them."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.parts import Columns, Work, Writer, stacked, table
from flexik.learning.storage import load_network, load_restarts
from flexik.machines.deviations import Magnitudes
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.planar.machine import flexible
from flexik.planar.measured.errors import campaign_errors
from flexik.planar.measured.fields import BUDGET, MEASURED
from flexik.planar.measured.nominal import approaches
from flexik.planar.measured.section import Budget, Campaign
from flexik.planar.measured.twins import measured_tips, twin_and_generator
from flexik.positioning import combined
from flexik.positioning.method import Array

# Belong to another kind; the spread of play does not grow with it
BELONGS = {
    "play_spread": "play",
    "angle_offset": "stroke_offset",
    "angle_repeatability": "repeatability",
}
STAYS = "play_spread"


@dataclass(frozen=True, eq=False)
class Study:
    """What all machines share; the campaign is measured at the query (n, 3)."""

    nominal: FlexibleMachine
    campaign: Campaign
    query: Array


@dataclass(frozen=True, eq=False)
class Item:
    """A machine by its number, with these kinds of deviations; coordinates (n, k) by method."""

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
    sections: object,
    constants: Path | None = None,
    restarts: Path | None = None,
) -> Work:
    """A table of BUDGET, an item a machine with all its kinds of deviations.

    `.restarts.parquet` is one of machines without deviations, each compensated by the network of
    another of the `restarts` of which `network` is the best; `twin` is the restart.
    """
    nominal, given = flexible(machine, constants), campaign.deviations
    strokes, query = approaches(machine, method, load_network(network)[0], campaign)
    items = [Item(k, kinds(given, budget.factor), strokes) for k in range(budget.n_twins)]
    others = {} if restarts is None else load_restarts(restarts)
    perfect = {kind: sizes for kind, sizes in items[0].kinds.items() if kind[0] == "none"}
    for number, other in others.items():
        items.append(Item(number, perfect, approaches(machine, method, other, campaign)[0]))

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        tables = {".parquet": results[: budget.n_twins]}
        tables[".restarts.parquet"] = results[budget.n_twins :]
        return {ending: table(stacked(found, BUDGET), BUDGET) for ending, found in tables.items()}

    return Work(functools.partial(errors_of, Study(nominal, campaign, query)), items, finish)


def kinds(given: Magnitudes, factor: float) -> dict[tuple[str, float], Magnitudes]:
    """No deviation, all, each alone (factor 0), and each `factor` times as large among all."""
    sizes = given.model_dump()
    none = dict.fromkeys(sizes, 0.0)
    found = {("none", 1.0): none, ("all", 1.0): sizes}
    for name in sizes:
        if name not in BELONGS:
            own = {key: size for key, size in sizes.items() if BELONGS.get(key, key) == name}
            found[name, 0.0] = none | own
            larger = {key: factor * size for key, size in own.items() if key != STAYS}
            found[name, factor] = sizes | larger
    return {kind: given.model_copy(update=changed) for kind, changed in found.items()}


def errors_of(study: Study, item: Item) -> Columns:
    """Errors of the campaign on a machine, from targets and points of reference."""
    campaign, strokes = study.campaign, item.strokes
    x, y, payload = np.tile(study.query, (len(strokes), 1)).T
    conditions = {"target_x": x, "target_y": y, "payload": payload}
    method = np.repeat(list(strokes), len(study.query))
    tables = []
    for (deviation, factor), magnitudes in item.kinds.items():
        twin, generator = twin_and_generator(study.nominal, magnitudes, campaign.seed + item.number)
        tips = measured_tips(twin, strokes, study.query[:, 2], campaign.noise, generator)
        measured = dict(zip(MEASURED, np.concatenate(list(tips.values())).T, strict=True))
        errors = campaign_errors(pd.DataFrame({"method": method, **conditions, **measured}))
        tables.append(errors.assign(deviation=deviation, factor=factor, twin=item.number))
    found = pd.concat(tables)
    return {field.name: found[field.name].to_numpy() for field in BUDGET}
