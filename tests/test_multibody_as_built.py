"""The as-built crane against the nominal one, shifted strokes, and statics of the rigid crane."""

from dataclasses import replace

import crane_case
import numpy as np
import pytest
from pydantic import ValidationError

from flexik.cases.crane.parts.samples import random_samples
from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import forward, pose, rotate
from flexik.machines.crane import Magnitudes
from flexik.multibody.crane import as_built
from flexik.multibody.crane.as_built import (
    ENDS,
    PINS,
    AsBuiltCrane,
    actual_strokes,
    as_built_tips,
    draw_twin,
    settle,
    settled_tips,
)
from flexik.multibody.crane.model import RODS, CraneModel, tips

SPRING = crane_case.SPRING
NONE = dict.fromkeys(PINS, 0.0)
ZERO = crane_case.magnitudes(*[0.0] * 8)
USUAL = crane_case.magnitudes(1e-3, 1e-3, 3e-4, 0.3, 1e-3, 3e-4, 0.03, 0.05)
# the jib cylinder pulls the jib of the first pose in, and pushes that of the second out
PULLED, PUSHED = np.array([0.1, 0.1, 0.6]), np.array([0.1, 0.75, 0.4])


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane()


@pytest.fixture(scope="module")
def samples(geometry):
    return random_samples(geometry, 12, (0.0, 400.0), 0.5, seed=5)


def with_play(crane, **play):
    return AsBuiltCrane(crane, NONE | play, np.zeros(3), 0.0)


def forces(crane, strokes, payload, play=NONE):
    model = CraneModel(crane, float(strokes[2]))
    model.place(np.asarray(strokes))
    settle(play, model, payload)
    return model.pin_forces()


def test_a_twin_of_no_errors_is_the_nominal_crane(crane, samples):
    strokes = np.vstack([samples.strokes, np.repeat(samples.strokes[:1], 3, axis=0)])
    payload = np.append(samples.payload, [0.0, 86.0, 172.0])
    twin = draw_twin(crane, ZERO, seed=3)
    found = as_built_tips(twin, strokes, payload, np.random.default_rng(1))
    np.testing.assert_array_equal(found, tips(crane, strokes, payload))


@pytest.mark.parametrize(
    ("part", "changed"),
    [
        ("pivot", {"geometry", "structure"}),
        ("length", {"geometry"}),
        ("play", {"play"}),
        ("stroke_offset", {"stroke_offset"}),
        ("repeatability", {"repeatability"}),
        ("section", {"structure"}),
        ("spring", {"spring"}),
    ],
)
def test_each_magnitude_changes_its_own_part_and_a_seed_draws_it_alike(crane, part, changed):
    def parts(twin):
        structure = twin.crane.structure
        spans = [getattr(structure, beam).span for beam in ("pillar", "lift", "jib", "extension")]
        moments = [b.section.second_moment.tolist() for b in (structure.pillar, structure.jib)]
        return {
            "geometry": twin.crane.geometry,
            "structure": (spans, moments),
            "play": twin.play,
            "stroke_offset": twin.stroke_offset.tolist(),
            "repeatability": twin.repeatability,
            "spring": twin.crane.spring_stiffness,
        }

    nominal, usual = (parts(draw_twin(crane, size, 8)) for size in (ZERO, USUAL))
    alone = parts(draw_twin(crane, ZERO.model_copy(update={part: getattr(USUAL, part)}), 8))
    assert {name for name in nominal if alone[name] != nominal[name]} == changed
    if part not in ("pivot", "length", "section", "play"):  # the others share a part with one
        assert all(alone[name] == usual[name] for name in changed)


def test_a_seed_gives_one_twin_and_the_sizes_are_those_asked_for(crane):
    first, again, other = (draw_twin(crane, USUAL, seed) for seed in (4, 4, 5))
    assert first.crane.geometry == again.crane.geometry != other.crane.geometry
    assert first.play == again.play != other.play
    twins = [draw_twin(crane, USUAL, seed) for seed in range(300)]
    offsets = [np.subtract(t.crane.geometry.coupler_pin, (-0.095, 0.24)) for t in twins]
    assert np.std(offsets) == pytest.approx(1e-3, rel=0.15)
    lengths = [t.crane.geometry.rocker_length - 0.45 for t in twins]
    assert np.std(lengths) == pytest.approx(1e-3, rel=0.15)
    clearance = np.array([list(t.play.values()) for t in twins])
    assert np.median(clearance) == pytest.approx(3e-4, rel=0.05)
    assert np.std(np.log(clearance)) == pytest.approx(0.3, rel=0.1)
    assert np.std([t.stroke_offset for t in twins]) == pytest.approx(1e-3, rel=0.15)
    springs = [t.crane.spring_stiffness / SPRING for t in twins]
    assert np.std(springs) == pytest.approx(0.05, rel=0.15)


