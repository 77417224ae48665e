"""Kinematics of any planar machine against closed forms, finite differences and geometry."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planar_machines import FILES, NAMES, four_bar, general, machine, pin, rigid, serial
from virtual_work import GEOMETRY

from flexik.errors import ParameterError
from flexik.kinematics import crane
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.kinematics.loops import Linkage
from flexik.kinematics.machine_file import (
    check_kinematics,
    crane_geometry,
    manipulator_of,
    read_manipulator,
)
from flexik.kinematics.planar import PlanarManipulator
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED
from flexik.machines.deviations import Expected
from flexik.machines.planar import PlanarMachine
from flexik.planar.measured.offsets import corrected, dimensions_of

each_machine = pytest.mark.parametrize("name", NAMES)
N_POSES = 100_000


def drawn(manipulator, n, seed=0, margin=0.0):
    """Random coordinates (n, k), `margin` of the range away from the limits."""
    share = np.random.default_rng(seed).uniform(margin, 1 - margin, (n, len(manipulator.lower)))
    return manipulator.lower + share * (manipulator.upper - manipulator.lower)


def middle(manipulator, n):
    return np.tile((manipulator.lower + manipulator.upper) / 2, (n, 1))


@pytest.mark.parametrize("name", ["crane", "elastic_arm"])
def test_agrees_with_the_closed_form(name):
    _, closed = read_manipulator(FILES[name])
    assert isinstance(closed, CraneManipulator | ArmGeometry)
    values = drawn(general(name), N_POSES)
    assert np.abs(general(name).forward(values) - closed.forward(values)).max() < 1e-9


def test_file_of_the_crane_has_the_dimensions_of_the_source():
    found = crane_geometry(general("crane").machine)
    for name, expected in vars(GEOMETRY).items():
        assert getattr(found, name) == pytest.approx(expected, abs=1e-15), name


def test_a_crane_of_other_dimensions_moves_as_its_closed_form():
    machine, expected = general("crane").machine, Expected()
    size = len(dimensions_of(machine, expected))
    changed = corrected(machine, np.random.default_rng(4).normal(0.0, 3e-3, size))
    assert changed.located("extension.tip").point[1] != 0.0
    assert changed.drives["extension"].retracted != 0.0
    near = Linkage(changed, near=general("crane").linkage)
    values = drawn(near, 200)
    tip = near.tip(near.poses(values))[0]
    assert tip == pytest.approx(crane.forward(crane_geometry(changed), values), abs=1e-9)
    assert near.poses(values) == pytest.approx(Linkage(changed).poses(values), abs=1e-9)


@each_machine
def test_poses_meet_every_constraint(name):
    linkage = general(name).linkage
    values = drawn(linkage, 2000, 1)
    poses = linkage.poses(values)
    for equation in linkage.equations:
        assert np.abs(equation.evaluate(poses, values)[0]).max() < 1e-12, equation.key


@each_machine
def test_branch_is_followed(name):
    """Poses along a random way, each from the one before, are those found from afar."""
    linkage = general(name).linkage
    corners = drawn(linkage, 2, 3)
    way = np.linspace(*corners, 60)
    pose = linkage.poses(way[:1])
    for before, after in pairwise(way):
        pose = linkage.follow(pose, before[None], after[None])
    assert np.abs(pose - linkage.poses(way[-1:])).max() < 1e-11


@each_machine
def test_derivatives_are_those_of_finite_differences(name):
    manipulator, h = general(name), 1e-6
    values = drawn(manipulator, 300, 2, 0.01)
    ways = [
        (manipulator.forward(values + h * way) - manipulator.forward(values - h * way)) / (2 * h)
        for way in np.eye(values.shape[1])
    ]
    assert np.abs(manipulator.derivatives(values) - np.stack(ways, axis=2)).max() < 1e-7


def test_serial_arm_of_six_drives_adds_its_angles():
    manipulator = PlanarManipulator(serial(6))
    values = drawn(manipulator, 1000)
    angles = np.cumsum(values, axis=1)
    tip = np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)], axis=1)
    assert np.abs(manipulator.forward(values) - tip).max() < 1e-12


def test_excavator_is_two_triangles():
    """The angle at the foot of the boom by the law of cosines."""
    manipulator = general("excavator")
    values = drawn(manipulator, 100)
    where = manipulator.machine.located
    pivot, base = (
        np.array(where(f"ground.{n}").point) for n in ("boom_pivot", "boom_cylinder_base")
    )
    head = np.array(where("boom.boom_cylinder_head").point)
    a, b, c = np.hypot(*(base - pivot)), np.hypot(*head), 1.5 + values[:, 0]
    opening = np.arccos((a**2 + b**2 - c**2) / (2 * a * b))
    angle = np.arctan2(*(base - pivot)[::-1]) + opening - np.arctan2(*head[::-1])
    assert np.allclose(manipulator.linkage.poses(values)[:, 1, 2], angle, atol=1e-12)


def test_telescope_slides_on_an_inclined_line_with_a_body_at_an_angle():
    given = machine(
        {"a": [1.0, 2.0]},
        {
            "inner": rigid(0.3, a=[0, 0], pad=[0.5, 0.1]),
            "outer": rigid(1.0, rear=[0, 0], tip=[2, 0]),
        },
        {
            "a": pin("ground.a", "inner.a"),
            "pads": {
                "kind": "slide",
                "of": ["inner.pad", "outer.rear"],
                "angle": 0.7,
                "direction": 0.2,
            },
        },
        {
            "turn": {"kind": "revolute", "joint": "a", "limits": [0.0, 0.6]},
            "out": {
                "kind": "telescope",
                "joint": "pads",
                "of": ["inner.pad", "outer.rear"],
                "retracted": 0.1,
                "limits": [0.0, 1.0],
            },
        },
        "outer.tip",
    )
    turn, out = values = np.array([0.4, 0.25])
    along, ahead = turn + 0.2, turn + 0.7
    c, s = np.cos(turn), np.sin(turn)
    pad = np.array([1 + c * 0.5 - s * 0.1, 2 + s * 0.5 + c * 0.1])
    rear = pad + (0.1 + out) * np.array([np.cos(along), np.sin(along)])
    tip = rear + 2 * np.array([np.cos(ahead), np.sin(ahead)])
    assert np.abs(PlanarManipulator(given).forward(values)[0] - tip).max() < 1e-12


def test_four_bar_closes_both_ways_as_its_angles_say():
    turns = np.linspace(-3, 3, 50)[:, None]
    above, below = (Linkage(four_bar(angles=(s * 0.8, s * 1.4))).poses(turns) for s in (1, -1))
    assert (np.sin(above[:, 3, 2]) > 0).all()
    assert np.allclose(above[:, 3, 2], -below[::-1, 3, 2], atol=1e-12)  # the mirror image


@settings(deadline=None, max_examples=25)
@given(
    crank=st.floats(0.1, 0.25),
    coupler=st.floats(0.8, 1.2),
    rocker=st.floats(0.7, 1.1),
    up=st.booleans(),
)
def test_any_crank_and_rocker_is_two_circles(crank, coupler, rocker, up):
    def joint(turn):
        """The upper or the lower point of two circles about the crank's end and the ground."""
        end = crank * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        way = np.array([1.0, 0.0]) - end
        distance = np.hypot(*way.T)
        ahead = (distance**2 + coupler**2 - rocker**2) / (2 * distance)
        across = np.sqrt(coupler**2 - ahead**2) * (1 if up else -1)
        return end, end + (ahead * way.T + across * np.stack([-way[:, 1], way[:, 0]])).T / distance[
            :, None
        ]

    end, head = joint(np.zeros(1))
    angles = [float(np.arctan2(*(head - foot)[0, ::-1])) for foot in (end, np.array([[1.0, 0.0]]))]
    linkage = Linkage(four_bar(crank, coupler, rocker, angles=angles))
    turn = np.linspace(-3.0, 3.0, 37)
    head = joint(turn)[1] - [1.0, 0.0]
    angle = linkage.poses(turn[:, None])[:, 3, 2]
    assert np.abs(rocker * np.stack([np.cos(angle), np.sin(angle)], axis=1) - head).max() < 1e-11


