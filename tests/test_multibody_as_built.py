"""The as-built crane against the nominal one, shifted strokes, and statics of the rigid crane."""

from dataclasses import replace

import crane_case
import numpy as np
import pytest
from planar_machines import FILES
from pydantic import ValidationError

from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import forward, pose, rotate
from flexik.kinematics.machine_file import crane_geometry
from flexik.machines.deviations import Magnitudes
from flexik.machines.planar import read_machine
from flexik.multibody import as_built
from flexik.multibody.as_built import (
    AsBuilt,
    actual_strokes,
    as_built_tips,
    draw_twin,
    settle,
    settled_tips,
)
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.joint_forces import joint_forces, pins_of
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import tips
from flexik.planar.samples import random_samples

PINS = pins_of(crane_case.crane().machine)
NONE = dict.fromkeys(PINS, 0.0)
ZERO = crane_case.magnitudes(*[0.0] * 8)
USUAL = crane_case.magnitudes(1e-3, 1e-3, 3e-4, 0.3, 1e-3, 3e-4, 0.03, 0.05)
# the jib cylinder pulls the jib of the first pose in, and pushes that of the second out
PULLED, PUSHED = np.array([0.1, 0.1, 0.6]), np.array([0.1, 0.75, 0.4])


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane()


@pytest.fixture(scope="module")
def samples():
    return random_samples(crane_case.MACHINE, 12, (0.0, 400.0), 0.5, seed=5)


def with_play(crane, **play):
    return AsBuilt(crane, NONE | play, np.zeros(3), 0.0)


def forces(crane, strokes, payload, play=NONE):
    model = PlanarModel.placed(crane, np.asarray(strokes, dtype=float))
    settle(play, model, payload)
    return model.pin_forces(PINS)


def test_a_twin_of_no_errors_is_the_nominal_crane(crane, samples):
    strokes = np.vstack([samples.values, np.repeat(samples.values[:1], 3, axis=0)])
    payload = np.append(samples.payload, [0.0, 86.0, 172.0])
    twin = draw_twin(crane, ZERO, seed=3)
    found = as_built_tips(twin, strokes, payload, np.random.default_rng(1))
    assert found == pytest.approx(tips(crane, strokes, payload), abs=1e-7)


@pytest.mark.parametrize(
    ("part", "changed"),
    [
        ("pivot", "points"),
        ("length", "retracted"),
        ("play", "play"),
        ("stroke_offset", "stroke_offset"),
        ("repeatability", "repeatability"),
        ("section", "stiffness_factor"),
        ("spring", "springs"),
    ],
)
def test_each_magnitude_changes_its_own_part_and_a_seed_draws_it_alike(crane, part, changed):
    def parts(twin):
        machine = twin.machine.machine
        return {
            "points": [body.points for body in machine.bodies.values()],
            "retracted": [machine.drives[name].retracted for name in ("lift", "jib")],
            "stiffness_factor": [beam.stiffness_factor for beam in machine.beams.values()],
            "springs": machine.joints["slew"].springs,
            "play": twin.play,
            "stroke_offset": twin.stroke_offset.tolist(),
            "repeatability": twin.repeatability.tolist(),
        }

    nominal, usual = (parts(draw_twin(crane, size, 8)) for size in (ZERO, USUAL))
    alone = parts(draw_twin(crane, ZERO.model_copy(update={part: getattr(USUAL, part)}), 8))
    assert {name for name in nominal if alone[name] != nominal[name]} == {changed}
    if part != "play":  # its spread is of another part
        assert alone[changed] == usual[changed]


def test_a_seed_gives_one_twin_and_the_sizes_are_those_asked_for(crane):
    first, again, other = (draw_twin(crane, USUAL, seed) for seed in (4, 4, 5))
    assert first.machine.machine == again.machine.machine != other.machine.machine
    assert first.play == again.play != other.play
    twins = [draw_twin(crane, USUAL, seed) for seed in range(300)]
    machines = [twin.machine.machine for twin in twins]
    offsets = [np.subtract(m.located("jib.coupler_pin").point, (-0.095, 0.24)) for m in machines]
    assert np.std(offsets) == pytest.approx(1e-3, rel=0.15)
    assert {m.located("jib.jib_pivot").point for m in machines} == {(0.0, 0.0)}
    assert np.std([m.drives["jib"].retracted for m in machines]) == pytest.approx(1e-3, rel=0.15)
    clearance = np.array([t.play["joints.jib_pivot"] for t in twins])
    assert np.median(clearance) == pytest.approx(3e-4, rel=0.05)
    assert np.std(np.log(clearance)) == pytest.approx(0.3, rel=0.15)
    both = np.median([t.play["drives.jib"] for t in twins])
    assert both == pytest.approx(2 * 3e-4, rel=0.1)
    assert np.std([t.stroke_offset for t in twins]) == pytest.approx(1e-3, rel=0.15)
    springs = [m.joints["slew"].springs.torsion / crane_case.SPRING for m in machines]
    assert np.std(springs) == pytest.approx(0.05, rel=0.15)


