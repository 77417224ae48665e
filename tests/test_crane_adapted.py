"""Play and spring against other calculations; identification and prediction on known stand-ins."""

from dataclasses import replace

import crane_case
import numpy as np
import pandas as pd
import pytest

from flexik.cases.crane.section import SPRING
from flexik.kinematics.crane import forward, inverse_with_smallest_extension
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import REACHED
from flexik.machines.deviations import Expected
from flexik.multibody.as_built import as_built_tips, draw_twin
from flexik.multibody.joint_forces import compliance, joint_forces, pins_of
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import tips
from flexik.planar.measured import adapted
from flexik.planar.measured.adapted import Measurements, Nominal, Offsets, misjudged
from flexik.planar.measured.fields import MEASURED, values_of
from flexik.planar.measured.offsets import dimensions_of, offsets_of
from flexik.planar.measured.predictions import misfit, outliers
from flexik.planar.measured.predictions import predictions as predictions_of
from flexik.positioning.combined import Combined
from flexik.positioning.method import PositioningError

SETTINGS = Expected(
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
MACHINE = crane_case.crane().machine
OFFSETS = [offset.name for offset in offsets_of(MACHINE, SETTINGS)]
DIMENSIONS = [offset.name for offset in dimensions_of(MACHINE, SETTINGS)]
PLAYS = [name for name in OFFSETS if name.endswith(".play")]
STROKES = values_of(MACHINE)
POSES = np.array([[0.1, 0.1, 0.0], [0.3, 0.3, 0.5], [0.2, 0.5, 1.2], [0.45, 0.6, 0.3]])
LOADS = np.array([0.0, 86.0, 172.0, 470.0])


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane(8.45e6)


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


def changed(**values):
    """SETTINGS, unchecked: also what nobody would expect."""
    return SETTINGS.model_copy(update=values)


def with_offsets(values):
    return Offsets(np.array([values.get(name, 0.0) for name in OFFSETS]))


def identify(crane, network, measurements, settings):
    return adapted.identify(Nominal(crane, network, settings), measurements)


def predicted_tip(crane, network, offsets, values, payload):
    return adapted.predicted_tip(Nominal(crane, network, SETTINGS), offsets, values, payload)


def surprise(crane, network, measurements, settings, offsets=None):
    return adapted.surprise(Nominal(crane, network, settings), measurements, offsets)


def predictions(crane, network, campaign, settings):
    return predictions_of(Nominal(crane, network, settings), campaign)


def method_of(crane, network, offsets, n_corrections=3):
    return adapted.Adapted(Nominal(crane, network, SETTINGS), offsets, n_corrections)


def drawn_offsets(seed, size=1.0):
    """Offsets as the settings expect them, by a prior of its own."""
    generator = np.random.default_rng(seed)
    deviation = dict.fromkeys(DIMENSIONS, SETTINGS.pivot)
    deviation |= dict.fromkeys(PLAYS, SETTINGS.play_deviation)
    deviation |= {"deflection": SETTINGS.section, SPRING: SETTINGS.spring}
    values = {name: size * generator.normal(0.0, deviation[name]) for name in OFFSETS}
    return with_offsets({k: v + (SETTINGS.play if k in PLAYS else 0.0) for k, v in values.items()})


# tips of the stand-in: another geometry, another deflection, joint play
tips_with = predicted_tip


def area(crane, generator, n):
    """Targets and payloads in the measured area that the rigid crane reaches."""
    targets = generator.uniform([1.5, -1.5], [5.0, 3.5], (4 * n, 2))
    reached = inverse_with_smallest_extension(crane.geometry, targets).reached
    return targets[reached][:n], generator.uniform(0.0, 172.0, n)


def baseline(crane, network):
    return Combined(CraneManipulator(crane.geometry), network)


def asked(method, targets, payload):
    return method(np.column_stack([targets, payload]), np.zeros((len(targets), 3)))


def measured(crane, network, offsets, generator, n):
    targets, payload = area(crane, generator, n)
    strokes = asked(baseline(crane, network), targets, payload).values
    tip = tips_with(crane, network, offsets, strokes, payload)
    noise = generator.normal(0.0, SETTINGS.measurement, (n, 2))
    return Measurements(strokes, payload, tip + noise)


def mean_error(method, crane, network, offsets, generator):
    targets, payload = area(crane, generator, 100)
    answer = asked(method, targets, payload)
    assert (answer.status == REACHED).all()
    reached = tips_with(crane, network, offsets, answer.values, payload)
    return np.linalg.norm(reached - targets, axis=1).mean()


def rigid_forces(crane, strokes, payload):
    loads = -crane.machine.gravity * payload[:, None] * [0.0, 1.0]
    return joint_forces(crane.machine, crane.linkage.poses(strokes), loads)


def giving_way(crane):
    """Compliance at POSES, and its play by name."""
    found = compliance(crane.machine, crane.linkage.poses(POSES), LOADS)
    return found, {
        k.partition(".")[2]: found.play[:, :, n] for n, k in enumerate(pins_of(crane.machine))
    }


def test_joint_forces_are_those_of_the_flexible_crane(crane):
    forces = rigid_forces(crane, POSES, LOADS)
    for k, (strokes, payload) in enumerate(zip(POSES, LOADS, strict=True)):
        model = PlanarModel.placed(crane, strokes)
        model.solve(payload)
        # the flexible crane hangs lower, by a few centimetres in metres
        for key, force in model.pin_forces(pins_of(crane.machine)).items():
            size = np.linalg.norm(force)
            assert forces[key][k] == pytest.approx(force, abs=0.03 * size + 100.0), key


def test_ground_carries_the_moment_of_all_weights(crane):
    moment = rigid_forces(crane, POSES, LOADS)["joints.slew"][:, 2]
    base, step = np.array([0.0, -0.311]), 1e-6
    tips_at = forward(crane.geometry, POSES)
    masses = crane.machine.masses().values()
    poses, names = crane.linkage.poses(POSES), crane.linkage.names
    expected = -9.81 * LOADS * (tips_at[:, 0] - base[0])
    for body, (x, y), mass in masses:
        at = poses[:, names.index(body)]
        expected -= 9.81 * mass * (at[:, 0] + np.cos(at[:, 2]) * x - np.sin(at[:, 2]) * y - base[0])
    assert moment == pytest.approx(expected, rel=1e-9)
    # and a cylinder's force is the slope of the potential energy along its stroke
    for k, name in enumerate(("lift", "jib", "extension")):
        energies = [potential(crane, POSES + sign * step * np.eye(3)[k]) for sign in (1, -1)]
        slope = (energies[0] - energies[1]) / (2 * step)
        force = rigid_forces(crane, POSES, LOADS)[f"drives.{name}"][:, 0]
        assert force == pytest.approx(-slope, rel=1e-5, abs=0.1)


def potential(crane, strokes):
    """Energy (n,) in J of all weights."""
    poses, names = crane.linkage.poses(strokes), crane.linkage.names
    found = 9.81 * LOADS * forward(crane.geometry, strokes)[:, 1]
    for body, (x, y), mass in crane.machine.masses().values():
        at = poses[:, names.index(body)]
        found += 9.81 * mass * (at[:, 1] + np.sin(at[:, 2]) * x + np.cos(at[:, 2]) * y)
    return found


def changed_by(crane, **constants):
    machine = crane.machine.with_constants(constants)
    return replace(crane, machine=machine, near=crane.linkage)


@pytest.mark.parametrize("drive", ["lift", "jib"])
def test_play_of_a_cylinder_is_a_change_of_its_length(crane, drive):
    gap, key = 1e-6, f"drives.{drive}.retracted"
    tension = rigid_forces(crane, POSES, LOADS)[f"drives.{drive}"]
    length = crane.machine.drives[drive].retracted
    longer, shorter = (changed_by(crane, **{key: length + sign * gap}) for sign in (1, -1))
    expected = np.sign(tension) * (tip_of(longer, POSES) - tip_of(shorter, POSES)) / gap
    assert giving_way(crane)[1][drive] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("joint", "body", "sign"),
    [
        ("lift_pivot", "pillar", 1.0),
        ("jib_pivot", "lift", 1.0),
        ("rocker_pivot", "lift", 1.0),
        ("rocker_head", "coupler", -1.0),  # of the rocker, where the jib cylinder stays
        ("coupler_pin", "coupler", 1.0),
    ],
)
def test_play_of_a_pin_shifts_it_along_the_force_on_the_inner_body(crane, joint, body, sign):
    gap = 1e-6
    forces = rigid_forces(crane, POSES, LOADS)[f"joints.{joint}"]
    found, key = giving_way(crane)[1][joint], f"bodies.{body}.points.{joint}"
    for k, strokes in enumerate(POSES):
        angle = crane.linkage.poses(strokes[None])[0, crane.linkage.names.index(body), 2]
        c, s = np.cos(angle), np.sin(angle)
        shift = sign * gap * np.array([[c, s], [-s, c]]) @ forces[k] / np.linalg.norm(forces[k])
        moved = np.array(crane.machine.bodies[body].points[joint]) + shift
        tip = tip_of(changed_by(crane, **{key: moved.tolist()}), strokes[None])
        expected = (tip - tip_of(crane, strokes[None]))[0] / gap
        assert found[k] == pytest.approx(expected, rel=1e-4, abs=1e-4)


