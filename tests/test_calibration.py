"""Fits of free constants: on errors known in closed form, and on tips of machines made here."""

import contextlib
import json

import crane_case
import numpy as np
import pandas as pd
import pytest
from planar_machines import FILES

from flexik.cases.crane.section import SPRING
from flexik.datasets.parts import key
from flexik.errors import FlexikError, ParameterError
from flexik.evaluation.calibration import fit_campaign, fit_mean_error
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import read_machine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import tips
from flexik.planar import calibrate
from flexik.planar.measured.campaign_file import columns_of, coordinate_columns
from flexik.planar.section import Calibration

BEAMS_ERROR, SPRING_ERROR = 0.004, 2e5  # m, and m per 1/(N m/rad): error = a + b / k
LIMITS = (1e6, 1e9)


def frame(*errors):
    errors = np.array(errors)
    zero = np.zeros(len(errors))
    return pd.DataFrame(
        {"error_x": zero, "error_y": errors, "error": np.abs(errors), "status": zero.astype(int)}
    )


def springy(calls):
    """Two conditions, one three times as far off as the other; their mean is a + b / k."""

    def uncompensated(stiffness):
        calls.append(stiffness)
        mean = BEAMS_ERROR + SPRING_ERROR / stiffness
        return frame(0.5 * mean, 1.5 * mean)

    return uncompensated


@pytest.mark.parametrize("stiffness", [1.1e6, 8e6, 9e8])
def test_the_spring_of_a_known_crane_is_found(stiffness):
    calls = []
    wanted = BEAMS_ERROR + SPRING_ERROR / stiffness
    found = fit_mean_error(springy(calls), wanted, SPRING, LIMITS)
    assert found == pytest.approx(stiffness, rel=1e-6)
    assert type(found) is float
    assert min(calls) >= 1e6 * (1 - 1e-12) and max(calls) <= 1e9 * (1 + 1e-12)
    assert len(calls) < 25


@pytest.mark.parametrize("end", [1e6, 1e9])
def test_an_end_of_the_range_may_be_the_answer(end):
    # through log and exp the end may move by round-off, so ask for a hair inside
    wanted = BEAMS_ERROR + SPRING_ERROR / end
    inside = wanted * (1 - 1e-12 if end == 1e6 else 1 + 1e-12)
    assert fit_mean_error(springy([]), inside, SPRING, LIMITS) == pytest.approx(end)


@pytest.mark.parametrize("wanted", [0.003, 0.3])
def test_an_error_that_no_spring_of_the_range_gives_is_told(wanted):
    with pytest.raises(ParameterError) as raised:
        fit_mean_error(springy([]), wanted, SPRING, LIMITS)
    text = str(raised.value)
    assert text.startswith(f"calibration.ranges.{SPRING}: ")
    assert "204.00 mm and 4.20 mm" in text
    assert f"{1e3 * wanted:.2f} mm" in text
    assert "\n" not in text


def test_errors_of_the_model_pass_through():
    def broken(stiffness):
        raise ParameterError("points")

    with pytest.raises(ParameterError, match="points"):
        fit_mean_error(broken, 0.03, SPRING, LIMITS)


def constants(tmp_path, machine, calibration, **inputs):
    """What the part writes."""
    work = calibrate.prepare(machine=machine, calibration=calibration, sections={}, **inputs)
    work.finish([])[".json"](tmp_path / "constants.json")
    return json.loads((tmp_path / "constants.json").read_text())


def test_the_crane_is_calibrated_on_conditions_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(crane_case.ROOT)
    machine = crane_case.MACHINE
    conditions = {"points": [[5.0, 2.0], [4.0, 1.0]], "payloads": [120.0, 470.0]}
    given = {"ranges": {SPRING: LIMITS}, "mean_error": 0.04, "conditions": conditions}
    found = constants(tmp_path, machine, Calibration.model_validate(given))
    assert 2e6 < found["constants"][SPRING] < 2e7
    assert found["uncompensated"]["mean_error"] == pytest.approx(0.04, rel=1e-5)
    assert found["uncompensated"]["n_conditions"] == 4
    known = constants(tmp_path, machine, Calibration(known={SPRING: 8.5e6}))
    assert known == {"constants": {SPRING: 8.5e6}}


