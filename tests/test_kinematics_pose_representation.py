"""What networks learn of poses and joints: nothing is lost, and nothing jumps."""

import dataclasses

import numpy as np
from fanuc_arm import ARM, largest_error, random_joints

from flexik.kinematics.pose_representation import (
    INPUTS,
    OUTPUTS,
    asked,
    joint_outputs,
    joints_of,
    pose_inputs,
    queries,
)
from flexik.kinematics.serial_arm import forward
from flexik.kinematics.spherical_wrist import canonical, configuration, inverse


def test_joints_come_back_from_what_is_learnt():
    joints = canonical(ARM, random_joints(5000))
    values = joint_outputs(ARM, joints)
    assert values.shape == (5000, len(OUTPUTS))
    found = joints_of(ARM, values, configuration(ARM, joints))
    assert np.quantile(np.abs(found - joints).max(axis=1), 0.99) < 1e-10
    assert largest_error(forward(ARM, joints), found) < 1e-9


def test_other_zeros_of_the_joints_change_nothing():
    shift = (0.3, -1.2, 0.4, 2.0, 0.0, -1.0)
    other = dataclasses.replace(ARM, offset=shift)
    joints = canonical(other, random_joints(500))
    found = joints_of(other, joint_outputs(other, joints), configuration(other, joints))
    assert np.quantile(np.abs(found - joints).max(axis=1), 0.99) < 1e-10


def test_inputs_are_position_and_rotation():
    pose = forward(ARM, random_joints(3))
    values = pose_inputs(pose)
    assert values.shape == (3, len(INPUTS))
    assert np.array_equal(values[:, :3], pose.position)
    assert np.array_equal(values[:, 3:].reshape(3, 3, 3), pose.rotation)
    found, number = asked(queries(pose, np.array([3, 0, 7])))
    assert all(map(np.array_equal, found, pose)) and number.tolist() == [3, 0, 7]


def test_nothing_jumps_where_angles_wrap_or_the_arm_is_singular():
    """A small step of the pose is a small step of what is learnt."""
    joints = random_joints(4000)
    joints[:1000, 0] = np.pi - 1e-7
    joints[1000:2000, 3] = np.pi - 1e-7
    joints[2000:3000, 5] = -np.pi + 1e-7
    joints[3000:, 4] = 1e-6
    step = 1e-5 * np.random.default_rng(1).normal(size=joints.shape)
    step[:, 4] = np.abs(step[:, 4])
    number = configuration(ARM, joints)
    one, other = joints, joints + step
    stays = configuration(ARM, other) == number
    values = [joint_outputs(ARM, canonical(ARM, each))[stays] for each in (one, other)]
    assert np.abs(values[1] - values[0]).max() < 1e-3
    # while the joints themselves jump
    turned = [canonical(ARM, each)[stays] for each in (one, other)]
    assert np.abs(turned[1] - turned[0]).max() > 6.0


def test_it_is_a_function_of_the_pose_within_a_configuration():
    joints = canonical(ARM, random_joints(2000))
    number = configuration(ARM, joints)
    found = inverse(ARM, forward(ARM, joints)).joints[np.arange(2000), number]
    difference = joint_outputs(ARM, canonical(ARM, found)) - joint_outputs(ARM, joints)
    assert np.abs(difference).max() < 1e-8
