"""Play and spring against other calculations; identification on stand-ins known exactly."""

from dataclasses import replace

import numpy as np
import pytest
from smoke_pipeline import ROOT

from flexik.errors import ParameterError
from flexik.kinematics.crane import forward, inverse_with_smallest_extension, pose
from flexik.kinematics.status import REACHED
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import equilibrium, tips
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.combined import Combined
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane_measured.adapted import (
    DIMENSIONS,
    OFFSETS,
    PLAYS,
    AdaptationSettings,
    Adapted,
    CorrectedDeflection,
    Measurements,
    Offsets,
    corrected,
    identify,
)
from flexik.positioning.crane_measured.joint_play import JOINTS, compliance, joint_forces
from flexik.positioning.method import PositioningError

SETTINGS = AdaptationSettings(
    measurement=0.5e-3,
    repeatability=0.1e-3,
    pivot=1e-3,
    length=1e-3,
    stroke_offset=1e-3,
    play=0.3e-3,
    play_deviation=0.1e-3,
    section=0.05,
    spring=0.1,
)
POSES = np.array([[0.1, 0.1, 0.0], [0.3, 0.3, 0.5], [0.2, 0.5, 1.2], [0.45, 0.6, 0.3]])
LOADS = np.array([0.0, 86.0, 172.0, 470.0])


@pytest.fixture(scope="module")
def crane():
    return flexible_crane(load_parameters(ROOT / "params.yaml").crane, 8.45e6)


class Sag:
    """Smooth deflection of about 10 mm at 172 kg; stands for the network."""

    def __init__(self, geometry):
        self.geometry = geometry

    def predict(self, values):
        """Deflection, as a network gives it."""
        x, y = forward(self.geometry, values[:, :3]).T
        load = 0.005 + 0.005 * values[:, 3] / 172
        return load[:, None] * np.column_stack([0.3 * y - 0.2, -0.2 * np.abs(x) ** 1.5])


@pytest.fixture(scope="module")
def network(crane):
    return Sag(crane.geometry)


def drawn_offsets(seed, size=1.0):
    """Offsets as the settings expect them."""
    generator = np.random.default_rng(seed)
    deviation = dict.fromkeys(DIMENSIONS, SETTINGS.pivot)
    deviation |= dict.fromkeys(PLAYS, SETTINGS.play_deviation)
    deviation |= {"deflection": SETTINGS.section, "spring": SETTINGS.spring}
    values = {name: size * generator.normal(0.0, deviation[name]) for name in OFFSETS}
    for name in PLAYS:
        values[name] += SETTINGS.play
    return Offsets(values)


def tips_with(crane, network, offsets, strokes, payload):
    """Tips of the stand-in: another geometry, another deflection, joint play."""
    added = CorrectedDeflection(crane, network, offsets).predict(
        np.column_stack([strokes, payload])
    )
    return forward(offsets.geometry(crane.geometry), strokes) + added


def area(crane, generator, n):
    """Targets and payloads in the measured area that the rigid crane reaches."""
    targets = generator.uniform([1.5, -1.5], [5.0, 3.5], (4 * n, 2))
    reached = inverse_with_smallest_extension(crane.geometry, targets).reached
    return targets[reached][:n], generator.uniform(0.0, 172.0, n)


def measured(crane, network, offsets, generator, n):
    targets, payload = area(crane, generator, n)
    command = Combined(closed_form(crane.geometry), network)(targets, payload, np.zeros((n, 3)))
    tip = tips_with(crane, network, offsets, command.strokes, payload)
    return Measurements(
        command.strokes, payload, tip + generator.normal(0.0, SETTINGS.measurement, (n, 2))
    )


def mean_error(method, crane, network, offsets, generator):
    targets, payload = area(crane, generator, 100)
    command = method(targets, payload, np.zeros((100, 3)))
    assert (command.status == REACHED).all()
    reached = tips_with(crane, network, offsets, command.strokes, payload)
    return np.linalg.norm(reached - targets, axis=1).mean()


def test_joint_forces_are_those_of_the_flexible_crane(crane):
    gravity = crane.structure.gravity
    down = np.array([0.0, -1.0])
    forces = joint_forces(crane, POSES, gravity * LOADS[:, None] * down, gravity)
    for k, (strokes, payload) in enumerate(zip(POSES, LOADS, strict=True)):
        found = equilibrium(crane, strokes, payload)
        # the flexible crane hangs lower, by a few centimetres in metres
        for name in ("lift_cylinder", "jib_cylinder", "rocker", "coupler"):
            force = found.forces[name]
            assert forces.joints[name][k, 0] == pytest.approx(force, rel=0.03, abs=100.0), name
        assert forces.moment[k] == pytest.approx(-found.reaction[2], rel=0.03)


