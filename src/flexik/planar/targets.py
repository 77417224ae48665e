"""Random targets and payloads that the loaded machine can be put on."""

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.errors import ParameterError
from flexik.evaluation.conditions import Array
from flexik.evaluation.targets import draw_candidates, reachable_targets
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import solve
from flexik.parameters.conditions import RandomTargets
from flexik.planar.constants import model_inputs
from flexik.planar.fields import target_fields
from flexik.planar.machine import flexible
from flexik.planar.section import PlanarSection

ROWS = 400
# Candidates drawn for each target that is wanted, at most; and those tried at first, as a share:
# a loaded machine reaches nearly all that the rigid one does
MAXIMUM_CANDIDATES = 20
TRIED = 1.1


def parts(section: PlanarSection) -> list[Part]:
    """A table of target_fields for every set of random conditions."""
    settings = {"machine": section.machine, "minimum_x": section.samples.minimum_tip_x}
    return [
        Part(
            name,
            prepare,
            {**settings, "key": f"{section.name}.conditions.{name}", "random": given},
            model_inputs(section),
        )
        for name, given in section.conditions.items()
        if isinstance(given, RandomTargets)
    ]


def prepare(
    *,
    machine: PlanarMachine,
    minimum_x: float | None,
    key: str,
    random: RandomTargets,
    sections: dict[str, Path],
    constants: Path | None = None,
) -> Work:
    """The first of the candidates that are reached, in the order they were drawn."""
    lower, upper = zip(random.x, random.y, strict=True)
    n, generator = MAXIMUM_CANDIDATES * random.n_targets, np.random.default_rng(random.seed)
    drawn = np.column_stack(draw_candidates(n, lower, upper, random.payload, generator))
    if minimum_x is not None:
        drawn = drawn[drawn[:, 0] >= minimum_x]
    fields = target_fields(machine)
    tried, others = _within_reach(machine, drawn, round(TRIED * random.n_targets))
    reach = functools.partial(_reach, flexible(machine, constants), random)

    def finish(results: list[Mapping[str, NDArray]]) -> Mapping[str, Writer]:
        found = [*results]
        for rows in _pieces(others):
            if sum(len(part["payload"]) for part in found) >= random.n_targets:
                break
            found.append(reach(rows))
        columns = stacked(found, fields)
        if (n_found := len(columns["payload"])) < random.n_targets:
            raise ParameterError(
                f"{key}: of {n} targets drawn in x, y only {n_found} are "
                f"reached, expected {random.n_targets}"
            )
        kept = {field: values[: random.n_targets] for field, values in columns.items()}
        return {".parquet": table(kept, fields)}

    return Work(reach, _pieces(tried), finish)


def _within_reach(machine: PlanarMachine, drawn: Array, n: int) -> tuple[Array, Array]:
    """The first `n` of the candidates `drawn` that the rigid machine reaches, and those after."""
    manipulator = manipulator_of(machine)
    middle, found, end = (manipulator.lower + manipulator.upper) / 2, drawn[:0], 0
    while len(found) < n and end < len(drawn):
        rows, end = drawn[end : end + n], end + n
        reached = manipulator.inverse(rows[:, :2], np.tile(middle, (len(rows), 1))).reached
        found = np.vstack([found, rows[reached]])
    return found[:n], np.vstack([found[n:], drawn[end:]])


def _pieces(rows: Array) -> list[Array]:
    return [rows[k : k + ROWS] for k in range(0, len(rows), ROWS)]


def _reach(machine: FlexibleMachine, random: RandomTargets, rows: Array) -> dict[str, Array]:
    """Those of the candidates `rows` (n, 3) of target and payload that `machine` reaches."""
    found = reachable_targets(
        rows[:, :2],
        rows[:, 2],
        manipulator_of(machine.machine),
        lambda values, payload: solve(machine, values, payload)[0],
        random.tolerance,
        random.n_iterations,
    )
    fields = target_fields(machine.machine)
    columns = [*found.targets.T, found.payload, *found.values.T]
    return {field.name: column for field, column in zip(fields, columns, strict=True)}
