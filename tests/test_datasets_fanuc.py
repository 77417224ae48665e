"""Taught path, targets beside it and random poses of the six-joint arm."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from fanuc_arm import ARM

from flexik.datasets.fanuc import samples
from flexik.datasets.fanuc.samples import all_configurations, beside, nearest_on, taught_path
from flexik.datasets.fanuc.tables import (
    evaluation_checksum,
    network_checksum,
    path_checksum,
    poses_checksum,
    query_checksum,
    study_checksum,
    workspace_network_checksum,
)
from flexik.errors import ParameterError
from flexik.kinematics.fanuc import canonical, configuration, inverse
from flexik.kinematics.serial_arm import Pose, forward, jacobian
from flexik.parameters import load_parameters, overlay, read_yaml, validate

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def fanuc():
    return load_parameters(ROOT / "params.yaml").fanuc


def test_the_path_is_smooth_and_at_rest_at_its_ends(fanuc):
    path = taught_path(ARM, fanuc.path)
    n = fanuc.path.n_training + fanuc.path.n_test
    assert path.joints.shape == (n, 6) and path.share[[0, -1]].tolist() == [0.0, 1.0]
    step = path.share[1]
    velocity, acceleration = (np.diff(path.joints, n=k, axis=0) / step**k for k in (1, 2))
    assert np.abs(velocity[[0, -1]]).max() < 0.05 * np.abs(velocity).max()
    # no jump of the acceleration: it changes by a little from sample to sample
    jumps = np.abs(np.diff(acceleration, axis=0)).max(axis=0)
    assert (jumps < 0.05 * np.abs(acceleration).max(axis=0)).all()


def test_the_path_of_params_yaml_keeps_away_from_trouble(fanuc):
    joints = taught_path(ARM, fanuc.path).joints
    assert ARM.within_limits(joints).all()
    assert len(np.unique(configuration(ARM, joints))) == 1
    assert np.linalg.svd(jacobian(ARM, joints), compute_uv=False)[:, -1].min() > 0.1
    # joints are a function of the position: the path does not meet itself
    position = forward(ARM, joints).position
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    apart = np.abs(np.subtract.outer(np.arange(600), np.arange(600))) > 60
    assert distance[apart].min() > 0.05


def test_test_samples_lie_between_training_samples(fanuc):
    is_test = taught_path(ARM, fanuc.path).is_test
    assert is_test.sum() == fanuc.path.n_test
    assert not is_test[[0, -1]].any()
    assert set(np.diff(np.flatnonzero(is_test))) == {3}
    uneven = fanuc.path.model_copy(update={"n_training": 50, "n_test": 21})
    counted = taught_path(ARM, uneven).is_test
    assert counted.sum() == 21 and np.ptp(np.diff(np.flatnonzero(counted))) <= 1


def test_a_path_beyond_the_limits_is_refused(fanuc):
    tight = dataclasses.replace(ARM, maximum=(*ARM.maximum[:5], 0.1))
    with pytest.raises(ParameterError, match=r"fanuc\.path: .* J6"):
        taught_path(tight, fanuc.path)


def test_targets_beside_a_path_are_at_their_distance_from_all_of_it(fanuc):
    pose = forward(ARM, taught_path(ARM, fanuc.path).joints)
    rows = np.arange(5, 595, 10)
    distances = [0.0, 0.02, 0.3]
    found = beside(pose, rows, distances, seed=1)
    assert np.array_equal(np.bincount(np.searchsorted(distances, found.distance)), [59] * 3)
    shift = found.pose.position - pose.position[found.row]
    assert np.linalg.norm(shift, axis=1) == pytest.approx(found.distance, abs=1e-15)
    # from every point of a path ten times as fine, no nearer than asked for
    fine = np.concatenate(
        [pose.position[:-1] + k / 10 * np.diff(pose.position, axis=0) for k in range(10)]
    )
    apart = np.linalg.norm(found.pose.position[:, None] - fine, axis=2).min(axis=1)
    assert (apart >= 0.99 * found.distance - 1e-15).all()
    tangent = np.gradient(pose.position, axis=0)[found.row]
    along = np.sum(tangent * shift, axis=1) / np.linalg.norm(tangent, axis=1)
    assert np.abs(along).max() < 1e-12
    assert np.array_equal(found.pose.rotation, pose.rotation[found.row])


def test_targets_nearer_to_another_part_of_the_path_are_left_out():
    # a closed ring: its middle is at the radius from all of it, beyond is nearer to the other side
    turn = np.linspace(0.0, 2.0 * np.pi, 201)
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(201)])
    pose = Pose(np.concatenate([ring + np.array([0.0, 0.0, z]) for z in (0.0, 0.5, -0.5)]), None)
    pose = pose._replace(rotation=np.tile(np.eye(3), (603, 1, 1)))
    found = beside(pose, np.arange(10, 190, 10), [0.1, 9.0], seed=1)
    assert (found.distance == 0.1).sum() == 18
    far = found.pose.position[found.distance == 9.0]
    assert (nearest_on(pose.position, far).distance >= 0.99 * 9.0).all()


def test_the_nearest_point_of_a_path_by_hand():
    path = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0]])
    points = np.array([[0.25, 0.3, 0.0], [-1, 0, 0], [1.5, 1.0, 0.0], [1.0, 3.0, 1.0]])
    found = nearest_on(path, points)
    assert found.segment.tolist() == [0, 0, 1, 1]
    assert found.share == pytest.approx([0.25, 0.0, 0.5, 1.0])
    assert found.distance == pytest.approx([0.3, 1.0, 0.5, np.sqrt(2.0)])


def test_random_joints_keep_limits_of_another_range():
    shifted = dataclasses.replace(
        ARM, minimum=(-1.1, *ARM.minimum[1:]), maximum=(6.0, *ARM.maximum[1:])
    )
    numbers, joints = all_configurations(shifted, 200, seed=3, role=0)
    assert shifted.within_limits(joints).all() and joints[:, 0].max() > np.pi
    assert np.array_equal(configuration(shifted, joints), numbers)


def test_random_joints_are_of_their_configuration_and_within_limits():
    numbers, joints = all_configurations(ARM, 300, seed=3, role=0)
    assert np.array_equal(np.bincount(numbers), [300] * 8)
    assert np.array_equal(configuration(ARM, joints), numbers)
    assert ARM.within_limits(joints).all()
    assert np.array_equal(canonical(ARM, joints), joints)
    # the closed form reaches each within the limits, at the same joints
    found = inverse(ARM, forward(ARM, joints))
    assert found.reached[np.arange(2400), numbers].all()


def test_sets_of_one_seed_are_apart_and_do_not_depend_on_their_length():
    one, other = (all_configurations(ARM, 50, seed=3, role=role)[1] for role in (0, 1))
    assert not set(one[:, 0]) & set(other[:, 0])
    longer = all_configurations(ARM, 80, seed=3, role=0)[1]
    assert np.array_equal(longer[:50], one[:50])


def test_a_configuration_that_does_not_occur_is_told(monkeypatch):
    monkeypatch.setattr(samples, "_MAXIMUM_DRAWN", 100_000)
    minimum, maximum = list(ARM.minimum), list(ARM.maximum)
    minimum[1:3], maximum[1:3] = [0.0, 0.0], [0.1, 0.1]
    forwards = dataclasses.replace(ARM, minimum=tuple(minimum), maximum=tuple(maximum))
    with pytest.raises(ParameterError, match=r"fanuc\.joints: 0 of .* arm configuration 4"):
        samples.random_joints(forwards, 4, 10, np.random.default_rng(0))


CHECKSUMS = {
    "path": path_checksum,
    "poses": poses_checksum,
    "config1": lambda fanuc: network_checksum(fanuc, "config1"),
    "study": study_checksum,
    "workspace": workspace_network_checksum,
    "evaluation": evaluation_checksum,
    "query": query_checksum,
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"path": {"seed": 2}}, ["path", "config1", "study", "evaluation"]),
        ({"networks": {"config1": {"seed": 2}}}, ["config1", "study", "evaluation"]),
        ({"networks": {"config2": {"n_restarts": 2}}}, ["evaluation"]),
        ({"networks": {"config2": {"n_hidden": 8}}}, ["evaluation", "query"]),
        ({"trainers": {"back_propagation": {"momentum": 0.8}}}, ["config1", "evaluation"]),
        ({"trainers": {"study": {"momentum": 0.8}}}, ["study"]),
        ({"trainers": {"adam": {"beta_1": 0.8}}}, ["workspace", "evaluation"]),
        ({"workspace": {"n_targets": 5}}, ["poses", "workspace", "evaluation"]),
        ({"workspace": {"n_hidden": [5]}}, ["workspace", "evaluation", "query"]),
        ({"off_path": {"seed": 6}}, ["evaluation"]),
        ({"refinement": {"damping": 1.0}}, ["evaluation", "query"]),
        ({"success": {"position": 1.0}}, []),
    ],
    ids=str,
)
def test_checksums_follow_what_they_depend_on(change, expected):
    data = read_yaml(ROOT / "params.yaml")
    before, after = (validate(d).fanuc for d in (data, overlay(data, {"fanuc": change})))
    found = [name for name, of in CHECKSUMS.items() if of(before) != of(after)]
    assert sorted(found) == sorted(expected)
