"""Methods of the six-joint arm and their errors."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fanuc_arm import ARM, random_joints

from flexik.evaluation.fanuc.errors import statistics, workspace_errors
from flexik.evaluation.fanuc.judging import errors_beside_path, errors_on_path, errors_on_targets
from flexik.learning.training import Architecture, BackPropagation, trainer_settings
from flexik.kinematics.fanuc import canonical, configuration
from flexik.kinematics.pose_representation import joint_outputs, pose_inputs
from flexik.kinematics.serial_arm import Pose, forward
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.methods import (
    closed_form,
    interpolated,
    nearest_sample,
    path_networks,
    refined,
    workspace_networks,
)
from flexik.positioning.fanuc.training import (
    PathTask,
    TaughtSamples,
    WorkspaceTask,
    error_percent,
    path_tasks,
    start_rows,
    study_row,
    train_path,
    train_workspace,
)
from flexik.positioning.method import PositioningError

ROOT = Path(__file__).parents[1]
SUCCESS = {"position": 1e-3, "orientation": 1e-3}
REFINEMENT = {"damping": 1e-8, "orientation_length": 0.5, "n_steps": 2}


class Known:
    """A network that knows the answer to what it is asked."""

    def __init__(self, inputs, outputs):
        self.answers = {row.tobytes(): answer for row, answer in zip(inputs, outputs, strict=True)}

    def predict(self, values, /):
        """Outputs at inputs that are known."""
        return np.array([self.answers[np.ascontiguousarray(row).tobytes()] for row in values])


@pytest.fixture
def joints():
    return canonical(ARM, random_joints(40, seed=4))


def test_the_closed_form_gives_the_joints_of_the_configuration(joints):
    number = configuration(ARM, joints)
    found = closed_form(ARM)(forward(ARM, joints), number)
    assert canonical(ARM, found) == pytest.approx(joints, abs=1e-7)
    out_of_reach = Pose(np.full((1, 3), 9.0), np.eye(3)[None])
    assert np.isnan(closed_form(ARM)(out_of_reach, np.zeros(1, dtype=np.int64))).all()


def test_path_networks_put_every_joint_in_its_place(joints):
    target = forward(ARM, joints)
    networks = {
        (6, 2): Known(target.position, joints[:, [5, 1]]),
        (1, 3, 4, 5): Known(target.position, joints[:, [0, 2, 3, 4]]),
    }
    found = path_networks(networks)(target, configuration(ARM, joints))
    assert np.array_equal(found, joints)
    with pytest.raises(PositioningError, match="each once"):
        path_networks({(1, 2): networks[(6, 2)]})


def test_workspace_networks_answer_for_their_own_configuration(joints):
    target, number = forward(ARM, joints), configuration(ARM, joints)
    inputs, outputs = pose_inputs(target), joint_outputs(ARM, joints)
    networks = {int(k): Known(inputs[number == k], outputs[number == k]) for k in np.unique(number)}
    found = workspace_networks(ARM, networks)(target, number)
    assert found == pytest.approx(joints, abs=1e-9)
    del networks[int(number[0])]
    with pytest.raises(PositioningError, match=f"configuration {number[0]}"):
        workspace_networks(ARM, networks)(target, number)


def test_refined_is_the_method_and_steps_after_it(joints):
    target, number = forward(ARM, joints), configuration(ARM, joints)

    def rough(target, number):
        return joints + 0.01

    errors = [
        workspace_errors(ARM, target, number, refined(ARM, rough, n, 1e-8, 0.5)(target, number))
        for n in range(3)
    ]
    medians = [float(np.median(error["position_error"])) for error in errors]
    assert medians[1] < 0.05 * medians[0] and medians[2] < 0.05 * medians[1]
    assert refined(ARM, rough, 0, 1e-8, 0.5) is rough


def test_errors_are_distances_angles_and_limits(joints):
    target, number = forward(ARM, joints), configuration(ARM, joints)
    found = workspace_errors(ARM, target, number, joints)
    assert found["position_error"].max() < 1e-14 and found["orientation_error"].max() < 1e-7
    assert found["within_limits"].all()
    turned = joints.copy()
    turned[:, 5] += 0.25
    turned[0, 3] += 4.0 * np.pi
    found = workspace_errors(ARM, target, number ^ (np.arange(40) == 3), turned)
    assert np.flatnonzero(found["in_configuration"] == 0).tolist() == [3]
    assert found["position_error"].max() < 1e-13
    assert found["orientation_error"] == pytest.approx(np.full(40, 0.25))
    assert not found["within_limits"][0] and found["within_limits"][1:].all()


def test_statistics_by_hand():
    frame = pd.DataFrame(
        {
            "position_error": [0.0, 1e-4, 2e-3, 1e-4, 0.0],
            "orientation_error": [0.0, 5e-4, 0.0, 0.0, 0.0],
            "within_limits": [1, 1, 1, 0, 1],
            "in_configuration": [1, 1, 1, 1, 0],
        }
    )
    found = statistics(frame, SUCCESS)
    assert found["mean_position_error"] == pytest.approx(4.4e-4)
    assert found["median_position_error"] == pytest.approx(1e-4)
    assert found["max_orientation_error"] == pytest.approx(5e-4)
    # the third is too far, the fourth beyond its limits, the fifth in another configuration
    assert found["success_rate"] == 0.4 and found["n_targets"] == 5


def exact_and_rough(joints):
    def rough(target, number):
        return closed_form(ARM)(target, number) + 0.02

    return {"rough": rough}, {"exact": closed_form(ARM)}


def test_on_the_path_all_methods_have_all_samples(joints):
    rough, exact = exact_and_rough(joints)
    share = np.linspace(0.0, 1.0, 40)
    frame = errors_on_path(ARM, rough | exact, share, joints)
    assert frame["method"].value_counts().to_dict() == {"rough": 40, "exact": 40}
    errors = frame.groupby("method")["position_error"].max()
    assert errors["exact"] < 1e-12 < 1e-3 < errors["rough"]
    assert frame["commanded_2"].to_numpy()[:40] == pytest.approx(joints[:, 1] + 0.02, abs=1e-6)


def test_beside_the_path_unreachable_targets_are_left_out_for_all(joints):
    rough, exact = exact_and_rough(joints)
    distances = [0.0, 0.01, 5.0]
    frame = errors_beside_path(ARM, rough, exact, joints, np.arange(40), distances, 1, REFINEMENT)
    counts = frame.groupby(["distance", "method", "n_steps"]).size()
    assert set(frame["distance"]) == {0.0, 0.01}
    assert list(counts[0.0].index) == [("exact", 0), ("rough", 0), ("rough", 1), ("rough", 2)]
    assert set(counts[0.0]) == {40}
    assert len(set(counts[0.01])) == 1 and counts[0.01].max() <= 40
    assert frame.loc[frame["method"] == "exact", "position_error"].max() < 1e-12


def test_random_targets_keep_their_configuration(joints):
    rough, exact = exact_and_rough(joints)
    number = configuration(ARM, joints)
    frame = errors_on_targets(ARM, rough, exact, number, joints, REFINEMENT)
    assert len(frame) == 4 * 40
    assert np.array_equal(frame["configuration"].to_numpy(), np.tile(number, 4))
    assert (frame["singular_value"] > 0.0).all()
    means = frame.groupby(["method", "n_steps"])["position_error"].median()
    assert means["rough", 0] > means["rough", 1] > means["rough", 2] > means["exact", 0]


@pytest.fixture
def samples():
    share = np.linspace(0.0, 1.0, 90)[:, None]
    joints = 0.4 * np.sin(2.0 * share + np.arange(6)) + np.array([0, 0, 0, 0, 1.0, 0])
    position = forward(ARM, joints).position
    test = np.arange(90) % 3 == 1
    return TaughtSamples(position[~test], joints[~test], position[test], joints[test])


def test_a_watched_training_gives_the_errors_of_every_joint(samples):
    settings = trainer_settings("levenberg_marquardt_accelerated", {"n_iterations": 15})
    architecture = Architecture(5, "logistic")
    task = PathTask(samples, (2, 5), architecture, settings, seed=1, restart=0)
    network, record, curves = train_path(task)
    assert set(curves["joint"]) == {2, 5}
    assert len(curves) == 2 * len(record.errors)
    for column, joint in enumerate((2, 5)):
        residuals = network.predict(samples.test_positions)[:, column]
        residuals = residuals - samples.test_joints[:, joint - 1]
        rms = np.sqrt(np.mean(residuals**2)) / samples.ranges[joint - 1]
        row = curves[(curves["joint"] == joint) & (curves["iteration"] == record.kept)]
        assert row["test_error"].item() == pytest.approx(rms)
    assert train_path(task, watch=False)[2].empty


def test_the_generalised_delta_rule_learns_the_path(samples):
    settings = BackPropagation(
        mode="pattern", n_iterations=150, learning_rate=0.05, momentum=0.9, rate_increase=1.0
    )
    task = PathTask(samples, (1,), Architecture(6, "logistic"), settings, seed=1, restart=0)
    network, record, curves = train_path(task)
    errors = curves["training_error"].to_numpy()
    assert errors[record.kept] < 0.2 * errors[0]
    percent = error_percent(network, samples, (1,))
    found = network.predict(samples.test_positions)[:, 0]
    by_hand = np.mean(np.abs(found - samples.test_joints[:, 0])) / samples.ranges[0]
    assert percent == pytest.approx([100.0 * by_hand])
    row = study_row(task)
    assert row["error_percent"] == pytest.approx(percent[0])
    assert row["kept"] == record.kept == int(np.argmin(record.errors))
    found = network.predict(samples.positions)[:, 0]
    by_hand = np.mean(np.abs(found - samples.joints[:, 0])) / samples.ranges[0]
    assert row["training_percent"] == pytest.approx(100.0 * by_hand)


def test_a_constant_learning_factor_is_never_lowered(samples):
    """With the settings of params.yaml a pass is kept whatever its error, until it is infinite."""
    options = load_parameters(ROOT / "params.yaml").fanuc.trainers["study"].model_dump()
    options |= {"n_iterations": 30}
    reasons = {}
    for factor in (0.4, 1e9):
        settings = {name: value for name, value in options.items() if name != "kind"}
        settings |= {"learning_rate": factor, "minimum_rate": factor}
        trainer = trainer_settings("back_propagation", settings)
        task = PathTask(samples, (6,), Architecture(6, "logistic"), trainer, seed=1, restart=0)
        _, record, _ = train_path(task)
        reasons[factor] = str(record.stop_reason), np.diff(record.errors).max(initial=0.0) > 0.0
    assert reasons == {0.4: ("iterations", True), 1e9: ("line_search", False)}


def test_the_median_start_is_the_middle_of_all(samples):
    settings = trainer_settings("levenberg_marquardt_accelerated", {"n_iterations": 3})
    pairs = [(1, 2, 3), (4, 5, 6)]
    tasks = path_tasks(samples, pairs, Architecture(4, "logistic"), settings, 1, 3)
    assert [task.restart for task in tasks] == [0, 1, 2, 3, 4, 5]
    trained = [train_path(task) for task in tasks]
    rows = start_rows(tasks, trained)
    assert len(rows) == 18 and set(rows["joint"]) == set(range(1, 7))
    means = rows.groupby("restart")["error_percent"].mean()
    (median,) = rows.loc[rows["is_median"] == 1, "restart"].unique()
    assert means[median] == means.median()
    expected = error_percent(trained[2 * median + 1][0], samples, (4, 5, 6))
    chosen = rows[(rows["is_median"] == 1) & (rows["joint"] > 3)]
    assert chosen["error_percent"].to_numpy() == pytest.approx(expected)


def test_look_ups_know_the_samples_and_what_lies_between():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    joints = np.array([np.full(6, value) for value in (0.0, 1.0, 3.0)])
    target = Pose(np.array([[0.3, 0.2, 0.0], [1.0, 0.75, 0.0], [1, 2, 0]]), np.zeros((3, 3, 3)))
    number = np.zeros(3, dtype=np.int64)
    found = nearest_sample(positions, joints)(target, number)
    assert found[:, 0].tolist() == [0.0, 3.0, 3.0]
    found = interpolated(positions, joints)(target, number)
    assert found == pytest.approx(np.tile([[0.3], [2.5], [3.0]], 6))


def test_networks_turn_joints_to_where_limits_admit_them():
    low, high = (-1.1, *ARM.minimum[1:]), (6.0, *ARM.maximum[1:])
    shifted = dataclasses.replace(ARM, minimum=low, maximum=high)
    joints = canonical(ARM, random_joints(200, seed=4))
    joints[:, 0] = np.where(joints[:, 0] < -1.1, joints[:, 0] + 2.0 * np.pi, joints[:, 0])
    joints = joints[(joints[:, 0] < 6.0) & (configuration(ARM, joints) == 0)]
    target = forward(ARM, joints)
    known = Known(pose_inputs(target), joint_outputs(ARM, canonical(ARM, joints)))
    found = workspace_networks(shifted, {0: known})(target, np.zeros(len(joints), dtype=np.int64))
    assert found[:, 0].max() > np.pi and shifted.within_limits(found).all()
    assert found == pytest.approx(joints, abs=1e-9)


def test_a_workspace_network_learns_poses_of_its_configuration():
    joints = canonical(ARM, random_joints(4000, seed=8))
    joints = joints[configuration(ARM, joints) == 2]
    options = {"n_iterations": 40, "batch_size": 20, "learning_rate": 0.01, "final_rate": 0.0}
    settings = trainer_settings("adam", options)
    task = WorkspaceTask(ARM, 2, joints, Architecture((20, 20)), settings, seed=1)
    network, record = train_workspace(task)
    assert record.errors[record.kept] < 0.4 * record.errors[0]
    method = workspace_networks(ARM, {2: network})
    found = method(forward(ARM, joints), np.full(len(joints), 2))
    assert np.isfinite(found).all() and (found[:, 4] >= 0.0).all()
    # better than the joint angles' own mean
    spread = np.abs(joints[:, 1:3] - joints[:, 1:3].mean(axis=0)).mean()
    assert np.abs(found[:, 1:3] - joints[:, 1:3]).mean() < 0.5 * spread
