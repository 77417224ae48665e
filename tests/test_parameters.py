"""params.yaml: what it says is valid, commented and complete, and every mistake names its key."""

import copy
import itertools
import re
import typing
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry
from flexik.parameters import (
    Parameters,
    load_parameters,
    overlay,
    parameters_checksum,
    read_yaml,
    validate,
)

ROOT = Path(__file__).parents[1]
PROFILES = sorted((ROOT / "profiles").glob("*.yaml"))
DVC_IGNORES = {"size", "nfiles"}  # names of keys that DVC's run cache leaves out


@pytest.fixture(scope="module")
def original():
    return read_yaml(ROOT / "params.yaml")


def changed(data, key, value):
    """Copy of `data` with `key` (dotted) set to `value`, or removed if that is `...`."""
    data = copy.deepcopy(data)
    *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
    section = data
    for name in path:
        section = section[name]
    if value is ...:
        del section[last]
    else:
        section[last] = value
    return data


def mistake(data):
    with pytest.raises(ParameterError) as raised:
        validate(data)
    return str(raised.value)


def test_params_yaml_is_valid(original, geometry):
    parameters = load_parameters(ROOT / "params.yaml")
    assert parameters == validate(original)
    assert CraneGeometry(**parameters.crane.geometry.model_dump()) == geometry
    assert parameters.crane.networks["deflection"].n_hidden == 14
    assert len(parameters.crane.evaluation.points) == 25


@pytest.mark.parametrize("path", PROFILES, ids=lambda path: path.stem)
def test_profiles_are_valid(original, path):
    assert validate(overlay(original, read_yaml(path))) != validate(original)


def test_the_smoke_profile_is_among_the_profiles():
    assert "smoke" in [path.stem for path in PROFILES]


