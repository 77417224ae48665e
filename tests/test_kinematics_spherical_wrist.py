"""Closed-form inverse of the six-joint arm: round trips, borders, and an independent package."""

import dataclasses

import numpy as np
import py_opw_kinematics as opw
import pytest
from fanuc_arm import ARM, LIMITS, largest_error, random_joints, within_limits
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from flexik.errors import ParameterError
from flexik.kinematics.serial_arm import Pose, forward, jacobian, pose_errors
from flexik.kinematics.spherical_wrist import (
    ELBOW,
    N_CONFIGURATIONS,
    SHOULDER,
    WRIST,
    admissible,
    canonical,
    check_spherical_wrist,
    configuration,
    inverse,
    reach,
    wrapped,
)
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED

N_ROUND_TRIP = 100_000


@pytest.fixture(scope="module")
def trip():
    joints = random_joints(N_ROUND_TRIP)
    pose = forward(ARM, joints)
    return joints, pose, inverse(ARM, pose, joints)


def test_round_trip_gives_the_joints_back(trip):
    joints, _, found = trip
    rows, number = np.arange(N_ROUND_TRIP), configuration(ARM, joints)
    assert (found.status[rows, number] == REACHED).all()
    # digits are lost towards singular poses, as the square root of rounding at worst
    difference = np.abs(found.joints[rows, number] - joints).max(axis=1)
    sine = np.minimum(np.abs(np.sin(joints[:, 4])), 1.0)
    assert np.quantile(difference, 0.99) < 1e-12
    assert (difference * sine).max() < 1e-9


def test_every_configuration_reaches_the_pose(trip):
    _, pose, found = trip
    for k in range(N_CONFIGURATIONS):
        rows = found.status[:, k] != OUT_OF_REACH
        assert 0.5 < rows.mean() < 1.0
        distance, angle = pose_errors(pose.rows(rows), forward(ARM, found.joints[rows, k]))
        assert distance.max() < 1e-13 and angle.max() < 1e-10
        assert (configuration(ARM, found.joints[rows, k]) == k).all()
    # the elbow has two solutions or none, and the wrist always two
    status = found.status.reshape(-1, 2, 2, 2) == OUT_OF_REACH
    assert (status == status[:, :, :1, :1]).all()


def test_limits_are_applied_to_every_configuration(trip):
    _, _, found = trip
    assert within_limits(ARM, found.joints[found.reached]).all()
    limited = found.status == ACTUATOR_LIMIT
    assert limited.any()
    assert not within_limits(ARM, found.joints[limited]).any()
    assert np.isnan(found.joints[found.status == OUT_OF_REACH]).all()
    assert set(np.bincount(found.reached.sum(axis=1)).nonzero()[0]) <= {1, 2, 3, 4, 6, 8}


def test_wrist_configurations_are_half_turns_of_one_another(trip):
    _, _, found = trip
    both = found.status[:, 0] != OUT_OF_REACH
    one, other = found.joints[both, 0], found.joints[both, WRIST]
    assert np.abs(one[:, :3] - other[:, :3]).max() == 0.0
    assert np.abs(wrapped(one[:, 4] + other[:, 4])).max() < 1e-12
    for joint in (3, 5):
        turned = wrapped(one[:, joint] - other[:, joint])
        assert np.abs(np.abs(turned) - np.pi).max() < 1e-9


def test_joints_turn_as_close_to_the_reference_as_limits_allow():
    joints = np.deg2rad([[10.0, 20.0, -150.0, 300.0, 40.0, -200.0]])
    pose = forward(ARM, joints)
    number = configuration(ARM, joints)[0]
    assert inverse(ARM, pose, joints).joints[0, number] == pytest.approx(joints[0])
    resting = np.rad2deg(inverse(ARM, pose).joints[0, number])
    assert resting == pytest.approx([10.0, 20.0, -150.0, -60.0, 40.0, 160.0])
    # joint 3 is the same at 210 degrees
    other = np.rad2deg(inverse(ARM, pose, np.full(6, 4.0)).joints[0, number])
    assert other == pytest.approx([10.0, 20.0, 210.0, 300.0, 40.0, 160.0])