def test_beyond_the_dead_point_there_is_nothing():
    bars = {"crank": 0.9, "coupler": 1.0, "rocker": 0.5, "angles": (-0.4, 1.0)}
    manipulator = PlanarManipulator(four_bar(limits=(0.8, 1.5), **bars))
    dead = np.arccos((0.9**2 + 1.0 - 1.5**2) / (2 * 0.9))
    tips = manipulator.forward(np.array([[dead - 1e-4], [dead + 1e-4], [2.5]]))
    assert np.isfinite(tips).all(axis=1).tolist() == [True, False, False]
    assert np.isnan(general("crane").forward(np.array([[0.7, 0.3, 0.2]]))).all()
    with pytest.raises(ParameterError, match=rf"from 0.8 to 2 rad; .*dead point at {dead:.4g}"):
        Linkage(four_bar(limits=(0.8, 2.0), **bars))


@each_machine
def test_inverse_reaches_what_the_drives_reach(name):
    manipulator = general(name)
    targets = manipulator.forward(drawn(manipulator, 1000, 4))
    found = manipulator.inverse(targets, middle(manipulator, 1000))
    assert found.reached.mean() > 0.998
    tips = manipulator.forward(found.values[found.reached])
    assert np.abs(tips - targets[found.reached]).max() < 1e-9
    assert (found.values >= manipulator.lower).all() and (found.values <= manipulator.upper).all()


