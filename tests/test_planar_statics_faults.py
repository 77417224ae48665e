"""Statics of machines of a file: joints at any angle, and independent checks of equilibria."""

import numpy as np
import pytest
from planar_machines import FILES, machine, pin, rigid
from scipy.integrate import quad
from test_planar_statics import EI, E, G, beam, drawn, sag, shipped, turning

from flexik.errors import ParameterError
from flexik.kinematics.planar import PlanarManipulator
from flexik.machines.planar import read_machine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import solve, tips

EA = E * 0.05 * 0.1
STIFF = {"kind": "box", "width": 0.3, "height": 0.6, "wall": 0.05}


def arm_of(body, origin=0.0):
    """A body on a drive at its point `a`."""
    joints = {"a": pin("ground.a", "arm.a")}
    drives = {"turn": turning("a")}
    return machine({"a": [origin, origin]}, {"arm": body}, joints, drives, "arm.tip")


@pytest.mark.parametrize("springs", [{"x": 1e5}, {"y": 1e5}, {"x": 1e5, "y": 3e5}])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("bends", [False, True])
def test_springs_are_the_inner_bodys_whatever_the_angle_of_the_joint(springs, angle, bends):
    turned, ends = 0.5, {"a": [0, 0], "b": [1, 0]}
    arm = beam([[0, 0], [1, 0]], STIFF, **ends) if bends else rigid(**ends)
    fixed = {"kind": "fixed", "of": ["arm.b", "end.b"], "angle": angle, "springs": springs}
    given = machine(
        {"a": [0, 0]},
        {"arm": arm, "end": rigid(b=[0, 0], tip=[0, 0])},
        {"a": pin("ground.a", "arm.a"), "b": fixed},
        {"turn": turning("a")},
        "end.tip",
    )
    x, y = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    flexibility = np.outer(x, x) / springs.get("x", np.inf)
    flexibility += np.outer(y, y) / springs.get("y", np.inf)
    expected = flexibility @ [0.0, -10 * G]
    found = sag(tips, given, values=np.array([turned]))
    assert found == pytest.approx(expected, rel=2e-3, abs=2e-6)


def lifted(element, kind, direction=0.0, turned=0.0):
    """A boom on a cylinder and a slider, each with its axis at an angle in its own frame."""
    front, tip = (
        (length * np.array([np.cos(along), np.sin(along)])).tolist()
        for length, along in ((2.0, direction), (1.5, direction - turned))
    )
    lift = {"kind": "cylinder", "of": ["ground.c", "boom.front"], "retracted": 1.0}
    out = {"kind": "cylinder", "of": ["boom.a", "slider.tip"], "retracted": 2.0}
    if kind == "telescope":
        out = {"kind": kind, "joint": "pads", "of": ["boom.front", "slider.tip"]}
    pads = {"kind": "slide", "of": ["boom.front", "slider.rear"], "direction": direction}
    return machine(
        {"a": [0, 0], "c": [1.0, -1.0]},
        {
            "boom": beam([[0, 0], front], a=[0, 0], front=front) | {"angle": -direction},
            "slider": beam([[0, 0], tip], rear=[0, 0], tip=tip) | {"angle": turned - direction},
        },
        {"a": pin("ground.a", "boom.a"), "pads": pads | {"angle": turned}},
        {"lift": lift | {"limits": [0.3, 0.8]}, "out": out | {"limits": [0.2, 1.0]}},
        "slider.tip",
        element=element,
    )


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
@pytest.mark.parametrize("kind", ["telescope", "cylinder"])
def test_pads_do_not_depend_on_the_frames_of_the_bodies(element, kind):
    values, payload = np.array([[0.4, 0.2], [0.5, 0.7], [0.6, 1.0]]), np.full(3, 50.0)
    expected = tips(FlexibleMachine(lifted(element, kind)), values, payload)
    for direction, turned in ((0.5, 0.3), (-0.4, -0.8)):
        found = tips(FlexibleMachine(lifted(element, kind, direction, turned)), values, payload)
        assert found == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    ("length", "n_elements", "origin"), [(2.0, 500, 0.0), (0.2, 50, 0.0), (1.0, 60, 95.0)]
)
def test_round_off_of_short_elements_is_no_missing_equilibrium(length, n_elements, origin):
    arm = beam([[0, 0], [length, 0]], n_elements=n_elements, a=[0, 0], tip=[length, 0])
    given = arm_of(arm, origin)
    values, payload = np.linspace(-1.0, 1.0, 9)[:, None], np.linspace(0.0, 100.0, 9)
    assert not solve(FlexibleMachine(given), values, payload)[1]
    sunk = sag(tips, given, 100.0)[1]
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
    "corner", ["[0.02, 0.01], [2.2, 1.0]", "[2.98, 1.05], [3.0, 1.05]", "[5.68, 0.01], [5.7, 0.0]]"]
)
def test_a_corner_that_would_share_a_node_is_a_line_that_names_the_axis(tmp_path, corner):
    text, before = FILES["excavator"].read_text(), corner.partition("], ")[2]
    assert text.count(before) == 1
    path = tmp_path / "excavator.yaml"
    path.write_text(text.replace(before, corner))
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


def sag_of_light(given, *values):
    """What `sag` gives with 1 kg on a machine whose own weight hardly bends it."""
    light = {f"bodies.{name}.density": 11.0 for name in given.beams}
    return sag(tips, given.with_constants(light), 1.0, np.array(values))


