"""Statics of machines of a file, by Exudyn and by beam theory, against closed forms."""

import numpy as np
import pytest
from planar_machines import FILES, ROOT, machine, pin, rigid
from pydantic import ValidationError
from scipy.integrate import quad

from flexik.errors import ParameterError, SolverError
from flexik.kinematics.planar import PlanarManipulator
from flexik.machines.planar import read_machine
from flexik.multibody.beam_theory import BeamTheory
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import solve, tips

E, G = 210e9, 9.81
SOLID = {"kind": "solid", "width": 0.05, "height": 0.1}
I = 0.05 * 0.1**3 / 12  # noqa: E741  the usual name
EI = E * I
SPRING = 8.5e6  # N m/rad, of the ground below the crane


def beam(axis, section=SOLID, n_elements=8, **points):
    return {
        "kind": "beam",
        "axis": axis,
        "section": section,
        "youngs_modulus": E,
        "density": 7850.0,
        "n_elements": n_elements,
        "points": points,
    }


def turning(joint, limits=(-1.0, 1.0)):
    return {"kind": "revolute", "joint": joint, "limits": list(limits)}


def clamped(body, **more):
    """A body whose point `a` a drive holds at the origin; its tip carries the payload."""
    return machine(
        {"a": [0, 0]},
        {"arm": body},
        {"a": pin("ground.a", "arm.a")},
        {"turn": turning("a")},
        "arm.tip",
        **more,
    )


def by_theory(flexible, values, payload):
    """Tips (n, 2) in m without Exudyn."""
    bent = BeamTheory(flexible, 6, 24).predict(np.column_stack([values, payload]))
    return PlanarManipulator(flexible.machine).forward(values) + bent


@pytest.fixture(params=[tips, by_theory])
def solver(request):
    """What finds tips."""
    return request.param


def sag(solver, given, load=10.0, values=None, refinement=1):
    """How far `load` in kg moves the tip, (2,) in m: what it weighs itself is taken off."""
    flexible = FlexibleMachine(given, refinement)
    n_drives = len(given.drives)
    at = np.tile(np.zeros(n_drives) if values is None else values, (2, 1))
    unloaded, loaded = solver(flexible, at, np.array([0.0, load]))
    return loaded - unloaded


def test_cantilever(solver):
    found = sag(solver, clamped(beam([[0, 0], [2, 0]], a=[0, 0], tip=[2, 0])))
    assert found[1] == pytest.approx(-10 * G * 8 / (3 * EI), rel=1e-4)


@pytest.mark.parametrize("n_elements", [1, 2, 8])
def test_own_weight(solver, n_elements):
    given = clamped(beam([[0, 0], [2, 0]], n_elements=n_elements, a=[0, 0], tip=[2, 0]))
    tip = solver(FlexibleMachine(given), np.zeros((1, 1)), np.zeros(1))[0]
    per_length = 7850 * 0.05 * 0.1 * G
    assert tip[1] == pytest.approx(-per_length * 16 / (8 * EI), rel=1e-3)


def test_tapered_cantilever_by_the_unit_load(solver):
    section = SOLID | {"height": [0.2, 0.05]}
    found = sag(solver, clamped(beam([[0, 0], [2, 0]], section, 5, a=[0, 0], tip=[2, 0])))
    flexibility = quad(lambda x: (2 - x) ** 2 / (E * 0.05 * (0.2 - 0.075 * x) ** 3 / 12), 0, 2)[0]
    assert found[1] == pytest.approx(-10 * G * flexibility, rel=1e-3)


def test_shear_as_by_timoshenko(solver):
    short = beam([[0, 0], [0.4, 0]], a=[0, 0], tip=[0.4, 0]) | {"shear_coefficient": 5 / 6}
    bent = 10 * G * 0.4**3 / (3 * EI)
    sheared = 10 * G * 0.4 / (5 / 6 * E / 2.6 * 0.05 * 0.1)
    assert sag(solver, clamped(short))[1] == pytest.approx(-bent, rel=1e-4)
    assert sag(solver, clamped(short, shear="included"))[1] == pytest.approx(
        -bent - sheared, rel=1e-4
    )


def test_an_axis_with_a_corner(solver):
    axis, tip = [[0, 0], [1.5, 0], [1.5, 1.0]], [1.5, 1.0]
    found = sag(solver, clamped(beam(axis, n_elements=10, a=[0, 0], tip=tip)))
    # the upright part only turns with the end of the level one, and leans by its own weight
    expected = [10 * G * 1.5**2 / (2 * EI), -10 * G * 1.5**3 / (3 * EI)]
    assert found == pytest.approx(np.array(expected), rel=4e-3)


