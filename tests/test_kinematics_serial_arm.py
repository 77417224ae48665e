"""Kinematics of a serial arm: against products of matrices, finite differences and SciPy."""

import numpy as np
import pytest
from fanuc_arm import ARM, LIMITS, largest_error, random_joints, within_limits
from scipy.spatial.transform import Rotation

from flexik.kinematics.serial_arm import (
    Pose,
    forward,
    frames,
    jacobian,
    pose_difference,
    pose_errors,
    refine,
    rotation_vector,
    smallest_singular_value,
)

LENGTH = 0.5


def by_matrices(joints):
    """Homogeneous matrix of one row of joints, link by link as the convention is written."""
    result = np.eye(4)
    for i, joint in enumerate(joints):
        theta, alpha = joint + ARM.offset[i], ARM.alpha[i]
        turn, twist = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", theta).as_matrix()
        turn[2, 3] = ARM.d[i]
        twist[:3, :3] = Rotation.from_euler("x", alpha).as_matrix()
        twist[0, 3] = ARM.a[i]
        result = result @ turn @ twist
    return result


def test_forward_is_the_product_of_the_links():
    joints = random_joints(50)
    found = forward(ARM, joints)
    expected = np.array([by_matrices(row) for row in joints])
    assert np.abs(found.position - expected[:, :3, 3]).max() < 1e-14
    assert np.abs(found.rotation - expected[:, :3, :3]).max() < 1e-14


def test_the_arm_at_rest_stands_where_its_dimensions_say():
    pose = forward(ARM, np.zeros((1, 6)))
    assert pose.position[0] == pytest.approx([0.15 + 1.016 + 0.175, 0.0, 0.565 + 0.87 + 0.17])


def test_frames_begin_at_the_base_and_end_at_the_pose():
    joints = random_joints(5)
    found, pose = frames(ARM, joints), forward(ARM, joints)
    assert found.origin.shape == (5, 7, 3) and found.rotation.shape == (5, 7, 3, 3)
    assert not found.origin[:, 0].any()
    assert np.array_equal(found.origin[:, -1], pose.position)
    # joints 4 to 6 meet in one point
    assert np.abs(found.origin[:, 4] - found.origin[:, 5]).max() < 1e-15


def test_jacobian_is_the_derivative_of_the_pose():
    joints, step = random_joints(300), 1e-6
    exact = jacobian(ARM, joints)
    for k in range(6):
        shift = step * np.eye(6)[k]
        difference = pose_difference(forward(ARM, joints + shift), forward(ARM, joints - shift))
        numeric = np.hstack(difference) / (2.0 * step)
        assert np.abs(numeric - exact[:, :, k]).max() < 1e-8


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-9, np.pi])
def test_rotation_vector_is_axis_times_angle(angle):
    axes = np.random.default_rng(0).normal(size=(200, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    matrices = Rotation.from_rotvec(angle * axes).as_matrix()
    found = rotation_vector(matrices)
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.full(200, angle), abs=1e-14)
    # half a turn has two axes
    same = Rotation.from_rotvec(found).as_matrix()
    assert np.abs(same - matrices).max() < 1e-8 * angle + 1e-15


def test_pose_errors_are_distance_and_angle():
    position, turn = np.array([[0.0, 3.0, 4.0]]), Rotation.from_rotvec([[0.0, 0.3, 0.4]])
    target = Pose(position, turn.as_matrix())
    distance, angle = pose_errors(target, Pose(np.zeros((1, 3)), np.eye(3)[None]))
    assert distance == pytest.approx([5.0]) and angle == pytest.approx([0.5])


def test_the_smallest_singular_value_tells_singular_poses():
    joints = random_joints(200) * 0.5
    values = smallest_singular_value(ARM, joints, LENGTH)
    scaled = jacobian(ARM, joints) * np.repeat([1.0, LENGTH], 3)[:, None]
    gram = scaled @ scaled.swapaxes(1, 2)
    assert values**2 == pytest.approx(np.linalg.eigvalsh(gram)[:, 0], abs=1e-12)
    joints[:, 4] = 0.0
    assert smallest_singular_value(ARM, joints, LENGTH).max() < 1e-15


def test_newton_steps_converge_quadratically_away_from_singular_poses():
    joints = random_joints(2000) * 0.9
    joints = joints[np.linalg.svd(jacobian(ARM, joints), compute_uv=False)[:, -1] > 0.05]
    target = forward(ARM, joints)
    start = joints + np.random.default_rng(1).normal(0.0, 0.01, joints.shape)
    found = (refine(ARM, target, start, n_steps, 1e-12, LENGTH) for n_steps in range(4))
    errors = [largest_error(target, joints) for joints in found]
    assert errors[0] > 1e-2
    assert errors[1] < 0.1 * errors[0] and errors[2] < 0.01 * errors[1]
    assert errors[3] < 1e-6


def test_newton_solves_the_damped_system_it_states():
    joints = random_joints(1) * 0.5
    target = forward(ARM, joints + 0.05)
    weights = np.array([1.0, 1.0, 1.0, LENGTH, LENGTH, LENGTH])
    error = weights * np.hstack(pose_difference(target, forward(ARM, joints)))[0]
    derivative = weights[:, None] * jacobian(ARM, joints)[0]
    system = derivative.T @ derivative + (1e-3 + 0.5 * error @ error) * np.eye(6)
    expected = joints[0] + np.linalg.solve(system, derivative.T @ error)
    found = refine(ARM, target, joints, 1, 1e-3, LENGTH)
    assert found[0] == pytest.approx(expected, abs=1e-12)


def test_newton_stays_finite_and_within_limits_where_the_arm_is_singular():
    joints = random_joints(500)
    joints[:, 4] = 0.0
    target = forward(ARM, random_joints(500, seed=1))
    found = refine(ARM, target, joints, 5, 1e-8, LENGTH)
    assert np.isfinite(found).all()
    assert within_limits(ARM, found).all()


def test_no_step_only_applies_the_limits():
    beyond = np.full((1, 6), 10.0)
    found = refine(ARM, forward(ARM, beyond), beyond, 0, 1e-8, LENGTH)
    assert np.array_equal(found, LIMITS[1:])
