"""Study `points`: how far the published comparison hangs on test points that are not known.

The thesis' figure with its 25 points is lost. Here those beyond the ones its text names are drawn
anew many times, the ground spring is fitted to each draw, and methods are judged on it. Errors are
linear in the spring's compliance nearly, so three springs do for all draws.
"""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexik.cases.crane.parts.crane import flexible, on_spring, stiffness_of
from flexik.cases.crane.section import PointStudy, Section
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import Field, read_csv
from flexik.errors import ParameterError
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import evaluate, tip_judge
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import REACHED
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.parameters.conditions import Points
from flexik.planar.conditions import at_points
from flexik.planar.constants import model_inputs
from flexik.planar.machine import columns_of
from flexik.planar.methods import method_inputs, method_settings, trained_methods
from flexik.positioning.method import Method

Array = NDArray[np.float64]

FIELDS = (
    Field("draw", "1", "from 0", "int64"),
    Field("method", "1", "name of the method", "string"),
    Field("spring_stiffness", "N m/rad", "fitted to the draw"),
    Field("mean_error", "m", "of the method on the draw"),
    Field("max_error", "m", "of the method on the draw"),
)
# Springs between which errors are interpolated, as shares of the stiffness fitted to all points
SPRINGS = (0.6, 1.0, 1.7)
NONE = "none"
# What the spring is fitted to: the mean error of `none`, mm
PUBLISHED = Path("data/reference/crane/positioning_errors.csv")


def part(section: Section) -> Part:
    """A row for every draw and method."""
    study, given = section.studies.points, section.conditions["published"]
    settings = {
        "machine": section.machine,
        "study": study,
        "payloads": given.payloads,  # type: ignore[union-attr]
        "n_points": len(given.points),  # type: ignore[union-attr]
        "methods": {name: method_settings(section, name) for name in (NONE, *study.methods)},
    }
    inputs = {
        **model_inputs(section),
        "published": PUBLISHED,
        "built_from": {name: method_inputs(section, name) for name in (NONE, *study.methods)},
    }
    return Part("points", prepare, settings, inputs)


def prepare(
    *,
    machine: PlanarMachine,
    study: PointStudy,
    payloads: list[float],
    n_points: int,
    methods: Mapping[str, Mapping[str, Any]],
    built_from: Mapping[str, Mapping[str, Any]],
    published: Path,
    constants: Path,
    sections: dict[str, Path],
) -> Work:
    """A method on all points that may be drawn is an item, `none` one on each of three springs."""
    crane = flexible(machine, constants)
    manipulator = CraneManipulator(crane.geometry)
    points = [*study.named, *_candidates(manipulator, study)]
    conditions = at_points(Points(points=points, payloads=payloads), manipulator)
    stiffness = stiffness_of(crane)
    items = [(NONE, share * stiffness) for share in SPRINGS]
    items += [(name, stiffness) for name in study.methods]
    trained = trained_methods(methods, built_from, manipulator, crane.machine)
    judged = functools.partial(_judged, machine, trained, conditions)
    shape = (len(points), len(payloads), 2)
    of_none = read_csv(published, ("none",), ("statistic",)).set_index("statistic")["none"]
    mean = 1e-3 * float(of_none["mean_error"])
    draw = functools.partial(_drawn, study, n_points, stiffness, mean, shape)
    return Work(judged, items, draw)


def _judged(
    machine: PlanarMachine,
    methods: Mapping[str, Method],
    conditions: Conditions,
    item: tuple[str, float],
) -> Mapping[str, NDArray]:
    """Errors and status of a method, the machine on a ground spring."""
    name, stiffness = item
    judge = tip_judge(functools.partial(tips, on_spring(machine, stiffness)))
    found = evaluate(methods[name], conditions, judge, columns_of(machine))
    error = np.column_stack([found["error_x"], found["error_y"]])
    return {"error": error, "status": found["status"]}


def _drawn(
    study: PointStudy,
    n_points: int,
    stiffness: float,
    mean: float,
    shape: tuple[int, int, int],
    results: list[Mapping[str, NDArray]],
) -> Mapping[str, Writer]:
    """The table: statistics of every method on every draw of `n_points`."""
    errors = [result["error"].reshape(shape) for result in results]
    status = np.array([result["status"].reshape(shape[:2]) for result in results])
    reached = (status == REACHED).all(axis=(0, 2))
    print(f"points: {np.sum(~reached)} of {len(reached)} are left out, a method fails there")
    named = np.flatnonzero(reached[: len(study.named)])
    others = len(study.named) + np.flatnonzero(reached[len(study.named) :])
    n_drawn, generator = max(0, n_points - len(named)), np.random.default_rng(study.seed)
    if len(others) < n_drawn:
        raise ParameterError(
            f"crane.studies.points.x: expected {n_drawn} or more whole metres that all methods "
            f"reach in x, y, got {len(others)}"
        )
    springs, found = stiffness * np.array(SPRINGS), []
    for draw in range(study.n_draws):
        rows = np.append(named, generator.choice(others, n_drawn, replace=False))
        fitted, none = _fitted(springs, [e[rows] for e in errors[: len(SPRINGS)]], mean)
        of_others = (e[rows] for e in errors[len(SPRINGS) :])
        for name, error in zip((NONE, *study.methods), (none, *of_others), strict=True):
            size = np.hypot(error[..., 0], error[..., 1])
            row = (draw, name, fitted, size.mean(), size.max())
            found.append({f.name: np.array([v]) for f, v in zip(FIELDS, row, strict=True)})
    return {".parquet": table(stacked(found, FIELDS), FIELDS)}


def _candidates(manipulator: CraneManipulator, study: PointStudy) -> list[tuple[float, float]]:
    """Points at whole metres of the area that the rigid crane reaches, but for the named ones."""
    axes = (np.arange(np.ceil(low), high + 1e-9) for low, high in (study.x, study.y))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    reached = manipulator.inverse(grid, np.zeros((len(grid), 3))).reached
    known = {tuple(point) for point in study.named}
    return [(x, y) for x, y in grid[reached].tolist() if (x, y) not in known]


def _fitted(springs: Array, errors: list[Array], mean: float) -> tuple[float, Array]:
    """Stiffness with which the mean of `errors` (..., 2), given by spring, is `mean` m; those.

    Within a third of the least and three times the largest of `springs`.
    """
    compliance = 1.0 / springs
    weights = np.linalg.inv(np.vander(compliance, len(springs), increasing=True))

    def at(c: float) -> Array:
        shares = c ** np.arange(len(springs)) @ weights
        return np.asarray(np.tensordot(shares, np.array(errors), 1))

    def excess(c: float) -> float:
        error = at(c)
        return float(np.hypot(error[..., 0], error[..., 1]).mean()) - mean

    low, high = compliance.min() / 3, compliance.max() * 3
    if excess(low) < 0 < excess(high):
        found = float(brentq(excess, low, high))
    else:  # points that sag too much or too little on any spring: the nearest one
        found = float(low if excess(low) > 0 else high)
    return 1.0 / found, at(found)
