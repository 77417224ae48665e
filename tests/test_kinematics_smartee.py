"""SmartEE: the leg formula as printed and by rotation matrices, closure, inverse, Newton."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.errors import ParameterError
from flexik.kinematics.smartee import (
    SmartEEGeometry,
    closure,
    closure_jacobian,
    complete_direct,
    elbow_circles,
    inverse,
    leg_tip_velocities,
    leg_tips,
    rotation_zyz,
)
from flexik.kinematics.smartee_newton import closed, newton_steps, solve_elbows, wrapped
from flexik.kinematics.status import (
    NOT_CONVERGED,
    OTHER_BRANCH,
    OUT_OF_REACH,
    REACHED,
    SINGULAR,
)

GEOMETRY = SmartEEGeometry(0.066, 0.114, 0.055, 0.05)
HALF = np.array([0.0135, 0.01, 0.0075, *[np.radians(10.0)] * 3])
HEIGHT = np.array([0.0, 0.0, 0.14])


def random_poses(n, seed=0, scale=1.0):
    values = np.random.default_rng(seed).uniform(-scale * HALF, scale * HALF, (n, 6))
    return HEIGHT + values[:, :3], rotation_zyz(values[:, 3:])


def random_joints(n, scale=1.0):
    return inverse(GEOMETRY, *random_poses(n, scale=scale)).joints


def centre_elbows():
    return inverse(GEOMETRY, HEIGHT[None], np.eye(3)[None]).joints[0, :, 2]


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def tips_at(joints):
    return leg_tips(elbow_circles(GEOMETRY, joints[..., :2]), joints[..., 2])


def test_legs_follow_the_printed_formula_and_its_product_of_rotations():
    joints = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 3, 3))
    found = tips_at(joints)
    first, second = GEOMETRY.first_link, GEOMETRY.second_link
    for row in range(50):
        for leg in range(3):
            t1, t2, t3 = joints[row, leg]
            link = turn("z", t3) @ [0.0, -second, 0.0]
            product = turn("z", t1) @ turn("y", -t2) @ (np.array([0.0, -first, 0.0]) + link)
            reach = first + second * np.cos(t3)
            across = second * np.sin(t3)
            printed = [
                reach * np.sin(t1) + across * np.cos(t1) * np.cos(t2),
                -reach * np.cos(t1) + across * np.sin(t1) * np.cos(t2),
                across * np.sin(t2),
            ]
            np.testing.assert_allclose(product, printed, atol=1e-15)
            base = np.array([GEOMETRY.base_radius, 0.0, 0.0]) + turn("x", -np.pi / 2) @ product
            expected = turn("z", 2.0 * np.pi / 3.0 * leg) @ base
            np.testing.assert_allclose(found[row, leg], expected, atol=1e-15)


def test_rotation_is_the_product_of_three():
    a, b, c = angles = np.array([0.3, -0.7, 1.1])
    expected = turn("z", a) @ turn("y", b) @ turn("z", c)
    np.testing.assert_allclose(rotation_zyz(angles[None])[0], expected, atol=1e-15)


def test_round_trip_of_10000_random_poses():
    position, rotation = random_poses(10_000)
    found = inverse(GEOMETRY, position, rotation)
    assert np.all(found.status == REACHED)
    assert np.all(found.joints[..., 2] < 0.0)
    tips = tips_at(found.joints)
    assert np.abs(closure(tips, GEOMETRY.side)).max() < 1e-15
    direct = solve_elbows(GEOMETRY, found.joints[..., :2], centre_elbows())
    assert np.all(direct.status == REACHED)
    assert np.abs(direct.elbows - found.joints[..., 2]).max() < 1e-10
    position_again, rotation_again = complete_direct(GEOMETRY, found.joints[..., :2], direct.elbows)
    assert np.abs(position_again - position).max() < 1e-10
    assert np.abs(rotation_again - rotation).max() < 1e-10


@settings(deadline=None, max_examples=60)
@given(
    st.tuples(*(st.floats(-2.0, 2.0) for _ in range(6))),
    st.floats(0.05, 0.15),
    st.floats(0.05, 0.15),
)
def test_what_is_reached_is_at_the_pose_whatever_the_links(shares, first, second):
    geometry = SmartEEGeometry(first, second, 0.055, 0.05)
    values = np.array(shares) * HALF
    position, rotation = (HEIGHT + values[:3])[None], rotation_zyz(values[None, 3:])
    found = inverse(geometry, position, rotation)
    if found.status[0] == OUT_OF_REACH:
        assert np.isnan(found.joints).all()
        return
    again = complete_direct(geometry, found.joints[..., :2], found.joints[..., 2])
    # near a stretched leg theta3 is known to the root of the rounding only
    np.testing.assert_allclose(again[0], position, atol=1e-7)
    np.testing.assert_allclose(again[1], rotation, atol=1e-6)


def test_poses_beyond_the_legs_are_flagged_alone():
    position, rotation = random_poses(3)
    position[1, 2] = 0.3
    found = inverse(GEOMETRY, position, rotation)
    assert found.status.tolist() == [REACHED, OUT_OF_REACH, REACHED]
    assert np.isnan(found.joints[1]).all() and np.isfinite(found.joints[[0, 2]]).all()


def test_closure_jacobian_against_central_differences():
    joints = random_joints(20)
    circles = elbow_circles(GEOMETRY, joints[..., :2])
    elbows = joints[..., 2] + np.random.default_rng(2).normal(scale=0.1, size=(20, 3))
    found = closure_jacobian(leg_tips(circles, elbows), leg_tip_velocities(circles, elbows))
    step = 1e-6
    for leg in range(3):
        change = np.zeros(3)
        change[leg] = step
        sides = [closure(leg_tips(circles, elbows + s * change), GEOMETRY.side) for s in (1, -1)]
        np.testing.assert_allclose(found[:, :, leg], (sides[0] - sides[1]) / (2 * step), atol=1e-10)


def test_a_newton_step_solves_the_linear_equations():
    actuated = random_joints(50)[..., :2]
    circles = elbow_circles(GEOMETRY, actuated)
    elbows = np.tile(centre_elbows(), (50, 1)) + 0.05
    tips = leg_tips(circles, elbows)
    jacobian = closure_jacobian(tips, leg_tip_velocities(circles, elbows))
    expected = elbows - np.linalg.solve(jacobian, closure(tips, GEOMETRY.side)[..., None])[..., 0]
    np.testing.assert_allclose(newton_steps(GEOMETRY, actuated, elbows, 1), expected, rtol=1e-12)


def test_newton_converges_quadratically():
    """The error of a step is at most a constant times the square of the one before."""
    joints = random_joints(200)
    start = joints[..., 2] + np.random.default_rng(3).uniform(-0.05, 0.05, (200, 3))
    errors = [
        np.linalg.norm(newton_steps(GEOMETRY, joints[..., :2], start, n) - joints[..., 2], axis=1)
        for n in range(4)
    ]
    largest = [error.max() for error in errors]
    for before, after in ((0, 1), (1, 2)):
        ratio = errors[after] / errors[before] ** 2
        # of the order of the geometry's curvature, the same for errors a hundred times smaller
        assert 0.01 < np.median(ratio) < 3.0
        assert ratio.max() < 10.0
    assert largest[0] > 0.05 and largest[1] < 2e-2 and largest[2] < 1e-4 and largest[3] < 1e-8


def test_every_row_of_newton_has_its_own_status():
    joints = random_joints(3)
    actuated, elbows = joints[..., :2].copy(), joints[..., 2].copy()
    # first links up and second links level: every tip moves straight up, none from another
    actuated[1], elbows[1] = 0.0, -np.pi / 2.0
    # the elbow inside: the same tips with theta2 turned by pi, and theta3 > 0
    actuated[2, :, 1] += np.pi
    elbows[2] *= -1.0
    found = solve_elbows(GEOMETRY, actuated, elbows)
    assert found.status.tolist() == [REACHED, SINGULAR, OTHER_BRANCH]
    assert found.n_steps.tolist() == [0, 0, 0]
    np.testing.assert_allclose(found.elbows, elbows, rtol=1e-14)
    assert found.residual[0] < 1e-12 < found.residual[1]
    assert np.isnan(newton_steps(GEOMETRY, actuated, elbows, 1)[1]).all()


def test_elbows_a_turn_apart_are_the_same():
    joints = random_joints(20)
    for turns in (1, -2):
        start = centre_elbows() + 2.0 * np.pi * turns
        found = solve_elbows(GEOMETRY, joints[..., :2], start)
        assert np.all(found.status == REACHED)
        np.testing.assert_allclose(found.elbows, joints[..., 2], atol=1e-12)
        turned = joints[..., 2] + 2.0 * np.pi * turns
        assert np.all(closed(GEOMETRY, joints[..., :2], turned, 1e-12)[0] == REACHED)
    angles = np.array([0.0, 3.0, -3.0, 4.0, -7.0])
    np.testing.assert_allclose(
        wrapped(angles), [0.0, 3.0, -3.0, 4.0 - 2.0 * np.pi, 2.0 * np.pi - 7.0], atol=1e-15
    )


def test_elbows_however_found_have_a_status():
    joints = random_joints(4)
    actuated, elbows = joints[..., :2].copy(), joints[..., 2].copy()
    elbows[1] += 1e-3
    elbows[2] = np.nan
    actuated[3, :, 1] += np.pi
    elbows[3] *= -1.0
    status, residual = closed(GEOMETRY, actuated, elbows, 1e-9)
    assert status.tolist() == [REACHED, NOT_CONVERGED, SINGULAR, OTHER_BRANCH]
    assert residual[0] < 1e-13 and 1e-5 < residual[1] < 1e-1 and np.isnan(residual[2])
    tips = tips_at(np.concatenate([actuated, elbows[..., None]], axis=2))[1]
    sides = [np.linalg.norm(tips[k] - tips[k - 1]) ** 2 / GEOMETRY.side**2 - 1.0 for k in range(3)]
    assert residual[1] == pytest.approx(np.abs(sides).max(), rel=1e-9)


def test_legs_that_no_plate_joins_do_not_converge():
    geometry = SmartEEGeometry(0.2, 0.02, 0.055, 0.05)
    actuated = np.zeros((1, 3, 2))
    actuated[..., 0] = np.pi / 2.0  # elbows 0.255 m from the middle, tips 0.02 m from those
    found = solve_elbows(geometry, actuated, np.full(3, -1.0))
    assert found.status[0] in (NOT_CONVERGED, SINGULAR)
    assert found.residual[0] > 1.0


def test_steps_that_run_out_are_told():
    actuated = random_joints(30, scale=2.0)[..., :2]
    short = solve_elbows(GEOMETRY, actuated, centre_elbows(), n_steps=1)
    assert np.all(short.status == NOT_CONVERGED) and np.all(short.n_steps == 1)
    whole = solve_elbows(GEOMETRY, actuated, centre_elbows())
    again = solve_elbows(GEOMETRY, actuated[7:8], centre_elbows())
    np.testing.assert_array_equal(again.elbows[0], whole.elbows[7])


@pytest.mark.parametrize("name", ["first_link", "second_link", "base_radius", "plate_radius"])
@pytest.mark.parametrize("value", [0.0, -0.1, float("nan")])
def test_lengths_must_be_positive(name, value):
    lengths = vars(GEOMETRY) | {name: value}
    with pytest.raises(ParameterError, match=name):
        SmartEEGeometry(**lengths)
