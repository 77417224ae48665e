"""Every mistake in the section and the machine file of the elastic arm names its key."""

import copy
from pathlib import Path

import pytest
from elastic_arm import ROOT, SECTION

from flexik.cases import case as cases
from flexik.errors import ParameterError
from flexik.parameters.reading import read_yaml

FILES = (Path("params.yaml"), Path("data/machines/elastic_arm.yaml"))
ORIGINAL = {file: read_yaml(ROOT / file) for file in FILES}
NETWORK = "networks.published_network"
WRONG = [
    ("machine.drives.theta_1.limits_degrees", [35.0, -5.0]),
    ("machine.bodies.link_1.section.wall", 0.01),
    ("machine.gravity", 0.0),
    ("machine.bodies.link_1.n_elements", 0),
    ("machine.bodies.link_1.n_elements", 1000000),
    ("machine.bodies.link_1.youngs_modulus", 1.0e6),
    ("machine.bodies.link_1.youngs_modulus", 1.0e30),
    ("machine.instruments.voltage_range", [5.0, -5.0]),
    ("machine.instruments.slopes.1", [0.0016, 0.0, 0.0022]),
    ("machine.instruments.noise", -1.0),
    ("samples.theta_2_degrees.increment", 7.0),
    ("samples.theta_1_degrees.maximum", 40.0),
    ("samples.theta_1_degrees.increment", 1.0e-6),
    ("samples.payloads", [0.0, 1.0, 1.0]),
    ("samples.payloads", []),
    ("samples.payloads", [0.0, 1.0e4]),
    ("samples.held_out_share", 0.0001),
    ("samples.held_out_share", 0.85),
    ("samples.selection_share", 0.8499),
    ("samples.selection_share", 0.0),
    ("studies.splits.seeds", [2, 2]),
    ("studies.splits.seeds", [1]),
    ("studies.splits.network", "deflection"),
    ("studies.splits.network", "selected_pair"),
    ("studies.payload_error", 0.0),
    ("conditions", {}),
    ("conditions.readings", ORIGINAL[FILES[0]]["elastic_arm"]["conditions"]["workspace"]),
    ("conditions.workspace.payload", [0.0, 10.0]),
    ("conditions.workspace.x", [1.2, 0.5]),
    ("networks.deflection.readings", "noisy"),
    (f"{NETWORK}.n_hidden", []),
    (f"{NETWORK}.n_hidden.1", 0),
    (f"{NETWORK}.trainer", "nothing"),
    (f"{NETWORK}.learns", "rigid"),
    (f"{NETWORK}.corrects", "deflection"),
    ("networks.selected_pair.select.trainer", "nothing"),
    ("networks.selected_pair.n_hidden.0.increment", 7),
    ("methods.combined.network", "inverse"),
    ("methods.combined.network", "nothing"),
    ("methods.combined.network", "gauges_elbow_lm_noisy"),
    ("methods.combined.n_corrections", 0),
    ("methods.inverse_network.network", "published_network"),
    ("methods.published_network.network", "deflection"),
    ("methods.published_network.network", "published_network_lm"),
    ("methods.published_network.method", "oracle"),
    ("methods.select", {"method": "none"}),
    ("methods.none", {"method": "gauges", "network": "published_network"}),
]


@pytest.fixture
def changed(monkeypatch):
    """Load the section with another value of a key."""

    def change(key, value):
        files = copy.deepcopy(ORIGINAL)
        section = files[FILES[0]]["elastic_arm"]
        if key.startswith("machine."):
            section, key = files[FILES[1]], key.removeprefix("machine.")
        *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
        for name in path:
            section = section[name]
        section[last] = value
        monkeypatch.setattr(cases, "_read", lambda file: files[Path(file)])
        return cases.load("elastic_arm")

    return change


@pytest.mark.parametrize(("key", "value"), WRONG, ids=lambda value: str(value)[:40])
def test_a_wrong_value_names_its_key(changed, key, value):
    with pytest.raises(ParameterError) as raised:
        changed(key, value)
    (line,) = str(raised.value).splitlines()
    file, named, _ = line.split(": ", 2)
    prefix, of_file = ("", FILES[1]) if key.startswith("machine.") else ("elastic_arm.", FILES[0])
    key = prefix + key.removeprefix("machine.")
    # what holds the value may be told, or an entry of it
    parents = {key, key.rpartition(".")[0]}
    assert Path(file) == of_file
    assert any(part.startswith(tuple(parents)) for part in named.split(", "))


def test_methods_of_the_crane_run_here_too(changed):
    tip = {"learns": "tip", "n_hidden": 10, "n_restarts": 2}
    networks = {**ORIGINAL[FILES[0]]["elastic_arm"]["networks"], "tip": tip}
    with pytest.raises(ParameterError, match="there is no network 'tip'"):
        changed("methods.direct", {"method": "direct", "network": "tip"})
    assert changed("networks", networks).networks["tip"].sizes == [(10,)]


def test_networks_given_gauges():
    assert len(SECTION.gauge_networks) == 11
    assert SECTION.networks["selected_pair"].sizes[0] == (5, 5)
    assert SECTION.networks["selected_pair"].is_selected