def test_smallest_extension_is_that_of_the_closed_form():
    manipulator = general("crane")
    closed = CraneManipulator(crane_geometry(manipulator.machine))
    values = drawn(manipulator, 400, 5)
    targets = manipulator.forward(values)
    found = manipulator.inverse(targets, values)
    expected = crane.smallest_extension(closed.geometry, targets)
    assert np.abs(found.values[:, 2] - expected)[found.reached].max() < 1e-8
    # a correction keeps the extension that the original target needs
    moved = targets + np.random.default_rng(6).uniform(-0.05, 0.05, targets.shape)
    found, known = (m.inverse(moved, values, targets) for m in (manipulator, closed))
    both = found.reached & known.reached
    assert both.mean() > 0.8
    # what reaches may be two intervals of the extension: the search may miss one
    assert (np.abs(found.values[:, 2] - known.values[:, 2])[both] < 1e-8).mean() > 0.995


def test_statuses_are_nearly_those_of_the_closed_form():
    targets = np.random.default_rng(7).uniform([-6, -5], [8, 8], (300, 2))
    manipulator = general("crane")
    closed = CraneManipulator(crane_geometry(manipulator.machine))
    found, known = (m.inverse(targets, np.zeros((300, 3))) for m in (manipulator, closed))
    assert (found.reached == known.reached).mean() > 0.99
    assert not found.values[~found.reached].any()  # the current ones
    assert set(found.status) == {REACHED, OUT_OF_REACH, ACTUATOR_LIMIT}
    assert manipulator.inverse(np.array([[30.0, 0.0]]), np.zeros((1, 3))).status[0] == OUT_OF_REACH


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10_000), size=st.floats(0.001, 0.1))
def test_redundant_inverse_is_near_the_current_coordinates(seed, size):
    """Nearer than the coordinates that made the target, and no neighbour on target is nearer."""
    manipulator = general("concrete_pump")
    span = manipulator.upper - manipulator.lower
    values = drawn(manipulator, 20, seed)
    away = np.random.default_rng(seed).uniform(-size, size, values.shape)
    current = np.clip(values + away * span, manipulator.lower, manipulator.upper)
    targets = manipulator.forward(values)
    found = manipulator.inverse(targets, current)
    assert found.reached.all()
    pull = (current - found.values) / span
    known = np.linalg.norm((current - values) / span, axis=1)
    assert (np.linalg.norm(pull, axis=1) <= known + 1e-6).all()
    share = (found.values - manipulator.lower) / span
    inside = ((share > 1e-9) & (share < 1 - 1e-9)).all(axis=1)
    slope = manipulator.derivatives(found.values) * span
    left = pull - np.einsum(
        "nki,ni->nk", np.linalg.pinv(slope), np.einsum("nik,nk->ni", slope, pull)
    )
    # what is left is along the solutions
    assert np.abs(left[inside]).max(initial=0.0) < 1e-4