def without_gravity(crane):
    return replace(crane, machine=crane.machine.model_copy(update={"gravity": 1e-6}))


def test_unloaded_the_tip_is_that_of_the_rigid_crane_with_the_same_errors(crane, samples):
    twin = draw_twin(crane, USUAL.model_copy(update={"play": 0.0}), seed=2).machine
    geometry = crane_geometry(twin.machine)
    found = tips(without_gravity(twin), samples.values, samples.payload)
    # the tip lies off the line of sliding too
    assert twin.machine.located("extension.tip").point[1] != 0.0
    assert found == pytest.approx(forward(geometry, samples.values), abs=1e-8)


@pytest.mark.parametrize("name", ["excavator", "concrete_pump"])
def test_any_machine_has_a_twin(name):
    flexible = FlexibleMachine(read_machine(FILES[name]))
    lower, upper = flexible.linkage.lower, flexible.linkage.upper
    values = np.random.default_rng(3).uniform(lower, upper, (6, len(lower)))
    payload = np.full(6, 100.0)
    twin = draw_twin(flexible, USUAL, seed=1)
    nominal = as_built_tips(draw_twin(flexible, ZERO, seed=1), values, payload)
    assert nominal == pytest.approx(tips(flexible, values, payload), abs=1e-7)
    off = np.linalg.norm(as_built_tips(twin, values, payload) - nominal, axis=1)
    assert (off > 1e-4).all() and (off < 0.2).all()


def test_stroke_offsets_are_shifted_strokes(crane, samples):
    offset = np.array([1e-3, -2e-3, 5e-4])
    twin = AsBuilt(crane, NONE, offset, 3e-4)
    found = as_built_tips(twin, samples.values, samples.payload)
    expected = tips(crane, samples.values + offset, samples.payload)
    assert found == pytest.approx(expected, abs=1e-7)


