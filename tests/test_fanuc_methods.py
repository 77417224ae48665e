"""Methods of the six-joint arm, how their networks learn, and their errors."""

import dataclasses

import numpy as np
import pytest
from fanuc_arm import ARM, SECTION, random_joints

from flexik.cases.fanuc.parts import evaluate, study, train
from flexik.cases.fanuc.parts.learning import TaughtSamples, learn, percent, side_by_side
from flexik.cases.fanuc.parts.tables import (
    COMMANDED_FIELDS,
    JOINT_FIELDS,
    PATH_FIELDS,
    POSITION_FIELDS,
    QUERY_FIELDS,
    array,
    named,
)
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import Part, make, stacked
from flexik.datasets.tables import read_table, write_table
from flexik.kinematics.pose_representation import joint_outputs, pose_inputs, queries
from flexik.kinematics.serial_arm import Pose, forward
from flexik.kinematics.spherical_wrist import canonical, configuration
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, limit_status
from flexik.learning.storage import load_network, load_restarts
from flexik.learning.training import Architecture
from flexik.parameters.trainers import Adam, BackPropagation, LevenbergMarquardtAccelerated
from flexik.positioning.arm_configurations import ArmConfigurations
from flexik.positioning.closed_form import ClosedForm
from flexik.positioning.interpolated import Interpolated
from flexik.positioning.method import Answer, PositioningError
from flexik.positioning.nearest_sample import NearestSample
from flexik.positioning.predicted import Predicted

STEPS = SECTION.conditions.refinement.model_copy(update={"n_steps": 2})
ALONE = ParallelSettings(n_workers=1)


class Known:
    """A network that knows the answer to what it is asked."""

    def __init__(self, inputs, outputs):
        self.inputs = tuple(range(inputs.shape[1]))
        self.answers = {row.tobytes(): answer for row, answer in zip(inputs, outputs, strict=True)}

    def predict(self, values, /):
        """Outputs at inputs that are known."""
        return np.array([self.answers[np.ascontiguousarray(row).tobytes()] for row in values])


@pytest.fixture
def joints():
    return canonical(ARM, random_joints(40, seed=4))


def query_of(joints):
    return queries(forward(ARM, joints), configuration(ARM, joints))


def rough(joints, by):
    """A method that is off by so many rad in every joint."""
    status = limit_status(joints + by, ARM.minimum, ARM.maximum)
    return lambda query, current: Answer(joints + by, status)


def test_the_closed_form_gives_the_joints_of_the_configuration(joints):
    found = ClosedForm(ARM)(query_of(joints), joints)
    assert found.values == pytest.approx(joints, abs=1e-7) and not found.status.any()
    far = queries(Pose(np.full((1, 3), 9.0), np.eye(3)[None]), np.zeros(1))
    found = ClosedForm(ARM)(far, np.zeros((1, 6)))
    assert np.isnan(found.values).all() and found.status.tolist() == [OUT_OF_REACH]


def test_a_network_is_asked_for_what_it_has_inputs_of(joints):
    position = forward(ARM, joints).position
    beyond = joints.copy()
    beyond[3, 1] = ARM.maximum[1] + 0.1
    method = Predicted(Known(position, beyond), ARM.minimum, ARM.maximum)
    found = method(query_of(joints), joints)
    assert np.array_equal(found.values, beyond)
    assert np.flatnonzero(found.status == ACTUATOR_LIMIT).tolist() == [3]


def test_networks_answer_for_their_own_configuration(joints):
    target, number = forward(ARM, joints), configuration(ARM, joints)
    inputs, outputs = pose_inputs(target), joint_outputs(ARM, joints)
    networks = {int(k): Known(inputs[number == k], outputs[number == k]) for k in np.unique(number)}
    found = ArmConfigurations(ARM, networks)(query_of(joints), joints)
    assert found.values == pytest.approx(joints, abs=1e-9) and not found.status.any()
    del networks[int(number[0])]
    with pytest.raises(PositioningError, match=f"configuration {number[0]}"):
        ArmConfigurations(ARM, networks)(query_of(joints), joints)


