"""The fit of the ground spring, on a crane whose errors are known in closed form."""

import numpy as np
import pandas as pd
import pytest

from flexik.errors import ParameterError
from flexik.evaluation.crane.calibration import fit_spring

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
    assert text.startswith("crane.calibration.stiffness_range: ")
    assert "204.00 mm and 4.20 mm" in text
    assert f"{1e3 * wanted:.2f} mm" in text
    assert "\n" not in text


def test_errors_of_the_model_pass_through():
    def broken(stiffness):
        raise ParameterError("points")

    with pytest.raises(ParameterError, match="points"):
        fit_spring(broken, 0.03, (1e6, 1e9))