DEFLECTION = "crane.networks.deflection"
MODULAR = "crane.modular_networks.modular"
SELECTED = "crane.selected_networks.deflection_selected"
SELECTED_MODULAR = "crane.selected_modular_networks.modular_selected"
TRAINER = "crane.trainers.levenberg_marquardt"
PROPAGATION = "crane.trainers.back_propagation"
INVERSION = "crane.methods.direct.inversion"
WRONG = [
    # value out of range
    ("crane.structure.beams.lift.mass", -124.6),
    ("crane.structure.beams.lift.mass", 0.0),
    ("crane.structure.rocker.mass", -1.0),
    ("crane.structure.youngs_modulus", 0.0),
    ("crane.structure.beams.jib.n_elements", 0),
    ("crane.structure.beams.jib.n_elements", 2.5),
    ("crane.structure.beams.jib.mass_span", [-1.0, 1.8]),
    ("crane.structure.beams.jib.centre_of_mass", 3.0),
    ("crane.geometry.rocker_length", -0.45),
    ("crane.geometry.stroke_maximum.1", 0.0),
    ("crane.calibration.stiffness_range", [1.0e9, 1.0e6]),
    ("crane.mesh_study.refinements", [1]),
    ("crane.mesh_study.refinements", [2, 1]),
    ("crane.illustration.strokes", [0.6, 0.1, 1.2]),
    ("crane.grid.lift.maximum", 0.6),
    ("crane.grid.jib.maximum", 0.8775),
    ("crane.grid.extension.maximum", 2.0),
    ("crane.grid.payload.minimum", -50.0),
    ("crane.grid.lift.increment", 0.0),
    ("crane.grid.lift.increment", -0.066875),
    ("crane.grid.lift.increment", 0.07),
    ("crane.grid.maximum_failed_share", 1.1),
    ("crane.selection.payload", [500.0, 30.0]),
    ("crane.selection.seed", -1),
    (f"{TRAINER}.mu", 0.0),
    (f"{TRAINER}.mu", 1.0e11),
    (f"{TRAINER}.mu_decrease", 1.0),
    (f"{TRAINER}.mu_increase", 1.0),
    (f"{PROPAGATION}.minimum_rate", 0.1),
    ("crane.trainers.accelerated.acceleration", -0.1),
    (f"{DEFLECTION}.n_hidden", 0),
    (f"{MODULAR}.n_restarts", 0),
    (f"{SELECTED}.select.n_hidden.minimum", 0),
    (f"{SELECTED}.select.n_hidden.increment", 7),
    (f"{SELECTED}.select.tolerance", -0.1),
    (f"{SELECTED_MODULAR}.select.n_restarts", 0),
    ("crane.fitting.n_samples", 0),
    ("crane.fitting.n_hidden.1", 0),
    ("crane.fitting.jib", -0.195),
    ("crane.workspace.n_targets", 0),
    ("crane.workspace.x", [6.5, 0.0]),
    ("crane.workspace.y", [1.0, 1.0]),
    ("crane.workspace.payload", [500.0, 30.0]),
    ("crane.workspace.payload.0", -30.0),
    ("crane.workspace.tolerance", 0.0),
    ("crane.workspace.n_iterations", 0),
    ("crane.methods.combined.n_corrections", 0),
    ("crane.methods.combined.n_workspace_targets", -1),
    ("crane.methods.inverse.n_workspace_targets", 10001),  # more than workspace.n_targets
    (f"{INVERSION}.learning_rate", 0.0),
    (f"{INVERSION}.tolerance", -1.0e-7),
    (f"{INVERSION}.n_iterations", 0),
    ("crane.methods.direct_gauss_newton.inversion.damping", 0.0),
    ("crane.methods.modular_gauss_newton.inversion.tolerance", 0.0),
    ("crane.tolerance_study.tolerances.1", 0.0),
    ("crane.methods.combined_ga.genetic.n_individuals", 1),
    ("crane.methods.combined_ga.genetic.n_current", 16),
    ("crane.methods.combined_ga.genetic.tolerance", 0.0),
    ("parallel.n_workers", -1),
    # names that nothing goes by
    ("crane.structure.element", "timoshenko"),
    (f"{DEFLECTION}.activation", "relu"),
    (f"{DEFLECTION}.kind", "correction"),  # that is learnt by modular networks alone
    (f"{DEFLECTION}.trainer", "nothing"),
    (f"{MODULAR}.trainer", "nothing"),
    (f"{SELECTED}.trainer", "nothing"),
    (f"{SELECTED}.select.trainer", "nothing"),
    (f"{SELECTED_MODULAR}.trainer", "nothing"),
    (f"{SELECTED_MODULAR}.select.trainer", "nothing"),
    ("crane.fitting.trainer", "nothing"),
    (f"{MODULAR}.rigid", "nothing"),
    (f"{MODULAR}.rigid", "deflection"),
    (f"{MODULAR}.rigid", "modular"),
    (f"{SELECTED_MODULAR}.rigid", "direct_selected"),
    (f"{TRAINER}.kind", "simplex"),
    ("crane.methods.combined.method", "newton"),
    ("crane.methods.combined.network", "nothing"),
    ("crane.methods.combined.network", "direct"),
    ("crane.methods.direct.network", "modular"),
    ("crane.methods.modular.network", "rigid"),
    ("crane.methods.modular_selected.network", "direct_selected"),
    ("crane.methods.inverse.network", "deflection"),
    (f"{INVERSION}.kind", "newton"),
    ("crane.tolerance_study.methods", ["combined"]),
    ("crane.tolerance_study.methods.1", "inverse"),
    ("crane.tolerance_study.methods.1", "nothing"),
    ("crane.methods.combined_ga.inverse", "newton"),
    # nothing where something is needed, or too much
    ("crane.evaluation.points", []),
    ("crane.evaluation.payloads", []),
    ("crane.networks", {}),
    ("crane.tolerance_study.methods", []),
    ("crane.tolerance_study.tolerances", []),
    ("crane.tolerance_study.tolerances.1", 1.0e-5),
    ("crane.tolerance_study.methods.1", "direct"),
    ("crane.fitting.jib", 0.2),
    ("crane.fitting.payload", 550.0),
    ("crane.fitting.n_hidden", []),
    (INVERSION, None),
    ("crane.methods.direct", 3),
    ("crane.geometry.lift_pivot", [1.0]),
    ("crane.geometry.lift_pivot", [1.0, 2.0, 3.0]),
    ("crane.structure.gravity", None),
    ("crane.grid.lift", [0.0, 0.5]),
    ("crane.evaluation.points.3", [1.0, 7.0]),
    # no numbers
    (f"{TRAINER}.minimum_gradient", "1e-5"),
    (f"{INVERSION}.tolerance", "1e-7"),
    ("crane.tolerance_study.tolerances.0", "1e-5"),
    ("crane.methods.combined.n_workspace_targets", True),
    ("crane.calibration.stiffness_range", ["1e6", 1.0e9]),
    ("crane.geometry.lift_pivot", ["1e-3", 1.0]),
    ("crane.structure.gravity", "nan"),
    ("crane.structure.gravity", float("nan")),
    ("crane.structure.gravity", float("inf")),
    ("crane.evaluation.payloads.1", float("nan")),
    ("crane.evaluation.points.0.1", float("inf")),
    ("crane.structure.gravity", True),
    ("crane.mesh_study.n_samples", True),
    ("crane.structure.gravity", "heavy"),
    ("crane.evaluation.points.0", ["1e-3", 1.0]),
    ("crane.evaluation.points.0", [True, 9.0]),
    # keys that are unknown or missing
    ("crane.gravity", 9.81),
    ("crane.structure.beams.lift.weight", 9.81),
    (f"{TRAINER}.momentum", 0.9),
    (f"{TRAINER}.acceleration", 0.75),  # of the other schedule
    (f"{MODULAR}.kind", "direct"),
    (f"{SELECTED}.n_hidden", 14),
    (f"{INVERSION}.damping", 0.01),  # of the other kind
    ("crane.methods.combined.inversion", {}),
    ("crane.methods.inverse.n_corrections", 1),
    ("robot", {}),
    ("crane.structure.gravity", ...),
    ("crane.structure.beams.pillar", ...),
    (f"{TRAINER}.goal", ...),
    (f"{TRAINER}.kind", ...),
    (f"{DEFLECTION}.trainer", ...),
    (f"{SELECTED}.select", ...),
    (f"{SELECTED_MODULAR}.select.trainer", ...),
    (f"{MODULAR}.rigid", ...),
    ("crane.workspace", ...),
    ("crane.tolerance_study", ...),
    ("crane.modular_networks", ...),
    ("crane.methods.combined.method", ...),
    ("crane.methods.inverse.n_workspace_targets", ...),
    (INVERSION, ...),
    (f"{INVERSION}.kind", ...),
    (f"{INVERSION}.learning_rate", ...),
    ("crane.methods.combined_ga.genetic", ...),
    ("parallel", ...),
]