def tip_of(crane, strokes):
    body, (x, y) = crane.machine.located(crane.machine.payload)
    at = crane.linkage.poses(strokes)[:, crane.linkage.names.index(body)]
    c, s = np.cos(at[:, 2]), np.sin(at[:, 2])
    return at[:, :2] + np.column_stack([c * x - s * y, s * x + c * y])


def test_a_softer_spring_gives_way_as_the_flexible_crane_does(crane):
    key = "joints.slew.springs.torsion"
    (stiffness,) = (crane.machine.joints["slew"].springs.torsion,)
    softer = replace(crane, machine=crane.machine.with_constants({key: stiffness / 1.1}))
    expected = tips(softer, POSES, LOADS) - tips(crane, POSES, LOADS)
    # its share is a tenth of the spring's, and the crane hangs a little lower than the rigid one
    found = 0.1 * giving_way(crane)[0].spring[:, :, 0]
    assert found == pytest.approx(expected, rel=0.05, abs=2e-6)


def test_factors_scale_deflection_and_spring(crane, network):
    offsets = with_offsets({"deflection": 0.05, SPRING: -0.2})
    inputs = np.column_stack([POSES, LOADS])
    found = adapted.CorrectedDeflection(Nominal(crane, network, SETTINGS), offsets).predict(inputs)
    spring = giving_way(crane)[0].spring[:, :, 0]
    assert found == pytest.approx(1.05 * network.predict(inputs) - 0.2 * spring, abs=1e-15)


