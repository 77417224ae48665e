"""Errors and iterations by the tolerance of a method."""

from dataclasses import dataclass

import numpy as np
import pytest

from flexik.errors import DataError
from flexik.evaluation.conditions import all_conditions
from flexik.evaluation.tolerance import tolerance_study
from flexik.positioning.method import NOT_CONVERGED, REACHED, Command


@dataclass(frozen=True)
class Halving:
    """Halves its distance to the target until below the tolerance, eight times at most."""

    tolerance: float

    def __call__(self, targets, payload, initial_strokes):
        """Command strokes that are the targets, nearly."""
        strokes = initial_strokes.copy()
        n_iterations = np.zeros(len(targets), dtype=np.int64)
        for _ in range(8):
            rows = np.linalg.norm(targets - strokes[:, :2], axis=1) > self.tolerance
            strokes[rows, :2] += 0.5 * (targets - strokes[:, :2])[rows]
            n_iterations[rows] += 1
        reached = np.linalg.norm(targets - strokes[:, :2], axis=1) <= self.tolerance
        status = np.where(reached, REACHED, NOT_CONVERGED)
        return Command(strokes, status, {"n_iterations": n_iterations})


def tip(strokes, payload):
    return strokes[:, :2]


def test_study_by_hand():
    # distances of 1, 4 and 8 m: after k halvings 2^-k, 4 * 2^-k, 8 * 2^-k
    conditions = all_conditions([[1.0, 0.0], [0.0, 4.0], [-8.0, 0.0]], [30.0])
    study = tolerance_study(Halving, [0.3, 0.05, 0.01], conditions, np.zeros((3, 3)), tip)
    assert study.columns.tolist() == [
        *("tolerance", "mean_error", "max_error"),
        *("mean_iterations", "max_iterations", "n_failed"),
    ]
    assert study["tolerance"].tolist() == [0.3, 0.05, 0.01]
    assert study["mean_error"].tolist() == pytest.approx([1 / 4, 1 / 32, 7 / 384])
    assert study["max_error"].tolist() == pytest.approx([1 / 4, 1 / 32, 1 / 32])
    assert study["mean_iterations"].tolist() == pytest.approx([11 / 3, 20 / 3, 23 / 3])
    assert study["max_iterations"].tolist() == [5, 8, 8]
    assert study["n_failed"].tolist() == [0, 0, 2]
    assert study["max_iterations"].dtype == study["n_failed"].dtype == np.int64


@pytest.mark.parametrize("diagnostics", [{}, {"n_iterations": np.zeros(1)}])
def test_a_method_that_does_not_count_is_told(diagnostics):
    def method_of(tolerance):
        return lambda targets, payload, strokes: Command(
            strokes, np.zeros(1, dtype=np.int64), diagnostics
        )

    conditions = all_conditions([[1.0, 0.0]], [30.0])
    with pytest.raises(DataError, match=r"tolerance=0\.1.*n_iterations"):
        tolerance_study(method_of, [0.1], conditions, np.zeros((1, 3)), tip)
