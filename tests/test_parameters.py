"""params.yaml and machine files: valid, commented, and every mistake is one line with its key."""

import copy
import re
from pathlib import Path

import pytest
import yaml

from flexik import docs
from flexik.cases import case as cases
from flexik.errors import ParameterError
from flexik.machines.bodies import Beam
from flexik.machines.planar import PlanarMachine
from flexik.parameters import describe
from flexik.parameters.conditions import Points
from flexik.parameters.reading import overlay, read_yaml
from flexik.parameters.trainers import Trainer
from flexik.planar.section import PlanarNetwork, Samples

ROOT = Path(__file__).parents[1]
FILES = [ROOT / "params.yaml", *sorted((ROOT / "data/machines").glob("*.yaml"))]
PROFILES = sorted((ROOT / "profiles").glob("*.yaml"))
DVC_IGNORES = {"size", "nfiles"}  # names of keys that DVC's run cache leaves out


@pytest.fixture(scope="module")
def original():
    return {path.relative_to(ROOT): read_yaml(path) for path in FILES}


@pytest.fixture
def changed(original, monkeypatch):
    """Load and check the case of a dotted key that is set to a value, or removed if that is `...`.

    Keys begin with the case; CASE.machine stands for the machine file.
    """
    monkeypatch.chdir(ROOT)

    def load(key, value):
        files = copy.deepcopy(original)
        case, *path = (int(part) if part.isdigit() else part for part in key.split("."))
        section, (*path, last) = files[Path("params.yaml")], [case, *path]
        if path[1:2] == ["machine"]:
            section, path = files[Path(f"data/machines/{case}.yaml")], path[2:]
        elif path[:1] == ["machine"] or last == "machine":
            raise AssertionError("a key of the machine file")
        for name in path:
            section = section[name]
        if value is ...:
            del section[last]
        else:
            section[last] = value
        monkeypatch.setattr(cases, "_read", lambda path: files[Path(path)])
        if case not in original[Path("params.yaml")]["cases"]:
            cases.load_parallel()
            return cases.load_all()
        found = cases.load(case)
        cases.check(found)
        return found

    return load


def test_what_stands_in_the_files_is_valid(monkeypatch):
    monkeypatch.chdir(ROOT)
    found = cases.load_all()
    assert {section.code for section in found.values()} == set(cases.codes())
    assert list(found) == ["crane", "elastic_arm", "fanuc", "smartee", "excavator", "concrete_pump"]
    for section in found.values():
        cases.check(section)
    crane = found["crane"]
    assert crane.networks["deflection"].n_hidden == 14
    assert crane.calibration.conditions == crane.conditions["published"]  # as published


@pytest.mark.parametrize("path", PROFILES, ids=lambda path: path.stem)
def test_profiles_are_valid(original, path, monkeypatch):
    monkeypatch.chdir(ROOT)
    files = {
        **original,
        Path("params.yaml"): overlay(original[Path("params.yaml")], read_yaml(path)),
    }
    monkeypatch.setattr(cases, "_read", lambda path: files[Path(path)])
    for section in cases.load_all().values():
        cases.check(section)


