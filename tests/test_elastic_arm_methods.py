"""Methods of the elastic arm, with exact functions in place of networks."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest
from elastic_arm import ARM, GEOMETRY, MODEL, ROOT

from flexik.datasets.elastic_arm.gauges import read, uncertainty
from flexik.datasets.elastic_arm.readings import gauges_of
from flexik.errors import DataError
from flexik.evaluation.conditions import random_conditions
from flexik.evaluation.errors import evaluate
from flexik.evaluation.regression import correlation
from flexik.evaluation.targets import reachable_targets
from flexik.kinematics.elastic_arm import DEFORMATION, elbow, forward, inverse_by_rule
from flexik.kinematics.status import OUT_OF_REACH, REACHED
from flexik.multibody.elastic_arm.model import equilibria, solve
from flexik.positioning.elastic_arm.assembly import arm_method, uncompensated
from flexik.positioning.elastic_arm.closed_form import closed_form
from flexik.positioning.elastic_arm.learnt_angles import GaugeNetwork, InverseNetwork
from flexik.positioning.method import PositioningError

TARGETS = np.array([[1.1, 0.3], [0.9, 0.7], [1.15, -0.1], [0.6, 0.85]])
PAYLOAD = np.array([3.0, 0.5, 1.5, 2.2])
HOME = np.zeros((4, 2))


def predicting(function):
    return SimpleNamespace(predict=function)


def exact_deflection(inputs):
    angles = inputs[:, :2]
    return equilibria(MODEL, angles, inputs[:, 2]).tip - forward(GEOMETRY, angles)


def tips(angles, payload):
    return equilibria(MODEL, angles, payload).tip


def test_rigid_inverse_puts_the_rigid_tip_on_targets_and_keeps_the_rest():
    targets = np.vstack([TARGETS[:2], [[1.3, 0.0]]])
    solution = closed_form(GEOMETRY)(targets, np.full((3, 2), 0.1))
    assert solution.status.tolist() == [REACHED, REACHED, OUT_OF_REACH]
    assert forward(GEOMETRY, solution.strokes[:2]) == pytest.approx(targets[:2], abs=1e-12)
    assert solution.strokes[2].tolist() == [0.1, 0.1]


def test_a_correction_does_not_turn_the_elbow_over():
    """Along a line across the border between the elbows, by the rule of the original target."""
    y = np.linspace(0.1, 0.35, 400)
    line = np.column_stack([np.full(400, 1.12), y])
    side = elbow(inverse_by_rule(GEOMETRY, line).angles)
    border = int(np.flatnonzero(np.diff(side))[0])
    original, corrected = line[[border]], line[[border + 1]]
    inverse = closed_form(GEOMETRY)
    alone = inverse(corrected, HOME[:1])
    kept = inverse(corrected, HOME[:1], original)
    assert elbow(alone.strokes)[0] == side[border + 1] != side[border] == elbow(kept.strokes)[0]
    assert forward(GEOMETRY, kept.strokes) == pytest.approx(corrected, abs=1e-12)


def test_combined_with_the_exact_deflection_converges_to_the_target():
    conditions = random_conditions(TARGETS, PAYLOAD)
    errors = {
        name: evaluate(
            arm_method(ARM.methods[name], GEOMETRY, predicting(exact_deflection)),
            conditions,
            HOME,
            tips,
            ("theta_1", "theta_2"),
        )["error"].to_numpy()
        for name in ("combined", "combined_iterated")
    }
    none = evaluate(uncompensated(GEOMETRY), conditions, HOME, tips, ("theta_1", "theta_2"))
    assert none["error"].min() > 1e-3
    assert errors["combined"].max() < 1e-3
    assert errors["combined_iterated"].max() < 1e-6


def test_inverse_network_is_asked_for_target_payload_and_elbow():
    asked = []

    def predict(inputs):
        asked.append(inputs)
        return np.full((len(inputs), 2), 9.0)  # beyond both limits

    targets = np.vstack([TARGETS, [[1.3, 0.0]]])
    method = InverseNetwork(GEOMETRY, predicting(predict))
    command = method(targets, np.append(PAYLOAD, 1.0), np.zeros((5, 2)))
    side = elbow(inverse_by_rule(GEOMETRY, TARGETS).angles)
    assert set(side) == {-1.0, 1.0}
    assert np.array_equal(asked[0], np.column_stack([TARGETS, PAYLOAD, side]))
    assert command.status.tolist() == [REACHED] * 4 + [OUT_OF_REACH]
    assert np.array_equal(command.strokes[:4], np.tile(GEOMETRY.upper, (4, 1)))
    assert command.strokes[4].tolist() == [0.0, 0.0]
    assert command.diagnostics["n_clipped"].tolist() == [2, 2, 2, 2, 0]


EIGHT = (*DEFORMATION, "p_x", "p_y")


def test_gauge_network_is_told_the_deformation_beside_the_target():
    deformation = np.arange(24.0).reshape(4, 6)

    def predict(inputs):
        assert np.array_equal(inputs, np.hstack([deformation, TARGETS]))
        return 0.1 * np.ones((4, 2))

    method = GaugeNetwork(GEOMETRY, predicting(predict), EIGHT, deformation)
    command = method(TARGETS, PAYLOAD, HOME)
    assert (command.strokes == 0.1).all() and (command.status == REACHED).all()
    with pytest.raises(PositioningError, match="deformation by the gauges"):
        method(TARGETS[:2], PAYLOAD[:2], HOME[:2])


def test_gauge_networks_of_other_kinds_are_told_their_inputs():
    deformation, asked = np.arange(24.0).reshape(4, 6), []

    def predict(inputs):
        asked.append(inputs)
        return np.full((4, 2), 9.0)

    network = predicting(predict)
    for label, kind in (
        ("published_network_without_dx", "gauges_without_dx"),
        ("gauges_elbow_lm_noisy", "gauges_elbow"),
    ):
        method = arm_method(ARM.methods[label], GEOMETRY, network, deformation, kind)
        command = method(TARGETS, PAYLOAD, HOME)
        assert command.diagnostics["n_clipped"].tolist() == [2] * 4
    side = elbow(inverse_by_rule(GEOMETRY, TARGETS).angles)
    assert np.array_equal(asked[0], np.hstack([deformation[:, [0, 2, 3, 5]], TARGETS]))
    assert np.array_equal(asked[1], np.column_stack([deformation, TARGETS, side]))


def test_noisy_gauges_are_noisy_at_the_targets_too(monkeypatch):
    """The stage's own choice of what a method is told."""
    path = ROOT / "stages" / "elastic_arm_evaluate.py"
    spec = importlib.util.spec_from_file_location("elastic_arm_evaluate", path)
    stage = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(stage)
    monkeypatch.setattr(stage, "trained", lambda arm, name: predicting(None))
    angles = inverse_by_rule(GEOMETRY, TARGETS).angles
    found = equilibria(MODEL, angles, PAYLOAD)
    told = {
        label: stage.chosen_method(ARM, label, MODEL, found).deformation
        for label, method in ARM.methods.items()
        if method.method == "gauges"
    }
    exact = read(gauges_of(ARM), *found[1:], None).deformation
    uncertain = uncertainty(gauges_of(ARM))
    for label, deformation in told.items():
        off = np.abs(deformation - exact)
        network = ARM.all_networks[ARM.methods[label].network]
        if network.readings == "noise_free":
            assert np.array_equal(deformation, exact)
        else:
            assert (off[:, [0, 2, 3, 5]] > 0.0).all() and (off < 6 * uncertain).all()
            assert (off[:, [1, 4]] > 0.0).all() == (network.readings == "noisy")


