"""Machine files: what they mean, and one line that names file, key and what was expected."""

import contextlib
import copy

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from planar_machines import FILES, NAMES, ROOT, general

from flexik.errors import ParameterError
from flexik.kinematics.machine_file import read_manipulator
from flexik.machines.bodies import Beam
from flexik.machines.planar import PlanarMachine, read_machine
from flexik.machines.sections import Box, Solid, Tube
from flexik.parameters.reading import read_yaml

each_machine = pytest.mark.parametrize("name", NAMES)
lengths = st.floats(0.1, 5.0)


def beam(**changes):
    """A straight steel box of 2 m."""
    given = {
        "kind": "beam",
        "points": {"a": [0, 0], "b": [2, 0]},
        "axis": [[0, 0], [2, 0]],
        "section": {"kind": "box", "width": 0.1, "height": 0.2, "wall": 0.01},
        "youngs_modulus": 2.1e11,
        "density": 7850.0,
        "n_elements": 4,
    }
    return Beam.model_validate(given | changes)


@each_machine
def test_shipped_files_are_read_and_move(name):
    machine, manipulator = read_manipulator(FILES[name])
    assert len(machine.beams) >= 2
    assert len(manipulator.lower) == len(machine.drives)


def test_closed_forms_of_sections():
    share = np.array([0.0, 1.0])
    area, second = Solid(kind="solid", width=0.1, height=(0.2, 0.4)).properties(share)
    assert np.allclose(area, [0.02, 0.04])
    assert np.allclose(second, [0.1 * 0.2**3 / 12, 0.1 * 0.4**3 / 12])
    area, second = Tube(kind="tube", diameter=0.2, wall=0.01).properties(share)
    assert np.allclose(area, np.pi * (0.1**2 - 0.09**2))
    assert np.allclose(second, np.pi / 4 * (0.1**4 - 0.09**4))
    box = Box(kind="box", width=0.1, height=0.2, wall=0.01).along(1.0, 3.0)
    assert box.abscissa.tolist() == [1.0, 3.0]
    assert np.allclose(box.second_moment, (0.1 * 0.2**3 - 0.08 * 0.18**3) / 12)


def test_a_tapered_section_is_cubic_between_its_ends():
    section = Solid(kind="solid", width=0.1, height=(0.4, 0.2)).along(0.0, 2.0)
    x = np.linspace(0.0, 2.0, 999)
    exact = 0.1 * (0.4 - 0.1 * x) ** 3 / 12
    assert np.allclose(np.interp(x, section.abscissa, section.second_moment), exact, rtol=2e-4)


@settings(deadline=None)
@given(a=lengths, b=lengths, share=st.floats(0.0, 1.0), left=st.floats(-0.05, 0.05))
def test_foot_is_the_inverse_of_place(a, b, share, left):
    bent = beam(axis=[[0.3, 0.1], [0.3 + a, 0.1], [0.3 + a, 0.1 - b]], start=-0.2)
    low, high = bent.span
    assert high - low == pytest.approx(a + b)
    abscissa = low + share * (high - low)
    if abs(abscissa - low - a) < 0.06:  # at the corner there are several feet
        return
    (x, y), angle = bent.place(abscissa)
    point = x - left * np.sin(angle), y + left * np.cos(angle)
    assert bent.foot(point) == pytest.approx((abscissa, left), abs=1e-9)


def test_a_tapered_beam_weighs_most_at_its_thick_end():
    solid = {"kind": "solid", "width": 0.1, "height": [0.3, 0.1]}
    mass, centre = beam(section=solid).weight()
    assert mass == pytest.approx(7850 * 0.1 * 0.2 * 2, rel=1e-4)
    assert centre[0] == pytest.approx(2 * (0.3 + 2 * 0.1) / 3 / (0.3 + 0.1), rel=1e-4)


def test_masses_of_the_crane_add_up():
    masses = {key: mass for key, (_, _, mass) in general("crane").machine.masses().items()}
    assert sum(masses.values()) == pytest.approx(93.26 + 124.6 + 76.6 + 58.6 + 11.52 + 7.9)
    assert general("elastic_arm").machine.masses()["bodies.link_1.masses.joint_2"][-1] == 0.5
    assert general("excavator").machine.masses()["drives.boom.masses.1"][-1] == 90.0


def test_free_constants_are_named_and_given():
    machine = general("crane").machine
    assert machine.free == ["joints.slew.springs.torsion"]
    fitted = machine.with_constants({"joints.slew.springs.torsion": 8e6})
    assert fitted.free == [] and fitted.joints["slew"].springs.torsion == 8e6
    with pytest.raises(ParameterError, match=r"constants: joints\.slew\.torsion: "):
        machine.with_constants({"joints.slew.torsion": 8e6})
    with pytest.raises(ParameterError, match=r"constants: joints\.slew\.springs\.torsion: "):
        machine.with_constants({"joints.slew.springs.torsion": -1.0})


def test_angles_may_be_in_degrees():
    given = general("elastic_arm").machine
    assert given.drives["theta_1"].limits == pytest.approx(np.radians([-5, 35]), abs=1e-15)