def test_networks_turn_joints_to_where_limits_admit_them():
    low, high = (-1.1, *ARM.minimum[1:]), (6.0, *ARM.maximum[1:])
    shifted = dataclasses.replace(ARM, minimum=low, maximum=high)
    joints = canonical(ARM, random_joints(200, seed=4))
    joints[:, 0] = np.where(joints[:, 0] < -1.1, joints[:, 0] + 2.0 * np.pi, joints[:, 0])
    joints = joints[(joints[:, 0] < 6.0) & (configuration(ARM, joints) == 0)]
    known = Known(pose_inputs(forward(ARM, joints)), joint_outputs(ARM, canonical(ARM, joints)))
    found = ArmConfigurations(shifted, {0: known})(query_of(joints), joints)
    assert found.values[:, 0].max() > np.pi and not found.status.any()
    assert found.values == pytest.approx(joints, abs=1e-9)


def test_look_ups_know_the_samples_and_what_lies_between():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    answers = np.array([np.full(6, value) for value in (0.0, 1.0, 3.0)])
    query = np.array([[0.3, 0.2, 0.0], [1.0, 0.75, 0.0], [1, 2, 0]])
    query = np.column_stack([query, np.full((3, 10), 7.0)])
    found = NearestSample(positions, answers)(query, answers)
    assert found.values[:, 0].tolist() == [0.0, 3.0, 3.0]
    found = Interpolated(positions, answers)(query, answers)
    assert found.values == pytest.approx(np.tile([[0.3], [2.5], [3.0]], 6))


def test_errors_are_distances_angles_and_configurations(joints):
    query = query_of(joints)
    found = evaluate.judge(ARM, query, joints)
    assert found["error"].max() < 1e-14 and found["orientation_error"].max() < 1e-7
    turned = joints.copy()
    turned[:, 5] += 0.25
    query[3, -1] = int(query[3, -1]) ^ 1
    found = evaluate.judge(ARM, query, turned)
    assert np.flatnonzero(found["in_configuration"] == 0).tolist() == [3]
    assert found["error"].max() < 1e-13
    assert found["orientation_error"] == pytest.approx(np.full(40, 0.25))


def test_a_method_has_a_row_for_every_query_and_step(joints):
    query, method = query_of(joints), rough(joints, 0.01)
    found = evaluate.errors_of(ARM, query, STEPS, method)
    assert np.array_equal(found["n_steps"], np.repeat([0, 1, 2], 40))
    assert np.array_equal(found["point"], np.tile(np.arange(40), 3))
    medians = [np.median(found["error"][found["n_steps"] == n]) for n in range(3)]
    assert medians[1] < 0.05 * medians[0] and medians[2] < 0.05 * medians[1]
    alone = evaluate.errors_of(ARM, query, None, method)
    commanded = np.column_stack([alone[field.name] for field in COMMANDED_FIELDS])
    assert np.array_equal(commanded, joints + 0.01)


@pytest.fixture
def samples():
    share = np.linspace(0.0, 1.0, 90)[:, None]
    joints = 0.4 * np.sin(2.0 * share + np.arange(6)) + np.array([0, 0, 0, 0, 1.0, 0])
    position = forward(ARM, joints).position
    test = np.arange(90) % 3 == 1
    return TaughtSamples(position[~test], joints[~test], position[test], joints[test])


@pytest.fixture
def path(samples, tmp_path):
    """The samples as the file of a path."""
    joints = np.concatenate([samples.joints, samples.test_joints])
    positions = np.concatenate([samples.positions, samples.test_positions])
    is_test = np.repeat([0, 1], [len(samples.joints), len(samples.test_joints)])
    columns = {"share": np.linspace(0.0, 1.0, len(joints)), "is_test": is_test}
    columns |= named(JOINT_FIELDS, joints) | named(POSITION_FIELDS, positions)
    write_table(tmp_path / "path.parquet", columns, PATH_FIELDS)
    return tmp_path / "path.parquet"


def attempt(samples, joints, settings, n_hidden=5, restart=0):
    return samples.attempt(joints, Architecture(n_hidden, "logistic"), settings, 1, restart)