# Mistakes told by a neighbour that the key has to fit, or by the section whose kind is wrong
TOLD_BY = {
    "crane.grid.lift.maximum": "crane.grid.lift.increment",
    f"{TRAINER}.kind": TRAINER,
    f"{INVERSION}.kind": INVERSION,
    "crane.methods.combined.method": "crane.methods.combined",
}
ENTRY = re.compile(r"\.\d+")


@pytest.mark.parametrize(("key", "value"), WRONG, ids=lambda value: str(value)[:40])
def test_a_mistake_names_its_key(original, key, value):
    text = mistake(changed(original, key, value))
    (line,) = text.splitlines()
    file, named, message = line.split(": ", 2)
    assert file == "params.yaml" and message
    # the number of an entry may be added or left out
    assert ENTRY.sub("", named) == ENTRY.sub("", TOLD_BY.get(key, key))


def test_several_mistakes_are_told_at_once(original):
    data = changed(original, "crane.structure.gravity", -1.0)
    text = mistake(changed(data, "crane.methods.combined_ga.genetic.tolerance", ...))
    assert [line.split(": ")[1] for line in text.splitlines()] == [
        *("crane.structure.gravity", "crane.methods.combined_ga.genetic.tolerance")
    ]


NAMED = {
    "networks": "deflection",
    "modular_networks": "modular",
    "selected_networks": "rigid_selected",
    "selected_modular_networks": "modular_selected",
    "methods": "combined",
    "trainers": "study",
}
NETWORK_SECTIONS = [section for section in NAMED if section.endswith("networks")]


@pytest.mark.parametrize("section", NAMED)
def test_names_are_plain_words(original, section):
    same = original["crane"][section][NAMED[section]]
    text = mistake(changed(original, f"crane.{section}.My own", same))
    assert f"crane.{section}.My own" in text


@pytest.mark.parametrize(("section", "other"), list(itertools.permutations(NETWORK_SECTIONS, 2)))
def test_a_network_has_one_section(original, section, other):
    same = original["crane"][section][NAMED[section]]
    text = mistake(changed(original, f"crane.{section}.{NAMED[other]}", same))
    first, last = sorted((section, other), key=NETWORK_SECTIONS.index)
    assert text == f"params.yaml: crane.{last}.{NAMED[other]}: stands under {first} too"