def test_true_offsets_put_the_tip_on_the_target(crane, network):
    offsets = drawn_offsets(1)
    tight = Offsets(np.where(np.isin(OFFSETS, PLAYS), 0.0, offsets.values))
    method = method_of(crane, network, tight, n_corrections=6)
    assert mean_error(method, crane, network, tight, np.random.default_rng(1)) < 1e-6
    # with play a few targets lie in the gap where a joint's force changes its sign
    method = method_of(crane, network, offsets, n_corrections=6)
    assert mean_error(method, crane, network, offsets, np.random.default_rng(1)) < 1e-4


def test_expected_offsets_measured_without_error_stay(crane, network):
    expected = with_offsets(dict.fromkeys(PLAYS, SETTINGS.play))
    exact = changed(measurement=1e-9)
    points = measured(crane, network, expected, np.random.default_rng(2), 9)
    tip = tips_with(crane, network, expected, points.values, points.payload)
    found = identify(crane, network, Measurements(points.values, points.payload, tip), exact)
    assert found.values == pytest.approx(expected.values, abs=1e-9)


def test_identified_offsets_are_the_most_probable(crane, network):
    truth = drawn_offsets(9)
    points = measured(crane, network, truth, np.random.default_rng(9), 9)
    values = identify(crane, network, points, changed(repeatability=0.0)).values
    nothing = changed(repeatability=0.0, measurement=1e6)
    scale = identify(crane, network, points, nothing).deviations  # the prior's
    expected = np.where(np.isin(OFFSETS, PLAYS), SETTINGS.play, 0.0)

    def cost(offsets):
        tip = tips_with(crane, network, Offsets(offsets), points.values, points.payload)
        missed = (points.tip - tip) / SETTINGS.measurement
        return np.sum(missed**2) + np.sum(((offsets - expected) / scale) ** 2)

    # the cost has its minimum here along any line, to a hundredth of a standard deviation
    for direction in np.random.default_rng(4).normal(size=(20, len(OFFSETS))):
        step = 0.01 * scale * direction / np.linalg.norm(direction)
        before, here, after = (cost(values + k * step) for k in (-1, 0, 1))
        assert here < before
        assert here < after