def test_beams_follow_the_pivots(crane, samples):
    # unloaded, the tip is that of the rigid crane with the same errors
    twin = draw_twin(crane, USUAL.model_copy(update={"play": 0.0}), seed=2).crane
    assert twin.structure.pillar.span[1] == twin.geometry.lift_pivot[1]
    assert twin.structure.lift.span[1] == twin.geometry.jib_pivot[0]
    light = replace(twin, structure=replace(twin.structure, gravity=1e-9))
    found = tips(light, samples.strokes, samples.payload)
    assert found == pytest.approx(forward(twin.geometry, samples.strokes), abs=1e-8)


def test_stroke_offsets_are_shifted_strokes(crane, samples):
    offset = np.array([1e-3, -2e-3, 5e-4])
    twin = AsBuiltCrane(crane, NONE, offset, 3e-4)
    found = as_built_tips(twin, samples.strokes, samples.payload)
    np.testing.assert_array_equal(found, tips(crane, samples.strokes + offset, samples.payload))


def test_repeatability_is_drawn_anew_for_every_row(crane):
    twin = AsBuiltCrane(crane, NONE, np.array([1e-3, 0.0, 0.0]), 3e-4)
    strokes = np.tile(PULLED, (2000, 1))
    first, again = (actual_strokes(twin, strokes, np.random.default_rng(6)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    spread = first - strokes - twin.stroke_offset
    assert np.std(spread, axis=0) == pytest.approx(np.full(3, 3e-4), rel=0.1)
    assert np.abs(np.corrcoef(spread.T) - np.eye(3)).max() < 0.1
    found = as_built_tips(twin, strokes[:2], np.zeros(2), np.random.default_rng(6))
    np.testing.assert_array_equal(found, tips(crane, first[:2], np.zeros(2)))


@pytest.mark.parametrize("pin", ["jib_cylinder_base", "lift_cylinder_head"])
def test_play_of_a_cylinder_is_a_stroke_that_follows_its_force(crane, pin):
    strokes, payload = np.array([PULLED, PUSHED]), np.array([50.0, 50.0])
    rod = pin[: pin.index("_cylinder")] + "_cylinder"
    tension = np.array([forces(crane, row, 50.0)[0][rod] for row in strokes])
    signs = np.sign(tension)
    assert signs.tolist() == ([1.0, -1.0] if rod == "jib_cylinder" else [-1.0, -1.0])
    found = settled_tips(with_play(crane, **{pin: 8e-4}), strokes, payload)
    longer = np.outer(signs * 8e-4, np.eye(3)[RODS.index(rod)])
    assert found == pytest.approx(tips(crane, strokes + longer, payload), abs=1e-6)
    assert np.linalg.norm(found - tips(crane, strokes, payload), axis=1).min() > 1e-3


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
def test_pivot_forces_balance_cylinder_coupler_and_weights(crane, samples, element):
    crane = replace(crane, element=element)
    structure = crane.structure
    at_i = 7.9 * 0.267 / 0.48
    for strokes, payload in zip(samples.strokes, samples.payload, strict=True):
        rods, pivots = forces(crane, strokes, payload)
        rigid = pose(crane.geometry, strokes)
        outer = structure.jib.mass + structure.extension.mass + payload
        carried = {
            "lift_pivot": structure.lift.mass + outer + 11.52 + 7.9,
            "jib_pivot": outer + at_i,
        }
        pulls = {
            "lift_pivot": ("lift_cylinder", rigid.lift_cylinder_base - rigid.lift_cylinder_head),
            "jib_pivot": ("coupler", rigid.rocker_head - rigid.coupler_pin),
        }
        for name, (rod, pull) in pulls.items():
            weight = np.array([0.0, -9.81 * carried[name]])
            expected = -weight - rods[rod] * pull[0] / np.linalg.norm(pull)
            size = np.linalg.norm(expected) + abs(rods[rod])
            assert pivots[name] == pytest.approx(expected, abs=0.02 * size)


def rigid_with_play(geometry, strokes, play, rods, pivots):
    """Rigid tip with rods longer by their play and the pivots' holes behind their pins."""

    def slack(rod):
        return np.sign(rods[rod]) * sum(play[pin] for pin in ENDS[rod])

    def behind(name):
        return -play[name] * pivots[name] / np.linalg.norm(pivots[name])

    angle = pose(geometry, strokes).lift_angle
    at_b = behind("lift_pivot")
    at_g = rotate(-angle, behind("jib_pivot")[None])[0]
    moved = {
        "lift_pivot": geometry.lift_pivot + at_b,
        "lift_cylinder_base": geometry.lift_cylinder_base - at_b,
        "jib_pivot": geometry.jib_pivot + at_g,
        "rocker_pivot": geometry.rocker_pivot - at_g,
    }
    moved = {name: tuple(point) for name, point in moved.items()}
    moved |= {f"{rod}_length": getattr(geometry, f"{rod}_length") + slack(rod) for rod in RODS}
    return forward(geometry.model_copy(update=moved), strokes)[0]


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
@pytest.mark.parametrize("pins", [PINS, ("lift_pivot",), ("jib_pivot",), ("rocker_head",)])
def test_play_moves_the_tip_as_rigid_kinematics_say(crane, samples, element, pins):
    crane = replace(crane, element=element)
    play = NONE | dict.fromkeys(pins, 4e-4)
    rows = slice(0, 5)
    strokes, payload = samples.strokes[rows], samples.payload[rows]
    found = settled_tips(with_play(crane, **play), strokes, payload) - tips(crane, strokes, payload)
    for row, mass, moved in zip(strokes, payload, found, strict=True):
        rods, pivots = forces(crane, row, mass)
        expected = rigid_with_play(crane.geometry, row, play, rods, pivots)
        expected = expected - forward(crane.geometry, row)[0]
        assert np.linalg.norm(moved - expected) < 0.03 * np.linalg.norm(expected) + 1e-5


def free_stroke(crane, strokes, payload):
    """Jib stroke in m, at the others of `strokes`, that leaves the jib cylinder without force."""
    low, high = 0.0, 0.78
    for _ in range(50):
        middle = (low + high) / 2
        tension = forces(crane, [strokes[0], middle, strokes[2]], payload)[0]["jib_cylinder"]
        low, high = (middle, high) if tension > 0 else (low, middle)
    return middle


def test_a_rod_within_its_play_of_force_free_hangs_where_it_is_free(crane):
    free = free_stroke(crane, PULLED, 86.0)
    twin = with_play(crane, jib_cylinder_base=3e-4, rocker_head=0.0, rocker_pivot=0.0)
    nominal = np.array([PULLED[0], free, PULLED[2]])
    at = tips(crane, nominal[None], np.array([86.0]))[0]
    for share in (-0.7, 0.0, 0.4):
        row = nominal + share * 3e-4 * np.eye(3)[1]
        assert settled_tips(twin, row[None], np.array([86.0]))[0] == pytest.approx(at, abs=2e-5)
        assert abs(forces(crane, row, 86.0, twin.play)[0]["jib_cylinder"]) < 1.0
    for share, taken in ((-3.0, -2.0), (3.0, 2.0)):
        rows = nominal + np.array([[0.0, share * 3e-4, 0.0], [0.0, taken * 3e-4, 0.0]])
        found = settled_tips(twin, rows[:1], np.array([86.0]))
        assert found == pytest.approx(tips(crane, rows[1:], np.array([86.0])), abs=1e-6)


def test_every_pin_ends_on_the_side_of_its_force(crane, samples, monkeypatch):
    # also at the strokes at which jib cylinder, rocker and coupler turn from pulled to pushed
    play = dict(zip(PINS, np.linspace(2e-4, 4e-4, len(PINS)), strict=True))
    seats = {}
    seat = CraneModel.seat
    monkeypatch.setattr(
        CraneModel,
        "seat",
        lambda model, rods, pivots: (seats.update(rods, **pivots), seat(model, rods, pivots)),
    )
    free = free_stroke(crane, PULLED, 86.0)
    near = free + np.arange(-4e-3, 4e-3, 1e-4)
    strokes = np.column_stack([np.full(80, PULLED[0]), near, np.full(80, PULLED[2])])
    model, hanging, steps = CraneModel(crane, PULLED[2]), set(), []
    for row in strokes:
        model.place(row)
        settle(play, model, 86.0)
        steps.append(model.tip())
        rods, pivots = model.pin_forces()
        for name, force in rods.items():
            slack = sum(play[pin] for pin in ENDS[name])
            if abs(force) < 1.0:
                hanging.add(name)
                assert abs(seats[name]) <= slack
            else:
                assert seats[name] == pytest.approx(np.copysign(slack, force), abs=2e-6)
        for name, force in pivots.items():
            behind = -play[name] * force / np.linalg.norm(force)
            assert seats[name] == pytest.approx(behind, abs=2e-6)
    assert hanging == {"jib_cylinder", "rocker", "coupler"}
    # nothing jumps: at most a rod hangs while another moves
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() < 1.5e-3


def test_statics_tell_the_seats_but_for_micrometres(crane, samples, monkeypatch):
    twin = draw_twin(crane, USUAL.model_copy(update={"play": 6e-5}), seed=9)
    strokes, payload = samples.strokes, samples.payload / 4
    solve, solved = CraneModel.solve, []
    monkeypatch.setattr(CraneModel, "solve", lambda *given: (solved.append(1), solve(*given)))
    found = settled_tips(twin, strokes, payload)
    n = len(solved)
    monkeypatch.setattr(as_built, "SIGN_CERTAIN", np.inf)
    assert found == pytest.approx(settled_tips(twin, strokes, payload), abs=2e-5)
    assert n < 0.75 * (len(solved) - n)


def test_a_model_placed_anew_has_its_pins_in_the_middle(crane):
    model = CraneModel(crane, PULLED[2])
    model.place(PULLED)
    settle(dict.fromkeys(PINS, 1e-3), model, 86.0)
    for strokes in (PULLED, PULLED + 0.1 * np.eye(3)[0]):
        model.place(strokes)
        model.solve(86.0)
        expected = tips(crane, strokes[None], np.array([86.0]))
        assert model.tip() == pytest.approx(expected[0], abs=1e-7)


def test_pins_that_do_not_settle_are_an_error(crane, monkeypatch):
    monkeypatch.setattr(as_built, "PASSES", 1)
    # where rigid statics leave no doubt, one equilibrium does
    monkeypatch.setattr(as_built, "SIGN_CERTAIN", np.inf)
    twin = with_play(crane, jib_pivot=3e-4)
    with pytest.raises(SolverError, match=r"play does not settle at strokes \(0.1, 0.1, 0.6\) m"):
        settled_tips(twin, PULLED[None], np.array([86.0]))


def test_rows_do_not_depend_on_each_other(crane, samples):
    twin = draw_twin(crane, USUAL, seed=9)
    strokes, payload = samples.strokes, samples.payload
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
    light = replace(crane, structure=replace(crane.structure, gravity=1e-9))
    found = settled_tips(with_play(light, **dict.fromkeys(PINS, 1e-3)), PULLED[None], np.zeros(1))
    assert found == pytest.approx(forward(crane.geometry, PULLED), abs=1e-8)


@pytest.mark.parametrize(("name", "size"), [("play", -1e-3), ("section", np.nan)])
def test_impossible_magnitudes_are_refused(name, size):
    with pytest.raises(ValidationError, match=name):
        Magnitudes(**USUAL.model_dump() | {name: size})


def test_impossible_cranes_and_rows_are_named(crane):
    with pytest.raises(ParameterError, match=r"as-built crane of seed 1: the linkage"):
        draw_twin(crane, USUAL.model_copy(update={"length": 0.4}), seed=1)
    with pytest.raises(SolverError, match=r"\(0.1, 3, 1\) m: the linkage cannot be assembled"):
        as_built_tips(with_play(crane), np.array([[0.1, 3.0, 1.0]]), np.array([100.0]))