def worked(*beams):
    """How far 1 kg moves a point by the unit-load theorem, (2,) in m.

    beams : length in m, and functions of the abscissa that give moment (3,) in m and tension (3,)
        by forces of 1 N on the point: downwards, along x and along y.
    """
    found = np.zeros(2)
    for length, moment, tension in beams:

        def density(x, axis, moment=moment, tension=tension):
            m, n = moment(x), tension(x)
            return m[0] * m[axis] / EI + n[0] * n[axis] / EA

        found += [quad(density, 0, length, args=(axis,), limit=200)[0] for axis in (1, 2)]
    return G * found


def test_a_portal_by_the_unit_load():
    high, wide, at, foot = 1.5, 2.0, 0.7, 0.6
    right = [float(np.hypot(foot, high)), 0]  # this post leans, and thrusts to the left
    given = machine(
        {"a": [0, 0], "d": [wide + foot, 0]},
        {
            "left": beam([[0, 0], [high, 0]], a=[0, 0], b=[high, 0]) | {"angle": np.pi / 2},
            "top": beam([[0, 0], [wide, 0]], b=[0, 0], tip=[at, 0], c=[wide, 0]),
            "right": beam([[0, 0], right], d=[0, 0], c=right) | {"angle": np.arctan2(high, -foot)},
        },
        {
            "a": pin("ground.a", "left.a"),
            "b": pin("left.b", "top.b"),
            "c": pin("right.c", "top.c"),
            "d": pin("ground.d", "right.d"),
        },
        {"turn": turning("a", (1.4, 1.7))},
        "top.tip",
    )
    lift = at / wide  # of the right post, of a load of 1 N
    thrust = lift * foot / high
    down, along = np.array([1.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
    expected = worked(
        (high, lambda y: (along - thrust * down) * (high - y), lambda _: (lift - 1) * down),
        (
            wide,
            lambda x: down * ((1 - lift) * x if x < at else lift * (wide - x)),
            lambda x: along * (x < at) - thrust * down,
        ),
        (right[0], lambda _: 0 * down, lambda _: -np.hypot(lift, thrust) * down),
    )
    assert sag_of_light(given, np.pi / 2) == pytest.approx(expected, rel=5e-4)


@pytest.mark.parametrize("turned", [(0.0, 0.0), (0.9, -1.4), (-0.5, 1.2)])
def test_two_links_on_drives_by_the_unit_load(turned):
    long = (1.2, 0.9)
    given = machine(
        {"a": [0, 0]},
        {
            "inner": beam([[0, 0], [long[0], 0]], a=[0, 0], b=[long[0], 0]),
            "outer": beam([[0, 0], [long[1], 0]], b=[0, 0], tip=[long[1], 0]),
        },
        {"a": pin("ground.a", "inner.a"), "b": pin("inner.b", "outer.b")},
        {"first": turning("a", (-1.5, 1.5)), "second": turning("b", (-1.5, 1.5))},
        "outer.tip",
    )
    forces = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    inner, outer = (np.array([np.cos(a), np.sin(a)]) for a in np.cumsum(turned))

    def moment(x, y):
        """At the place `x` before the end of the inner link and `y` before the tip."""
        arm = x * inner + y * outer
        return arm[0] * forces[:, 1] - arm[1] * forces[:, 0]

    expected = worked(
        (long[0], lambda x: moment(long[0] - x, long[1]), lambda _: forces @ inner),
        (long[1], lambda y: moment(0.0, long[1] - y), lambda _: forces @ outer),
    )
    assert sag_of_light(given, *turned) == pytest.approx(expected, rel=1e-4, abs=1e-8)


def settled(name, payload):
    """Solved models of a shipped machine that hardly bends, with their coordinates."""
    given = shipped(name).machine
    hard = {f"bodies.{body}.stiffness_factor": 1e3 for body in given.beams}
    hard |= {f"bodies.{body}.youngs_modulus": 2e12 for body in given.beams}
    hard |= {"joints.slew.springs.torsion": 1e13} if name == "crane" else {}
    flexible = FlexibleMachine(given.with_constants(hard))
    for at in drawn(flexible, 6, 1.0)[0]:
        model = PlanarModel.placed(flexible, at)
        model.solve(payload)
        yield model, at


def energy(machine, values, payload):
    """Potential energy (n,) of all weights at coordinates (n, k), J."""
    manipulator = PlanarManipulator(machine)
    poses, names = manipulator.linkage.poses(values), manipulator.linkage.names
    height = payload * manipulator.forward(values)[:, 1]
    for body, (x, y), mass in machine.masses().values():
        _, up, angle = poses[:, names.index(body)].T
        height += mass * (up + x * np.sin(angle) + y * np.cos(angle))
    return machine.gravity * height


@pytest.mark.parametrize(("name", "payload"), [("crane", 400.0), ("excavator", 2500.0)])
def test_cylinders_lift_as_virtual_work_says(name, payload):
    for model, at in settled(name, payload):
        forces = model.pin_forces(model.rods)
        for drive, step in zip(model.machine.drives, 1e-4 * np.eye(len(at)), strict=True):
            if (key := f"drives.{drive}") in forces:
                down, up = energy(model.machine, np.array([at - step, at + step]), payload)
                assert forces[key][0] == pytest.approx((down - up) / 2e-4, rel=1e-3, abs=2.0)


def test_the_ground_bears_all_weights():
    for model, _ in settled("crane", 400.0):
        weight = G * (400.0 + sum(mass for *_, mass in model.machine.masses().values()))
        force = model.pin_forces(["joints.slew"])["joints.slew"]
        assert force == pytest.approx(np.array([0.0, -weight]), abs=1e-5 * weight)
