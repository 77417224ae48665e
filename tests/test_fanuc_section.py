"""The section `fanuc` and its machine file: every mistake names its key."""

import copy

import numpy as np
import pytest
from fanuc_arm import ARM, FILES, SECTION, section

from flexik.cases.fanuc.parts.tables import arm_of
from flexik.cases.fanuc.section import N_COLUMNS, check, n_weights
from flexik.errors import ParameterError
from flexik.kinematics.pose_representation import INPUTS, OUTPUTS
from flexik.kinematics.serial_arm import SerialArm
from flexik.learning.weights import initial_weights

PARAMETERS, MACHINE = FILES.values()


def changed(data, key, value):
    data = copy.deepcopy(data)
    *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
    inside = data
    for name in path:
        inside = inside[name]
    if value is None:
        del inside[last]
    else:
        inside[last] = value
    return data


def test_the_arm_is_the_published_one():
    found = arm_of(SECTION.machine.joints)
    for name in SerialArm.__dataclass_fields__:
        assert getattr(found, name) == pytest.approx(getattr(ARM, name), abs=1e-15), name
    # radians in the file, degrees in the source
    degrees = np.rad2deg([found.minimum, found.maximum])
    assert np.abs(degrees - degrees.round()).max() < 1e-12
    check(SECTION)


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("samples.path.region.1", [0.5, 0.5], ""),
        ("samples.path.region.4", [0.5, 2.5], ""),
        ("samples.path.n_via_points", 2, ""),
        ("samples.path.n_test", 0, ""),
        ("samples.path.n_training", 1, ""),
        ("samples.n_poses", 10, "networks.whole_workspace.n_hidden"),
        ("conditions.refinement.damping", 0.0, ""),
        ("conditions.refinement.n_steps", 0, ""),
        ("conditions.off_path.distances", [0.1, 0.0], "conditions.off_path.distances.1"),
        ("conditions.off_path.distances.0", -0.1, ""),
        ("conditions.off_path.distances", [0.001, 0.0010000001], "conditions.off_path.distances.1"),
        ("success.position", -1.0, ""),
        ("networks.config1.learns", "two_joints", ""),
        ("networks.config1.trainer", "nothing", ""),
        ("networks.config1.n_restarts", 0, ""),
        ("networks.config1.n_hidden", 100, "networks.config1.n_hidden: 501 weights"),
        ("networks.config1.n_hidden", {"minimum": 2, "maximum": 4, "increment": 1}, ""),
        ("networks.config1.n_hidden", [5, 5], "networks.config1.n_hidden: expected one layer"),
        ("networks.whole_workspace.n_hidden", [], ""),
        ("networks.whole_workspace", None, ""),
        ("methods.closed_form", None, ""),
        ("methods.config1", None, ""),
        ("methods.config1_refined_2", {"kind": "predicted"}, ""),
        ("methods.whole_workspace.kind", "predicted", "methods.whole_workspace"),
        ("methods.config2.kind", "newton", ""),
        ("studies.n_hidden.network", "config2", ""),
        ("studies.learning_factor.network", "config1_levenberg_marquardt", ""),
        ("studies.n_hidden.joint", 7, ""),
        ("studies.n_hidden.values.1", 2, ""),
        ("studies.n_hidden.values", [2, 200], "studies.n_hidden.values.1: 1001 weights"),
        ("studies.learning_factor.values", [0.1, 0.1], "studies.learning_factor.values.1"),
        ("speed", 1.0, ""),
    ],
)
def test_a_mistake_names_its_key(key, value, named):
    with pytest.raises(ParameterError) as raised:
        section(changed(PARAMETERS, f"fanuc.{key}", value))
    expected = f"params.yaml: fanuc.{named or key}"
    assert any(line.startswith(expected) for line in str(raised.value).splitlines()), raised.value


@pytest.mark.parametrize(
    ("key", "value"), [("joints", []), ("joints.2.maximum", -9.0), ("joints.2.d", "long")]
)
def test_a_mistake_in_the_machine_file_names_its_key(key, value):
    with pytest.raises(ParameterError, match=rf"data/machines/fanuc\.yaml: {key}"):
        section(PARAMETERS, changed(MACHINE, key, value))


def test_a_learning_factor_that_does_not_stay_is_told():
    trainer = section(changed(PARAMETERS, "trainers.delta_rule.rate_increase", 1.0))
    assert trainer == SECTION
    with pytest.raises(ParameterError, match=r"studies\.n_hidden\.network: .* constant"):
        section(changed(PARAMETERS, "trainers.delta_rule.rate_increase", 1.1))


def test_weights_are_counted_as_networks_have_them():
    n_inputs, n_outputs = N_COLUMNS["arm_configuration"]
    assert (len(INPUTS), len(OUTPUTS)) == (n_inputs, n_outputs)
    weights = initial_weights(n_inputs, (5, 7), n_outputs, "tanh", np.random.default_rng(0))
    assert n_weights(n_inputs, (5, 7), n_outputs) == sum(matrix.size for matrix in weights)
