"""Random targets and payloads that the loaded crane can be put on."""

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.crane.parts.crane import FlexibleCrane, flexible, model_inputs
from flexik.cases.crane.parts.fields import TARGET_FIELDS
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.errors import ParameterError
from flexik.evaluation.conditions import Array
from flexik.evaluation.targets import draw_candidates, reachable_targets
from flexik.kinematics.crane import smallest_extension
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.machine_file import crane_geometry
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import solve
from flexik.parameters.conditions import RandomTargets

ROWS = 400
# Candidates drawn for each target that is wanted, at most; and those tried at first, as a share:
# a loaded crane reaches nearly all that the rigid one does
MAXIMUM_CANDIDATES = 20
TRIED = 1.1


def parts(section: Section) -> list[Part]:
    """A table of TARGET_FIELDS for every set of random conditions."""
    settings = {"machine": section.machine, "minimum_x": section.samples.minimum_tip_x}
    return [
        Part(name, prepare, {**settings, "name": name, "random": given}, model_inputs(section))
        for name, given in section.conditions.items()
        if isinstance(given, RandomTargets)
    ]


def prepare(
    *,
    machine: PlanarMachine,
    minimum_x: float,
    name: str,
    random: RandomTargets,
    spring: Path,
    sections: dict[str, Path],
) -> Work:
    """The first of the candidates that are reached, in the order they were drawn."""
    lower, upper = zip(random.x, random.y, strict=True)
    n, generator = MAXIMUM_CANDIDATES * random.n_targets, np.random.default_rng(random.seed)
    drawn = np.column_stack(draw_candidates(n, lower, upper, random.payload, generator))
    drawn = drawn[drawn[:, 0] >= minimum_x]
    drawn = drawn[~np.isnan(smallest_extension(crane_geometry(machine), drawn[:, :2]))]
    first = round(TRIED * random.n_targets)
    tried, others = drawn[:first], drawn[first:]
    reach = functools.partial(_reach, flexible(machine, spring), random)

    def finish(results: list[Mapping[str, NDArray]]) -> Mapping[str, Writer]:
        found = [*results]
        for rows in _pieces(others):
            if sum(len(part["payload"]) for part in found) >= random.n_targets:
                break
            found.append(reach(rows))
        columns = stacked(found, TARGET_FIELDS)
        if (n_found := len(columns["payload"])) < random.n_targets:
            raise ParameterError(
                f"crane.conditions.{name}: of {n} targets drawn in x, y only {n_found} are "
                f"reached, expected {random.n_targets}"
            )
        kept = {field: values[: random.n_targets] for field, values in columns.items()}
        return {".parquet": table(kept, TARGET_FIELDS)}

    return Work(reach, _pieces(tried), finish)


def _pieces(rows: Array) -> list[Array]:
    return [rows[k : k + ROWS] for k in range(0, len(rows), ROWS)]


def _reach(crane: FlexibleCrane, random: RandomTargets, rows: Array) -> dict[str, Array]:
    """Those of the candidates `rows` (n, 3) of target and payload that `crane` reaches."""
    found = reachable_targets(
        rows[:, :2],
        rows[:, 2],
        CraneManipulator(crane.geometry),
        lambda strokes, payload: solve(crane, strokes, payload)[0],
        random.tolerance,
        random.n_iterations,
    )
    columns = [*found.targets.T, found.payload, *found.values.T]
    return {field.name: column for field, column in zip(TARGET_FIELDS, columns, strict=True)}