@pytest.mark.parametrize(
    ("joint", "dimension"),
    [
        ("lift_cylinder", "lift_cylinder_length"),
        ("jib_cylinder", "jib_cylinder_length"),
        ("rocker", "rocker_length"),
        ("coupler", "coupler_length"),
    ],
)
def test_play_of_a_rod_is_a_change_of_its_length(crane, joint, dimension):
    gap = 1e-6
    change = np.where(np.array(DIMENSIONS) == dimension, gap, 0.0)
    longer = forward(corrected(crane.geometry, change), POSES)
    shorter = forward(corrected(crane.geometry, -change), POSES)
    gravity = crane.structure.gravity
    loads = gravity * LOADS[:, None] * np.array([0.0, -1.0])
    tension = np.sign(joint_forces(crane, POSES, loads, gravity).joints[joint])
    expected = JOINTS[joint] * tension * (longer - shorter) / (2 * gap)
    found = compliance(crane, POSES, LOADS).play[:, :, list(JOINTS).index(joint)]
    assert found == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("joint", ["jib_pivot", "lift_pivot"])
def test_play_of_a_pivot_shifts_it_against_the_force_that_carries(crane, joint):
    gap = 1e-6
    gravity = crane.structure.gravity
    loads = gravity * LOADS[:, None] * np.array([0.0, -1.0])
    force = joint_forces(crane, POSES, loads, gravity).joints[joint]
    shift = -gap * force / np.linalg.norm(force, axis=1, keepdims=True)
    found = compliance(crane, POSES, LOADS).play[:, :, list(JOINTS).index(joint)]
    for k, strokes in enumerate(POSES):
        geometry = crane.geometry
        if joint == "jib_pivot":  # G moves in the lift frame, F stays
            angle = pose(geometry, strokes[None]).lift_angle[0]
            c, s = np.cos(angle), np.sin(angle)
            moved = np.array([[c, s], [-s, c]]) @ shift[k]
            changed = {
                "jib_pivot": tuple(geometry.jib_pivot + moved),
                "rocker_pivot": tuple(geometry.rocker_pivot - moved),
            }
        else:  # B moves, C stays
            changed = {
                "lift_pivot": tuple(geometry.lift_pivot + shift[k]),
                "lift_cylinder_base": tuple(geometry.lift_cylinder_base - shift[k]),
            }
        tip = forward(replace(geometry, **changed), strokes[None])
        expected = (tip - forward(geometry, strokes[None]))[0] / gap
        assert found[k] == pytest.approx(expected, abs=1e-4)


def test_a_softer_spring_gives_way_as_the_flexible_crane_does(crane):
    softer = replace(crane, spring_stiffness=crane.spring_stiffness / 1.1)
    expected = tips(softer, POSES, LOADS) - tips(crane, POSES, LOADS)
    # its share is a tenth of the spring's, and the crane hangs a little lower than the rigid one
    found = 0.1 * compliance(crane, POSES, LOADS).spring
    assert found == pytest.approx(expected, rel=0.05, abs=2e-6)


def test_factors_scale_deflection_and_spring(crane, network):
    values = dict.fromkeys(OFFSETS, 0.0) | {"deflection": 0.05, "spring": -0.2}
    inputs = np.column_stack([POSES, LOADS])
    found = CorrectedDeflection(crane, network, Offsets(values)).predict(inputs)
    spring = compliance(crane, POSES, LOADS).spring
    assert found == pytest.approx(1.05 * network.predict(inputs) - 0.2 * spring, abs=1e-15)


def test_true_offsets_put_the_tip_on_the_target(crane, network):
    offsets = drawn_offsets(1)
    tight = Offsets({n: 0.0 if n in PLAYS else v for n, v in offsets.values.items()})
    method = Adapted(crane, network, tight, n_corrections=6)
    assert mean_error(method, crane, network, tight, np.random.default_rng(1)) < 1e-6
    # with play a few targets lie in the gap where a joint's force changes its sign
    method = Adapted(crane, network, offsets, n_corrections=6)
    assert mean_error(method, crane, network, offsets, np.random.default_rng(1)) < 1e-4