def test_the_mean_error_is_the_published_one():
    published = pd.read_csv(crane_case.ROOT / "data/reference/crane/positioning_errors.csv")
    mean = published.set_index("statistic")["none"]["mean_error"]
    assert crane_case.section().calibration.mean_error == pytest.approx(1e-3 * mean, rel=1e-12)


def test_test_conditions_do_not_change_the_machine(monkeypatch):
    monkeypatch.chdir(crane_case.ROOT)
    section = crane_case.section()
    assert len(section.calibration_points.points) == 25
    few = section.conditions["published"].model_copy(update={"payloads": [100.0]})
    conditions = {**section.conditions, "published": few}
    other = section.model_copy(update={"conditions": conditions})
    (before,), (after,) = calibrate.parts(section), calibrate.parts(other)
    assert key(before) == key(after)
    for changed in (few, "published"):
        fitted = section.calibration.model_copy(update={"conditions": changed})
        found = calibrate.parts(other.model_copy(update={"calibration": fitted}))
        assert key(found[0]) != key(before)


# Constants of a machine as it is, by key, and the range in which they are looked for
TRUE = {
    "crane": {SPRING: (7.3e6, LIMITS)},
    "excavator": {
        "bodies.boom.stiffness_factor": (0.8, (0.3, 3.0)),
        "bodies.stick.stiffness_factor": (1.3, (0.3, 3.0)),
    },
    "elastic_arm": {
        "bodies.link_1.stiffness_factor": (1.2, (0.3, 3.0)),
        "bodies.link_2.stiffness_factor": (0.9, (0.3, 3.0)),
    },
}
PAYLOADS = {"crane": 300.0, "excavator": 3000.0, "elastic_arm": 3.0}


def measured(name, true, noise, n=12):
    """The machine with constants that are free, and coordinates, payloads and tips measured."""
    with contextlib.chdir(crane_case.ROOT):
        machine = read_machine(FILES[name])
        exact = FlexibleMachine(machine.with_constants(true))
        generator, manipulator = np.random.default_rng(1), manipulator_of(machine)
        values = generator.uniform(manipulator.lower, manipulator.upper, (n, len(machine.drives)))
        payload = generator.uniform(0.0, PAYLOADS[name], n)
        found = tips(exact, values, payload) + generator.normal(0.0, noise, (n, 2))
        return machine.with_constants(dict.fromkeys(true, "fit")), values, payload, found


def campaign(path, machine, values, payload, tip):
    """A file of measurements."""
    columns = columns_of(coordinate_columns(machine))[3:]
    numbers = np.column_stack([payload, values, tip])
    pd.DataFrame(numbers, columns=list(columns)).to_csv(path, index=False)
    return path


@pytest.mark.parametrize("name", TRUE)
def test_constants_of_a_measured_machine_are_recovered(name, tmp_path, monkeypatch):
    true = {at: value for at, (value, _) in TRUE[name].items()}
    ranges = {at: limits for at, (_, limits) in TRUE[name].items()}
    monkeypatch.chdir(crane_case.ROOT)
    for noise in (0.0, 1e-4):
        machine, *data = measured(name, true, noise)
        path = campaign(tmp_path / "own.csv", machine, *data)
        given = Calibration(ranges=ranges, campaign=str(path))
        found = constants(tmp_path, machine, given, campaign=path)
        assert found["left"]["n_measurements"] == 12
        assert found["left"]["rms_distance"] == pytest.approx(noise * 2**0.5, rel=0.4, abs=2e-6)
        for at, value in true.items():
            away = abs(found["constants"][at] - value)
            deviation = found["standard_deviations"][at]
            assert away < (4.0 * deviation if noise else 2e-3 * value)
            assert noise == 0.0 or 0.0 < deviation < 0.5 * value


