"""The fit of the ground spring, on a crane whose errors are known in closed form."""

import json

import crane_case
import numpy as np
import pandas as pd
import pytest

from flexik.cases.crane.parts import calibrate
from flexik.cases.crane.section import SPRING, Calibration
from flexik.datasets.parts import key
from flexik.errors import ParameterError
from flexik.evaluation.calibration import fit_spring

BEAMS_ERROR, SPRING_ERROR = 0.004, 2e5  # m, and m per 1/(N m/rad): error = a + b / k


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
    fit = fit_spring(springy(calls), wanted, (1e6, 1e9))
    assert fit.spring_stiffness == pytest.approx(stiffness, rel=1e-6)
    assert type(fit.spring_stiffness) is float
    assert fit.errors["error"].mean() == pytest.approx(wanted, rel=1e-9)
    assert fit.errors["error"].tolist() == springy([])(fit.spring_stiffness)["error"].tolist()
    assert min(calls) >= 1e6 * (1 - 1e-12) and max(calls) <= 1e9 * (1 + 1e-12)
    assert len(calls) < 25


@pytest.mark.parametrize("end", [1e6, 1e9])
def test_an_end_of_the_range_may_be_the_answer(end):
    # through log and exp the end may move by round-off, so ask for a hair inside
    wanted = BEAMS_ERROR + SPRING_ERROR / end
    inside = wanted * (1 - 1e-12 if end == 1e6 else 1 + 1e-12)
    assert fit_spring(springy([]), inside, (1e6, 1e9)).spring_stiffness == pytest.approx(end)


@pytest.mark.parametrize("wanted", [0.003, 0.3])
def test_an_error_that_no_spring_of_the_range_gives_is_told(wanted):
    with pytest.raises(ParameterError) as raised:
        fit_spring(springy([]), wanted, (1e6, 1e9))
    text = str(raised.value)
    assert text.startswith("calibration.stiffness_range: ")
    assert "204.00 mm and 4.20 mm" in text
    assert f"{1e3 * wanted:.2f} mm" in text
    assert "\n" not in text


def test_errors_of_the_model_pass_through():
    def broken(stiffness):
        raise ParameterError("points")

    with pytest.raises(ParameterError, match="points"):
        fit_spring(broken, 0.03, (1e6, 1e9))


def spring(calibration, tmp_path):
    """What the part writes."""
    section = crane_case.section()
    published = tmp_path / "published.csv"
    published.write_text("statistic,none\nmean_error,40.0\n")
    work = calibrate.prepare(
        machine=section.machine, calibration=calibration, published=published, sections={}
    )
    work.finish([])[".json"](tmp_path / "spring.json")
    return json.loads((tmp_path / "spring.json").read_text())


def test_the_crane_is_calibrated_on_conditions_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(crane_case.ROOT)
    conditions = {"points": [[5.0, 2.0], [4.0, 1.0]], "payloads": [120.0, 470.0]}
    found = spring(Calibration.model_validate({"conditions": conditions}), tmp_path)
    assert 2e6 < found["constants"][SPRING] < 2e7
    assert found["uncompensated"]["mean_error"] == pytest.approx(0.04, rel=1e-5)
    assert found["uncompensated"]["n_conditions"] == 4
    known = spring(Calibration(stiffness=8.5e6), tmp_path)
    assert known == {"constants": {SPRING: 8.5e6}}


def test_test_conditions_do_not_change_the_machine(monkeypatch):
    monkeypatch.chdir(crane_case.ROOT)
    section = crane_case.section()
    assert len(section.calibration.conditions.points) == 25
    few = section.conditions["published"].model_copy(update={"payloads": [100.0]})
    conditions = {**section.conditions, "published": few}
    other = section.model_copy(update={"conditions": conditions})
    (before,), (after,) = calibrate.parts(section), calibrate.parts(other)
    assert key(before) == key(after)
    other = section.model_copy(update={"calibration": Calibration(conditions=few)})
    assert key(calibrate.parts(other)[0]) != key(before)