GRID, BEAMS = "crane.samples.grid", "crane.machine.bodies"
DEFLECTION, SELECTED = "crane.networks.deflection", "crane.networks.deflection_selected"
MODULAR, INVERSION = "crane.networks.modular", "crane.methods.direct.inversion"
MEASURED = "crane.studies.measured"
WRONG = [
    # value out of range
    (f"{BEAMS}.lift.mass", -124.6),
    (f"{BEAMS}.rocker.mass", -1.0),
    (f"{BEAMS}.lift.youngs_modulus", 0.0),
    (f"{BEAMS}.jib.n_elements", 0),
    (f"{BEAMS}.jib.n_elements", 2.5),
    (f"{BEAMS}.jib.mass_span", [-1.0, 1.8]),
    (f"{BEAMS}.jib.centre", [3.0, 0.2]),
    ("crane.machine.drives.jib.retracted", -0.45),
    ("crane.machine.drives.jib.limits", [0.0, 0.0]),
    ("crane.calibration.ranges", {"joints.slew.springs.torsion": [1.0e9, 1.0e6]}),
    ("crane.calibration.known", {"joints.slew.springs.torsion": 0.0}),
    ("crane.calibration.mean_error", 0.0),
    ("crane.studies.mesh.refinements", [1]),
    ("crane.studies.mesh.refinements", [2, 1]),
    ("crane.studies.shape.strokes", [0.6, 0.1, 1.2]),
    (f"{GRID}.lift", {"minimum": 0.0, "maximum": 0.6, "increment": 0.1}),
    (f"{GRID}.extension", {"minimum": 0.0, "maximum": 2.0, "increment": 0.4}),
    (f"{GRID}.lift.increment", 0.0),
    (f"{GRID}.lift.increment", -0.066875),
    (f"{GRID}.lift.increment", 0.07),
    ("crane.samples.maximum_failed_share", 1.1),
    ("crane.samples.selection.seed", -1),
    ("trainers.levenberg_marquardt.mu", 0.0),
    ("trainers.levenberg_marquardt.mu", 1.0e11),
    ("trainers.levenberg_marquardt.mu_decrease", 1.0),
    ("trainers.delta_rule.minimum_rate", 0.1),
    ("trainers.accelerated.acceleration", -0.1),
    (f"{DEFLECTION}.n_hidden", 0),
    (f"{DEFLECTION}.n_hidden", [14, 14]),  # the crane's have one layer
    (f"{MODULAR}.n_restarts", 0),
    (f"{SELECTED}.n_hidden.minimum", 0),
    (f"{SELECTED}.n_hidden.increment", 7),
    (f"{SELECTED}.select", {"tolerance": -0.1}),
    ("crane.studies.fitting.n_samples", 0),
    ("crane.studies.fitting.n_hidden.1", 0),
    ("crane.studies.fitting.jib", 0.2),
    ("crane.studies.fitting.payload", 550.0),
    ("crane.conditions.workspace.n_targets", 0),
    ("crane.conditions.workspace.x", [6.5, 0.0]),
    ("crane.conditions.workspace.y", [1.0, 1.0]),
    ("crane.conditions.workspace.payload", [500.0, 30.0]),
    ("crane.conditions.workspace.tolerance", 0.0),
    ("crane.methods.combined.n_corrections", 0),
    (f"{INVERSION}.learning_rate", 0.0),
    (f"{INVERSION}.tolerance", -1.0e-7),
    ("crane.studies.tolerance.tolerances.1", 0.0),
    ("crane.methods.combined_ga.genetic.n_individuals", 1),
    ("crane.methods.combined_ga.genetic.n_current", 16),
    ("parallel.n_workers", -1),
    # names that nothing goes by
    ("crane.machine.element", "timoshenko"),
    (f"{DEFLECTION}.activation", "relu"),
    (f"{DEFLECTION}.learns", "correction"),
    (f"{DEFLECTION}.trainer", "nothing"),
    (f"{SELECTED}.select", {"trainer": "nothing"}),
    ("crane.studies.fitting.trainer", "nothing"),
    (f"{MODULAR}.corrects", "nothing"),
    (f"{MODULAR}.corrects", "deflection"),
    (f"{MODULAR}.corrects", "modular"),
    ("trainers.study.kind", "simplex"),
    ("crane.methods.combined.method", "newton"),
    ("crane.methods.combined.network", "nothing"),
    ("crane.methods.combined.network", "direct"),
    ("crane.methods.direct.network", "deflection"),
    ("crane.methods.inverse.network", "deflection"),
    (f"{INVERSION}.kind", "newton"),
    ("crane.studies.tolerance.methods", ["combined"]),
    ("crane.studies.tolerance.methods.1", "nothing"),
    (f"{MEASURED}.campaign.method", "direct"),
    # nothing where something is needed, or too much
    ("crane.conditions.published.points", []),
    ("crane.conditions.published.payloads", []),
    ("crane.networks", {}),
    ("crane.methods.none", ...),
    ("crane.conditions.workspace", ...),
    ("crane.studies.tolerance.tolerances", []),
    ("crane.studies.tolerance.tolerances.1", 1.0e-5),
    ("crane.studies.tolerance.methods.1", "direct"),
    (INVERSION, None),
    ("crane.methods.direct", 3),
    (f"{BEAMS}.lift.points.jib_pivot", [1.0]),
    (f"{BEAMS}.lift.points.jib_pivot", [1.0, 2.0, 3.0]),
    ("crane.machine.gravity", None),
    (f"{GRID}.lift", [0.0, 0.5]),
    ("crane.conditions.published.points.3", [1.0, 7.0]),
    # no numbers
    ("trainers.study.minimum_gradient", "1e-5"),
    (f"{INVERSION}.tolerance", "1e-7"),
    ("crane.studies.tolerance.tolerances.0", "1e-5"),
    ("crane.machine.gravity", "nan"),
    ("crane.machine.gravity", float("nan")),
    ("crane.machine.gravity", True),
    ("crane.conditions.published.points.0.1", float("inf")),
    ("crane.conditions.published.points.0", ["1e-3", 1.0]),
    ("crane.studies.mesh.n_samples", True),
    # keys that are unknown or missing
    ("crane.gravity", 9.81),
    (f"{BEAMS}.lift.weight", 9.81),
    ("trainers.levenberg_marquardt.momentum", 0.9),
    (f"{INVERSION}.damping", 0.01),  # of the other kind
    ("crane.methods.inverse.n_corrections", 1),
    ("robot", {}),
    ("cases", {"crane": {"code": "robot"}}),
    ("cases", {"My own": {"code": "crane"}}),
    ("crane.machine.gravity", ...),
    (f"{BEAMS}.pillar.axis", ...),
    ("trainers.study.kind", ...),
    (f"{DEFLECTION}.n_hidden", ...),
    # what no single value tells
    ("crane.conditions.published.points.1", [9.0, 9.0]),
    ("crane.conditions.workspace.x", [50.0, 60.0]),
    ("crane.machine.kinematics", "general"),
    ("crane.machine.joints.slew.springs.torsion", 8.0e6),
    ("crane.machine.drives.jib.limits", [0.0, 0.95]),
    (f"{BEAMS}.jib.section.file", "data/nosuch.csv"),
    # the other cases
    ("elastic_arm.networks.published_network.n_hidden", [15, 0]),
    ("elastic_arm.networks.published_network.learns", "strains"),
    ("elastic_arm.networks.published_network.trainer", "nothing"),
    ("elastic_arm.samples.held_out_share", 1.5),
    ("elastic_arm.methods.combined.network", "published_network"),
    ("elastic_arm.conditions.workspace.x", [50.0, 60.0]),
    ("elastic_arm.studies.splits.network", "nothing"),
    ("excavator.machine.drives.boom.limits", [1.0, 0.5]),
    ("excavator.machine.bodies.boom.youngs_modulus", 210.0),
    ("excavator.samples.grid.boom", ...),
    ("excavator.samples.grid.bucket", {"minimum": 0.0, "maximum": 1.0, "increment": 0.5}),
    ("excavator.samples.grid.boom.maximum", 1.365),
    ("excavator.samples.grid.payload.increment", 1.0e-3),
    ("excavator.samples.selection.payload", [-5.0, 3000.0]),
    ("excavator.conditions.workspace.x", [50.0, 60.0]),
    ("excavator.conditions.workspace.x", [8.0, 30.0]),  # a hundredth of it is reached
    ("excavator.conditions.workspace.payload", [0.0, 3.0]),
    ("excavator.conditions.workspace.payload", [0.0, 9.0e3]),
    ("excavator.conditions.workspace.n_targets", 10**12),
    ("excavator.samples.grid.payload", {"minimum": 0.0, "maximum": 3.0, "increment": 1.0}),
    ("excavator.samples.grid.payload", {"minimum": 0.0, "maximum": 3.0e5, "increment": 1.0e5}),
    ("excavator.networks.deflection.n_restarts", 10**9),
    ("excavator.networks.deflection.n_hidden", 10**6),
    ("excavator.studies", {"picture": {"values": [0.5], "payload": 100.0}}),
    ("fanuc.machine.joints.4.d", 0.1),
    ("fanuc.machine.joints.0.alpha", 1.0),
    ("fanuc.samples.path.n_via_points", 2),
    ("fanuc.samples.path.region.3", [-6.28, 6.28]),
    ("fanuc.networks.config1.activation", "relu"),
    ("fanuc.conditions.off_path.distances", [-0.1]),
    ("smartee.samples.box.centre", [0.0, 0.0, 1.0]),
    ("smartee.samples.poses.training.n_poses", 0),
    ("smartee.networks.best.learns", "nothing"),
    ("smartee.methods.best.start", "nothing"),
    ("smartee.studies.starts.trainers", ["nothing"]),
]

