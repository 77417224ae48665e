"""Study `corrections`: what further corrections of a method buy, from one to convergence."""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, rows
from flexik.datasets.tables import Field
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import Judge, evaluate, tip_judge, workspace_statistics
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.planar.conditions import at_targets
from flexik.planar.constants import model_inputs
from flexik.planar.machine import columns_of, flexible
from flexik.planar.methods import method_inputs, method_settings, trained_method
from flexik.planar.section import PlanarSection
from flexik.planar.study_section import CorrectionStudy
from flexik.positioning.method import Columns, Method

FIELDS = (
    Field("method", "1", "name of the method", "string"),
    Field("n_corrections", "1", "at most", "int64"),
    Field("mean_error", "m", "at random targets"),
    Field("p99_error", "m", "99th percentile at random targets"),
    Field("max_error", "m", "at random targets"),
    Field("n_failed", "1", "targets without an answer", "int64"),
)


def part(section: PlanarSection, study: CorrectionStudy) -> Part:
    """A row for every method and number of corrections."""
    settings = {
        "machine": section.machine,
        "n_corrections": study.n_corrections,
        "n_targets": study.n_targets,
        "methods": {name: method_settings(section, name) for name in study.methods},
    }
    inputs = {
        **model_inputs(section),
        "targets": section.data / f"samples/{study.conditions}.parquet",
        "built_from": {name: method_inputs(section, name) for name in study.methods},
    }
    return Part("corrections", prepare, settings, inputs)


def prepare(
    *,
    machine: PlanarMachine,
    n_corrections: list[int],
    n_targets: int,
    methods: Mapping[str, Mapping[str, Any]],
    built_from: Mapping[str, Mapping[str, Any]],
    targets: Path,
    sections: dict[str, Path],
    constants: Path | None = None,
) -> Work:
    """A method with a number of corrections is an item."""
    built, manipulator = flexible(machine, constants), manipulator_of(machine)
    conditions = at_targets(targets, machine, manipulator, n_targets)
    items = []
    for name, given in methods.items():
        for n in n_corrections:
            method = given["method"].model_copy(update={"n_corrections": n})
            inputs = {**built_from[name], "machine": built.machine}
            items.append((name, n, trained_method(method, given["build"], manipulator, **inputs)))
    judge = tip_judge(functools.partial(tips, built))
    return Work(
        functools.partial(_row, conditions, judge, columns_of(machine)), items, rows(*FIELDS)
    )


def _row(
    conditions: Conditions, judge: Judge, columns: Columns, item: tuple[str, int, Method]
) -> Mapping[str, NDArray]:
    name, n, method = item
    found = workspace_statistics(pd.DataFrame(evaluate(method, conditions, judge, columns)))
    row = {"method": name, "n_corrections": n} | found
    return {field.name: np.array([row[field.name]]) for field in FIELDS}