@pytest.mark.parametrize("section", [*NETWORK_SECTIONS, "methods"])
@pytest.mark.parametrize("name", ["none", "workspace", "grid", "nfiles"])
def test_names_that_mean_something_else_are_taken(original, section, name):
    same = original["crane"][section][NAMED[section]]
    text = mistake(changed(original, f"crane.{section}.{name}", same))
    assert text == f"params.yaml: crane.{section}.{name}: the name is taken"


def test_a_network_may_have_the_name_of_a_method(original):
    same = original["crane"]["networks"]["rigid"]
    validate(changed(original, "crane.networks.combined_ga", same))


@pytest.mark.parametrize(
    ("key", "value", "known"),
    [
        (f"{SELECTED}.select.trainer", "fast", "levenberg_marquardt, accelerated, study, back_pr"),
        (f"{MODULAR}.rigid", "direct", "rigid, rigid_selected"),
        ("crane.methods.inverse.network", "direct", "of kind direct, inverse needs inverse"),
        ("crane.methods.direct.n_workspace_targets", 20000, "there are 10000"),
        ("crane.tolerance_study.methods.0", "inverse", "direct, modular, direct_selected, modul"),
        (f"{INVERSION}.kind", "newton", "'gradient_descent', 'gauss_newton'"),
        (f"{TRAINER}.kind", "simplex", "'back_propagation', 'adam', 'lbfgs'"),
    ],
)
def test_a_wrong_name_comes_with_those_that_would_do(original, key, value, known):
    assert known in mistake(changed(original, key, value))


def test_a_kind_that_a_method_does_not_take_is_told_there(original):
    text = mistake(changed(original, f"{DEFLECTION}.kind", "inverse"))
    assert text.startswith("params.yaml: crane.methods.combined.network: 'deflection' is of kind")


def test_every_network_of_the_four_sections_is_found(original):
    crane = validate(original).crane
    sections = [original["crane"][section] for section in NETWORK_SECTIONS]
    assert set(crane.all_networks) == {name for section in sections for name in section}
    assert list(crane.studies) == [*sections[2], *sections[3]]
    for name in sections[1] | sections[3]:
        assert crane.all_networks[name].kind == "correction"


def test_the_value_given_is_shown(original):
    assert "-124.6" in mistake(changed(original, "crane.structure.beams.lift.mass", -124.6))


def test_an_increment_that_does_not_divide_is_told(original):
    text = mistake(changed(original, "crane.grid.jib.increment", 0.1))
    assert "crane.grid.jib.increment: " in text and "whole number" in text


def test_a_missing_network_lists_those_there_are(original):
    text = mistake(changed(original, "crane.methods.combined_ga.network", "nothing"))
    assert text.startswith("params.yaml: crane.methods.combined_ga.network: ")
    sections = [original["crane"][section] for section in NETWORK_SECTIONS]
    assert f"({', '.join(name for section in sections for name in section)})" in text


def test_values_as_yaml_reads_them_are_not_changed_on_the_way(original):
    parameters = validate(original).model_dump(mode="json")

    def compare(given, found):
        if isinstance(given, dict):
            assert given.keys() == found.keys()
            for key, value in given.items():
                compare(value, found[key])
        elif isinstance(given, list):
            assert len(given) == len(found)
            for pair in zip(given, found, strict=True):
                compare(*pair)
        else:
            assert given == found and isinstance(found, bool) == isinstance(given, bool)

    compare(original, parameters)


@pytest.mark.parametrize("text", ["1e-05", "1E5", "-2.5e+3", ".5e1", "3.e2", "1.0e-5"])
def test_numbers_that_dvc_writes_are_numbers(tmp_path, text):
    file = tmp_path / "params.yaml"
    file.write_text(f"a: {text}\nb: '{text}'\nc: e{text}\n")
    assert read_yaml(file) == {"a": float(text), "b": text, "c": f"e{text}"}


