"""The section `fanuc` of params.yaml: every mistake names its key."""

import copy
from pathlib import Path

import numpy as np
import pytest
from fanuc_arm import ARM

from flexik.errors import ParameterError
from flexik.learning.weights import initial_weights
from flexik.kinematics.pose_representation import INPUTS, OUTPUTS
from flexik.kinematics.serial_arm import SerialArm
from flexik.parameters import read_yaml, validate
from flexik.parameters.fanuc import N_OUTPUTS, N_POSE, n_weights

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def original():
    return read_yaml(ROOT / "params.yaml")


def changed(data, key, value):
    data = copy.deepcopy(data)
    *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
    section = data
    for name in path:
        section = section[name]
    section[last] = value
    return data


def test_the_arm_is_the_published_one(original):
    joints = validate(original).fanuc.joints
    found = SerialArm.from_rows([joint.model_dump() for joint in joints])
    for name in SerialArm.__dataclass_fields__:
        assert getattr(found, name) == pytest.approx(getattr(ARM, name), abs=1e-15), name
    # radians in the file, degrees in the source
    degrees = np.rad2deg([found.minimum, found.maximum])
    assert np.abs(degrees - degrees.round()).max() < 1e-12


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("fanuc.joints", [], "fanuc.joints"),
        ("fanuc.joints.2.maximum", -9.0, "fanuc.joints.2.maximum"),
        ("fanuc.joints.2.d", "long", "fanuc.joints.2.d"),
        ("fanuc.path.region.1", [0.5, 0.5], "fanuc.path.region.1"),
        ("fanuc.path.region.4", [0.5, 2.5], "fanuc.path.region.4"),
        ("fanuc.path.n_via_points", 2, "fanuc.path.n_via_points"),
        ("fanuc.path.n_test", 0, "fanuc.path.n_test"),
        ("fanuc.refinement.damping", 0.0, "fanuc.refinement.damping"),
        ("fanuc.refinement.n_steps", 0, "fanuc.refinement.n_steps"),
        ("fanuc.success.position", -1.0, "fanuc.success.position"),
        ("fanuc.networks.config1.outputs", "two_joints", "fanuc.networks.config1.outputs"),
        ("fanuc.networks.config1.trainer", "nothing", "fanuc.networks.config1.trainer"),
        ("fanuc.networks.closed_form", {}, "fanuc.networks.closed_form"),
        ("fanuc.study.trainer", "adam", "fanuc.study.trainer"),
        ("fanuc.study.trainer", "nothing", "fanuc.study.trainer"),
        ("fanuc.study.network", "config2", "fanuc.study.network"),
        ("fanuc.study.joint", 7, "fanuc.study.joint"),
        ("fanuc.study.n_hidden.1", 2, "fanuc.study.n_hidden.1"),
        ("fanuc.study.learning_factors", [0.1, 0.1], "fanuc.study.learning_factors.1"),
        ("fanuc.off_path.distances", [0.1, 0.0], "fanuc.off_path.distances.1"),
        ("fanuc.off_path.distances.0", -0.1, "fanuc.off_path.distances.0"),
        ("fanuc.workspace.n_hidden", [], "fanuc.workspace.n_hidden"),
        ("fanuc.workspace.trainer", "nothing", "fanuc.workspace.trainer"),
        ("fanuc.trainers.adam.final_rate", 1.5, "fanuc.trainers.adam.final_rate"),
        ("fanuc.networks.config1.n_restarts", 0, "fanuc.networks.config1.n_restarts"),
        ("fanuc.networks.config1.n_hidden", 100, "fanuc.networks.config1.n_hidden: 501 weights"),
        ("fanuc.study.n_hidden", [2, 200], "fanuc.study.n_hidden.1: 1001 weights"),
        ("fanuc.path.n_training", 1, "fanuc.path.n_training"),
        ("fanuc.workspace.n_training", 10, "fanuc.workspace.n_hidden"),
        ("fanuc.off_path.distances", [0.001, 0.0010000001], "fanuc.off_path.distances.1: prints"),
        ("fanuc.trainers.study.rate_increase", 1.1, "fanuc.study.trainer"),
        ("fanuc.speed", 1.0, "fanuc.speed"),
    ],
)
def test_a_mistake_names_its_key(original, key, value, named):
    with pytest.raises(ParameterError) as raised:
        validate(changed(original, key, value))
    assert any(
        line.startswith(f"params.yaml: {named}") for line in str(raised.value).splitlines()
    ), raised.value


@pytest.mark.parametrize(
    "name", ["closed_form", "whole_workspace", "opw", "interpolated", "config1_refined_2"]
)
def test_a_name_that_is_taken_is_told(original, name):
    network = original["fanuc"]["networks"]["config1"]
    with pytest.raises(ParameterError, match=rf"fanuc\.networks\.{name}: the name is taken"):
        validate(changed(original, f"fanuc.networks.{name}", network))


def test_weights_are_counted_as_networks_have_them():
    assert (len(INPUTS), len(OUTPUTS)) == (N_POSE, N_OUTPUTS)
    weights = initial_weights(N_POSE, (5, 7), N_OUTPUTS, "tanh", np.random.default_rng(0))
    assert n_weights(N_POSE, [5, 7], N_OUTPUTS) == sum(matrix.size for matrix in weights)