def test_a_row_whose_joint_forces_nearly_vanish_does_not_spoil_the_others(crane, network):
    # row 5 has -62 N in the jib cylinder, but 20 N by the nominal crane: its play lies otherwise
    truth = drawn_offsets(20)
    points = measured(crane, network, truth, np.random.default_rng(20), 9)
    true_crane = Nominal(crane, network, SETTINGS).like(truth)
    nominal, true = (
        rigid_forces(c, points.values, points.payload)["drives.jib"][:, 0]
        for c in (crane, true_crane)
    )
    assert np.flatnonzero(np.sign(nominal) != np.sign(true)) == [5]
    found = identify(crane, network, points, changed(repeatability=0.0))
    modelled = tips_with(crane, network, found, points.values, points.payload)
    missed = np.linalg.norm(points.tip - modelled, axis=1)
    assert np.delete(missed, 5).max() < 3 * SETTINGS.measurement


def test_more_measurements_leave_less_doubt(crane, network):
    points = measured(crane, network, drawn_offsets(5), np.random.default_rng(5), 30)
    less, more = (identify(crane, network, m, SETTINGS).deviations for m in (points[:5], points))
    assert (more > 0.0).all() and (more <= less * (1 + 1e-6)).all()
    length = less[OFFSETS.index("drives.lift.retracted")]
    assert length < 0.8 * np.hypot(SETTINGS.length, SETTINGS.stroke_offset)


def test_few_measurements_help_and_more_help_further(crane, network):
    errors = {n: [] for n in (0, 3, 9, 30)}
    for seed in range(5):
        truth = drawn_offsets(seed + 10)
        points = measured(crane, network, truth, np.random.default_rng(seed), 30)
        for n, found in errors.items():
            method = baseline(crane, network)
            if n:
                offsets = identify(crane, network, points[:n], SETTINGS)
                method = method_of(crane, network, offsets)
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
    sizes = crane_case.magnitudes(0.5e-3, 0.5e-3, 0.1e-3, 0.3, 0.5e-3, 0.05e-3, 0.05, 0.1)
    small = dict.fromkeys(("pivot", "length", "stroke_offset"), 0.5e-3)
    expected = changed(**small, repeatability=0.05e-3, play=0.1e-3, play_deviation=0.03e-3)
    network, errors = Exact(crane), []
    nominal = baseline(crane, network)
    for seed in range(3):
        generator = np.random.default_rng(seed)
        twin = draw_twin(crane, sizes, seed)
        targets, payload = area(crane, generator, 9)
        strokes = asked(nominal, targets, payload).values
        tip = as_built_tips(twin, strokes, payload, generator)
        tip += generator.normal(0.0, 0.5e-3, tip.shape)
        found = identify(crane, network, Measurements(strokes, payload, tip), expected)
        targets, payload = area(crane, generator, 30)
        for method in (nominal, method_of(crane, network, found)):
            answer = asked(method, targets, payload)
            assert (answer.status == REACHED).all()
            reached = as_built_tips(twin, answer.values, payload)
            errors.append(np.linalg.norm(reached - targets, axis=1).mean())
    without, adapted = np.reshape(errors, (3, 2)).mean(axis=0)
    assert without > 5e-3
    assert adapted < 0.3 * without


