"""Study `tolerance`: networks inverted to several tolerances, under the published conditions."""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from flexik.cases.crane.parts.crane import flexible
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part, Work, rows
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import Judge, evaluate, tip_judge
from flexik.evaluation.tolerance import FIELDS, tolerance_row
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.parameters.conditions import Points
from flexik.planar.conditions import at_points
from flexik.planar.constants import model_inputs
from flexik.planar.machine import columns_of
from flexik.planar.methods import method_inputs, method_settings, trained_method
from flexik.positioning.method import Columns, Method


def part(section: Section) -> Part:
    """A row for every method and tolerance."""
    study = section.studies.tolerance
    settings = {
        "machine": section.machine,
        "tolerances": study.tolerances,
        "points": section.conditions["published"],
        "methods": {name: method_settings(section, name) for name in study.methods},
    }
    networks = {name: method_inputs(section, name)["network"] for name in study.methods}
    return Part("tolerance", prepare, settings, {**model_inputs(section), "networks": networks})


def prepare(
    *,
    machine: PlanarMachine,
    tolerances: list[float],
    points: Points,
    methods: dict[str, dict[str, Any]],
    constants: Path,
    sections: dict[str, Path],
    networks: dict[str, Path],
) -> Work:
    """Ask every method with every tolerance."""
    crane = flexible(machine, constants)
    manipulator = CraneManipulator(crane.geometry)
    conditions = at_points(points, manipulator)
    items = []
    for name, given in methods.items():
        for tolerance in tolerances:
            inversion = given["method"].inversion.model_copy(update={"tolerance": tolerance})
            method = given["method"].model_copy(update={"inversion": inversion})
            found = trained_method(method, given["build"], manipulator, networks[name])
            items.append((name, tolerance, found))
    judge = tip_judge(functools.partial(tips, crane))
    function = functools.partial(_row, conditions, judge, columns_of(machine))
    return Work(function, items, rows(*FIELDS))


def _row(
    conditions: Conditions, judge: Judge, columns: Columns, item: tuple[str, float, Method]
) -> Mapping[str, NDArray]:
    name, tolerance, method = item
    return tolerance_row(name, tolerance, evaluate(method, conditions, judge, columns))
