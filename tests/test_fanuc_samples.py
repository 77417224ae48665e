"""Taught path, targets beside it and random poses of the six-joint arm."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from fanuc_arm import ARM, SECTION, within_limits

from flexik.cases.fanuc.parts import generate, samples
from flexik.cases.fanuc.parts.samples import beside, random_joints, taught_path
from flexik.cases.fanuc.parts.tables import JOINT_FIELDS, QUERY_FIELDS, array
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import make
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.kinematics.pose_representation import asked
from flexik.kinematics.serial_arm import Pose, forward, jacobian
from flexik.kinematics.spherical_wrist import canonical, configuration, inverse
from flexik.positioning.interpolated import nearest_on

PATH = SECTION.samples.path


def test_the_path_is_smooth_and_at_rest_at_its_ends():
    path = taught_path(ARM, PATH)
    n = PATH.n_training + PATH.n_test
    assert path.joints.shape == (n, 6) and path.share[[0, -1]].tolist() == [0.0, 1.0]
    step = path.share[1]
    velocity, acceleration = (np.diff(path.joints, n=k, axis=0) / step**k for k in (1, 2))
    assert np.abs(velocity[[0, -1]]).max() < 0.05 * np.abs(velocity).max()
    # no jump of the acceleration: it changes by a little from sample to sample
    jumps = np.abs(np.diff(acceleration, axis=0)).max(axis=0)
    assert (jumps < 0.05 * np.abs(acceleration).max(axis=0)).all()


def test_the_path_of_params_yaml_keeps_away_from_trouble():
    joints = taught_path(ARM, PATH).joints
    assert within_limits(ARM, joints).all()
    assert len(np.unique(configuration(ARM, joints))) == 1
    assert np.linalg.svd(jacobian(ARM, joints), compute_uv=False)[:, -1].min() > 0.1
    # joints are a function of the position: the path does not meet itself
    position = forward(ARM, joints).position
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    apart = np.abs(np.subtract.outer(np.arange(600), np.arange(600))) > 60
    assert distance[apart].min() > 0.05


def test_test_samples_lie_between_training_samples():
    is_test = taught_path(ARM, PATH).is_test
    assert is_test.sum() == PATH.n_test
    assert not is_test[[0, -1]].any()
    assert set(np.diff(np.flatnonzero(is_test))) == {3}
    uneven = PATH.model_copy(update={"n_training": 50, "n_test": 21})
    counted = taught_path(ARM, uneven).is_test
    assert counted.sum() == 21 and np.ptp(np.diff(np.flatnonzero(counted))) <= 1


def test_a_path_beyond_the_limits_is_refused():
    tight = dataclasses.replace(ARM, maximum=(*ARM.maximum[:5], 0.1))
    with pytest.raises(ParameterError, match="limits of J6"):
        taught_path(tight, PATH)


def test_targets_beside_a_path_are_at_their_distance_from_all_of_it():
    pose = forward(ARM, taught_path(ARM, PATH).joints)
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


def drawn(arm, n, role=0):
    """Numbers and joints of all arm configurations, `n` each."""
    work = generate.prepare_poses(arm=arm, n=n, seed=3, role=role, length=None)
    frame = pd.concat(pd.DataFrame(work.function(item)) for item in work.items)
    return frame["configuration"].to_numpy(), array(frame, JOINT_FIELDS)


def test_random_joints_keep_limits_of_another_range():
    shifted = dataclasses.replace(
        ARM, minimum=(-1.1, *ARM.minimum[1:]), maximum=(6.0, *ARM.maximum[1:])
    )
    numbers, joints = drawn(shifted, 200)
    assert within_limits(shifted, joints).all() and joints[:, 0].max() > np.pi
    assert np.array_equal(configuration(shifted, joints), numbers)


def test_random_joints_are_of_their_configuration_and_within_limits():
    numbers, joints = drawn(ARM, 300)
    assert np.array_equal(np.bincount(numbers), [300] * 8)
    assert np.array_equal(configuration(ARM, joints), numbers)
    assert within_limits(ARM, joints).all()
    assert np.array_equal(canonical(ARM, joints), joints)
    # the closed form reaches each within the limits, at the same joints
    found = inverse(ARM, forward(ARM, joints))
    assert found.reached[np.arange(2400), numbers].all()


def test_sets_of_one_seed_are_apart_and_do_not_depend_on_their_length():
    one, other = (drawn(ARM, 50, role)[1] for role in (0, 1))
    assert not set(one[:, 0]) & set(other[:, 0])
    assert np.array_equal(drawn(ARM, 80)[1][:50], one[:50])


def test_a_configuration_that_does_not_occur_is_told(monkeypatch):
    monkeypatch.setattr(samples, "_MAXIMUM_DRAWN", 100_000)
    minimum, maximum = list(ARM.minimum), list(ARM.maximum)
    minimum[1:3], maximum[1:3] = [0.0, 0.0], [0.1, 0.1]
    forwards = dataclasses.replace(ARM, minimum=tuple(minimum), maximum=tuple(maximum))
    with pytest.raises(ParameterError, match=r"0 of .* arm configuration 4"):
        random_joints(forwards, 4, 10, np.random.default_rng(0))


def test_targets_are_reached_by_the_configuration_that_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    off_path = SECTION.conditions.off_path.model_copy(update={"distances": [0.0, 0.01, 5.0]})
    poses = SECTION.conditions.random_poses.model_copy(update={"n_targets": 5})
    conditions = SECTION.conditions.model_copy(update={"off_path": off_path, "random_poses": poses})
    few = SECTION.samples.model_copy(update={"n_poses": 4})
    parts = generate.parts(SECTION.model_copy(update={"conditions": conditions, "samples": few}))
    folder = SECTION.data / "samples"
    make(folder, parts, ParallelSettings(n_workers=1))
    tables = {p.name: read_table(folder / f"{p.name}.parquet") for p in parts}
    assert {name: len(tables[name]) for name in ("path", "poses")} == {"path": 600, "poses": 32}
    for name, n in (("path", 200), ("off_path", 400), ("random_poses", 40)):
        frame = tables[f"conditions/{name}"]
        target, number = asked(array(frame, QUERY_FIELDS))
        assert len(frame) == n
        assert inverse(ARM, target).reached[np.arange(n), number].all()
    assert set(tables["conditions/off_path"]["distance"]) == {0.0, 0.01}
    random = tables["conditions/random_poses"]
    assert (random["singular_value"] > 0.0).all() and random["singular"].sum() == 0
    test = tables["conditions/path"]
    assert np.array_equal(test[["x", "y", "z"]], forward(ARM, array(test, JOINT_FIELDS)).position)
