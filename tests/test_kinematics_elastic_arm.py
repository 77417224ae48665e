"""Kinematics of the elastic arm: homogeneous matrices, printed equations, round trips."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.kinematics.elastic_arm import (
    ArmGeometry,
    elbow,
    flexible_forward,
    inverse,
    inverse_by_rule,
)
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED

LENGTHS = (0.57, 0.62)
LIMITS = np.radians([[-10.0, 45.0], [-45.0, 70.0]]).tolist()
ARM = ArmGeometry(LENGTHS, (tuple(LIMITS[0]), tuple(LIMITS[1])))
FREE = ArmGeometry(LENGTHS, ((-np.pi, np.pi), (-np.pi, np.pi)))


def denavit_hartenberg(theta, length):
    """Equation 11 with alpha = 0 and d = 0 (table 1)."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0, length * c], [s, c, 0, length * s], [0, 0, 1, 0], [0, 0, 0, 1]])


def error_matrix(dy, dx, dphi):
    """Equation 18."""
    c, s = np.cos(dphi), np.sin(dphi)
    return np.array([[c, -s, 0, dx], [s, c, 0, dy], [0, 0, 1, 0], [0, 0, 0, 1]])


def drawn(n, seed=0):
    generator = np.random.default_rng(seed)
    return generator.uniform(-np.pi, np.pi, (n, 2)), generator.uniform(-0.3, 0.3, (n, 6))


def test_flexible_tip_is_that_of_the_product_of_matrices():
    angles, deformation = drawn(200)
    products = [
        denavit_hartenberg(theta[0], 0.57)
        @ error_matrix(*d[:3])
        @ denavit_hartenberg(theta[1], 0.62)
        @ error_matrix(*d[3:])
        for theta, d in zip(angles, deformation, strict=True)
    ]
    expected = np.array(products)[:, :2, 3]
    assert flexible_forward(ARM, angles, deformation) == pytest.approx(expected, abs=1e-14)


def test_flexible_tip_is_that_of_the_printed_equations():
    """Equations 44 and 45, term by term."""
    angles, deformation = drawn(200, 1)
    a1, a2 = ARM.lengths
    dy1, dx1, dphi1, dy2, dx2, _ = deformation.T
    c1, c2, s1, s2 = *np.cos(angles.T), *np.sin(angles.T)
    cd1, sd1 = np.cos(dphi1), np.sin(dphi1)
    px = (
        c1 * c2 * (cd1 * (dx2 + a2) - sd1 * dy2)
        - c1 * s2 * (cd1 * dy2 + sd1 * (dx2 + a2))
        - s1 * c2 * (sd1 * (dx2 + a2) + cd1 * dy2)
        + s1 * s2 * (sd1 * dy2 - cd1 * (dx2 + a2))
        + c1 * (dx1 + a1)
        - s1 * dy1
    )
    py = (
        s1 * c2 * (cd1 * (dx2 + a2) - sd1 * dy2)
        - s1 * s2 * (sd1 * (dx2 + a2) + cd1 * dy2)
        + c1 * c2 * (sd1 * (dx2 + a2) + cd1 * dy2)
        + c1 * s2 * (cd1 * (dx2 + a2) - sd1 * dy2)
        + c1 * dy1
        + s1 * (dx1 + a1)
    )
    found = flexible_forward(ARM, angles, deformation)
    assert found == pytest.approx(np.column_stack([px, py]), abs=1e-14)


def test_rigid_tip_of_plain_poses():
    angles = np.radians([[0.0, 0.0], [90.0, 0.0], [0.0, 90.0], [30.0, -30.0]])
    expected = [[1.19, 0.0], [0.0, 1.19], [0.57, 0.62], [0.57 * np.sqrt(0.75) + 0.62, 0.285]]
    assert ARM.forward(angles) == pytest.approx(np.array(expected), abs=1e-15)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_inverse_of_forward_on_both_elbows(theta_1, theta_2):
    angles = np.array([[theta_1, theta_2]])
    tip = FREE.forward(angles)
    for side in (1.0, -1.0):
        found = inverse(FREE, tip, side)
        assert found.status.tolist() == [REACHED]
        assert FREE.forward(found.values) == pytest.approx(tip, abs=1e-7)
    own = inverse(FREE, tip, elbow(angles)).values
    # the root of a stretched arm costs half the digits
    assert np.angle(np.exp(1j * (own - angles))) == pytest.approx(np.zeros((1, 2)), abs=1e-6)


