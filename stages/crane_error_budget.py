"""What each deviation of a crane as built does to its errors: the campaign on many such cranes.

Reads params.yaml: parallel, crane.measured.budget, crane.measured.method, crane.measured.points,
crane.measured.payloads, crane.measured.noise, crane.measured.deviations, crane.measured.seed,
crane.geometry, crane.structure, the compensating method under crane.methods (and crane.grid,
crane.selection, networks and trainers to know which network belongs to it);
data/crane/calibration.json; its network.
Writes data/crane/error_budget.parquet, a row for every deviation, crane, method and condition.
"""

import functools
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import stage
from flexik.datasets.crane.provenance import budget_checksum
from flexik.datasets.crane_measured.fields import BUDGET_FIELDS
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.tables import write_table
from flexik.evaluation.conditions import Conditions, all_conditions
from flexik.evaluation.crane_measured.campaign import campaign_errors, reference_errors
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method
from flexik.positioning.method import Array

FOLDER = Path("data/crane")
# the spread of play belongs to the play
BELONGS = {"play_spread": "play"}


@dataclass(frozen=True, eq=False)
class Case:
    """Cranes with these deviations."""

    deviation: str
    factor: float
    magnitudes: Magnitudes
    twin: int


@dataclass(frozen=True, eq=False)
class Study:
    """What all cases share."""

    nominal: FlexibleCrane
    conditions: Conditions
    strokes: dict[str, Array]
    noise: float
    seed: int


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane = given.crane
    measured = crane.measured
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    nominal = flexible_crane(crane, stiffness)
    conditions = all_conditions(measured.points, measured.payloads)
    initial = initial_positions(nominal.geometry, conditions.targets)
    strokes = {}
    for name, label in (("none", "none"), ("combined", measured.method)):
        method = trained_method(crane, label, nominal.geometry, stiffness, FOLDER / "networks")
        strokes[name] = method(conditions.targets, conditions.payload, initial).strokes
    study = Study(nominal, conditions, strokes, measured.noise, measured.seed)
    magnitudes = Magnitudes(**measured.deviations.model_dump())
    items = cases(magnitudes, measured.budget.factor, measured.budget.n_cranes)
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    table = pd.concat(
        parallel_map(functools.partial(errors_of, study), items, settings, "error budget")
    )
    write_table(
        FOLDER / "error_budget.parquet",
        {field.name: table[field.name].to_numpy() for field in BUDGET_FIELDS},
        BUDGET_FIELDS,
        budget_checksum(crane, stiffness),
    )
    whole = table[(table["deviation"] == "all") & (table["method"] == "combined")]
    print(f"{measured.budget.n_cranes} cranes, combined: mean {1e3 * whole['error'].mean():.1f} mm")


def cases(magnitudes: Magnitudes, factor: float, n_cranes: int) -> list[Case]:
    """No deviation, all, each alone (factor 0), and each `factor` times as large among all."""
    given = asdict(magnitudes)
    none = dict.fromkeys(given, 0.0)
    kinds: list[tuple[str, float, dict[str, float]]] = [("none", 1.0, none), ("all", 1.0, given)]
    for name in given.keys() - BELONGS.keys():
        own = {key: given[key] for key in given if BELONGS.get(key, key) == name}
        kinds.append((name, 0.0, none | own))
        kinds.append((name, factor, given | {name: factor * given[name]}))
    order = ["none", "all", *given]
    kinds.sort(key=lambda kind: (order.index(kind[0]), kind[1]))
    return [
        Case(name, times, replace(magnitudes, **sizes), twin)
        for name, times, sizes in kinds
        for twin in range(n_cranes)
    ]


def errors_of(study: Study, case: Case) -> pd.DataFrame:
    """Errors of the campaign on one crane, from the targets and from the points of reference."""
    seed = study.seed + case.twin
    twin = draw_twin(study.nominal, case.magnitudes, seed)
    generator = np.random.default_rng((seed, 1))
    conditions, frames = study.conditions, {}
    for name, strokes in study.strokes.items():
        tip = as_built_tips(twin, strokes, conditions.payload, generator)
        tip = tip + study.noise * generator.standard_normal(tip.shape)
        frames[name] = campaign_errors(conditions.targets, conditions.payload, tip)
    moved = reference_errors(frames)
    tables = [
        frame[["target_x", "target_y", "payload", "error"]].assign(
            deviation=case.deviation,
            factor=case.factor,
            twin=case.twin,
            method=name,
            reference_error=moved[name]["error"],
        )
        for name, frame in frames.items()
    ]
    return pd.concat(tables)


if __name__ == "__main__":
    stage.run(main)