def test_shear_needs_its_coefficients():
    data = general("crane").machine.model_dump() | {"shear": "included"}
    with pytest.raises(ValueError, match=r"bodies.pillar.shear_coefficient: missing"):
        PlanarMachine.model_validate(data)


CRANE, ARM = "crane", "elastic_arm"
LIFT_PIVOT = "  lift_pivot: {kind: pin, of: [pillar.lift_pivot, lift.lift_pivot]}"
TWICE = LIFT_PIVOT + LIFT_PIVOT.replace("lift_pivot:", "\n  again:")
PADS = "pads: {kind: slide, of: [jib.front_pad, extension.rear_pad]}"
# Machine, what stands in its file, what a user may write by mistake, and the message
MISTAKES = [
    # units
    (CRANE, "210.0e+9", "210", r"bodies.pillar.youngs_modulus: .* Pa .*210 GPa would be 2.1e\+11"),
    (CRANE, "210.0e+9", "2.1e5", r"youngs_modulus: .* \(210000 MPa would be 2.1e\+11"),
    (CRANE, "[2.88, -0.024]", "[2880, -24]", "lift.points.jib_pivot.0: .*2880 mm would be 2.88"),
    (CRANE, "mass: 124.6", "mass: 0.1246", r"bodies.lift.mass: .*0.1246 t would be 124.6"),
    (CRANE, "mass: 124.6", "mass: -124.6", "bodies.lift.mass: .*expected 0 or more, got -124.6"),
    (CRANE, "mass: 11.52", "mass: 0.01152", "bodies.rocker.mass: .*0.01152 t would be 11.52"),
    (CRANE, "angle_degrees: 40", "angle: 40", "bodies.lift.angle: .*40 degrees would be 0.698"),
    (CRANE, "limits: [0.0, 0.535]", "limits: [0.0, 535]", "drives.lift.limits.1: .*535 mm"),
    (CRANE, "gravity: 9.81", "gravity: 9810", "gravity: expected m/s2"),
    (CRANE, "retracted: 0.8 ", "retracted: 800 ", "drives.lift.retracted: .*800 mm would be 0.8"),
    (ARM, "limits_degrees: [-5.0, 35.0]", "limits: [-5.0, 35.0]", "theta_1.limits.1: .*35 degrees"),
    (ARM, "width: 0.040", "width: 40", "link_1.section.width: .*40 mm would be 0.04"),
    (ARM, "density: 2700.0", "density: 2.7", "link_1.density: .*2.7 g/cm3 would be 2700"),
    # what does not go together
    (
        CRANE,
        "limits: [0.0, 0.535]",
        "limits: [0.535, 0.0]",
        "drives.lift.limits: expected two increasing values, got 0.535 and 0",
    ),
    (
        CRANE,
        "limits: [0.0, 0.78]",
        "limits: [0.0, 0.9]",
        "drives.jib.limits: .*point at 0.844.* points are 1.88",
    ),
    (CRANE, "limits: [0.0, 0.535]", "limits: [0.0, 0.9]", "drives.lift.limits: .* lift .*0.592"),
    (
        CRANE,
        "retracted: 1.037",
        "retracted: 0.3",
        r"rocker cannot be put together.*drives.jib.retracted \+ limits are 0.3 to",
    ),
    (CRANE, "rocker_head: [0.45, 0.0]", "rocker_head: [0.045, 0.0]", "coupler, jib cannot be put"),
    (CRANE, "angle_degrees: 130", "angle_degrees: -130", r"bodies.rocker.angle: .* 2\.0\d rad"),
    (CRANE, LIFT_PIVOT, "", "lift, rocker, coupler, jib, extension: .*leave 2 free"),
    (
        CRANE,
        LIFT_PIVOT,
        TWICE,
        "lift: .*2 too often",
    ),
    (CRANE, PADS, "x" + PADS, r"extension.joint: expected the name of a slide \(xpads\), got pads"),
    (CRANE, PADS, PADS.replace("rear_pad", "tap"), "joints.pads.of: extension has no point 'tap'"),
    (CRANE, "[jib.extension_start", "[lift.jib_pivot", "drives.extension.of: expected points of"),
    (CRANE, "[lift.jib_pivot, jib", "[jib.jib_pivot, jib", "joints.jib_pivot.of: both points"),
    (CRANE, "payload: extension.tip", "payload: boom.tip", "payload: there is no body 'boom'"),
    (CRANE, "payload: extension.tip", "payload: tip", "payload: expected body.point, got 'tip'"),
    (
        CRANE,
        "first: extension",
        "first: telescope",
        r"smallest_first: expected the name of a drive \(lift, jib, ext",
    ),
    (CRANE, "kinematics: crane", "kinematics: elastic_arm", "kinematics: elastic_arm needs link_1"),
    (
        ARM,
        "masses: {joint_2",
        "masses: {joint_3",
        "link_1.masses.joint_3: the body has no such point, only joint_1, joint_2",
    ),
    (ARM, "joint: joint_2,", "joint: joint_9,", "theta_2.joint: expected the name of a pin"),
    (ARM, "joint: joint_2,", "joint: joint_1,", "theta_2.joint: joint_1 is driven by theta_1 alr"),
    (ARM, "limits_degrees: [-5.0, ", "limits_degrees: [x, ", "limits_degrees: expected numbers"),
    # sections and masses
    (CRANE, "lift_section", "jib_section", r"lift.section: .*0 to 2.88 m, it covers -0.446066 to"),
    (
        CRANE,
        "lift_section",
        "no_section",
        r"bodies.lift.section.file: section table \S+ cannot be read \(there is no such file\)$",
    ),
    (CRANE, "centre: [1.12, 0.03]", "centre: [-1.12, 0.03]", "lift.centre: must lie between"),
    (CRANE, "[0.0, 0.03], [2.88, 0.03]", "[0.0, 0.03]", "lift.axis"),
    (
        CRANE,
        "mass_span: [0.03, 1.118]",
        "mass_span: [0.03, 2.0]",
        "pillar.mass_span: expected two increasing values within",
    ),
    (ARM, "wall: 0.0015", "wall: 0.015", "link_1.section.wall: expected less than half the height"),
    (ARM, "density: 2700.0 ", "mass: 2 ", "link_1.mass: expected mass and centre, or else density"),
    # words
    (CRANE, "  jib_pivot: {", "  jib pivot: {", "joints.jib pivot: a name is small letters"),
    (CRANE, "  rocker:  ", "  $(rocker):  ", "a name is small letters, digits and _"),
    (CRANE, "data/reference/crane/lift_section", "a; rm b", "lift.section.file: expected a path"),
    (CRANE, "title: PATU 655 log crane", "", "title: this key is missing"),
    (
        CRANE,
        "n_elements: 6",
        "n_elemets: 6",
        "lift.n_elemets: there is no such key, did you mean n_elements. .known: ",
    ),
    (
        CRANE,
        "torsion: fit",
        "torsion: fitted",
        "slew.springs.torsion: .*'fit', got 'fitted'",
    ),
    (CRANE, "kind: table, file", "kind: tabel, file", "bodies.pillar.section: .*'tabel'"),
    (CRANE, "[0.0, 1.6] ", "[0.0, 1.6m] ", "drives.extension.limits.1: .*number.*'1.6m'"),
    (
        ARM,
        "limits_degrees: [-5",
        "limits: [0, 1], limits_degrees: [-5",
        "theta_1.limits: stands twice",
    ),
]


