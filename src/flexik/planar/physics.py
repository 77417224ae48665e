"""Study `physics`: what is left open about a machine, and what methods make of it.

A variant is the machine with other values of some keys: another axis, shear. Its constants are kept
as they are, and fitted anew. It tells how far the tip moves; how methods of the nominal machine
command it; and how methods whose beam theory is that of the variant command the nominal machine
once their networks have learnt what such a theory leaves.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, rows
from flexik.datasets.tables import Field, read_table
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import evaluate, tip_judge, workspace_statistics
from flexik.kinematics.machine_file import manipulator_of
from flexik.kinematics.manipulator import Manipulator
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import tips
from flexik.planar import calibrate
from flexik.planar.calibration_section import Calibration
from flexik.planar.conditions import at_targets
from flexik.planar.constants import known, model_inputs
from flexik.planar.fields import PAYLOAD, TIP, coordinates, kept, sample_fields
from flexik.planar.learning import pair
from flexik.planar.learning_curves import learning, learnt
from flexik.planar.machine import columns_of
from flexik.planar.methods import method_inputs, method_settings, trained_method, trained_methods
from flexik.planar.section import PlanarSection
from flexik.planar.study_section import PhysicsStudy
from flexik.positioning.method import Method

KEPT, FITTED = "kept", "fitted"
NOMINAL, VARIANT = "nominal", "variant"
MOVED = "tip"
FIELDS = (
    Field("variant", "1", "name of the variant", "string"),
    Field("constants", "1", "kept, or fitted anew to the variant", "string"),
    Field("subject", "1", "tip: how far it moves; or the method whose errors these are", "string"),
    Field("theory", "1", "nominal: commands the variant; variant: the nominal machine", "string"),
    Field("mean_error", "m", "over samples or random targets"),
    Field("p99_error", "m", "99th percentile"),
    Field("max_error", "m", "largest"),
    Field("n_failed", "1", "targets without an answer", "int64"),
)


@dataclass(frozen=True)
class Given:
    """What all variants share.

    nominal : the machine, all constants known.
    methods : those of the nominal machine, by name.
    relearnt : of some of them, by name, the method whose beam theory is of another machine.
    samples : of the nominal machine, to tell how far a variant moves its tips.
    """

    nominal: PlanarMachine
    methods: Mapping[str, Method]
    relearnt: Mapping[str, Callable[[PlanarMachine], Method]]
    conditions: Conditions
    samples: pd.DataFrame


def parts(section: PlanarSection, study: PhysicsStudy | None) -> list[Part]:
    """`physics`, a table of FIELDS."""
    if study is None:
        return []
    samples = section.data / "samples"
    theories = {
        name: learning(section, method.network, study.n_restarts) if method.network else None
        for name, method in section.methods.items()
        if name in study.methods and method.asks_machine
    }
    settings = {
        **calibrate.described(section),
        "variants": study.variants,
        "n_targets": study.n_targets,
        "methods": {name: method_settings(section, name) for name in study.methods},
        "theories": theories,
    }
    inputs = {
        **calibrate.inputs(section),
        **model_inputs(section),
        "targets": samples / f"{study.conditions}.parquet",
        "grid": samples / "grid.parquet",
        "selection": samples / "selection.parquet",
        "built_from": {name: method_inputs(section, name) for name in study.methods},
    }
    return [Part("physics", prepare, settings, inputs)]


def read(section: PlanarSection, study: PhysicsStudy | None) -> pd.DataFrame:
    """The table of the study; empty where there is none."""
    path = section.data / "studies/physics.parquet"
    return read_table(path, FIELDS) if study else pd.DataFrame()


def prepare(
    *,
    machine: PlanarMachine,
    calibration: Calibration,
    variants: Mapping[str, Mapping[str, Any]],
    n_targets: int,
    methods: Mapping[str, Mapping[str, Any]],
    theories: Mapping[str, Mapping[str, Any] | None],
    built_from: Mapping[str, Mapping[str, Any]],
    targets: Path,
    grid: Path,
    selection: Path,
    sections: dict[str, Path],
    constants: Path | None = None,
    campaign: Path | None = None,
) -> Work:
    """A variant with its constants kept or fitted is an item."""
    nominal, manipulator = known(machine, constants), manipulator_of(machine)
    tables = [kept(read_table(path, sample_fields(machine))) for path in (grid, selection)]
    trained = trained_methods(methods, built_from, manipulator, nominal)
    relearnt = {
        name: functools.partial(_relearnt, methods[name], manipulator, tables, by)
        for name, by in theories.items()
    }
    conditions = at_targets(targets, machine, manipulator, n_targets)
    given = Given(nominal, trained, relearnt, conditions, tables[1])
    items = []
    for name, keys in variants.items():
        other = machine.with_constants(keys)
        items.append((name, KEPT, known(other, constants)))
        if calibration.ranges:
            found = calibrate.fitted(other, calibration, campaign)["constants"]
            items.append((name, FITTED, other.with_constants(found)))
    return Work(functools.partial(_judged, given), items, rows(*FIELDS))


def _judged(given: Given, item: tuple[str, str, PlanarMachine]) -> Mapping[str, NDArray]:
    """Rows of a variant."""
    name, constants, variant = item
    values, payload, tip = (
        given.samples[[field.name for field in fields]].to_numpy()
        for fields in (coordinates(variant), [PAYLOAD], TIP)
    )
    moved = np.linalg.norm(tips(FlexibleMachine(variant), values, payload[:, 0]) - tip, axis=1)
    measures = {
        "mean_error": moved.mean(),
        "p99_error": np.quantile(moved, 0.99),
        "max_error": moved.max(),
    }
    found: list[dict[str, Any]] = [{"subject": MOVED, "theory": NOMINAL, "n_failed": 0, **measures}]
    asked = [(label, NOMINAL, method, variant) for label, method in given.methods.items()]
    asked += [
        (label, VARIANT, learn(variant), given.nominal) for label, learn in given.relearnt.items()
    ]
    for label, theory, method, commanded in asked:
        judge = tip_judge(functools.partial(tips, FlexibleMachine(commanded)))
        errors = pd.DataFrame(evaluate(method, given.conditions, judge, columns_of(commanded)))
        found.append({"subject": label, "theory": theory} | workspace_statistics(errors))
    frame = pd.DataFrame(found).assign(variant=name, constants=constants)
    return {field.name: frame[field.name].to_numpy() for field in FIELDS}


def _relearnt(
    given: Mapping[str, Any],
    manipulator: Manipulator,
    tables: list[pd.DataFrame],
    by: Mapping[str, Any] | None,
    variant: PlanarMachine,
) -> Method:
    """Method `given` with beam theory of `variant`; its network learns what that leaves."""
    network = None
    if by is not None:
        base = by["theory"](variant, by["n_passes"])
        grid, chosen = (pair(table, by["kind"], variant, base) for table in tables)
        network = learnt(by, variant, grid, chosen)
    return trained_method(given["method"], given["build"], manipulator, network, machine=variant)
