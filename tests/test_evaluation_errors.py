"""Test conditions, positioning errors, their statistics, and the published ones."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.tables import Field
from flexik.errors import DataError, ParameterError
from flexik.evaluation.conditions import Conditions, every
from flexik.evaluation.errors import (
    STATISTICS,
    TIP_ERRORS,
    check,
    comparison,
    evaluate,
    fields_of,
    statistics,
    statistics_without,
    tip_judge,
    workspace_statistics,
    worst_points,
)
from flexik.kinematics.status import NOT_CONVERGED, REACHED
from flexik.positioning.method import Answer, Columns, PositioningError

PUBLISHED = Path(__file__).parents[1] / "data/reference/crane/positioning_errors.csv"


COLUMNS = Columns(
    query=tuple(
        Field(n, u, n) for n, u in (("target_x", "m"), ("target_y", "m"), ("payload", "kg"))
    ),
    answer=tuple(Field(name, "m", name) for name in ("lift", "jib", "extension")),
    errors=TIP_ERRORS,
    lower=(0.0, 0.0, 0.0),
    upper=(9.0, 9.0, 900.0),
)


def two_conditions():
    query, group = every([[1.0, 2.0], [4.0, 1.0]], [30.0])
    return Conditions(query, np.zeros((2, 3)), group)


def method(query, current):
    """Answers whose fake tip is (3, 4) mm and (-12, 0) mm short; the second row fails."""
    assert current.shape == query.shape
    status = np.array([REACHED, NOT_CONVERGED])
    return Answer(query, status, {"n_generations": np.array([7, 1000]), "residual": np.ones(2)})


def flexible_tip(strokes, payload):
    assert np.array_equal(strokes[:, 2], payload)
    return strokes[:, :2] - [[0.003, 0.004], [-0.012, 0.0]]


def evaluated():
    return evaluate(method, two_conditions(), tip_judge(flexible_tip), COLUMNS)


def test_conditions_are_point_major(points, payloads):
    query, group = every(points, payloads)
    assert query.shape == (125, 3)
    assert query[:6, 2].tolist() == [30, 120, 260, 310, 470, 30]
    assert group.tolist() == [i // 5 for i in range(125)]
    assert np.array_equal(query[:, :2], points[group])


@pytest.mark.parametrize(
    ("points", "payloads"),
    [([], [1.0]), ([[1.0, 2.0]], []), ([[1.0, 2.0, 3.0]], [1.0]), ([[1.0, np.nan]], [1.0])],
)
def test_bad_conditions_are_told(points, payloads):
    with pytest.raises(ParameterError, match="payloads"):
        every(points, payloads)


def test_conditions_in_pieces_are_whole_rows_in_order(points, payloads):
    query, group = every(points, payloads)
    conditions = Conditions(query, np.arange(250.0).reshape(125, 2), group)
    pieces = conditions.chunks(40)
    assert [len(piece) for piece in pieces] == [40, 40, 40, 5]
    for name in ("query", "current", "group"):
        together = np.concatenate([getattr(piece, name) for piece in pieces])
        assert np.array_equal(together, getattr(conditions, name))
    with pytest.raises(ParameterError, match=r"self\.current\.shape=\(3, 2\)"):
        Conditions(query, conditions.current[:3], group)


def test_errors_are_desired_minus_achieved_and_failures_stay():
    table = evaluated()
    assert list(table) == [
        *("point", "target_x", "target_y", "payload", "lift", "jib", "extension"),
        *("achieved_x", "achieved_y", "error_x", "error_y", "error", "status"),
        *("n_generations", "residual"),
    ]
    assert table["error_x"].tolist() == pytest.approx([0.003, -0.012])
    assert table["error_y"].tolist() == pytest.approx([0.004, 0.0])
    assert table["error"].tolist() == pytest.approx([0.005, 0.012])
    assert table["status"].tolist() == [REACHED, NOT_CONVERGED]
    assert table["point"].tolist() == [0, 1]
    assert table["n_generations"].tolist() == [7, 1000]
    fields = fields_of(table, COLUMNS)
    assert [field.name for field in fields] == list(table)
    assert [(f.unit, f.dtype) for f in fields[-2:]] == [("1", "int64"), ("m", "float64")]


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("payload", np.nan, "query not finite in row 0"),
        ("status", 17, "status unknown in row 0"),
        ("lift", np.nan, "answer not finite in row 0"),
        ("lift", 9.1, "answer beyond its limits in row 0"),
        ("jib", -0.1, "answer beyond its limits in row 0"),
        ("error", np.nan, "error negative or not finite in row 0"),
        ("error", -1.0, "error negative or not finite in row 0"),
    ],
)
def test_a_long_table_is_checked(column, value, message):
    frame = pd.DataFrame(evaluated())
    check(frame, COLUMNS)
    wrong = frame.assign(**{column: [value, frame[column][1]]})
    with pytest.raises(DataError, match=message):
        check(wrong, COLUMNS)
    if message.startswith(("answer", "error")):  # where a method failed there may be none
        check(frame.assign(**{column: [frame[column][0], value]}), COLUMNS)
    with pytest.raises(DataError, match=f"expected columns .'{column}'. too"):
        check(frame.drop(columns=column), COLUMNS)


def test_statistics_by_hand():
    frame = pd.DataFrame(evaluated())
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
    conditions, still = two_conditions(), tip_judge(lambda values, payload: values[:, :2])
    with pytest.raises(PositioningError, match="achieved tip: sample 1 is not finite"):
        evaluate(method, conditions, tip_judge(lambda *_: np.array([[0, 0], [0, np.nan]])), COLUMNS)

    def clash(query, current):
        return Answer(current, np.zeros(2, dtype=np.int64), {"error": np.zeros(2)})

    with pytest.raises(DataError, match="'error'"):
        evaluate(clash, conditions, still, COLUMNS)


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