def test_expected_offsets_measured_without_error_stay(crane, network):
    values = {name: SETTINGS.play if name in PLAYS else 0.0 for name in OFFSETS}
    expected = Offsets(values)
    exact = replace(SETTINGS, measurement=1e-9)
    points = measured(crane, network, expected, np.random.default_rng(2), 9)
    tip = tips_with(crane, network, expected, points.strokes, points.payload)
    found = identify(crane, network, Measurements(points.strokes, points.payload, tip), exact)
    assert found.values == pytest.approx(values, abs=1e-9)


def test_identified_offsets_are_the_most_probable(crane, network):
    truth = drawn_offsets(4)
    points = measured(crane, network, truth, np.random.default_rng(4), 9)
    settings = replace(SETTINGS, repeatability=0.0)
    found = identify(crane, network, points, settings)
    deviation = identify(crane, network, points, replace(settings, measurement=1e6)).deviations
    values = np.array([found.values[name] for name in OFFSETS])
    scale = np.array([deviation[name] for name in OFFSETS])  # nothing measured: the prior

    def cost(changed):
        offsets = Offsets(dict(zip(OFFSETS, changed, strict=True)))
        missed = points.tip - tips_with(crane, network, offsets, points.strokes, points.payload)
        expected = np.array([SETTINGS.play if name in PLAYS else 0.0 for name in OFFSETS])
        prior = np.sum(((changed - expected) / scale) ** 2)
        return np.sum((missed / SETTINGS.measurement) ** 2) + prior

    # the cost has its minimum here along any line, to a hundredth of a standard deviation
    for direction in np.random.default_rng(4).normal(size=(20, len(OFFSETS))):
        step = 0.01 * scale * direction / np.linalg.norm(direction)
        before, here, after = (cost(values + k * step) for k in (-1, 0, 1))
        assert here < before
        assert here < after


def test_a_row_whose_joint_forces_nearly_vanish_does_not_spoil_the_others(crane, network):
    # row 2 has 28 N in the jib cylinder, but -140 N by the nominal crane: its play lies otherwise
    truth = drawn_offsets(3)
    points = measured(crane, network, truth, np.random.default_rng(3), 9)
    loads = crane.structure.gravity * points.payload[:, None] * np.array([0.0, -1.0])
    true_crane = replace(crane, geometry=truth.geometry(crane.geometry))
    nominal, true = (
        joint_forces(c, points.strokes, loads, crane.structure.gravity).joints["jib_cylinder"][:, 0]
        for c in (crane, true_crane)
    )
    assert np.flatnonzero(np.sign(nominal) != np.sign(true)) == [2]
    found = identify(crane, network, points, replace(SETTINGS, repeatability=0.0))
    modelled = tips_with(crane, network, found, points.strokes, points.payload)
    missed = np.linalg.norm(points.tip - modelled, axis=1)
    assert np.delete(missed, 2).max() < 3 * SETTINGS.measurement


def test_more_measurements_leave_less_doubt(crane, network):
    points = measured(crane, network, drawn_offsets(5), np.random.default_rng(5), 30)
    few = Measurements(points.strokes[:5], points.payload[:5], points.tip[:5])
    less, more = (identify(crane, network, m, SETTINGS).deviations for m in (few, points))
    assert all(0.0 < more[name] <= less[name] * (1 + 1e-6) for name in OFFSETS)
    assert less["lift_cylinder_length"] < 0.8 * np.hypot(SETTINGS.length, SETTINGS.stroke_offset)


def test_few_measurements_help_and_more_help_further(crane, network):
    baseline = Combined(closed_form(crane.geometry), network)
    errors = {n: [] for n in (0, 3, 9, 30)}
    for seed in range(5):
        truth = drawn_offsets(seed + 10)
        points = measured(crane, network, truth, np.random.default_rng(seed), 30)
        for n, found in errors.items():
            method = baseline
            if n:
                some = Measurements(points.strokes[:n], points.payload[:n], points.tip[:n])
                method = Adapted(crane, network, identify(crane, network, some, SETTINGS))
            judge = np.random.default_rng(seed + 100)
            found.append(mean_error(method, crane, network, truth, judge))
    means = {n: np.mean(found) for n, found in errors.items()}
    assert means[30] < means[9] < means[3] < means[0]
    assert means[9] < means[0] / 2
    assert means[30] < 2e-3


class Exact:
    """Deflection of the flexible model itself; stands for a perfect network."""

    def __init__(self, crane):
        self.crane = crane

    def predict(self, values):
        """Deflection, as a network gives it."""
        strokes, payload = values[:, :3], values[:, 3]
        return tips(self.crane, strokes, payload) - forward(self.crane.geometry, strokes)


