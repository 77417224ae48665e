"""Method `inverse`: the network's part, the extension rule and the limits."""

import numpy as np
import pytest

from flexik.evaluation.conditions import all_conditions
from flexik.kinematics.crane import forward, inverse, smallest_extension
from flexik.kinematics.status import OUT_OF_REACH, REACHED
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.methods import build_method
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import PositioningError


class RigidCrane:
    """Knows the rigid inverse; `offset` m is added to both strokes. Keeps what it was asked."""

    def __init__(self, geometry, offset=(0.0, 0.0)):
        self.geometry, self.offset, self.asked = geometry, np.array(offset), np.empty((0, 4))

    def predict(self, values):
        """Lift and jib stroke for x, y, payload and extension."""
        self.asked = values
        return inverse(self.geometry, values[:, :2], values[:, 3]).strokes[:, :2] + self.offset


def built(geometry, network):
    return build_method(
        "inverse", Ingredients(geometry, closed_form(geometry), {"inverse": network})
    )


@pytest.fixture
def conditions(points, payloads):
    return all_conditions(points, payloads)


def test_a_perfect_network_reaches_with_the_smallest_extension(geometry, conditions):
    network = RigidCrane(geometry)
    initial = initial_positions(geometry, conditions.targets)
    command = built(geometry, network)(conditions.targets, conditions.payload, initial)
    extension = smallest_extension(geometry, conditions.targets)
    assert np.array_equal(command.strokes[:, 2], extension)
    assert forward(geometry, command.strokes) == pytest.approx(conditions.targets, abs=1e-9)
    assert (command.status == REACHED).all()
    assert (command.diagnostics["n_clipped"] == 0).all()
    asked = np.column_stack([conditions.targets, conditions.payload, extension])
    assert np.array_equal(network.asked, asked)
    assert (extension > 0.0).any() and (extension == 0.0).any()


def test_strokes_beyond_the_limits_are_clipped_and_counted(geometry, conditions):
    targets, payload = conditions.targets, conditions.payload
    initial = initial_positions(geometry, targets)
    exact = inverse(geometry, targets, smallest_extension(geometry, targets)).strokes[:, :2]
    limits = np.array(geometry.stroke_maximum[:2])
    for offset in ([0.2, 0.0], [-0.2, 0.9], [-9.0, -9.0]):
        command = built(geometry, RigidCrane(geometry, offset))(targets, payload, initial)
        wanted = exact + np.array(offset)
        assert np.array_equal(command.strokes[:, :2], np.clip(wanted, 0.0, limits))
        beyond = (wanted < 0.0) | (wanted > limits)
        n_clipped = command.diagnostics["n_clipped"]
        assert np.array_equal(n_clipped, beyond.sum(axis=1))
        assert np.issubdtype(n_clipped.dtype, np.integer)
        assert beyond.any()


def test_targets_out_of_rigid_reach_keep_the_initial_strokes(geometry):
    targets = np.array([[4.0, 1.0], [9.0, 9.0], [2.0, -3.95]])
    initial = np.array([[0.1, 0.2, 0.3]] * 3)
    network = RigidCrane(geometry, [9.0, 0.0])
    command = built(geometry, network)(targets, np.array([30.0, 40.0, 50.0]), initial)
    assert command.status.tolist() == [REACHED, OUT_OF_REACH, REACHED]
    assert command.strokes[1].tolist() == [0.1, 0.2, 0.3]
    assert command.diagnostics["n_clipped"].tolist() == [1, 0, 1]
    assert network.asked[:, 2].tolist() == [30.0, 50.0]
    assert initial.tolist() == [[0.1, 0.2, 0.3]] * 3


def test_the_status_tells_why_the_rigid_crane_does_not_reach(geometry):
    # below the base: the links are long enough, the cylinders are not
    targets = np.array([[0.5, -4.0]])
    expected = inverse(geometry, targets, 0.0).status
    command = built(geometry, RigidCrane(geometry))(targets, np.zeros(1), np.zeros((1, 3)))
    assert command.status == expected != REACHED


def test_bad_networks_are_told(geometry):
    class Broken:
        def __init__(self, predicted):
            self.predicted = predicted

        def predict(self, values):
            return np.tile(self.predicted, (len(values), 1))

    targets, payload, initial = np.array([[4.0, 1.0]]), np.zeros(1), np.zeros((1, 3))
    with pytest.raises(PositioningError, match="predicted strokes: sample 0 is not finite"):
        built(geometry, Broken([np.nan, 0.1]))(targets, payload, initial)
    with pytest.raises(PositioningError, match="predicted strokes: expected shape"):
        built(geometry, Broken([0.1, 0.1, 0.1]))(targets, payload, initial)
    with pytest.raises(PositioningError, match="expected a network 'inverse', got \\[\\]"):
        build_method("inverse", Ingredients(geometry, closed_form(geometry)))
