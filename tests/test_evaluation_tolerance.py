"""Errors and iterations of a method with one tolerance."""

import numpy as np
import pytest

from flexik.errors import DataError
from flexik.evaluation.tolerance import FIELDS, tolerance_row
from flexik.kinematics.status import NOT_CONVERGED, REACHED


def table(**diagnostics):
    error = np.array([0.25, 1 / 32, 0.5])
    status = np.array([REACHED, NOT_CONVERGED, REACHED])
    return {"error_x": error, "error_y": error, "error": error, "status": status} | diagnostics


def test_a_row_by_hand():
    row = tolerance_row("direct", 0.3, table(n_iterations=np.array([5, 8, 1])))
    assert list(row) == [field.name for field in FIELDS]
    assert {name: values.tolist() for name, values in row.items()} == {
        "method": ["direct"],
        "tolerance": [0.3],
        "mean_error": [pytest.approx(0.78125 / 3)],
        "max_error": [0.5],
        "mean_iterations": [pytest.approx(14 / 3)],
        "max_iterations": [8],
        "n_failed": [1],
    }
    assert row["max_iterations"].dtype == row["n_failed"].dtype == np.int64


@pytest.mark.parametrize("diagnostics", [{}, {"n_iterations": np.zeros(3)}])
def test_a_method_that_does_not_count_is_told(diagnostics):
    with pytest.raises(DataError, match=r"direct with tolerance=0\.1.*n_iterations"):
        tolerance_row("direct", 0.1, table(**diagnostics))