def test_elbows_mirror_each_other():
    tip = ARM.forward(np.radians([[5.0, 20.0]]))
    up, down = inverse(FREE, tip, 1.0).values[0], inverse(FREE, tip, -1.0).values[0]
    assert up[1] == pytest.approx(-down[1])
    assert np.degrees(up) == pytest.approx([5.0, 20.0])
    # the line to the tip halves the angle between the two first links
    assert (up[0] + down[0]) / 2 == pytest.approx(np.arctan2(tip[0, 1], tip[0, 0]))


def test_rule_takes_the_elbow_farther_inside_the_limits():
    # the first tip has its other elbow at (26, -20) degrees, the second at (-1, 20): nearer -10
    angles = np.radians([[5.0, 20.0], [20.0, -20.0], [0.0, -35.0], [15.0, -40.0], [30.0, 0.0]])
    found = inverse_by_rule(ARM, ARM.forward(angles))
    assert found.reached.all()
    assert ARM.forward(found.values) == pytest.approx(ARM.forward(angles), abs=1e-12)
    assert elbow(found.values).tolist() == [1.0, -1.0, -1.0, -1.0, 1.0]


@given(st.floats(-0.8, 0.8), st.floats(0.5, 1.19))
def test_rule_reaches_what_either_elbow_reaches(direction, reach):
    target = reach * np.array([[np.cos(direction), np.sin(direction)]])
    either = [inverse(ARM, target, side) for side in (1.0, -1.0)]
    found = inverse_by_rule(ARM, target)
    assert found.reached[0] == any(solution.reached[0] for solution in either)
    assert any(np.array_equal(found.values, s.values) for s in either)


def test_status_and_angles_of_targets_beyond_reach_and_limits():
    targets = np.array([[1.2, 0.0], [0.01, 0.0], [-1.0, 0.1], [1.1, 0.3]])
    found = inverse_by_rule(ARM, targets)
    assert found.status.tolist() == [OUT_OF_REACH, OUT_OF_REACH, ACTUATOR_LIMIT, REACHED]
    assert np.isnan(found.values).all(axis=1).tolist() == [True, True, False, False]
    assert ARM.forward(found.values[2:]) == pytest.approx(targets[2:], abs=1e-12)


def test_limits_admit_the_poses_on_them():
    corners = np.array([[a, b] for a in ARM.limits[0] for b in ARM.limits[1]])
    found = inverse(ARM, ARM.forward(corners), elbow(corners))
    assert found.reached.all()
    assert found.values == pytest.approx(corners, abs=1e-9)


def test_the_inverse_of_a_manipulator_keeps_what_it_does_not_reach():
    targets = np.array([[1.1, 0.3], [0.9, 0.5], [1.3, 0.0]])
    solution = ARM.inverse(targets, np.full((3, 2), 0.1))
    assert solution.status.tolist() == [REACHED, REACHED, OUT_OF_REACH]
    assert ARM.forward(solution.values[:2]) == pytest.approx(targets[:2], abs=1e-12)
    assert solution.values[2].tolist() == [0.1, 0.1]


def test_a_correction_does_not_turn_the_elbow_over():
    """Along a line across the border between the elbows, by the rule of the original target."""
    line = np.column_stack([np.full(400, 1.12), np.linspace(0.1, 0.35, 400)])
    side = ARM.branch(inverse_by_rule(ARM, line).values)[:, 0]
    border = int(np.flatnonzero(np.diff(side))[0])
    original, corrected = line[[border]], line[[border + 1]]
    alone = ARM.inverse(corrected, np.zeros((1, 2)))
    kept = ARM.inverse(corrected, np.zeros((1, 2)), original)
    assert ARM.branch(alone.values)[0, 0] == side[border + 1] != side[border]
    assert ARM.branch(kept.values)[0, 0] == side[border]
    assert ARM.forward(kept.values) == pytest.approx(corrected, abs=1e-12)
