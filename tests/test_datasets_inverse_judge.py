"""What an inverse network is judged by: how far its strokes move the tip."""

import numpy as np
import pytest

from flexik.datasets.crane.learning import stroke_error_at_tip
from flexik.kinematics.crane import forward

INPUTS = np.array([[4.0, 1.0, 200.0, 0.5], [3.0, 2.0, 50.0, 1.0], [5.0, 0.0, 400.0, 1.6]])
STROKES = np.array([[0.2, 0.3], [0.3, 0.4], [0.1, 0.2]])
REACH = np.array([3.0, 6.0])


class Offset:
    """Strokes that are off by a constant."""

    def __init__(self, *offset):
        self.offset = np.array(offset)

    def predict(self, values):
        """Exact strokes and the offset."""
        assert np.array_equal(values, INPUTS)
        return STROKES + self.offset


def error(geometry, *offset):
    return stroke_error_at_tip(geometry, INPUTS, STROKES, REACH, Offset(*offset))


def test_exact_strokes_have_none(geometry):
    assert error(geometry, 0.0, 0.0) == 0.0


def test_it_is_the_displacement_of_the_rigid_tip(geometry):
    full = np.column_stack([STROKES, INPUTS[:, 3]])
    moved = forward(geometry, full + np.array([0.01, -0.02, 0.0])) - forward(geometry, full)
    expected = np.sqrt(((moved[:, 0] / 3.0) ** 2 + (moved[:, 1] / 6.0) ** 2).sum() / 6)
    assert error(geometry, 0.01, -0.02) == pytest.approx(expected, rel=1e-12)


def test_strokes_beyond_their_limits_are_clipped_as_the_method_does(geometry):
    assert error(geometry, 9.0, 9.0) == error(geometry, 99.0, 99.0)
    assert np.isfinite(error(geometry, -9.0, -9.0))