def test_same_measurements_give_the_same_offsets_in_any_order(crane, network):
    points = measured(crane, network, drawn_offsets(6), np.random.default_rng(6), 6)
    first, second = (identify(crane, network, m, SETTINGS).values for m in (points, points[::-1]))
    assert second == pytest.approx(first, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": (2, np.nan)}, "measured values: sample 2 is not finite"),
        ({"payload": (2, np.nan)}, "measured payload: sample 2 is not finite"),
        ({"tip": (2, np.nan)}, "measured tip: sample 2 is not finite"),
        ({"values": ((1, 0), 5.0)}, "sample 1: the linkage does not close"),
        ({"n": 2}, "2 rows, expected 3 or more"),
    ],
)
def test_measurements_that_cannot_be_are_named(crane, network, change, message):
    given = {"values": POSES.copy(), "payload": LOADS.copy(), "tip": POSES[:, :2].copy()}
    n = change.pop("n", 4)
    for name, (where, value) in change.items():
        given[name][where] = value
    with pytest.raises(PositioningError, match=message):
        identify(crane, network, Measurements(**given)[:n], SETTINGS)
    with pytest.raises(PositioningError, match=r"measured tip: expected shape \(4, 2\)"):
        Measurements(POSES, LOADS, POSES[:3, :2])


def test_measurements_at_the_stroke_limits_are_taken(crane, network):
    low, high = np.zeros(3), np.array(crane.geometry.stroke_maximum)
    strokes = np.array([low, high, [low[0], high[1], 0.5], [high[0], low[1], 0.5]])
    truth = drawn_offsets(9)
    tip = tips_with(crane, network, truth, strokes, LOADS)
    found = identify(crane, network, Measurements(strokes, LOADS, tip), SETTINGS)
    for offsets, least, most in ((drawn_offsets(9, 0.0), 5e-3, np.inf), (found, 0.0, 2e-3)):
        missed = np.linalg.norm(tip - tips_with(crane, network, offsets, strokes, LOADS), axis=1)
        # the last row, stretched to its full length with the lift cylinder out, weighs little
        assert least < missed[:3].max() < most


def test_unreachable_targets_keep_their_strokes_and_say_so(crane, network):
    initial = np.array([[0.1, 0.2, 0.3]])
    method = method_of(crane, network, drawn_offsets(7))
    answer = method(np.array([[20.0, 0.0, 86.0]]), initial)
    assert answer.status[0] != REACHED
    assert (answer.values == initial).all()


# what differs less, as the campaign of params.yaml does
USUAL = SETTINGS.model_copy(
    update={
        **dict.fromkeys(("pivot", "length", "stroke_offset"), 0.5e-3),
        "play": 0.1e-3,
        "play_deviation": 0.03e-3,
        "section": 0.03,
        "spring": 0.05,
    }
)
TARGETS = np.array([[3.8, 1.75], [3.0, 0.95], [3.8, 0.15], [4.6, 2.5], [2.4, -1.0], [4.5, -0.5]])


@pytest.fixture(scope="module")
def conditions(crane):
    """Strokes (12, 3) and payload (12,), two loads a target."""
    targets = np.repeat(TARGETS, 2, axis=0)
    strokes = inverse_with_smallest_extension(crane.geometry, targets).values
    return strokes, np.tile([0.0, 172.0], len(TARGETS))


def prior_drawn(crane, network, seed):
    prior = Nominal(crane, network, USUAL).prior
    return Offsets(np.random.default_rng(seed).normal(prior.values, prior.deviations))


def usual_measurements(crane, network, conditions, seed):
    """Measurements of a crane that differs as expected, its strokes never quite repeated."""
    strokes, payload = conditions
    offsets = prior_drawn(crane, network, seed)
    generator = np.random.default_rng((seed, 1))
    actual = strokes + generator.normal(0.0, USUAL.repeatability, strokes.shape)
    tip = predicted_tip(crane, network, offsets, actual, payload)
    return Measurements(strokes, payload, tip + generator.normal(0.0, 0.5e-3, tip.shape))


def test_predicted_tips_are_rigid_tips_and_deflections(crane, network, conditions):
    strokes, payload = conditions
    inputs = np.column_stack([strokes, payload])
    nominal = predicted_tip(crane, network, None, strokes, payload)
    np.testing.assert_allclose(nominal, forward(crane.geometry, strokes) + network.predict(inputs))
    zero = with_offsets({})
    np.testing.assert_allclose(predicted_tip(crane, network, zero, strokes, payload), nominal)
    offsets = drawn_offsets(3)
    found = predicted_tip(crane, network, offsets, strokes, payload)
    rigid = forward(Nominal(crane, network, SETTINGS).like(offsets).geometry, strokes)
    moved = adapted.CorrectedDeflection(Nominal(crane, network, SETTINGS), offsets).predict(inputs)
    np.testing.assert_allclose(found, rigid + moved)