FILES = {
    "twice": ("a: 1\nb: 2\na: 3\n", "'a' stands twice"),
    "twice_deep": ("crane:\n  grid: {lift: 1, lift: 2}\n", "'lift' stands twice"),
    "open": ("a: [1, 2\n", "no valid YAML"),
    "tab": ("a:\n\tb: 1\n", "no valid YAML"),
    "list": ("- 1\n", "expected a mapping"),
    "empty": ("", "expected a mapping"),
    "text": ("hello", "expected a mapping"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_no_mapping_is_told(tmp_path, name):
    text, message = FILES[name]
    path = tmp_path / "params.yaml"
    path.write_text(text)
    with pytest.raises(ParameterError) as raised:
        load_parameters(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_file_that_cannot_be_read_is_told(tmp_path):
    with pytest.raises(ParameterError, match=r"gone\.yaml: cannot be read"):
        load_parameters(tmp_path / "gone.yaml")
    with pytest.raises(ParameterError, match="cannot be read"):
        load_parameters(tmp_path)


def test_a_file_in_another_encoding_is_told(tmp_path):
    (tmp_path / "params.yaml").write_bytes(b"a: \xb5\n")
    with pytest.raises(ParameterError, match=r"params\.yaml"):
        load_parameters(tmp_path / "params.yaml")


def test_overlay_replaces_leaves_and_leaves_the_rest(original):
    before = copy.deepcopy(original)
    result = overlay(original, {"crane": {"grid": {"lift": {"increment": 0.2675}}}})
    assert result == changed(original, "crane.grid.lift.increment", 0.2675)
    assert original == before
    replaced = overlay(original, {"crane": {"evaluation": {"points": [[1.0, 2.0]]}}})
    assert replaced["crane"]["evaluation"]["points"] == [[1.0, 2.0]]
    assert overlay(original, {}) == original


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"robot": 1}, "robot"),
        ({"crane": {"grid": {"lift": {"step": 1}}}}, "crane.grid.lift.step"),
        ({"crane": {"networks": {"other": {}}}}, "crane.networks.other"),
    ],
)
def test_overlay_refuses_unknown_keys(original, change, key):
    with pytest.raises(ParameterError) as raised:
        overlay(original, change)
    assert f" {key} is no key of params.yaml" in str(raised.value)


def test_equal_values_have_equal_checksums(original):
    crane, same = validate(original).crane, validate(copy.deepcopy(original)).crane
    assert parameters_checksum([crane.grid]) == parameters_checksum([same.grid])
    assert parameters_checksum([crane.grid]) != parameters_checksum([crane.selection])
    assert parameters_checksum([crane.grid, crane.selection]) != parameters_checksum([crane.grid])
    # a whole number is the same value as 0.0
    whole = validate(changed(original, "crane.grid.minimum_tip_x", 0)).crane
    assert parameters_checksum([crane.grid]) == parameters_checksum([whole.grid])


def mappings(data):
    if isinstance(data, dict):
        yield data
    for value in data.values() if isinstance(data, dict) else data:
        if isinstance(value, dict | list):
            yield from mappings(value)


@pytest.mark.parametrize("path", [ROOT / "params.yaml", *PROFILES], ids=lambda path: path.stem)
def test_no_key_has_a_name_that_dvc_ignores(path):
    keys = {key for mapping in mappings(read_yaml(path)) for key in mapping}
    assert not keys & DVC_IGNORES


def models(kind, seen):
    """All models that the annotation `kind` mentions."""
    if isinstance(kind, type) and issubclass(kind, BaseModel) and kind not in seen:
        seen.add(kind)
        for field in kind.model_fields.values():
            models(field.annotation, seen)
    for part in typing.get_args(kind):
        models(part, seen)
    return seen


def test_no_model_has_a_default_or_swallows_keys():
    found = models(Parameters, set())
    assert len(found) > 15
    for model in found:
        for name, field in model.model_fields.items():
            assert field.is_required(), f"{model.__name__}.{name} has a default"
            assert field.alias is None and name not in DVC_IGNORES
        assert model.model_config["extra"] == "forbid"
        assert model.model_config["frozen"]


def leaves(node, path=()):
    """(path, line numbers of its ancestors' keys and itself) of all leaves of a YAML tree."""
    for key, value in node.value:
        here = (*path, (key.value, key.start_mark.line))
        if isinstance(value, yaml.MappingNode) and not value.flow_style:
            yield from leaves(value, here)
        else:
            yield here


def test_every_value_of_params_yaml_stands_by_a_comment():
    text = (ROOT / "params.yaml").read_text()
    lines = text.splitlines()

    def commented(number):
        return "#" in lines[number] or lines[number - 1].strip().startswith("#")

    bare = []
    for path in leaves(yaml.compose(text)):
        names = [name for name, _ in path]
        # below the case itself, a comment on a block speaks for the keys in it
        if not any(commented(line) for _, line in path[1:]) and names[-1] != "seed":
            bare.append(".".join(names))
    assert not bare
