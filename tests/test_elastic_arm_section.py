"""Every mistake in the section of the elastic arm names its key."""

import copy

import pytest
from elastic_arm import ROOT

from flexik.errors import ParameterError
from flexik.parameters import read_yaml, validate

ORIGINAL = read_yaml(ROOT / "params.yaml")
WRONG = [
    ("geometry.lengths", [0.57, -0.62]),
    ("geometry.theta_1_degrees", [35.0, -5.0]),
    ("structure.tube.wall", 0.01),
    ("structure.gravity", 0.0),
    ("structure.n_elements", 0),
    ("structure.n_elements", 1000000),
    ("structure.youngs_modulus", 1.0e6),
    ("structure.youngs_modulus", 1.0e30),
    ("gauges.voltage_range", [5.0, -5.0]),
    ("gauges.slopes.1", [0.0016, 0.0, 0.0022]),
    ("gauges.deflection_stations.0", 0.6),
    ("gauges.strain_stations.1", 0.62),
    ("gauges.noise", -1.0),
    ("readings.theta_2_degrees.increment", 7.0),
    ("readings.theta_1_degrees.maximum", 40.0),
    ("readings.payloads", [0.0, 1.0, 1.0]),
    ("readings.payloads", []),
    ("readings.payloads", [0.0, 1.0e4]),
    ("readings.held_out_share", 0.0001),
    ("readings.selection_share", 0.8499),
    ("readings.theta_1_degrees.increment", 1.0e-6),
    ("splits.seeds", [2, 2]),
    ("splits.seeds", [1]),
    ("splits.network", "deflection"),
    ("workspace.payload", [0.0, 10.0]),
    ("workspace.payload_error", 0.0),
    ("readings.held_out_share", 0.85),
    ("readings.selection_share", 0.0),
    ("networks.published_network.readings", None),
    ("networks.deflection.readings", "noisy"),
    ("networks.published_network.n_hidden", []),
    ("networks.published_network.n_hidden.1", 0),
    ("networks.published_network.trainer", "nothing"),
    ("networks.published_network.kind", "rigid"),
    ("selected_networks.selected_pair.select.trainer", "nothing"),
    ("selected_networks.selected_pair.select.n_hidden.0.increment", 7),
    ("workspace.x", [1.2, 0.5]),
    ("methods.combined.network", "inverse"),
    ("methods.combined.network", "nothing"),
    ("methods.combined.n_corrections", 0),
    ("methods.combined.network", "gauges_elbow_lm_noisy"),
    ("methods.inverse_network.network", "published_network"),
    ("methods.published_network.network", "published_network_lm"),
    ("methods.published_network.method", "oracle"),
    ("trainers.back_propagation.minimum_rate", 1.0),
]


def changed(key, value):
    data = copy.deepcopy(ORIGINAL)
    *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
    section = data["elastic_arm"]
    for name in path:
        section = section[name]
    section[last] = value
    return data


def mistake(data):
    with pytest.raises(ParameterError) as raised:
        validate(data)
    return str(raised.value)


@pytest.mark.parametrize(("key", "value"), WRONG, ids=[f"{k}={v}" for k, v in WRONG])
def test_a_wrong_value_names_its_key(key, value):
    text = mistake(changed(key, value))
    # a list, or one whole section, may be what is wrong
    parents = {key, key.rpartition(".")[0]}
    if key.endswith("method"):
        parents = {key.removesuffix(".method")}
    assert any(f"params.yaml: elastic_arm.{parent}" in text for parent in parents), text


def test_names_stand_once_and_are_free():
    networks = ORIGINAL["elastic_arm"]["networks"]
    selected = ORIGINAL["elastic_arm"]["selected_networks"]["selected_pair"]
    twice = changed("selected_networks", {"deflection": selected})
    assert "selected_networks.deflection: stands under networks too" in mistake(twice)
    taken = changed("networks", {**networks, "none": networks["deflection"]})
    assert "networks.none: the name is taken" in mistake(taken)


def test_a_network_given_gauges_is_needed():
    networks = ORIGINAL["elastic_arm"]["networks"]
    data = changed("networks", {k: networks[k] for k in ("deflection", "inverse")})
    data["elastic_arm"]["selected_networks"] = {}
    data["elastic_arm"]["methods"] = {}
    text = mistake(data)
    assert "splits.network" in text and "of kind gauges, the published idea" in text


def test_angles_are_in_degrees_and_radians_inside():
    from elastic_arm import GEOMETRY

    assert GEOMETRY.limits[0] == pytest.approx((-0.08726646, 0.61086524))