def test_surprise_is_in_standard_deviations(crane, network, conditions):
    # squared distances of two normal coordinates have the mean 2; rows of a crane go together
    squares = [
        surprise(crane, network, usual_measurements(crane, network, conditions, seed), USUAL) ** 2
        for seed in range(60)
    ]
    assert np.mean(squares) == pytest.approx(2.0, rel=0.2)


def test_surprise_after_identification_is_in_its_own_standard_deviations(
    crane, network, conditions
):
    first, rest = slice(0, 4), slice(4, None)
    squares = []
    for seed in range(60):
        whole = usual_measurements(crane, network, conditions, seed)
        offsets = identify(crane, network, whole[rest], USUAL)
        squares.append(surprise(crane, network, whole[first], USUAL, offsets) ** 2)
    assert np.mean(squares) == pytest.approx(2.0, rel=0.3)


def test_what_stands_out_is_judged_by_the_median():
    generator = np.random.default_rng(1)
    distance = np.linalg.norm(generator.standard_normal((2000, 2)), axis=1)
    assert misfit(3.0 * distance) == pytest.approx(3.0, rel=0.05)
    assert misfit(0.1 * distance) == 1.0
    few = distance[:50]
    assert not outliers(few, few).any()
    assert outliers(np.append(few, 9.0), few).tolist() == [False] * 50 + [True]
    # where all fit badly, none of them stands out
    assert not outliers(10.0 * few, 10.0 * few).any()


def test_a_slip_of_the_pen_surprises(crane, network, conditions):
    whole = usual_measurements(crane, network, conditions, 1)
    before = surprise(crane, network, whole, USUAL)
    tip = whole.tip.copy()
    tip[4] += [0.0, 0.1]
    after = surprise(crane, network, replace(whole, tip=tip), USUAL)
    assert after[4] > 5.0 > before.max()
    np.testing.assert_array_equal(np.delete(after, 4), np.delete(before, 4))


def test_who_misjudges_expects_less():
    found = misjudged(USUAL, 0.5)
    assert (found.play, found.pivot, found.spring) == (0.0, 0.25e-3, 0.025)
    assert (found.measurement, found.repeatability) == (0.5e-3, 0.1e-3)


@pytest.fixture
def campaign(crane, network, conditions):
    rows = usual_measurements(crane, network, conditions, 2)
    targets = np.repeat(TARGETS, 2, axis=0)
    numbers = np.column_stack([targets, rows.payload, rows.values, rows.tip])
    columns = ["target_x", "target_y", "payload", *STROKES, *MEASURED]
    return pd.DataFrame(numbers, columns=columns).assign(line=np.arange(1, 13))


def test_a_target_is_predicted_from_the_others_alone(crane, network, campaign):
    table = predictions(crane, network, campaign, USUAL)
    assert table["line"].tolist() == list(range(1, 13))
    assert (table["used"] == 1).all()
    strokes, payload = campaign[STROKES].to_numpy(), campaign["payload"].to_numpy()
    nominal = predicted_tip(crane, network, None, strokes, payload)
    away = np.linalg.norm(campaign[MEASURED] - nominal, axis=1)
    np.testing.assert_allclose(table["nominal_error"], away)
    assert table["adapted_error"].mean() < 0.6 * table["nominal_error"].mean()
    # 50 mm that one target's points were moved stand in their own errors only in full
    moved = campaign.copy()
    moved.loc[:1, "measured_y"] += 0.05
    after = predictions(crane, network, moved, USUAL)["adapted_error"]
    change = (after - table["adapted_error"]).abs()
    assert change[:2].min() > 0.04
    assert (change[2:] > 1e-6).any()
    # strokes tell the groups where there are no targets
    assert predictions(crane, network, moved, USUAL)["used"].tolist() == [0, 0, *[1] * 10]
    unknown = campaign.assign(target_x=np.nan, target_y=np.nan)
    pd.testing.assert_frame_equal(predictions(crane, network, unknown, USUAL), table)


def test_too_few_others_predict_nothing(crane, network, campaign):
    table = predictions(crane, network, campaign[:4], USUAL)
    assert table["adapted_error"].isna().all()
    assert table["nominal_error"].notna().all()