def test_repeatability_is_drawn_anew_for_every_row(crane):
    twin = AsBuilt(crane, NONE, np.array([1e-3, 0.0, 0.0]), 3e-4)
    strokes = np.tile(PULLED, (2000, 1))
    first, again = (actual_strokes(twin, strokes, np.random.default_rng(6)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    spread = first - strokes - twin.stroke_offset
    assert np.std(spread, axis=0) == pytest.approx(np.full(3, 3e-4), rel=0.1)
    assert np.abs(np.corrcoef(spread.T) - np.eye(3)).max() < 0.1
    found = as_built_tips(twin, strokes[:2], np.zeros(2), np.random.default_rng(6))
    assert found == pytest.approx(tips(crane, first[:2], np.zeros(2)), abs=1e-7)


@pytest.mark.parametrize("drive", ["jib", "lift"])
def test_play_of_a_cylinder_is_a_stroke_that_follows_its_force(crane, drive):
    strokes, payload = np.array([PULLED, PUSHED]), np.array([50.0, 50.0])
    tension = [forces(crane, row, 50.0)[f"drives.{drive}"][0] for row in strokes]
    signs = np.sign(tension)
    assert signs.tolist() == ([1.0, -1.0] if drive == "jib" else [-1.0, -1.0])
    found = settled_tips(with_play(crane, **{f"drives.{drive}": 8e-4}), strokes, payload)
    longer = np.outer(signs * 8e-4, np.eye(3)[["lift", "jib"].index(drive)])
    assert found == pytest.approx(tips(crane, strokes + longer, payload), abs=1e-6)
    assert np.linalg.norm(found - tips(crane, strokes, payload), axis=1).min() > 1e-3


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
def test_forces_are_nearly_those_of_the_rigid_crane(crane, samples, element):
    crane = crane_case.upright(crane, element)
    loads = -9.81 * samples.payload[:, None] * [0.0, 1.0]
    expected = joint_forces(crane.machine, crane.linkage.poses(samples.values), loads)
    for k, (strokes, payload) in enumerate(zip(samples.values, samples.payload, strict=True)):
        found = forces(crane, strokes, payload)
        largest = max(np.abs(force).max() for force in found.values())
        for key, force in found.items():
            assert force == pytest.approx(expected[key][k], abs=0.02 * largest), key


def rigid_with_play(geometry, strokes, play, found):
    """Rigid tip with cylinders longer by their play and outer bodies along the forces on pins."""

    def moved(pin):
        force = found[f"joints.{pin}"]
        return play[f"joints.{pin}"] / np.linalg.norm(force) * force

    p = pose(geometry, strokes)
    head, pivot = p.rocker_head[0], p.rocker_pivot[0]
    # where F, H and I come to lie by the play of their pins, to first order along the rods
    to_head, to_pin = head - pivot, p.coupler_pin[0] - head
    rocker = moved("rocker_pivot") @ to_head / np.linalg.norm(to_head)
    coupler = (moved("rocker_head") + moved("coupler_pin")) @ to_pin / np.linalg.norm(to_pin)
    at_b, at_g = moved("lift_pivot"), rotate(-p.lift_angle, moved("jib_pivot")[None])[0]
    changed = {
        "lift_pivot": geometry.lift_pivot + at_b,
        "jib_pivot": geometry.jib_pivot + at_g,
    }
    changed = {name: tuple(point) for name, point in changed.items()}
    changed |= {
        "rocker_length": geometry.rocker_length + rocker,
        "coupler_length": geometry.coupler_length + coupler,
    }
    for name in ("lift", "jib"):
        longer = np.sign(found[f"drives.{name}"][0]) * play[f"drives.{name}"]
        changed[f"{name}_cylinder_length"] = getattr(geometry, f"{name}_cylinder_length") + longer
    return forward(replace(geometry, **changed), strokes)[0]


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
@pytest.mark.parametrize(
    "pins", [tuple(PINS), *((f"joints.{p}",) for p in ("lift_pivot", "jib_pivot", "rocker_head"))]
)
def test_play_moves_the_tip_as_rigid_kinematics_say(crane, samples, element, pins):
    crane = crane_case.upright(crane, element)
    play = NONE | dict.fromkeys(pins, 4e-4)
    rows = slice(0, 5)
    strokes, payload = samples.values[rows], samples.payload[rows]
    found = settled_tips(with_play(crane, **play), strokes, payload) - tips(crane, strokes, payload)
    for row, mass, moved in zip(strokes, payload, found, strict=True):
        expected = rigid_with_play(crane.geometry, row, play, forces(crane, row, mass))
        expected = expected - forward(crane.geometry, row)[0]
        assert np.linalg.norm(moved - expected) < 0.03 * np.linalg.norm(expected) + 1e-5


def free_stroke(crane, strokes, payload):
    """Jib stroke in m, at the others of `strokes`, that leaves the jib cylinder without force."""
    low, high = 0.0, 0.78
    for _ in range(50):
        middle = (low + high) / 2
        (tension,) = forces(crane, [strokes[0], middle, strokes[2]], payload)["drives.jib"]
        low, high = (middle, high) if tension > 0 else (low, middle)
    return middle


def test_a_cylinder_within_its_play_of_force_free_hangs_where_it_is_free(crane):
    free = free_stroke(crane, PULLED, 86.0)
    twin = with_play(crane, **{"drives.jib": 3e-4})
    nominal = np.array([PULLED[0], free, PULLED[2]])
    at = tips(crane, nominal[None], np.array([86.0]))[0]
    for share in (-0.7, 0.0, 0.4):
        row = nominal + share * 3e-4 * np.eye(3)[1]
        assert settled_tips(twin, row[None], np.array([86.0]))[0] == pytest.approx(at, abs=2e-5)
        assert abs(forces(crane, row, 86.0, twin.play)["drives.jib"][0]) < 1.0
    for share, taken in ((-3.0, -2.0), (3.0, 2.0)):
        rows = nominal + np.array([[0.0, share * 3e-4, 0.0], [0.0, taken * 3e-4, 0.0]])
        found = settled_tips(twin, rows[:1], np.array([86.0]))
        assert found == pytest.approx(tips(crane, rows[1:], np.array([86.0])), abs=1e-6)


def test_every_pin_ends_on_the_side_of_its_force(crane, monkeypatch):
    # also at the strokes at which jib cylinder, rocker and coupler turn from pulled to pushed
    play = dict(zip(PINS, np.linspace(2e-4, 4e-4, len(PINS)), strict=True))
    seats, seat = {}, PlanarModel.seat
    monkeypatch.setattr(PlanarModel, "seat", lambda m, given: (seats.update(given), seat(m, given)))
    free = free_stroke(crane, PULLED, 86.0)
    near = free + np.arange(-4e-3, 4e-3, 1e-4)
    hanging, steps = 0, []
    for row in np.column_stack([np.full(80, PULLED[0]), near, np.full(80, PULLED[2])]):
        model = PlanarModel.placed(crane, row)
        settle(play, model, 86.0)
        steps.append(model.tip())
        for name, force in model.pin_forces(PINS).items():
            size = np.linalg.norm(force)
            if size < 1.0:
                hanging += 1
                assert np.linalg.norm(seats[name]) <= play[name]
            else:
                assert seats[name] == pytest.approx(play[name] / size * force, abs=2e-6)
    assert hanging
    # nothing jumps: at most a rod hangs while another moves
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() < 1.5e-3


def test_statics_tell_the_seats_but_for_micrometres(crane, samples, monkeypatch):
    twin = draw_twin(crane, USUAL.model_copy(update={"play": 6e-5}), seed=9)
    strokes, payload = samples.values, samples.payload / 4
    solve, solved = PlanarModel.solve, []
    monkeypatch.setattr(PlanarModel, "solve", lambda *given: (solved.append(1), solve(*given)))
    found = settled_tips(twin, strokes, payload)
    n = len(solved)
    monkeypatch.setattr(as_built, "CERTAIN", np.inf)
    assert found == pytest.approx(settled_tips(twin, strokes, payload), abs=2e-5)
    assert n < 0.75 * (len(solved) - n)


def test_a_model_placed_anew_has_its_pins_in_the_middle(crane):
    model = PlanarModel.placed(crane, PULLED)
    settle(dict.fromkeys(PINS, 1e-3), model, 86.0)
    for strokes in (PULLED, PULLED + 0.1 * np.eye(3)[0]):
        model.place(strokes, crane.linkage.poses(strokes[None])[0])
        model.solve(86.0)
        expected = tips(crane, strokes[None], np.array([86.0]))
        assert model.tip() == pytest.approx(expected[0], abs=1e-7)


def test_pins_that_do_not_settle_are_an_error(crane, monkeypatch):
    monkeypatch.setattr(as_built, "PASSES", 1)
    # where rigid statics leave no doubt, one equilibrium does
    monkeypatch.setattr(as_built, "CERTAIN", np.inf)
    twin = with_play(crane, **{"joints.jib_pivot": 3e-4})
    with pytest.raises(
        SolverError, match=r"play does not settle with 86 kg at lift 0\.1, jib 0\.1"
    ):
        settled_tips(twin, PULLED[None], np.array([86.0]))


def test_rows_do_not_depend_on_each_other(crane, samples):
    twin = draw_twin(crane, USUAL, seed=9)
    strokes, payload = samples.values, samples.payload
    together = as_built_tips(twin, strokes, payload)
    back = as_built_tips(twin, strokes[::-1], payload[::-1])
    assert together == pytest.approx(back[::-1], abs=1e-7)
    alone = [
        as_built_tips(twin, row[None], mass) for row, mass in zip(strokes, payload, strict=True)
    ]
    assert together == pytest.approx(np.vstack(alone), abs=1e-7)
    # rows of equal strokes start from one another
    twice = as_built_tips(twin, np.repeat(strokes[:3], 2, axis=0), np.tile([0.0, 172.0], 3))
    loaded = as_built_tips(twin, strokes[:3], np.full(3, 172.0))
    assert twice[1::2] == pytest.approx(loaded, abs=1e-6)


def test_without_gravity_no_pin_moves(crane):
    found = settled_tips(
        with_play(without_gravity(crane), **dict.fromkeys(PINS, 1e-3)), PULLED[None], np.zeros(1)
    )
    assert found == pytest.approx(forward(crane.geometry, PULLED), abs=1e-8)


@pytest.mark.parametrize(("name", "size"), [("play", -1e-3), ("section", np.nan)])
def test_impossible_magnitudes_are_refused(name, size):
    with pytest.raises(ValidationError, match=name):
        Magnitudes(**USUAL.model_dump() | {name: size})


def test_impossible_cranes_and_rows_are_named(crane):
    with pytest.raises(
        ParameterError, match=r"as-built machine of seed 1: the linkage does not close at lift 0"
    ):
        draw_twin(crane, USUAL.model_copy(update={"length": 0.4}), seed=1)
    with pytest.raises(SolverError, match=r"cannot be assembled at lift 0\.1, jib 3"):
        as_built_tips(with_play(crane), np.array([[0.1, 3.0, 1.0]]), np.array([100.0]))
