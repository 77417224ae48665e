"""params.yaml: what it says is valid, commented and complete, and every mistake names its key."""

import copy
import re
import typing
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from flexik.errors import ParameterError
from flexik.mechanisms.crane import CraneGeometry
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
    (f"{DEFLECTION}.trainer.mu", 0.0),
    (f"{DEFLECTION}.trainer.mu_decrease", 1.0),
    (f"{DEFLECTION}.trainer.mu_increase", 1.0),
    ("crane.methods.combined.n_corrections", 0),
    ("crane.methods.combined_ga.genetic.n_individuals", 1),
    ("crane.methods.combined_ga.genetic.n_current", 16),
    ("crane.methods.combined_ga.genetic.tolerance", 0.0),
    ("parallel.n_workers", -1),
    # names that nothing goes by
    ("crane.structure.element", "timoshenko"),
    (f"{DEFLECTION}.activation", "relu"),
    (f"{DEFLECTION}.kind", "inverse"),
    ("crane.methods.combined.method", "direct"),
    ("crane.methods.combined.network", "nothing"),
    ("crane.methods.combined_ga.inverse", "newton"),
    # nothing where something is needed, or too much
    ("crane.evaluation.points", []),
    ("crane.evaluation.payloads", []),
    ("crane.networks", {}),
    ("crane.geometry.lift_pivot", [1.0]),
    ("crane.geometry.lift_pivot", [1.0, 2.0, 3.0]),
    ("crane.structure.gravity", None),
    ("crane.grid.lift", [0.0, 0.5]),
    ("crane.evaluation.points.3", [1.0, 7.0]),
    # no numbers
    (f"{DEFLECTION}.trainer.minimum_gradient", "1e-5"),
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
    (f"{DEFLECTION}.trainer.momentum", 0.9),
    ("robot", {}),
    ("crane.structure.gravity", ...),
    ("crane.structure.beams.pillar", ...),
    (f"{DEFLECTION}.trainer.goal", ...),
    ("crane.methods.combined_ga.genetic", ...),
    ("parallel", ...),
]

# Mistakes told by a neighbour that the key has to fit
TOLD_BY = {"crane.grid.lift.maximum": "crane.grid.lift.increment"}
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


def test_names_are_plain_words(original):
    methods = original["crane"]["methods"]
    text = mistake(changed(original, "crane.methods.My method", methods["combined"]))
    assert "crane.methods.My method" in text


def test_the_value_given_is_shown(original):
    assert "-124.6" in mistake(changed(original, "crane.structure.beams.lift.mass", -124.6))


def test_an_increment_that_does_not_divide_is_told(original):
    text = mistake(changed(original, "crane.grid.jib.increment", 0.1))
    assert "crane.grid.jib.increment: " in text and "whole number" in text


def test_a_missing_network_lists_those_there_are(original):
    text = mistake(changed(original, "crane.methods.combined_ga.network", "nothing"))
    assert (
        "crane.methods.combined_ga.network" in text and "(deflection, deflection_selected)" in text
    )


def test_a_method_may_not_take_the_name_of_the_uncompensated_crane(original):
    methods = original["crane"]["methods"]
    text = mistake(changed(original, "crane.methods.none", methods["combined"]))
    assert "crane.methods.none" in text


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
