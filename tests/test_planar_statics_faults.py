"""Statics of machines of a file: joints at any angle, and independent checks of equilibria."""

import numpy as np
import pytest
from planar_machines import FILES, machine, pin, rigid
from test_planar_statics import EI, G, beam, drawn, sag, shipped, turning

from flexik.errors import ParameterError
from flexik.machines.planar import read_machine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import solve, tips


def arm_of(body, origin=0.0):
    """A body on a drive at its point `a`."""
    joints = {"a": pin("ground.a", "arm.a")}
    drives = {"turn": turning("a")}
    return machine({"a": [origin, origin]}, {"arm": body}, joints, drives, "arm.tip")


STIFF = {"kind": "box", "width": 0.3, "height": 0.6, "wall": 0.05}


@pytest.mark.parametrize("springs", [{"x": 1e5}, {"y": 1e5}, {"x": 1e5, "y": 3e5}])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("bends", [False, True])
def test_springs_are_the_inner_bodys_whatever_the_angle_of_the_joint(springs, angle, bends):
    turned, ends = 0.5, {"a": [0, 0], "b": [1, 0]}
    given = machine(
        {"a": [0, 0]},
        {
            "arm": beam([[0, 0], [1, 0]], STIFF, **ends) if bends else rigid(**ends),
            "end": rigid(b=[0, 0], tip=[0, 0]),
        },
        {
            "a": pin("ground.a", "arm.a"),
            "b": {
                "kind": "fixed",
                "of": ["arm.b", "end.b"],
                "angle": angle,
                "springs": springs,
            },
        },
        {"turn": turning("a")},
        "end.tip",
    )
    x, y = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    flexibility = np.outer(x, x) / springs.get("x", np.inf)
    flexibility += np.outer(y, y) / springs.get("y", np.inf)
    expected = flexibility @ [0.0, -10 * G]
    assert sag(given, values=np.array([turned])) == pytest.approx(expected, rel=2e-3, abs=2e-6)


def lifted(element, drive, direction=0.0, turned=0.0):
    """A boom on a cylinder and a slider, each with its axis at an angle in its own frame."""
    front, tip = (
        (length * np.array([np.cos(along), np.sin(along)])).tolist()
        for length, along in ((2.0, direction), (1.5, direction - turned))
    )
    out = {
        "telescope": {"joint": "pads", "of": ["boom.front", "slider.tip"]},
        "cylinder": {"of": ["boom.a", "slider.tip"], "retracted": 2.0},
    }[drive]
    lift = {"kind": "cylinder", "of": ["ground.c", "boom.front"], "retracted": 1.0}
    pads = {"kind": "slide", "of": ["boom.front", "slider.rear"]}
    return machine(
        {"a": [0, 0], "c": [1.0, -1.0]},
        {
            "boom": beam([[0, 0], front], a=[0, 0], front=front) | {"angle": -direction},
            "slider": beam([[0, 0], tip], rear=[0, 0], tip=tip) | {"angle": turned - direction},
        },
        {
            "a": pin("ground.a", "boom.a"),
            "pads": pads | {"direction": direction, "angle": turned},
        },
        {
            "lift": lift | {"limits": [0.3, 0.8]},
            "out": {"kind": drive, "limits": [0.2, 1.0], **out},
        },
        "slider.tip",
        element=element,
    )


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
@pytest.mark.parametrize("drive", ["telescope", "cylinder"])
def test_pads_do_not_depend_on_the_frames_of_the_bodies(element, drive):
    values, payload = np.array([[0.4, 0.2], [0.5, 0.7], [0.6, 1.0]]), np.full(3, 50.0)
    expected = tips(FlexibleMachine(lifted(element, drive)), values, payload)
    for direction, turned in ((0.5, 0.3), (-0.4, -0.8)):
        found = tips(FlexibleMachine(lifted(element, drive, direction, turned)), values, payload)
        assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    ("length", "n_elements", "origin"), [(2.0, 500, 0.0), (0.2, 50, 0.0), (1.0, 60, 95.0)]
)
def test_round_off_of_short_elements_is_no_missing_equilibrium(length, n_elements, origin):
    arm = beam([[0, 0], [length, 0]], n_elements=n_elements, a=[0, 0], tip=[length, 0])
    given = arm_of(arm, origin)
    values, payload = np.linspace(-1.0, 1.0, 9)[:, None], np.linspace(0.0, 100.0, 9)
    assert not solve(FlexibleMachine(given), values, payload)[1]
    sunk = sag(given, 100.0)[1]
    assert sunk == pytest.approx(-100.0 * G * length**3 / (3 * EI), rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "payload"), [("excavator", 3000.0), ("concrete_pump", 300.0), ("elastic_arm", 1.0)]
)
def test_meshes_sixteen_times_finer_are_solved(name, payload):
    fine, usual = shipped(name, 16), shipped(name)
    values, mass = drawn(usual, 8, payload)
    found, failures = solve(fine, values, mass)
    assert not failures
    assert found == pytest.approx(tips(usual, values, mass), abs=2e-3)


@pytest.mark.parametrize(
    ("corner", "before"),
    [
        ("[0.02, 0.01]", "[2.2, 1.0], [3.0"),
        ("[2.98, 1.05]", "[3.0, 1.05], [5.7"),
        ("[5.68, 0.01]", "[5.7, 0.0]]"),
    ],
)
def test_a_corner_that_would_share_a_node_is_a_line_that_names_the_axis(tmp_path, corner, before):
    text = FILES["excavator"].read_text()
    assert text.count(before) == 1
    # beside the first end, beside another corner, beside the last end
    path = tmp_path / "excavator.yaml"
    path.write_text(text.replace(before, f"{corner}, {before}"))
    with pytest.raises(ParameterError) as raised:
        read_machine(path)
    assert str(raised.value) == f"{path}: bodies.boom.axis: expected corners 0.03 m apart or more"


def test_corners_as_far_apart_as_that_have_nodes():
    axis = [[0, 0], [0.03, 0], [1.0, 0], [1.0, 0.03], [1.03, 0.03], [1.03, 1.0], [1.06, 1.0]]
    flexible = FlexibleMachine(arm_of(beam(axis, a=[0, 0], tip=axis[-1])))
    (meshes,) = flexible.meshes(np.zeros((1, 0, 2, 2)), ["arm"])
    corners = np.cumsum(np.hypot(*np.diff(axis, axis=0).T))[:-1]
    apart = np.abs(meshes["arm"].stations[:, None] - corners).min(axis=0)
    assert apart == pytest.approx(np.zeros(len(corners)), abs=1e-12)
