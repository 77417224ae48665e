"""Test conditions, positioning errors, their statistics, and the published ones."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.errors import DataError, ParameterError
from flexik.evaluation.conditions import all_conditions, random_conditions
from flexik.evaluation.errors import (
    STATISTICS,
    comparison,
    evaluate,
    statistics,
    statistics_without,
    workspace_statistics,
    worst_points,
)
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


def test_random_conditions_are_points_of_their_own():
    targets, payload = [[1.0, 2.0], [1.0, 2.0], [4.0, 1.0]], [30.0, 470.0, 30.0]
    conditions = random_conditions(pd.DataFrame(targets, index=[7, 3, 1]), pd.Series(payload))
    assert len(conditions) == 3
    assert conditions.targets.tolist() == targets
    assert conditions.payload.tolist() == payload
    assert conditions.point_index.tolist() == [0, 1, 2]
    assert conditions.point_index.dtype == np.int64
    assert len(random_conditions(np.empty((0, 2)), np.empty(0))) == 0


@pytest.mark.parametrize(
    ("targets", "payload"),
    [([[1.0, 2.0]], [30.0, 50.0]), ([[1.0, 2.0, 3.0]], [30.0]), ([1.0, 2.0], [30.0, 50.0])],
)
def test_random_conditions_of_other_lengths_are_told(targets, payload):
    with pytest.raises(ParameterError, match=r"targets\.shape=.*expected \(m, 2\) and \(m,\)"):
        random_conditions(targets, payload)


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


def test_workspace_statistics_by_hand():
    # 0 to 100 mm in any order: every percentile is a row; three rows failed
    order = np.random.default_rng(0).permutation(101)
    frame = pd.DataFrame({"error": 0.001 * order, "status": np.where(order > 97, NOT_CONVERGED, 0)})
    assert workspace_statistics(frame) == pytest.approx(
        {
            "mean_error": 0.050,
            "median_error": 0.050,
            "p95_error": 0.095,
            "p99_error": 0.099,
            "max_error": 0.100,
            "n_targets": 101,
            "n_failed": 3,
        }
    )
    # percentiles between rows are interpolated
    assert workspace_statistics(frame.iloc[:0:-1])["n_targets"] == 100
    pair = pd.DataFrame({"error": [0.0, 0.010], "status": 0})
    assert workspace_statistics(pair)["p95_error"] == pytest.approx(0.0095)


def errors_of_points():
    """Three points with two payloads; the largest errors are those of (4, 1), then of (3, 2)."""
    errors = [0.001, 0.002, 0.009, 0.001, 0.004, 0.005]
    return pd.DataFrame(
        {
            "target_x": [1.0, 1.0, 4.0, 4.0, 3.0, 3.0],
            "target_y": [2.0, 2.0, 1.0, 1.0, 2.0, 2.0],
            "error_x": errors,
            "error_y": 0.0,
            "error": errors,
            "status": [0, 0, 0, NOT_CONVERGED, 0, 0],
        }
    )


def test_worst_points_have_the_largest_errors_over_their_payloads():
    frame = errors_of_points()
    assert worst_points(frame).tolist() == [[4.0, 1.0], [3.0, 2.0]]
    assert worst_points(frame, 1).tolist() == [[4.0, 1.0]]
    assert worst_points(frame.sample(frac=1.0, random_state=1), 3).tolist() == [
        *([4.0, 1.0], [3.0, 2.0], [1.0, 2.0])
    ]
    with pytest.raises(DataError, match="expected 4 target points or more, found 3"):
        worst_points(frame, 4)


def test_equal_errors_come_by_their_coordinates():
    frame = errors_of_points().assign(error=0.001)
    assert worst_points(frame).tolist() == [[1.0, 2.0], [3.0, 2.0]]


def test_statistics_without_points_by_hand():
    found = statistics_without(errors_of_points(), [[4.0, 1.0]])
    assert found["max_error"] == 0.005
    assert found["mean_error"] == pytest.approx(0.003)
    assert (found["n_conditions"], found["n_failed"]) == (4, 0)


def test_statistics_without_no_point_are_all_statistics():
    frame = errors_of_points()
    assert statistics_without(frame, np.empty((0, 2))) == statistics(frame)


def test_points_that_cannot_be_left_out_are_told():
    frame = errors_of_points()
    # both coordinates are in the frame, not together
    with pytest.raises(DataError, match=r"\(4, 2\)"):
        statistics_without(frame, [[4.0, 1.0], [4.0, 2.0]])
    with pytest.raises(PositioningError, match="points: expected shape"):
        statistics_without(frame, [4.0, 1.0])
    with pytest.raises(DataError, match="no error is left"):
        statistics_without(frame, worst_points(frame, 3))


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