def test_canonical_joints_are_the_same_pose_and_configuration():
    joints = random_joints(5000)
    found = canonical(ARM, joints)
    assert largest_error(forward(ARM, joints), found) < 1e-12
    assert np.array_equal(configuration(ARM, joints), configuration(ARM, found))
    assert np.abs(found[:, [0, 3, 5]]).max() <= np.pi
    # the elbow angle spans half a turn in each configuration
    elbow = (configuration(ARM, joints) & ELBOW) > 0
    assert np.ptp(found[elbow, 2]) < np.pi and np.ptp(found[~elbow, 2]) < np.pi
    assert within_limits(ARM, found).all()


def test_wrist_singularity_is_flagged_and_still_solved():
    joints = np.tile(np.deg2rad([20.0, 30.0, 10.0, 40.0, 0.0, 50.0]), (3, 1))
    joints[:, 4] = [0.0, 1e-8, 0.5]
    pose = forward(ARM, joints)
    found = inverse(ARM, pose)
    number = configuration(ARM, joints)
    assert found.singular[np.arange(3), number].tolist() == [True, True, False]
    for k in range(N_CONFIGURATIONS):
        rows = found.reached[:, k]
        # where cosines are 1 to the last digit, angles are known to half the digits
        assert largest_error(pose.rows(rows), found.joints[rows, k]) < 1e-8


def shoulder_pose(radius):
    """A pose whose wrist centre lies `radius` from axis 1, at a height the arm reaches."""
    joints = np.deg2rad([[0.0, 10.0, 30.0, 20.0, 60.0, 10.0]])
    pose = forward(ARM, joints)
    centre = pose.position - 0.175 * pose.rotation[:, :, 2]
    goal = np.array([[radius, 0.0, 0.565 + 1.2]])
    return Pose(pose.position + goal - centre, pose.rotation)


def test_shoulder_singularity_is_flagged_and_still_solved():
    for radius, singular in ((0.0, True), (1e-7, True), (1e-3, False)):
        pose = shoulder_pose(radius)
        found = inverse(ARM, pose)
        assert found.reached.any()
        assert (found.singular[found.status != OUT_OF_REACH] == singular).all()
        for k in np.flatnonzero(found.reached[0]):
            assert largest_error(pose, found.joints[:, k]) < 1e-9


def test_reach_ends_with_the_stretched_arm():
    assert reach(ARM) == pytest.approx(2.050, abs=5e-4)
    assert reach(ARM) == pytest.approx(0.15 + 0.87 + np.hypot(0.17, 1.016))
    # flange straight ahead, wrist centre at the height of joint 2
    turn = forward(ARM, np.zeros((1, 6))).rotation
    for beyond, status in ((-1e-3, REACHED), (1e-6, OUT_OF_REACH)):
        position = np.array([[reach(ARM) + 0.175 + beyond, 0.0, 0.565]])
        found = inverse(ARM, Pose(position, turn))
        assert (found.status[0, :SHOULDER] == status).all()
        assert (found.status[0, SHOULDER:] == OUT_OF_REACH).all()
    edge = inverse(ARM, Pose(np.array([[reach(ARM) + 0.175, 0.0, 0.565]]), turn))
    assert edge.singular[0, :SHOULDER].all() and edge.reached[0, :SHOULDER].all()


angles = st.floats(-1.0, 1.0)


@given(st.tuples(*[angles] * 6))
def test_any_joints_come_back(share):
    joints = np.array([0.5 * (LIMITS.sum(axis=0) + np.array(share) * np.ptp(LIMITS, axis=0))])
    pose = forward(ARM, joints)
    found = inverse(ARM, pose, joints)
    assert found.reached.any()
    for k in np.flatnonzero(found.reached[0]):
        # a joint outside its limits by LIMIT_TOLERANCE is put on them
        assert largest_error(pose, found.joints[:, k]) < 1e-8


@pytest.mark.parametrize("power", range(5, 15))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_closed_form_is_exact_next_to_the_wrist_singularity(power, sign):
    joints = random_joints(2000, seed=power)
    joints[:, 4] = sign * 10.0**-power
    # no limit to put a joint on
    free = dataclasses.replace(ARM, minimum=(-20.0,) * 6, maximum=(20.0,) * 6)
    pose = forward(free, joints)
    found = inverse(free, pose, joints)
    assert found.reached.any(axis=1).all()
    for k in range(N_CONFIGURATIONS):
        rows = found.reached[:, k]
        distance, angle = pose_errors(pose.rows(rows), forward(free, found.joints[rows, k]))
        assert distance.max() < 1e-12 and angle.max() < 3e-12