# Mistakes told by a neighbour that the value has to fit
TOLD_BY = {
    "crane.conditions.published.payloads": "crane.conditions.published.points",
}


@pytest.mark.parametrize(("key", "value"), WRONG, ids=lambda value: str(value)[:45])
def test_a_mistake_is_one_line_that_names_file_and_key(changed, key, value):
    with pytest.raises(ParameterError) as raised:
        changed(key, value)
    (line,) = str(raised.value).splitlines()
    file, named, message = line.split(": ", 2)
    assert message and "nput should" not in message  # pydantic's words
    case, _, within = key.partition(".machine.")
    assert file == (f"data/machines/{case}.yaml" if within else "params.yaml")
    # a value that does not fit is told at the key, at an entry of it or at what holds it
    expected, found = (
        [part for part in text.split(".") if not part.isdigit()]
        for text in (TOLD_BY.get(key, within or key), named)
    )
    shared = min(len(expected), len(found))
    assert found[:shared] == expected[:shared]
    assert len(found) >= len(expected) - 2


def test_several_mistakes_are_told_at_once(original, monkeypatch):
    files = copy.deepcopy(original)
    crane = files[Path("params.yaml")]["crane"]
    crane["methods"]["combined"]["n_corrections"] = 0
    crane["samples"]["selection"]["n_samples"] = -1
    monkeypatch.setattr(cases, "_read", lambda path: files[Path(path)])
    with pytest.raises(ParameterError) as raised:
        cases.load("crane")
    assert [line.split(": ")[1] for line in str(raised.value).splitlines()] == [
        *("crane.samples.selection.n_samples", "crane.methods.combined.n_corrections")
    ]


