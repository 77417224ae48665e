"""What each deviation of a crane as built does to its errors: the campaign on many such cranes."""

import functools
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.cases.crane.measured_section import Budget, Campaign
from flexik.cases.crane.parts.crane import flexible
from flexik.cases.crane.parts.measured.campaign import approaches
from flexik.cases.crane.parts.measured.errors import campaign_errors
from flexik.cases.crane.parts.measured.fields import BUDGET, MEASURED
from flexik.cases.crane.parts.measured.nominal import read_network
from flexik.cases.crane.parts.measured.twins import measured_tips, twin_and_generator
from flexik.datasets.parts import Columns, Work, rows
from flexik.machines.crane import Machine
from flexik.multibody.crane.as_built import Magnitudes
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning import combined
from flexik.positioning.method import Array

# the spread of play belongs to the play
BELONGS = {"play_spread": "play"}


@dataclass(frozen=True, eq=False)
class Study:
    """What all cranes share; strokes (n, 3) in m by method at the query (n, 3)."""

    crane: FlexibleCrane
    budget: Budget
    campaign: Campaign
    strokes: Mapping[str, Array]
    query: Array


def prepare(
    *,
    machine: Machine,
    campaign: Campaign,
    budget: Budget,
    method: combined.Settings,
    network: Path,
    spring: Path,
    sections: object,
) -> Work:
    """A table of BUDGET; an item is a crane with all its kinds of deviations."""
    crane = flexible(machine, spring)
    strokes, query = approaches(crane, method, read_network(network), campaign)
    study = Study(crane, budget, campaign, strokes, query)
    return Work(functools.partial(errors_of, study), range(budget.n_cranes), rows(*BUDGET))


def kinds(given: Magnitudes, factor: float) -> dict[tuple[str, float], Magnitudes]:
    """No deviation, all, each alone (factor 0), and each `factor` times as large among all."""
    sizes = asdict(given)
    none = dict.fromkeys(sizes, 0.0)
    found = {("none", 1.0): none, ("all", 1.0): sizes}
    for name in sizes:
        if name not in BELONGS:
            own = {key: size for key, size in sizes.items() if BELONGS.get(key, key) == name}
            found[name, 0.0] = none | own
            found[name, factor] = sizes | {name: factor * sizes[name]}
    return {kind: replace(given, **changed) for kind, changed in found.items()}


def errors_of(study: Study, number: int) -> Columns:
    """Errors of the campaign on crane `number`, from targets and points of reference."""
    campaign, n = study.campaign, len(study.query)
    x, y, payload = np.tile(study.query, (len(study.strokes), 1)).T
    conditions = {"target_x": x, "target_y": y, "payload": payload}
    method = np.repeat(list(study.strokes), n)
    given = Magnitudes(**campaign.deviations.model_dump())
    tables = []
    for (deviation, factor), magnitudes in kinds(given, study.budget.factor).items():
        twin, generator = twin_and_generator(study.crane, magnitudes, campaign.seed + number)
        tips = measured_tips(twin, study.strokes, study.query[:, 2], campaign.noise, generator)
        measured = dict(zip(MEASURED, np.concatenate(list(tips.values())).T, strict=True))
        errors = campaign_errors(pd.DataFrame({"method": method, **conditions, **measured}))
        tables.append(errors.assign(deviation=deviation, factor=factor, twin=number))
    table = pd.concat(tables)
    return {field.name: table[field.name].to_numpy() for field in BUDGET}
