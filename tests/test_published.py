"""What the last run of the pipeline reports, against the published values and our targets."""

import json
from pathlib import Path

import crane_case
import numpy as np
import pandas as pd
import pytest

from flexik.kinematics.crane import inverse_with_smallest_extension
from flexik.multibody.planar import tips

ROOT = Path(__file__).resolve().parents[1]
CALIBRATED = 6.44937e6  # N m/rad, reports/crane/metrics.json


@pytest.fixture(scope="module")
def metrics():
    return json.loads((ROOT / "reports/crane/metrics.json").read_text())


@pytest.fixture(scope="module")
def published():
    path = ROOT / "data/reference/crane/positioning_errors.csv"
    return pd.read_csv(path).set_index("statistic")


@pytest.mark.parametrize(
    ("statistic", "tolerance"),
    [
        ("max_abs_dx", 0.1),
        ("max_abs_dy", 0.1),
        ("max_error", 0.112),  # 11.1 %, 10.5 % with a straight pillar: see the next test
        ("mean_abs_dx", 0.1),
        ("mean_abs_dy", 0.1),
        ("mean_error", 1e-5),  # fitted
    ],
)
def test_uncompensated_errors_are_the_published_ones(metrics, published, statistic, tolerance):
    found = metrics[f"none.{statistic}_mm"]
    assert found == pytest.approx(published.loc[statistic, "none"], rel=tolerance)


def test_largest_published_error_is_that_of_a_point_beside_ours(published):
    """Max |dY| and max R of the thesis belong to one point if |dX| there is 24.5 mm.

    Our points (6, 1) and (6, 3) have 5 and 48 mm; between them, at (6, 2), the model has it all.
    """
    model = crane_case.crane(CALIBRATED)
    target = np.array([[6.0, 2.0]])
    strokes = inverse_with_smallest_extension(model.geometry, target).values
    x, y = 1e3 * np.abs(target - tips(model, strokes, np.array([470.0])))[0]
    largest, vertical = published.loc[["max_error", "max_abs_dy"], "none"]
    assert np.hypot(x, y) == pytest.approx(largest, rel=0.015)
    assert y == pytest.approx(vertical, rel=0.01)
    assert x == pytest.approx(np.sqrt(largest**2 - vertical**2), abs=3.0)


def test_spring_is_the_one_of_the_report(metrics):
    assert metrics["calibration.spring_stiffness_nm_per_rad"] == pytest.approx(CALIBRATED, rel=1e-4)


# Which of the restarts is kept decides little but hangs on round-off: half as much again. A largest
# error hangs on it altogether (that of `inverse` is 0.3 to 1.8 m over the ten best): it has to be
# within reach of one of them
@pytest.mark.parametrize(
    ("method", "mean", "largest"),
    [
        ("combined", 2.5, 9.2),
        ("direct", 16.5, 50.0),
        ("modular", 13.0, 35.0),
        ("inverse", 90.0, 340.0),
        ("combined_ga", 5.0, None),
        ("combined_selected", 0.5, None),
        ("direct_selected", 5.0, None),
        ("modular_selected", 5.0, None),
    ],
)
def test_targets_of_the_compensated_crane(metrics, method, mean, largest):
    assert metrics[f"{method}.mean_error_mm"] <= 1.5 * mean
    assert largest is None or metrics[f"{method}.restarts.min_max_error_mm"] <= largest
    assert metrics[f"{method}.n_failed"] == 0


def test_methods_rank_as_published(metrics):
    error = {
        method: metrics[f"{method}.mean_error_mm"]
        for method in ("none", "combined", "direct", "modular", "inverse")
    }
    assert error["combined"] < min(error["direct"], error["modular"])
    assert max(error["direct"], error["modular"]) < error["none"] < error["inverse"]


def test_random_targets_agree_with_the_test_points(metrics):
    for method in ("none", "combined", "direct", "modular", "inverse"):
        everywhere = metrics[f"{method}.workspace_mean_error_mm"]
        assert everywhere == pytest.approx(metrics[f"{method}.mean_error_mm"], rel=0.5)
        assert everywhere < metrics[f"{method}.workspace_p99_error_mm"]