@pytest.mark.parametrize("section", ["networks", "methods"])
@pytest.mark.parametrize("name", ["My own", "x; touch pwned #", "../up", "A", ""])
def test_names_are_plain_words(changed, original, section, name):
    same = next(iter(original[Path("params.yaml")]["crane"][section].values()))
    with pytest.raises(ParameterError, match=re.escape(f"crane.{section}.{name}")):
        changed(f"crane.{section}", {name: same})


@pytest.mark.parametrize(
    ("key", "value", "known"),
    [
        (f"{DEFLECTION}.trainer", "fast", "accelerated, study"),
        (f"{MODULAR}.corrects", "direct", "expected a network of the rigid_tip"),
        ("crane.studies.tolerance.methods.0", "inverse", "direct, modular, direct_selected, modul"),
        (f"{INVERSION}.kind", "newton", "gradient_descent"),
        ("trainers.study.kind", "simplex", "back_propagation"),
        (f"{BEAMS}.lift.mass", -124.6, "-124.6"),
        (f"{GRID}.jib.increment", 0.1, "0.1 makes 7.8; 0.0975 would do"),
        (f"{GRID}.jib.maximum", 0.975, "expected 0.78 or less, got 0.975"),
        (f"{DEFLECTION}.n_restart", 5, "did you mean n_restarts? (known: learns, corrects"),
        ("excavator.samples.grid.payload.maximum", 3.0e5, "(300000 g would be 300)"),
    ],
)
def test_a_wrong_value_comes_with_what_would_do(changed, key, value, known):
    with pytest.raises(ParameterError, match=re.escape(known)):
        changed(key, value)