def test_a_gauge_method_without_gauges_is_refused():
    with pytest.raises(PositioningError, match="deformation that the gauges show"):
        arm_method(ARM.methods["published_network"], GEOMETRY, predicting(None))


def test_random_targets_of_two_joints_are_reached():
    found = reachable_targets(
        np.vstack([TARGETS, [[1.3, 0.0]]]),
        np.append(PAYLOAD, 1.0),
        closed_form(GEOMETRY),
        lambda angles: forward(GEOMETRY, angles),
        lambda angles, payload: solve(MODEL, angles, payload)[0].tip,
        1e-7,
        30,
        n_strokes=2,
    )
    assert np.array_equal(found.targets, TARGETS)
    assert tips(found.strokes, found.payload) == pytest.approx(TARGETS, abs=1e-7)


def test_correlation_is_that_of_numpy_and_needs_variation():
    generator = np.random.default_rng(0)
    a = generator.normal(size=(50, 2))
    b = a + 0.1 * generator.normal(size=(50, 2))
    expected = [np.corrcoef(a[:, k], b[:, k])[0, 1] for k in (0, 1)]
    assert correlation(a, b) == pytest.approx(expected, rel=1e-12)
    assert correlation(a, -2.0 * a + 3.0) == pytest.approx([-1.0, -1.0])
    for wrong in (np.ones((50, 2)), np.full((50, 2), np.nan)):
        with pytest.raises(DataError, match="vary"):
            correlation(a, wrong)
    with pytest.raises(DataError, match="shape"):
        correlation(a, b[:-1])