@pytest.mark.parametrize("springs", [{"torsion": 1e5}, {"torsion": 1e5, "x": 1e6, "y": 2e6}])
def test_a_soft_ground(solver, springs):
    given = machine(
        {"a": [0, 0]},
        {"post": rigid(a=[0, 0], b=[0, 0.5]), "arm": rigid(b=[0, 0], tip=[2, 0])},
        {
            "a": {"kind": "fixed", "of": ["ground.a", "post.a"], "springs": springs},
            "b": pin("post.b", "arm.b"),
        },
        {"turn": turning("b")},
        "arm.tip",
    )
    turned, sunk = 2 * 10 * G / 1e5, 10 * G / 2e6 if "y" in springs else 0.0
    # small turns, though the arm's own weight has turned it already
    assert sag(solver, given) == pytest.approx(
        np.array([0.5 * turned, -2 * turned - sunk]), rel=2e-2
    )


@pytest.mark.parametrize(
    ("springs", "sunk"), [({"x": 1e5}, 1e-5), ({"y": 1e5}, 0.0), ({"x": 1e5, "y": 3e5}, 1e-5)]
)
def test_springs_have_the_axes_of_the_inner_body(solver, springs, sunk):
    # which the drive turns until its x is up
    given = machine(
        {"a": [0, 0]},
        {"arm": rigid(a=[0, 0], b=[1, 0]), "end": rigid(b=[0, 0], tip=[0.5, 0])},
        {"a": pin("ground.a", "arm.a"), "b": {"kind": "fixed", "of": ["arm.b", "end.b"]}},
        {"turn": turning("a", (0.0, 2.0))},
        "end.tip",
    )
    soft = given.with_constants({"joints.b.springs": springs})
    found = sag(solver, soft, values=np.array([np.pi / 2]))
    assert found == pytest.approx(np.array([0.0, -10 * G * sunk]), rel=1e-6, abs=1e-9)


def extended(inner, outer):
    """A boom of two bodies that slide."""
    out = {"kind": "telescope", "joint": "pads", "of": ["boom.front", "slider.tip"]}
    return machine(
        {"a": [0, 0]},
        {"boom": inner, "slider": outer},
        {
            "a": pin("ground.a", "boom.a"),
            "pads": {"kind": "slide", "of": ["boom.front", "slider.rear"]},
        },
        {"turn": turning("a"), "out": {**out, "limits": [0.2, 1.0]}},
        "slider.tip",
    )


STIFF = {"kind": "box", "width": 0.3, "height": 0.6, "wall": 0.05}


@pytest.mark.parametrize("inner_bends", [False, True])
@pytest.mark.parametrize("outer_bends", [False, True])
def test_pads_move_on_bodies_of_every_kind(solver, inner_bends, outer_bends):
    boom, slider = {"a": [0, 0], "front": [2, 0]}, {"rear": [0, 0], "tip": [1.5, 0]}
    given = extended(
        beam([[0, 0], [2, 0]], STIFF, **boom) if inner_bends else rigid(**boom),
        beam([[0, 0], [1.5, 0]], STIFF, **slider) if outer_bends else rigid(**slider),
    )
    values = np.array([[0.0, 0.2], [0.5, 0.7], [-0.3, 1.0]])
    expected = PlanarManipulator(given).forward(values)
    found = solver(FlexibleMachine(given), values, np.full(3, 0.01))
    assert found == pytest.approx(expected, abs=1e-4 if inner_bends or outer_bends else 1e-8)


def test_a_four_bar_with_a_flexible_coupler(solver):
    middle = [1.0, 0.0]
    given = machine(
        {"a": [0, 0], "d": [2, 0]},
        {
            "crank": rigid(np.pi / 2, a=[0, 0], b=[0.8, 0]),
            "coupler": beam([[0, 0], [2, 0]], b=[0, 0], c=[2, 0], tip=middle),
            "rocker": rigid(np.pi / 2, d=[0, 0], c=[0.8, 0]),
        },
        {
            "a": pin("ground.a", "crank.a"),
            "b": pin("crank.b", "coupler.b"),
            "c": pin("rocker.c", "coupler.c"),
            "d": pin("ground.d", "rocker.d"),
        },
        {"turn": turning("a", (1.0, 2.2))},
        "coupler.tip",
    )
    found = sag(solver, given, values=np.array([np.pi / 2]))
    assert found == pytest.approx(np.array([0.0, -10 * G * 8 / (48 * EI)]), rel=1e-3, abs=1e-8)


def below(x, y):
    """Deflection of a cantilever at `x` by a unit force at `y`, m/N."""
    x, y = min(x, y), max(x, y)
    return x**2 * (3 * y - x) / (6 * EI)


@pytest.mark.parametrize("out", [0.4, 0.9])
def test_a_telescope_on_two_pads(solver, out):
    given = extended(
        beam([[0, 0], [2, 0]], a=[0, 0], front=[2, 0]),
        beam([[0, 0], [1.5, 0]], rear=[0, 0], tip=[1.5, 0]),
    )
    inside = 1.5 - out
    front, rear = (out + inside) / inside, -out / inside  # forces on the boom, of the payload
    at = {x: front * below(x, 2.0) + rear * below(x, 2.0 - inside) for x in (2.0, 2.0 - inside)}
    line = at[2.0] + out / inside * (at[2.0] - at[2.0 - inside])
    expected = 10 * G * (line + out**2 * (out + inside) / (3 * EI))
    assert sag(solver, given, values=np.array([0.0, out]))[1] == pytest.approx(-expected, rel=1e-3)