def test_a_known_spring_is_accepted_instead_of_a_fit(changed):
    known = {"joints.slew.springs.torsion": 8.5e6}
    assert changed("crane.calibration", {"known": known}).calibration.known == known


@pytest.mark.parametrize("text", ["1e-05", "1E5", "-2.5e+3", ".5e1", "3.e2", "1.0e-5"])
def test_numbers_that_dvc_writes_are_numbers(tmp_path, text):
    file = tmp_path / "params.yaml"
    file.write_text(f"a: {text}\nb: '{text}'\nc: e{text}\n")
    assert read_yaml(file) == {"a": float(text), "b": text, "c": f"e{text}"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3\n", "'a' stands twice"),
        ("crane:\n  grid: {lift: 1, lift: 2}\n", "'lift' stands twice"),
        ("a: [1, 2\n", "no valid YAML"),
        ("a:\n\tb: 1\n", "no valid YAML"),
        ("- 1\n", "expected a mapping"),
        ("", "expected a mapping"),
        ("hello", "expected a mapping"),
        (b"a: \xb5\n", "expected text in UTF-8"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_mapping_is_told(tmp_path, text, message):
    path = tmp_path / "params.yaml"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ParameterError) as raised:
        cases.load("crane", path)
    assert str(raised.value).startswith(f"{path}: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_overlay_replaces_leaves_and_leaves_the_rest():
    base = {"a": {"b": 1, "c": [1, 2]}, "d": 3}
    before = copy.deepcopy(base)
    assert overlay(base, {"a": {"c": [3]}, "e": {"f": 4}}) == {
        "a": {"b": 1, "c": [3]},
        "d": 3,
        "e": {"f": 4},
    }
    assert base == before
    assert overlay(base, {}) == base


def test_docs_are_those_of_the_models():
    """`dvc repro readme` renews them."""
    for name, text in docs.pages().items():
        assert (ROOT / "docs" / name).read_text() == text, name
    kinds = {"kind", "method"}  # told below the heading
    for model in describe.models_in(PlanarMachine, Samples, Points, PlanarNetwork, Trainer):
        bare = [key.name for key in describe.keys(model) if not key.text and key.name not in kinds]
        assert not bare, model


def test_docs_tell_units_ranges_and_defaults():
    beam = {key.name: key for key in describe.keys(Beam)}
    assert beam["youngs_modulus"].takes == "number, more than 0, Pa (1e+08 to 2e+12)"
    assert beam["mass_span"].takes == "list of 2: number, m (up to 100)"
    assert (
        beam["section"].takes
        == "[table](#table) or [box](#box) or [tube](#tube) or [solid](#solid)"
    )
    assert (beam["poisson"].default, beam["axis"].default) == ("0.3", "")
    assert beam["angle"].text.startswith("of its frame")  # of the class that all bodies share


def mappings(data):
    if isinstance(data, dict):
        yield data
    for value in data.values() if isinstance(data, dict) else data:
        if isinstance(value, dict | list):
            yield from mappings(value)


@pytest.mark.parametrize("path", [*FILES, *PROFILES], ids=lambda path: path.stem)
def test_no_key_has_a_name_that_dvc_ignores(path):
    keys = {key for mapping in mappings(read_yaml(path)) for key in mapping}
    assert not keys & DVC_IGNORES


def leaves(node, path=()):
    """(name, line) of the keys down to each leaf of a YAML tree."""
    for key, value in node.value:
        here = (*path, (key.value, key.start_mark.line))
        if isinstance(value, yaml.MappingNode) and not value.flow_style:
            yield from leaves(value, here)
        else:
            yield here


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_value_stands_by_a_comment(path):
    text = path.read_text()
    lines = text.splitlines()

    def commented(number):
        return "#" in lines[number] or lines[number - 1].strip().startswith("#")

    first = 1 if path.name == "params.yaml" else 0
    bare = []
    for leaf in leaves(yaml.compose(text)):
        # below the case itself, a comment on a block speaks for the keys in it
        held = leaf[first:] or leaf
        if not any(commented(line) for _, line in held) and leaf[-1][0] != "seed":
            bare.append(".".join(name for name, _ in leaf))
    assert not bare
