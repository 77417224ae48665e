"""Conditions of methods: targets, payloads, and the coordinates from which they start."""

import numpy as np
from numpy.typing import NDArray

from flexik.evaluation.conditions import Conditions, every
from flexik.kinematics.manipulator import Manipulator
from flexik.parameters.conditions import Points


def at_points(points: Points, manipulator: Manipulator) -> Conditions:
    """Every point with every payload, see `at`."""
    return at(*every(points.points, points.payloads), manipulator)


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
