"""Direct kinematics of the SmartEE by network and Newton steps, and how its errors are measured."""

import numpy as np
import pytest
from smartee_case import small
from test_smartee_poses import draw, rows

from flexik.cases import case as cases
from flexik.cases.smartee.parts.errors import COLUMNS, angle, conditions_of, errors, judge_of
from flexik.cases.smartee.parts.evaluate import largest
from flexik.cases.smartee.parts.methods import DirectKinematics, network_file, trained
from flexik.cases.smartee.parts.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    centre_elbows,
    geometry_of,
    inputs_of,
)
from flexik.cases.smartee.parts.starts import linear_error
from flexik.errors import ParameterError
from flexik.evaluation.errors import evaluate
from flexik.kinematics.smartee import complete_direct, rotation_zyz
from flexik.kinematics.status import NOT_CONVERGED, REACHED, SINGULAR
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, Lesson, train
from flexik.parameters.trainers import LevenbergMarquardtAccelerated

SMARTEE = small(conditions={"random": {"n_poses": 300}})
GEOMETRY = geometry_of(SMARTEE.machine)
CENTRE = centre_elbows(SMARTEE.machine, SMARTEE.samples.box)


def asked(name):
    """Conditions, judge and joints (n, 3, 3) of a set of poses."""
    found = rows(SMARTEE, name)
    return conditions_of(found, CENTRE), judge_of(GEOMETRY, found), draw(SMARTEE, name)[1]


@pytest.fixture(scope="module")
def records():
    _, joints = draw(SMARTEE, "random")
    names = quantities(ACTUATED_FIELDS), quantities(ELBOW_FIELDS)
    settings = LevenbergMarquardtAccelerated(n_iterations=15)
    lesson = Lesson(inputs_of(joints[..., :2]), joints[..., 2], *names, Architecture(5), settings)
    return [train(lesson, restart) for restart in range(2)]


@pytest.fixture(scope="module")
def network(records):
    return records[0][0]


def test_newton_steps_square_the_error_of_the_network(network):
    conditions, judge, _ = asked("validation")
    found = [
        evaluate(DirectKinematics(GEOMETRY, network, n), conditions, judge, COLUMNS)
        for n in range(4)
    ]
    largest = [table["error"].max() for table in found]
    assert largest[0] > 1e-3
    for before, after in ((0, 1), (1, 2)):
        assert largest[after] < 10.0 * largest[before] ** 2
    assert largest[3] < 1e-12
    assert [set(table["status"]) for table in found[::3]] == [{NOT_CONVERGED}, {REACHED}]


def test_rows_do_not_depend_on_their_company(network):
    conditions, *_ = asked("validation")
    for method in (
        DirectKinematics(GEOMETRY, network, 2),
        DirectKinematics(GEOMETRY, "centre", 3),
        DirectKinematics(GEOMETRY, "centre", 20, tolerance=1e-13),
    ):
        together = method(conditions.query, conditions.current)
        alone = [method(one.query, one.current) for one in conditions.chunks(1)]
        found = np.vstack([answer.values for answer in alone])
        np.testing.assert_allclose(found, together.values, rtol=1e-13)


def test_along_a_path_every_sample_starts_from_the_one_before():
    conditions, judge, _ = asked("path_1000")
    answer = DirectKinematics(GEOMETRY, "previous", 1)(conditions.query, conditions.current)
    found = answer.values
    again = np.vstack([CENTRE, found[:-1]])
    one = DirectKinematics(GEOMETRY, "centre", 1)
    for k in (0, 7, 399):
        answer = one(conditions.query[k : k + 1], again[k : k + 1])
        np.testing.assert_array_equal(found[k : k + 1], answer.values)
    error = judge(conditions.query, found)["error"]
    # the first sample is the centre, where its own elbows leave nothing to do
    assert error[0] < 1e-13 and error.max() < 1e-3


