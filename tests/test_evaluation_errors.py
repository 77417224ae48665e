"""Test conditions, positioning errors, their statistics, and the published ones."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.errors import DataError, ParameterError
from flexik.evaluation.conditions import all_conditions
from flexik.evaluation.errors import STATISTICS, comparison, evaluate, statistics
from flexik.positioning.method import NOT_CONVERGED, REACHED, Command, PositioningError

PUBLISHED = Path(__file__).parents[1] / "data/reference/crane/positioning_errors.csv"


def two_conditions():
    return all_conditions([[1.0, 2.0], [4.0, 1.0]], [30.0])


def method(targets, payload, initial_strokes):
    """Command strokes whose fake tip is (3, 4) mm and (-12, 0) mm short; the second row fails."""
    strokes = np.column_stack([targets, payload])
    status = np.array([REACHED, NOT_CONVERGED])
    return Command(strokes, status, {"n_generations": np.array([7, 1000])})


def flexible_tip(strokes, payload):
    assert np.array_equal(strokes[:, 2], payload)
    return strokes[:, :2] - [[0.003, 0.004], [-0.012, 0.0]]


def test_conditions_are_point_major(points, payloads):
    conditions = all_conditions(points, payloads)
    assert len(conditions) == 125
    assert conditions.payload[:6].tolist() == [30, 120, 260, 310, 470, 30]
    assert conditions.point_index.tolist() == [i // 5 for i in range(125)]
    assert np.array_equal(conditions.targets, points[conditions.point_index])


@pytest.mark.parametrize(
    ("points", "payloads"),
    [([], [1.0]), ([[1.0, 2.0]], []), ([[1.0, 2.0, 3.0]], [1.0]), ([[1.0, np.nan]], [1.0])],
)
def test_bad_conditions_are_told(points, payloads):
    with pytest.raises(ParameterError, match="payloads"):
        all_conditions(points, payloads)


def test_errors_are_desired_minus_achieved_and_failures_stay():
    frame = evaluate(method, two_conditions(), np.zeros((2, 3)), flexible_tip)
    assert frame.columns.tolist() == [
        *("point", "target_x", "target_y", "payload"),
        *("lift_stroke", "jib_stroke", "extension_stroke"),
        *("achieved_x", "achieved_y", "error_x", "error_y", "error", "status", "n_generations"),
    ]
    assert frame["error_x"].tolist() == pytest.approx([0.003, -0.012])
    assert frame["error_y"].tolist() == pytest.approx([0.004, 0.0])
    assert frame["error"].tolist() == pytest.approx([0.005, 0.012])
    assert frame["status"].tolist() == [REACHED, NOT_CONVERGED]
    assert frame["point"].tolist() == [0, 1]
    assert frame["n_generations"].tolist() == [7, 1000]


def test_statistics_by_hand():
    frame = evaluate(method, two_conditions(), np.zeros((2, 3)), flexible_tip)
    assert statistics(frame) == pytest.approx(
        {
            "max_abs_dx": 0.012,
            "max_abs_dy": 0.004,
            "max_error": 0.012,
            "mean_abs_dx": 0.0075,
            "mean_abs_dy": 0.002,
            "mean_error": 0.0085,
            "n_conditions": 2,
            "n_failed": 1,
        }
    )


def test_misfits_are_told():
    conditions = two_conditions()
    with pytest.raises(PositioningError, match="initial strokes: expected shape"):
        evaluate(method, conditions, np.zeros((1, 3)), flexible_tip)
    with pytest.raises(PositioningError, match="achieved tip: sample 1 is not finite"):
        evaluate(
            method, conditions, np.zeros((2, 3)), lambda *_: np.array([[0.0, 0.0], [0.0, np.nan]])
        )

    def clash(targets, payload, initial_strokes):
        return Command(initial_strokes, np.zeros(2, dtype=np.int64), {"error": np.zeros(2)})

    with pytest.raises(DataError, match="'error'"):
        evaluate(clash, conditions, np.zeros((2, 3)), lambda *_: np.zeros((2, 2)))


def test_published_errors_are_consistent():
    published = pd.read_csv(PUBLISHED).set_index("statistic")
    assert published.index.tolist() == list(STATISTICS)
    assert published.columns.tolist() == ["none", "combined", "direct", "modular", "inverse"]
    for kind in ("max", "mean"):
        dx, dy, r = (published.loc[f"{kind}_{c}"] for c in ("abs_dx", "abs_dy", "error"))
        assert (r >= np.maximum(dx, dy)).all()
        assert (r <= dx + dy).all()
    assert published.loc["mean_error", "combined"] == 4.1405


def test_comparison_in_millimetres_beside_the_published():
    published = pd.read_csv(PUBLISHED)
    ours = {name: 0.001 * k for k, name in enumerate(STATISTICS, start=1)}
    table = comparison(
        {"none": ours, "combined (genetic)": ours}, published, {"combined (genetic)": "combined"}
    )
    assert table.index.tolist() == list(STATISTICS)
    assert table["none"].tolist() == pytest.approx([1, 2, 3, 4, 5, 6])
    assert table.loc["max_error", "none published"] == 129.6755
    assert table.loc["max_error", "combined (genetic) published"] == 9.2058
    unpublished = comparison({"none": ours, "mine": ours}, published, {"mine": None})
    assert unpublished["mine"].tolist() == pytest.approx([1, 2, 3, 4, 5, 6])
    assert unpublished["mine published"].isna().all()
    assert unpublished["none published"].equals(table["none published"])
    with pytest.raises(DataError, match="no column 'other'"):
        comparison({"other": ours}, published)
    with pytest.raises(DataError, match="mean_error"):
        comparison({"none": ours}, published.iloc[:5])
