"""Conditions of the crane's methods: targets, payloads, and the strokes from which they start."""

import numpy as np
from numpy.typing import NDArray

from flexik.evaluation.conditions import Conditions, every
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.parameters.conditions import Points


def at_points(points: Points, manipulator: CraneManipulator) -> Conditions:
    """Every point with every payload, from the initial positions of chapter 4."""
    return at(*every(points.points, points.payloads), manipulator)


def at(query: NDArray, group: NDArray[np.int64], manipulator: CraneManipulator) -> Conditions:
    """Queries (m, 3) of the points `group` (m,), from the initial positions of chapter 4."""
    return Conditions(query, manipulator.initial_positions(query[:, :2]), group)
