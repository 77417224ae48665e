"""Direct kinematics of the SmartEE by network and Newton steps, and how its errors are measured."""

import importlib.util

import numpy as np
import pandas as pd
import pytest
from smartee_case import ROOT, small

from flexik.datasets.smartee.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    corner_poses,
    draw,
    geometry_of,
    inputs_of,
    path_poses,
)
from flexik.errors import ParameterError
from flexik.evaluation.smartee.errors import (
    angle,
    error_table,
    errors,
    extent_of,
    linear_error,
    newton_table,
    outside_poses,
)
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, LevenbergMarquardtAccelerated, train
from flexik.kinematics.smartee import rotation_zyz
from flexik.positioning.smartee.direct import (
    along_path,
    by_network,
    centre_elbows,
    from_centre,
    solved_from_centre,
)

SMARTEE = small(poses={"random": {"n_poses": 300}})
GEOMETRY = geometry_of(SMARTEE)


@pytest.fixture(scope="module")
def network():
    _, joints = draw(SMARTEE, "random")
    settings = LevenbergMarquardtAccelerated(n_iterations=15)
    inputs, outputs = inputs_of(joints[..., :2]), joints[..., 2]
    names = quantities(ACTUATED_FIELDS), quantities(ELBOW_FIELDS)
    return train(inputs, outputs, Architecture(5), settings, 0, *names)[0]


def test_newton_steps_square_the_error_of_the_network(network):
    _, joints = draw(SMARTEE, "validation")
    largest = [
        np.abs(by_network(GEOMETRY, network, n)(joints[..., :2]) - joints[..., 2]).max()
        for n in range(4)
    ]
    assert largest[0] > 1e-3
    for before, after in ((0, 1), (1, 2)):
        assert largest[after] < 10.0 * largest[before] ** 2
    assert largest[3] < 1e-12


def test_rows_do_not_depend_on_their_company(network):
    _, joints = draw(SMARTEE, "validation")
    centre = centre_elbows(GEOMETRY, SMARTEE.workspace)
    for method in (
        by_network(GEOMETRY, network, 2),
        from_centre(GEOMETRY, centre, 3),
        solved_from_centre(GEOMETRY, centre, 1e-13, 20),
    ):
        together = method(joints[..., :2])
        alone = np.vstack([method(joints[k : k + 1, :, :2]) for k in range(len(joints))])
        np.testing.assert_allclose(alone, together, rtol=1e-13)


def test_along_a_path_every_sample_starts_from_the_one_before():
    _, joints = path_poses(SMARTEE, 400)
    start = centre_elbows(GEOMETRY, SMARTEE.workspace)
    found = along_path(GEOMETRY, joints[..., :2], start, 1)
    again = np.vstack([start, found[:-1]])
    for k in (0, 7, 399):
        one = from_centre(GEOMETRY, again[k], 1)(joints[k : k + 1, :, :2])
        np.testing.assert_array_equal(found[k : k + 1], one)
    assert np.abs(found - joints[..., 2]).max() < 1e-3


def test_errors_are_those_of_the_definitions():
    poses, joints = draw(SMARTEE, "validation")
    elbows = joints[..., 2] + [1e-3, -2e-3, 2e-3]
    found = errors(GEOMETRY, poses, joints[..., :2], joints[..., 2], elbows)
    np.testing.assert_allclose(found["elbow_error"], 3e-3, rtol=1e-9)
    right = errors(GEOMETRY, poses, joints[..., :2], joints[..., 2], joints[..., 2])
    for name, values in right.items():
        assert np.all(values < 1e-13), name
        # of the order of the elbow error: the mechanism is far from any singularity
        scale = 0.1 if name == "position_error" else 1.0
        assert np.all((0.05 * scale * 3e-3 < found[name]) & (found[name] < 5 * scale * 3e-3)), name


def test_orientation_error_is_that_of_the_published_arc_cosines():
    poses, joints = draw(SMARTEE, "validation")
    elbows = joints[..., 2] + np.random.default_rng(1).normal(scale=0.01, size=(12, 3))
    found = errors(GEOMETRY, poses, joints[..., :2], joints[..., 2], elbows)
    from flexik.kinematics.smartee import complete_direct

    _, computed = complete_direct(GEOMETRY, joints[..., :2], elbows)
    truth = rotation_zyz(poses[:, 3:])
    # equation 6 as printed: n x s is not made a unit vector
    n, s = computed[:, :, 0], computed[:, :, 1]
    cosines = [np.sum(axis * truth[:, :, k], axis=1) for axis, k in ((np.cross(n, s), 2), (n, 0))]
    expected = np.linalg.norm(np.arccos(cosines), axis=0)
    np.testing.assert_allclose(found["orientation_error"], expected, rtol=1e-6)
    cosines[0] /= np.linalg.norm(np.cross(n, s), axis=1)
    expected = np.linalg.norm(np.arccos(cosines), axis=0)
    np.testing.assert_allclose(found["angle_error"], expected, rtol=1e-6)
    assert np.all(found["angle_error"] < 0.999 * found["orientation_error"])