def test_a_training_gives_the_errors_of_every_joint(samples):
    settings = LevenbergMarquardtAccelerated(n_iterations=15)
    (found,) = learn(samples, [attempt(samples, (2, 5), settings)])
    assert found.curves.shape == (2, len(found.record.errors), 2)
    residuals = found.network.predict(samples.test_positions) - samples.test_joints[:, [1, 4]]
    rms = np.sqrt(np.mean(residuals**2, axis=0)) / samples.ranges[[1, 4]]
    assert found.curves[1, found.record.kept] == pytest.approx(rms)


def test_networks_are_joined_into_one_that_gives_all_their_outputs(samples):
    settings = LevenbergMarquardtAccelerated(n_iterations=3)
    learnt = learn(samples, [attempt(samples, (joint,), settings) for joint in (1, 2, 3)])
    joined = side_by_side([each.network for each in learnt])
    expected = np.hstack([each.network.predict(samples.positions) for each in learnt])
    assert joined.predict(samples.positions) == pytest.approx(expected, abs=1e-14)
    assert [quantity.name for quantity in joined.outputs] == ["joint_1", "joint_2", "joint_3"]


def test_the_generalised_delta_rule_learns_the_path(samples):
    """With the settings of params.yaml a pass is kept whatever its error, until it is infinite."""
    rule = SECTION.trainers["delta_rule"].but(n_iterations=150)
    faster = [rule.but(learning_rate=rate, minimum_rate=rate) for rate in (0.4, 1e9)]
    attempts = [attempt(samples, (6,), each) for each in (rule, *faster)]
    rule, fast, beyond = learn(samples, attempts)
    assert rule.curves[0, rule.record.kept] < 0.2 * rule.curves[0, 0]
    assert rule.record.kept == int(np.argmin(rule.record.errors))
    assert str(fast.record.stop_reason) == "iterations"
    assert np.diff(fast.record.errors).max() > 0.0
    assert str(beyond.record.stop_reason) == "line_search" and len(beyond.record.errors) == 1


@pytest.mark.parametrize("learns", ["each_joint", "all_joints"])
def test_the_median_start_is_the_middle_of_all(samples, path, tmp_path, learns):
    rule = SECTION.trainers["delta_rule"].but(n_iterations=4)
    settings = {"learns": learns, "architecture": Architecture(4, "logistic"), "seed": 1}
    settings |= {"trainer": rule, "n_restarts": 3}
    make(tmp_path, [Part("net", train.prepare_path, settings, {"path": path})], ALONE)
    starts = read_table(tmp_path / "net.starts.parquet")
    assert len(starts) == 18 and set(starts["joint"]) == set(range(1, 7))
    means = starts.groupby("restart")["error_percent"].mean()
    (median,) = starts.loc[starts["is_median"] == 1, "restart"].unique()
    assert means[median] == means.median()
    networks = load_restarts(tmp_path / "net.restarts.json")
    network, record = load_network(tmp_path / "net.json")
    assert list(networks) == [0, 1, 2] and record.restart == median
    found = network.predict(samples.test_positions)
    assert np.array_equal(found, networks[median].predict(samples.test_positions))
    by_hand = 100.0 * np.abs(found - samples.test_joints).mean(axis=0) / samples.ranges
    chosen = starts[starts["restart"] == median]
    assert chosen["error_percent"].to_numpy() == pytest.approx(by_hand)
    curves = read_table(tmp_path / "net.curves.parquet")
    assert len(curves) == 18 * 5
    kept = curves.merge(chosen, on=["restart", "joint"]).query("iteration == kept")
    rms = np.sqrt(np.mean((found - samples.test_joints) ** 2, axis=0)) / samples.ranges
    assert kept["test_error"].to_numpy() == pytest.approx(rms)


def test_starts_that_learn_together_become_what_they_are_alone(path):
    settings = {"learns": "all_joints", "architecture": Architecture(4, "logistic"), "seed": 1}
    rule = BackPropagation(mode="pattern", n_iterations=3)
    work = train.prepare_path(**settings, trainer=rule, n_restarts=2, path=path)
    (item,) = work.items
    together, alone = work.function(item), work.function(item[1:])
    for name, values in alone.items():
        assert np.array_equal(together[name], values), name


