"""Conditions of methods: targets, payloads, and the coordinates from which they start."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.datasets.tables import read_table
from flexik.evaluation.conditions import Conditions, every
from flexik.kinematics.manipulator import Manipulator
from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import Points
from flexik.planar.fields import QUERY, target_fields


def at_points(points: Points, manipulator: Manipulator) -> Conditions:
    """Every point with every payload, see `at`."""
    return at(*every(points.points, points.payloads), manipulator)


def at_targets(
    file: Path, machine: PlanarMachine, manipulator: Manipulator, n_targets: int | None = None
) -> Conditions:
    """The first `n_targets` of the random targets of `file`, or all, each a point of its own."""
    frame = read_table(file, target_fields(machine))[:n_targets]
    query = frame[[field.name for field in QUERY]].to_numpy()
    return at(query, np.arange(len(query)), manipulator)


def at(query: NDArray, group: NDArray[np.int64], manipulator: Manipulator) -> Conditions:
    """Queries (m, 3) of the points `group` (m,), from the machine's own initial positions.

    Those of the crane are of chapter 4 of Rouvinen 1999; others start from the middle of their
    limits.
    """
    initial = getattr(manipulator, "initial_positions", None)
    if initial is not None:
        return Conditions(query, initial(query[:, :2]), group)
    middle = (manipulator.lower + manipulator.upper) / 2
    return Conditions(query, np.tile(middle, (len(query), 1)), group)