def test_joints_are_turned_to_where_their_limits_admit_them():
    shifted = dataclasses.replace(
        ARM,
        minimum=(-1.1, *ARM.minimum[1:3], 0.5, *ARM.minimum[4:]),
        maximum=(6.0, *ARM.maximum[1:3], 7.5, *ARM.maximum[4:]),
    )
    low, high = np.array(shifted.minimum), np.array(shifted.maximum)
    drawn = np.random.default_rng(2).uniform(low, high, (500, 6))
    joints = canonical(shifted, drawn)
    assert not within_limits(shifted, joints).all()
    turned = admissible(shifted, joints)
    assert within_limits(shifted, turned).all()
    assert np.abs(wrapped(turned - drawn)).max() < 1e-12
    kept = within_limits(shifted, joints)
    assert np.array_equal(turned[kept], joints[kept])
    # joint 2 has no other turn
    beyond = np.array([[0.0, 3.0, 0.0, 1.0, 0.0, 0.0]])
    assert np.array_equal(admissible(shifted, beyond), beyond)


@pytest.mark.parametrize(
    ("column", "values", "what"),
    [
        ("d", (0.5, 0.1, 0.0, -1.0, 0.0, -0.2), "d2 = 0"),
        ("a", (0.1, 0.8, 0.1, 0.2, 0.0, 0.0), "a4 = 0"),
        ("a", (0.1, -0.8, 0.1, 0.0, 0.0, 0.0), "a2 > 0"),
        ("alpha", (1.0, np.pi, -1.5, 1.5, -1.5, np.pi), "alpha1"),
        ("alpha", (np.pi / 2, 1.0, np.pi / 2, np.pi / 2, np.pi / 2, 0.0), "alpha2"),
    ],
)
def test_the_closed_form_refuses_other_arms(column, values, what):
    with pytest.raises(ParameterError, match=what):
        check_spherical_wrist(dataclasses.replace(ARM, **{column: values}))
    check_spherical_wrist(ARM)


# The package of Brandstoetter's notation: its arm at rest points up, and joints 3 to 6 turn the
# other way
MODEL = opw.KinematicModel(a1=0.15, a2=-0.17, b=0.0, c1=0.565, c2=0.87, c3=1.016, c4=0.175)
SIGNS = np.array([1.0, 1.0, -1.0, -1.0, -1.0, -1.0])
SHIFT = np.array([0.0, 0.0, np.pi / 2, 0.0, 0.0, np.pi])


def test_forward_agrees_with_an_independent_package():
    joints = random_joints(2000)
    expected = opw.Robot(MODEL, degrees=False).batch_forward(SIGNS * joints + SHIFT)
    found = forward(ARM, joints)
    assert np.abs(found.position - expected.translation).max() < 1e-14
    assert np.abs(found.rotation - expected.rotation.as_matrix()).max() < 1e-14


def test_inverse_agrees_with_an_independent_package():
    joints = random_joints(5000)
    pose = forward(ARM, joints)
    matrices = np.tile(np.eye(4), (5000, 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = pose.rotation, pose.position
    theirs = opw.Robot(MODEL, degrees=False).reach(RigidTransform.from_matrix(matrices))
    their_joints = SIGNS * (theirs.joints - SHIFT)
    found = inverse(ARM, pose)
    assert np.array_equal(
        np.isnan(their_joints[:, :, 0]).sum(axis=1), (found.status == OUT_OF_REACH).sum(axis=1)
    )
    for k in range(N_CONFIGURATIONS):
        exists = found.status[:, k] != OUT_OF_REACH
        difference = np.abs(wrapped(their_joints - found.joints[:, k : k + 1])).max(axis=2)
        assert np.nanmin(difference[exists], axis=1).max() < 1e-7
    # their branches know how far a pose is from singular, ours flags the same
    smallest = np.linalg.svd(jacobian(ARM, joints), compute_uv=False)[:, -1]
    nearest_branch = np.nanmin(np.abs(theirs.sigma_min - smallest[:, None]), axis=1)
    assert nearest_branch.max() < 1e-9