def test_a_study_tells_errors_of_every_value_and_start(samples, path):
    rule = SECTION.trainers["delta_rule"].but(n_iterations=5)
    settings = {"joint": 2, "n_restarts": 2, "n_hidden": (4,), "activation": "logistic"}
    settings |= {"seed": 1, "trainer": rule, "path": path}
    by_size = study.prepare(varied="n_hidden", values=[2, 4], **settings)
    by_factor = study.prepare(varied="learning_factor", values=[0.03, 0.2], **settings)
    assert (len(by_size.items), len(by_factor.items)) == (2, 1)
    sizes = stacked([by_size.function(item) for item in by_size.items], study.STUDY_FIELDS)
    factors = by_factor.function(by_factor.items[0])
    assert sizes["value"].tolist() == [2.0, 2.0, 4.0, 4.0]
    assert factors["value"].tolist() == [0.03, 0.03, 0.2, 0.2]
    # the size and the factor of the others stand in both
    assert np.array_equal(sizes["error_percent"][2:], factors["error_percent"][:2])
    assert factors["error_percent"][0] != factors["error_percent"][2]
    (found,) = learn(samples, [attempt(samples, (2,), rule, n_hidden=4, restart=1)])
    for inputs, joints, name in (
        (samples.positions, samples.joints, "training_percent"),
        (samples.test_positions, samples.test_joints, "error_percent"),
    ):
        error = percent(found.network.predict(inputs), joints[:, [1]], samples.ranges[[1]])
        assert factors[name][1] == error[0]


def test_a_workspace_network_learns_poses_of_its_configuration():
    joints = canonical(ARM, random_joints(4000, seed=8))
    joints = joints[configuration(ARM, joints) == 2]
    settings = Adam(n_iterations=40, batch_size=20, learning_rate=0.01, final_rate=0.0)
    lesson = train.workspace_lesson(ARM, joints, Architecture((20, 20)), settings, seed=1)
    network, record = train.trained(train.train_workspace((lesson, 2)))
    assert record.errors[record.kept] < 0.4 * record.errors[0]
    found = ArmConfigurations(ARM, {2: network})(query_of(joints), joints).values
    assert np.isfinite(found).all() and (found[:, 4] >= 0.0).all()
    # better than the joint angles' own mean
    spread = np.abs(joints[:, 1:3] - joints[:, 1:3].mean(axis=0)).mean()
    assert np.abs(found[:, 1:3] - joints[:, 1:3]).mean() < 0.5 * spread


def test_errors_of_all_starts_stand_beside_those_of_the_median(samples, path, tmp_path):
    settings = {"learns": "all_joints", "architecture": Architecture(4, "logistic"), "seed": 1}
    settings |= {"trainer": LevenbergMarquardtAccelerated(n_iterations=5), "n_restarts": 3}
    net = Part("net", train.prepare_path, settings, {"path": path})
    query = named(QUERY_FIELDS, query_of(samples.test_joints))
    write_table(tmp_path / "asked.parquet", query, QUERY_FIELDS)
    inputs = {"asked_for": tmp_path / "asked.parquet", "networks": tmp_path / "net.json"}
    inputs |= {"restarts": tmp_path / "net.restarts.json"}
    judged = {"arm": ARM, "kind": "predicted", "refinement": STEPS}
    make(tmp_path, [net, Part("errors", evaluate.prepare, judged, inputs)], ALONE)
    found = read_table(tmp_path / "errors.parquet")
    starts = read_table(tmp_path / "errors.starts.parquet")
    plain = found[found["n_steps"] == 0]
    assert len(found) == 3 * len(plain) == 3 * len(samples.test_joints)
    assert np.array_equal(array(plain, QUERY_FIELDS), query_of(samples.test_joints))
    medians = read_table(tmp_path / "net.starts.parquet").query("is_median == 1")
    (median,) = medians["restart"].unique()
    assert len(starts) == 3 * len(found) and starts["error"].nunique() > 2 * len(found)
    chosen = starts[starts["restart"] == median]
    for name in ("n_steps", "point", "error", "orientation_error", "status"):
        assert np.array_equal(chosen[name], found[name])