def test_elbows_a_turn_apart_are_no_error():
    poses, joints = draw(SMARTEE, "validation")
    actuated, right = joints[..., :2], joints[..., 2]
    turned = right + np.array([2.0 * np.pi, -4.0 * np.pi, 0.0])
    found = errors(GEOMETRY, poses, actuated, right, turned)
    assert found["elbow_error"].max() < 1e-13
    half = errors(GEOMETRY, poses, actuated, right, right + np.pi)["elbow_error"]
    np.testing.assert_allclose(half, np.sqrt(3.0) * np.pi, rtol=1e-12)
    table = error_table(SMARTEE, ("centre", 2, "validation"), poses, joints, turned)
    assert (table["status"] == 0).all() and table["residual"].max() < 1e-12
    table = error_table(SMARTEE, ("centre", 2, "validation"), poses, joints, right + 0.01)
    assert (table["status"] == 1).all()


def test_corners_are_those_of_the_box():
    poses, joints = corner_poses(SMARTEE)
    assert poses.shape == (64, 6) and joints.shape == (64, 3, 3)
    assert len(np.unique(poses.round(9), axis=0)) == 64
    np.testing.assert_allclose(extent_of(SMARTEE.workspace, poses), 1.0)
    np.testing.assert_allclose(np.abs(poses[:, 3:]), np.radians(10.0), rtol=1e-9)
    high = small(workspace={"centre": [0.0, 0.0, 0.17]})
    with pytest.raises(ParameterError, match=r"smartee\.workspace: corners: the legs do not reach"):
        corner_poses(high)


def test_the_best_linear_map_leaves_what_no_line_takes():
    inputs = np.linspace(-1.0, 1.0, 2001)[:, None]
    assert linear_error(inputs, 3.0 * inputs + 2.0) < 1e-25
    # x^2, normalised 2 x^2 - 1, about its mean: variance 4 (1/5 - 1/9)
    assert linear_error(inputs, inputs**2) == pytest.approx(16.0 / 45.0, rel=5e-3)


def test_a_path_begins_at_the_centre_of_the_box():
    spec = importlib.util.spec_from_file_location("evaluate", ROOT / "stages/smartee_evaluate.py")
    evaluate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(evaluate)
    smartee = small(path={"n_samples": [200]})
    poses, joints = path_poses(smartee, 200)
    table = pd.concat(evaluate.previous(smartee, {"path_200": (poses, joints)}))
    assert table["n_steps"].unique().tolist() == [1, 2]
    # the first sample is the centre, where its own elbows leave nothing to do
    assert table.loc[table["number"] == 0, "elbow_error"].max() < 1e-13
    assert table["elbow_error"].max() < 1e-2


def test_small_angles_keep_their_digits():
    one = np.array([[0.0, 0.0, 1.0]])
    other = np.array([[np.sin(1e-11), 0.0, np.cos(1e-11)]])
    assert angle(one, other)[0] == pytest.approx(1e-11, rel=1e-9)


def test_outside_poses_have_a_uniform_extent():
    smartee = small(outside={"n_poses": 4000})
    poses, joints, n_missed = outside_poses(smartee)
    assert len(poses) == len(joints) == 4000 - n_missed
    extents = extent_of(smartee.workspace, poses)
    assert extents.max() <= 2.0
    if n_missed == 0:
        np.testing.assert_allclose(np.histogram(extents, 4, (0.0, 2.0))[0], 1000, atol=120)
    # a box the legs do not span any more: what they do not reach is counted
    far = small(outside={"n_poses": 4000, "extent": 12.0})
    kept, _, n_missed = outside_poses(far)
    assert n_missed > 0 and len(kept) + n_missed == 4000


def test_tables_name_the_method_and_the_extent():
    poses, joints = draw(SMARTEE, "validation")
    table = error_table(SMARTEE, ("centre", 2, "validation"), poses, joints, joints[..., 2])
    assert table[["method", "n_steps", "poses"]].drop_duplicates().to_numpy().tolist() == [
        ["centre", 2, "validation"]
    ]
    assert table["extent"].between(0.3, 1.0).all()
    newton = newton_table(SMARTEE, "validation", poses, joints)
    assert (newton["status"] == 0).all() and newton["elbow_error"].max() < 1e-12
    assert newton["n_steps"].between(3, 8).all()


def test_a_centre_out_of_reach_is_named():
    smartee = small(workspace={"centre": [0.0, 0.0, 0.4]})
    with pytest.raises(ParameterError, match=r"smartee\.workspace\.centre"):
        centre_elbows(geometry_of(smartee), smartee.workspace)