def test_newton_tells_its_steps_and_what_is_left():
    conditions, judge, _ = asked("validation")
    method = DirectKinematics(GEOMETRY, "centre", 50, tolerance=1e-13)
    table = evaluate(method, conditions, judge, COLUMNS)
    assert (table["status"] == REACHED).all() and table["error"].max() < 1e-12
    assert np.all((table["steps"] >= 3) & (table["steps"] <= 8))
    assert table["residual"].max() <= 1e-13


def test_a_step_that_fails_is_a_row_with_its_status():
    # every tip moves straight up, none from another
    query = np.zeros((12, 6))
    method = DirectKinematics(GEOMETRY, "centre", 1)
    answer = method(query, np.full((12, 3), -np.pi / 2))
    assert (answer.status == SINGULAR).all() and np.isnan(answer.values).all()


def test_errors_are_those_of_the_definitions():
    poses, joints = draw(SMARTEE, "validation")
    elbows = joints[..., 2] + [1e-3, -2e-3, 2e-3]
    found = errors(GEOMETRY, poses, joints[..., :2], joints[..., 2], elbows)
    np.testing.assert_allclose(found["error"], 3e-3, rtol=1e-9)
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
    conditions, judge, joints = asked("validation")
    turned = joints[..., 2] + np.array([2.0 * np.pi, -4.0 * np.pi, 0.0])
    assert judge(conditions.query, turned)["error"].max() < 1e-13
    half = judge(conditions.query, joints[..., 2] + np.pi)["error"]
    np.testing.assert_allclose(half, np.sqrt(3.0) * np.pi, rtol=1e-12)
    # and the answer lies within its limits
    answer = DirectKinematics(GEOMETRY, "centre", 0)(conditions.query, turned)
    assert (answer.status == REACHED).all()
    np.testing.assert_allclose(answer.values, joints[..., 2], atol=1e-13)


def test_small_angles_keep_their_digits():
    one = np.array([[0.0, 0.0, 1.0]])
    other = np.array([[np.sin(1e-11), 0.0, np.cos(1e-11)]])
    assert angle(one, other)[0] == pytest.approx(1e-11, rel=1e-9)


def test_the_best_linear_map_leaves_what_no_line_takes():
    inputs = np.linspace(-1.0, 1.0, 2001)[:, None]
    assert linear_error(inputs, 3.0 * inputs + 2.0) < 1e-25
    # x^2, normalised 2 x^2 - 1, about its mean: variance 4 (1/5 - 1/9)
    assert linear_error(inputs, inputs**2) == pytest.approx(16.0 / 45.0, rel=5e-3)


def test_peaks_of_all_restarts_are_those_of_their_networks(records):
    networks = dict(enumerate(network for network, _ in records))
    peaks = largest(SMARTEE.machine, networks, ("validation", rows(SMARTEE, "validation")))
    assert peaks["restart"].tolist() == [0, 1]
    conditions, judge, _ = asked("validation")
    for network, peak in zip(networks.values(), peaks["error"], strict=True):
        error = judge(conditions.query, network.predict(conditions.query))["error"]
        assert peak == pytest.approx(error.max(), rel=1e-12)


def test_methods_are_found_by_name():
    assert network_file(SMARTEE, SMARTEE.methods["newton"]) is None
    assert str(network_file(SMARTEE, SMARTEE.methods["best"])) == "data/smartee/networks/best.json"
    assert trained(SMARTEE, "centre", 3) == DirectKinematics(GEOMETRY, "centre", 3)
    with pytest.raises(ParameterError, match="no 'centre' of 99 steps"):
        trained(SMARTEE, "centre", 99)


def test_files_are_those_of_the_name_of_the_section():
    other = SMARTEE.model_copy(update={"name": "other"})
    inputs = [part.inputs for stage in cases.STAGES for part in cases.parts(other, stage)]
    assert "smartee" not in str(inputs) and "data/other/networks/best.json" in str(inputs)
