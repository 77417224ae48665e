"""The command `flexik`: begin a machine, check it, and what it says of mistakes."""

import shutil

import pytest
import yaml
from planar_machines import ROOT

from flexik import commands
from flexik.cases import case as cases
from flexik.errors import ParameterError


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A copy of what describes the machines."""
    shutil.copy(ROOT / "params.yaml", tmp_path)
    for folder in ("machines", "reference/crane"):
        shutil.copytree(ROOT / "data" / folder, tmp_path / "data" / folder)
    monkeypatch.chdir(tmp_path)
    cases._read.cache_clear()
    yield tmp_path
    cases._read.cache_clear()


@pytest.mark.parametrize("like", ["excavator", "concrete_pump"])
def test_a_new_machine_is_a_case_like_its_model(project, like):
    before = yaml.safe_load((project / "params.yaml").read_text())
    said = commands.new("digger", like)
    cases._read.cache_clear()
    after = yaml.safe_load((project / "params.yaml").read_text())
    assert after.pop("digger") == before[like]
    assert after["cases"].pop("digger") == {"code": "general"}
    assert after == before
    section, model = cases.load("digger"), cases.load(like)
    text = (project / "data/machines/digger.yaml").read_text()
    assert "[x]" not in text and "assumed" not in text  # what is true of the model alone
    assert "youngs_modulus: 210.0e+9  # Pa\n" in text  # what the keys of the model are
    assert section.machine.title == f"digger (begun as {like})"
    assert section.machine.bodies == model.machine.bodies
    cases.check(section)
    assert "data/machines/digger.yaml" in said[0] and "flexik check digger" in said[-1]
    with pytest.raises(ParameterError, match="there is such a machine already"):
        commands.new("digger", like)


@pytest.mark.parametrize(
    ("name", "like", "message"),
    [
        ("My digger", "excavator", "a name is small letters"),
        ("crane", "excavator", "there is such a machine already"),
        ("digger", "crane", "expected one of excavator, concrete_pump"),
        ("digger", "nothing", "expected one of excavator, concrete_pump"),
    ],
)
def test_what_cannot_begin_changes_nothing(project, name, like, message):
    before = (project / "params.yaml").read_bytes()
    with pytest.raises(ParameterError, match=message):
        commands.new(name, like)
    assert (project / "params.yaml").read_bytes() == before
    assert not (project / "data/machines/digger.yaml").exists()


def test_a_check_tells_what_the_machine_is_and_draws_it(project):
    said = "\n".join(commands.check("excavator"))
    assert "2 bodies, of which 2 bend; 2480.0 kg" in said
    assert "boom (cylinder, 0 to 1.26 m), stick (cylinder, 0 to 1.504 m)" in said
    picture = project / "data/excavator/check.png"
    assert picture.read_bytes().startswith(b"\x89PNG") and f"drawn: data/{'excavator'}" in said
    # a constant that is not known yet is said, and nothing is drawn on a guess
    assert commands.check("crane")[-1] == (
        "not drawn: joints.slew.springs.torsion are fitted by `flexik run crane`"
    )


@pytest.mark.parametrize(
    ("was", "becomes", "message"),
    [
        ("limits: [0.0, 1.26]", "limits: [0.0, 3.26]", "expected"),
        ("of: [ground.boom_cylinder_base", "of: [ground.nowhere", "ground has no point 'nowhere'"),
        ("youngs_modulus: 210.0e+9", "youngs_modulus: 210.0", "youngs_modulus"),
    ],
)
def test_a_check_names_file_and_key_of_a_mistake(project, was, becomes, message):
    path = project / "data/machines/excavator.yaml"
    text = path.read_text()
    assert was in text
    path.write_text(text.replace(was, becomes))
    with pytest.raises(ParameterError, match=message) as raised:
        commands.check("excavator")
    assert str(raised.value).startswith("data/machines/excavator.yaml: ")


def test_what_is_no_planar_machine_is_said(project):
    for name, message in (("fanuc", "no planar flexible machine"), ("nothing", "no case")):
        with pytest.raises(ParameterError, match=message):
            commands.check(name)