def test_few_measurements_of_an_as_built_crane_halve_the_error(crane):
    magnitudes = Magnitudes(0.5e-3, 0.5e-3, 0.1e-3, 0.3, 0.5e-3, 0.05e-3, 0.05, 0.1)
    expected = AdaptationSettings(
        0.5e-3, 0.05e-3, 0.5e-3, 0.5e-3, 0.5e-3, 0.1e-3, 0.03e-3, 0.05, 0.1
    )
    network, errors = Exact(crane), []
    baseline = Combined(closed_form(crane.geometry), network)
    for seed in range(3):
        generator = np.random.default_rng(seed)
        twin = draw_twin(crane, magnitudes, seed)
        targets, payload = area(crane, generator, 9)
        strokes = baseline(targets, payload, np.zeros((9, 3))).strokes
        tip = as_built_tips(twin, strokes, payload, generator)
        tip += generator.normal(0.0, 0.5e-3, tip.shape)
        found = identify(crane, network, Measurements(strokes, payload, tip), expected)
        targets, payload = area(crane, generator, 30)
        for method in (baseline, Adapted(crane, network, found)):
            command = method(targets, payload, np.zeros((30, 3)))
            assert (command.status == REACHED).all()
            reached = as_built_tips(twin, command.strokes, payload)
            errors.append(np.linalg.norm(reached - targets, axis=1).mean())
    without, adapted = np.reshape(errors, (3, 2)).mean(axis=0)
    assert without > 8e-3
    assert adapted < 0.3 * without


def test_same_measurements_give_the_same_offsets_in_any_order(crane, network):
    points = measured(crane, network, drawn_offsets(6), np.random.default_rng(6), 6)
    turned = Measurements(points.strokes[::-1], points.payload[::-1], points.tip[::-1])
    first, second = (identify(crane, network, m, SETTINGS).values for m in (points, turned))
    assert second == pytest.approx(first, abs=1e-9)


def test_too_few_measurements_are_refused():
    with pytest.raises(PositioningError, match="2 rows, expected 3 or more"):
        Measurements(POSES[:2], LOADS[:2], POSES[:2, :2])


@pytest.mark.parametrize("name", ["strokes", "payload", "tip"])
def test_measurements_that_are_not_finite_name_their_row(name):
    given = {"strokes": POSES.copy(), "payload": LOADS.copy(), "tip": POSES[:, :2].copy()}
    given[name][2] = np.nan
    with pytest.raises(PositioningError, match=f"measured {name}: sample 2 is not finite"):
        Measurements(**given)


def test_measurements_that_do_not_fit_together_are_refused():
    with pytest.raises(PositioningError, match=r"measured tip: expected shape \(4, 2\)"):
        Measurements(POSES, LOADS, POSES[:3, :2])


def test_strokes_that_no_crane_can_take_name_their_row(crane, network):
    strokes = POSES.copy()
    strokes[1, 0] = 5.0
    with pytest.raises(PositioningError, match="sample 1: the linkage does not close"):
        identify(crane, network, Measurements(strokes, LOADS, POSES[:, :2]), SETTINGS)


def test_measurements_at_the_stroke_limits_are_taken(crane, network):
    low, high = np.zeros(3), np.array(crane.geometry.stroke_maximum)
    strokes = np.array([low, high, [low[0], high[1], 0.5], [high[0], low[1], 0.5]])
    truth = drawn_offsets(8)
    tip = tips_with(crane, network, truth, strokes, LOADS)
    found = identify(crane, network, Measurements(strokes, LOADS, tip), SETTINGS)
    for offsets, least, most in ((drawn_offsets(8, 0.0), 5e-3, np.inf), (found, 0.0, 2e-3)):
        missed = np.linalg.norm(tip - tips_with(crane, network, offsets, strokes, LOADS), axis=1)
        # the last row, stretched to its full length with the lift cylinder out, weighs little
        assert least < missed[:3].max() < most


@pytest.mark.parametrize(
    ("name", "value"), [("pivot", 0.0), ("section", -0.1), ("play", -1e-4), ("measurement", np.nan)]
)
def test_settings_out_of_range_are_refused(name, value):
    with pytest.raises(ParameterError, match=f"adaptation: {name}="):
        replace(SETTINGS, **{name: value})


def test_unreachable_targets_keep_their_strokes_and_say_so(crane, network):
    initial = np.array([[0.1, 0.2, 0.3]])
    method = Adapted(crane, network, drawn_offsets(7))
    command = method(np.array([[20.0, 0.0]]), np.array([86.0]), initial)
    assert command.status[0] != REACHED
    assert (command.strokes == initial).all()