def test_deviations_are_those_of_repeated_campaigns():
    x = np.linspace(1.0, 3.0, 20)

    def predicted(values):
        return np.column_stack([0.01 * x / values["a"], 0.02 * x**2 / values["b"]])

    exact = predicted({"a": 2.0, "b": 5.0})
    ranges = {"a": (0.1, 50.0), "b": (0.1, 50.0)}
    generator, fits = np.random.default_rng(2), []
    for _ in range(100):
        noisy = exact + generator.normal(0.0, 1e-4, exact.shape)
        fits.append(fit_campaign(predicted, noisy, ranges))
    for name in ranges:
        found = [fit.constants[name] for fit in fits]
        said = np.mean([fit.deviations[name] for fit in fits])
        assert np.mean(found) == pytest.approx({"a": 2.0, "b": 5.0}[name], rel=2e-3)
        assert np.std(found) == pytest.approx(said, rel=0.25)
    assert fits[0].rms_distance == pytest.approx(1e-4 * 2**0.5, rel=0.4)


def test_as_many_data_as_constants_leave_no_deviation():
    def predicted(values):
        return np.array([[1.0 / values["a"], 1.0 / values["b"]]])

    fit = fit_campaign(predicted, np.array([[0.5, 0.25]]), {"a": (0.1, 9.0), "b": (0.1, 9.0)})
    assert fit.deviations is None
    assert fit.constants == {"a": pytest.approx(2.0), "b": pytest.approx(4.0)}


@pytest.mark.parametrize(
    ("predicted", "message"),
    [
        (lambda v: np.full((4, 2), 0.01 / (v["a"] * v["b"])), "campaign: does not tell a, b; exp"),
        (lambda v: np.full((4, 2), 0.01 / v["a"]), "campaign: does not tell b; expected poses"),
        (lambda v: np.array([[0.01 / v["a"], 9e-4 / v["b"]]] * 4), "ranges.b: the best value lies"),
    ],
)
def test_what_cannot_be_determined_is_told(predicted, message):
    with pytest.raises(ParameterError, match=message) as raised:
        fit_campaign(predicted, np.full((4, 2), 0.01), {"a": (0.1, 9.0), "b": (0.1, 9.0)})
    assert "\n" not in str(raised.value)
    with pytest.raises(ParameterError, match=r"campaign: 2 coordinates of tips are too few for 3"):
        fit_campaign(predicted, np.zeros((1, 2)), dict.fromkeys("abc", (0.1, 9.0)))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ranges": {SPRING: (1e9, 1e6)}, "campaign": "a.csv"}, "must increase"),
        ({"ranges": {SPRING: LIMITS}}, "mean_error: expected it, with conditions, or else camp"),
        ({"ranges": {SPRING: LIMITS}, "mean_error": 0.1}, "mean_error: expected conditions"),
        ({"ranges": {SPRING: LIMITS}, "mean_error": 0.1, "campaign": "a.csv"}, "or else campaign"),
        (
            {"ranges": dict.fromkeys("ab", LIMITS), "mean_error": 0.1, "conditions": "published"},
            "and one of ranges",
        ),
    ],
)
def test_calibrations_that_make_no_sense_are_told(given, message):
    with pytest.raises(ValueError, match=message):
        Calibration.model_validate(given)


def test_exactly_the_free_constants_are_told():
    for given, message in (
        (Calibration(), "machine.joints.slew.*: expected a value, or it once in calibration"),
        (Calibration(known={SPRING: 1e7, "gravity": 9.0}), "machine.gravity: expected fit"),
    ):
        with pytest.raises(ValueError, match=message):
            given.check_keys(crane_case.MACHINE)


def test_a_campaign_without_coordinates_fits_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(crane_case.ROOT)
    path = crane_case.ROOT / "data/reference/crane/campaign_example.csv"
    rows = pd.read_csv(path, comment="#")
    rows.drop(columns=[c for c in rows if "_stroke_" in c]).to_csv(tmp_path / "a.csv", index=False)
    given = Calibration(ranges={SPRING: LIMITS}, campaign=str(tmp_path / "a.csv"))
    with pytest.raises(FlexikError, match=r"a\.csv: expected the columns .*lift_stroke_m"):
        constants(tmp_path, crane_case.MACHINE, given, campaign=tmp_path / "a.csv")
