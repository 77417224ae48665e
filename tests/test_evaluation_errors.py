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
    evaluate,
    fields_of,
    statistics,
    tip_judge,
    workspace_statistics,
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