def test_what_is_rigid_stays_where_kinematics_say():
    given = clamped(rigid(a=[0, 0], tip=[2, 0.3]))
    at = np.linspace(-1, 1, 5)[:, None]
    expected = PlanarManipulator(given).forward(at)
    assert tips(FlexibleMachine(given), at, np.full(5, 50.0)) == pytest.approx(expected, abs=1e-9)


def drawn(flexible, n, largest):
    """Coordinates (n, k) and payloads (n,)."""
    generator, linkage = np.random.default_rng(4), flexible.linkage
    share = generator.random((n, len(linkage.lower)))
    values = linkage.lower + share * (linkage.upper - linkage.lower)
    return values, largest * generator.random(n)


def shipped(name, refinement=1):
    found = read_machine(ROOT / FILES[name].relative_to(ROOT))
    return FlexibleMachine(found.with_constants(dict.fromkeys(found.free, SPRING)), refinement)


@pytest.fixture(autouse=True)
def _here(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize(
    ("name", "payload", "largest"),
    [("crane", 500.0, 2e-3), ("excavator", 3000.0, 1e-4), ("concrete_pump", 300.0, 2e-3)],
)
def test_four_times_finer_meshes_move_the_tip_little(name, payload, largest):
    values, mass = drawn(shipped(name), 40, payload)
    fine, failures = solve(shipped(name, 4), values, mass)
    assert not failures
    assert np.abs(fine - tips(shipped(name), values, mass)).max() < largest


@pytest.mark.parametrize(
    ("name", "payload", "largest"),
    [("crane", 500.0, 1e-5), ("excavator", 3000.0, 1e-5), ("concrete_pump", 300.0, 5e-5)],
)
def test_fine_meshes_lead_to_beam_theory(name, payload, largest):
    values, mass = drawn(shipped(name), 40, payload)
    bent = BeamTheory(shipped(name), 6, 64).predict(np.column_stack([values, mass]))
    rigid = PlanarManipulator(shipped(name).machine).forward(values)
    assert np.abs(rigid + bent - tips(shipped(name, 4), values, mass)).max() < largest


def test_beam_theory_of_the_rigid_pose_is_linear_in_the_payload():
    values, _ = drawn(shipped("crane"), 20, 500.0)
    with_load = [
        BeamTheory(shipped("crane")).predict(np.column_stack([values, np.full(20, load)]))
        for load in (0.0, 250.0, 500.0)
    ]
    middle = (with_load[0] + with_load[2]) / 2
    assert with_load[1] == pytest.approx(middle, abs=1e-7)


def test_beam_theory_says_where_a_machine_is_not_put_together():
    theory = BeamTheory(shipped("excavator"))
    found = theory.predict(np.array([[0.5, 0.5, 100.0], [5.0, 0.5, 100.0]]))
    assert np.isfinite(found).all(axis=1).tolist() == [True, False]


def test_payloads_far_beyond_those_of_the_crane_have_an_equilibrium():
    values, payload = drawn(shipped("crane"), 150, 3500.0)
    assert not solve(shipped("crane"), values, payload)[1]


def test_meshes_sixteen_times_finer_are_solved():
    values, payload = drawn(shipped("crane"), 5, 500.0)
    assert not solve(shipped("crane", 16), values, payload)[1]


def test_rows_do_not_depend_on_each_other():
    flexible = shipped("crane")
    values, payload = drawn(flexible, 12, 500.0)
    alone = [tips(flexible, values[[k]], payload[[k]])[0] for k in range(12)]
    assert tips(flexible, values, payload) == pytest.approx(np.array(alone), abs=1e-7)


def test_corners_that_would_share_a_node_are_refused():
    with pytest.raises(ValidationError, match=r"axis: expected corners 0\.03 m apart or more"):
        clamped(beam([[0, 0], [1, 0], [1.02, 0], [1.02, 1]], a=[0, 0], tip=[1.02, 1]))


def test_a_failure_is_a_row_that_names_its_coordinates():
    given = clamped(beam([[0, 0], [2, 0]], a=[0, 0], tip=[2, 0]))
    found, failures = solve(FlexibleMachine(given), np.zeros((2, 1)), np.array([1.0, 1e9]))
    assert list(failures) == [1] and np.isnan(found).all(axis=1).tolist() == [False, True]
    with pytest.raises(SolverError, match=r"no static equilibrium with 1e\+09 kg at turn 0"):
        tips(FlexibleMachine(given), np.zeros((1, 1)), np.array([1e9]))


def test_constants_must_be_known_and_elements_fit():
    with pytest.raises(ParameterError, match=r"joints\.slew\.springs\.torsion: fit, expected"):
        FlexibleMachine(read_machine(FILES["crane"]))
    bent = clamped(beam([[0, 0], [1, 0], [1, 1]], a=[0, 0], tip=[1, 1]), element="ancf")
    with pytest.raises(ParameterError, match=r"bodies\.arm\.axis: elements ancf are straight"):
        FlexibleMachine(bent)