def test_rows_do_not_depend_on_each_other():
    for name in ("crane", "concrete_pump"):
        manipulator = general(name)
        targets = manipulator.forward(drawn(manipulator, 30, 8))
        current = middle(manipulator, 30)
        together = manipulator.inverse(targets, current).values
        rows = zip(targets[:, None], current[:, None], strict=True)
        alone = [manipulator.inverse(*row).values[0] for row in rows]
        assert np.abs(together - alone).max() < 1e-9


def test_one_drive_reaches_its_curve_alone():
    manipulator = PlanarManipulator(four_bar())
    targets = manipulator.forward(np.array([[0.5], [-2.0]]))
    found = manipulator.inverse(np.vstack([targets, targets + 0.3]), np.zeros((4, 1)))
    assert found.reached.tolist() == [True, True, False, False]
    assert manipulator.branch(found.values).shape == (4, 0)


def test_branch_is_the_elbow_of_two_drives_and_the_rest_of_more():
    arm = read_manipulator(FILES["elastic_arm"])[1]
    values = drawn(arm, 50)
    assert np.array_equal(general("elastic_arm").branch(values), arm.branch(values))
    values = drawn(general("crane"), 5)
    assert np.array_equal(general("crane").branch(values), values[:, 2:])


def test_empty_queries_have_empty_answers():
    manipulator = general("crane")
    assert manipulator.forward(np.zeros((0, 3))).shape == (0, 2)
    assert manipulator.inverse(np.zeros((0, 2)), np.zeros((0, 3))).values.shape == (0, 3)


def test_a_bar_too_many_is_told():
    """A parallelogram with a third bar moves, but its constraints repeat each other."""
    third = rigid(1.0, e=[0, 0], f=[0.5, 0])
    shape = {"crank": 0.5, "rocker": 0.5, "limits": (0.8, 1.2), "angles": (0.0, 1.0)}
    given = four_bar(**shape, bodies={"third": third}).model_dump()
    given["ground"]["e"] = given["bodies"]["coupler"]["points"]["f"] = [0.5, 0.0]
    given["joints"]["e"] = pin("ground.e", "third.e")
    with pytest.raises(ParameterError, match=r"bodies: third: .* leave 1 free"):
        Linkage(PlanarMachine.model_validate(given))
    given["joints"]["f"] = pin("coupler.f", "third.f")
    with pytest.raises(ParameterError, match="hold 1 too often"):
        Linkage(PlanarMachine.model_validate(given))
    # without the drive the count is right, yet the parallelogram moves
    given["drives"] = {"pull": {"kind": "cylinder", "of": ["ground.a", "load.tip"]}}
    given["drives"]["pull"] |= {"retracted": 1.0, "limits": [0.0, 1.0]}
    given["bodies"]["load"] = rigid(1.9, a=[0, 0], tip=[1.5, 0])
    given["joints"]["load"] = pin("ground.d", "load.a")
    given["payload"] = "load.tip"
    with pytest.raises(ParameterError, match="hold one motion twice and leave another free"):
        Linkage(PlanarMachine.model_validate(given))


def test_closed_form_of_another_machine_is_refused():
    given = general("crane").machine
    other = given.with_constants({"joints.pads.direction": 0.01})
    with pytest.raises(ParameterError, match="kinematics: expected general"):
        check_kinematics(other)
    assert isinstance(
        manipulator_of(other.model_copy(update={"kinematics": "general"})), PlanarManipulator
    )