@pytest.mark.parametrize(("name", "right", "wrong", "message"), MISTAKES)
def test_a_mistake_is_told_in_one_line(tmp_path, monkeypatch, name, right, wrong, message):
    monkeypatch.chdir(ROOT)
    text = FILES[name].read_text()
    assert right in text
    path = tmp_path / "machine.yaml"
    path.write_text(text.replace(right, wrong, 1))
    with pytest.raises(ParameterError, match=message) as caught:
        read_manipulator(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())


def test_the_name_of_the_file_is_a_name(tmp_path):
    for name in ("my crane", "crane;ls", "Crane", "1"):
        with pytest.raises(ParameterError, match="the file's name must be"):
            read_machine(tmp_path / f"{name}.yaml")


def test_sections_in_millimetres_are_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = np.genfromtxt(
        ROOT / "data/reference/crane/lift_section.csv", delimiter=",", skip_header=1
    )
    rows = "\n".join(",".join(map(repr, row)) for row in (table * [1, 1e12, 1e6]).tolist())
    (tmp_path / "mm.csv").write_text(f"x_m,Iz_m4,A_m2\n{rows}\n")
    text = FILES["crane"].read_text()
    text = text.replace("file: data/reference/crane/lift_section.csv", "file: mm.csv")
    path = tmp_path / "crane.yaml"
    path.write_text(text.replace("data/reference", f"{ROOT}/data/reference"))
    with pytest.raises(ParameterError, match=r"bodies.lift.section: .*are these mm4 and mm2\?"):
        read_machine(path)


def places(data, keys=()):
    """Keys of all that is in `data`, however deep."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        yield (*keys, key)
        if isinstance(value, dict | list):
            yield from places(value, (*keys, key))


GIVEN = {name: read_yaml(FILES[name]) for name in NAMES}
PLACES = [(name, keys) for name, data in GIVEN.items() for keys in places(data)]
ODD = [None, [], {}, "", "a.b", -1, 0, 1e9, 1e-9, True, [1, 2], [[1]], {"kind": "pin"}, "1.0"]


@settings(deadline=None, max_examples=60)
@given(place=st.sampled_from(PLACES), odd=st.sampled_from(ODD))
def test_no_odd_value_breaks_off(tmp_path_factory, place, odd):
    name, (*outer, last) = place
    data = copy.deepcopy(GIVEN[name])
    inside = data
    for key in outer:
        inside = inside[key]
    inside[last] = odd
    path = tmp_path_factory.getbasetemp() / "odd.yaml"
    path.write_text(yaml.safe_dump(data, sort_keys=False))
    told = ""
    with contextlib.chdir(ROOT):
        try:
            read_manipulator(path)
        except ParameterError as error:
            told = str(error)
    assert all(line.startswith(f"{path}: ") for line in told.splitlines())
