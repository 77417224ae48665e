"""Figures and tables of a campaign: what they show, and what they refuse."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from flexik.datasets.tables import read_csv
from flexik.errors import DataError
from flexik.evaluation.crane_measured.campaign import campaign_errors, campaign_table
from flexik.evaluation.errors import STATISTICS
from flexik.kinematics.crane import inverse_with_smallest_extension
from flexik.reporting import style
from flexik.reporting.crane_measured import campaign_figures, campaign_tables
from flexik.reporting.tables import markdown

REFERENCE = Path(__file__).resolve().parents[1] / "data/reference/crane"
POINTS = np.array([[3.8, 0.15], [3.8, 0.95], [2.2, 1.75]])
PAYLOADS = np.array([0.0, 86.0, 172.0])
TARGETS, PAYLOAD = np.repeat(POINTS, 3, axis=0), np.tile(PAYLOADS, 3)


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture
def frames():
    """Errors of none: 1 to 9 mm in x, -1 to -9 in y; a third of it with compensation."""
    error = 1e-3 * np.outer(np.arange(1.0, 10.0), [1.0, -1.0])
    return {
        "none": campaign_errors(TARGETS, PAYLOAD, TARGETS - error),
        "combined": campaign_errors(TARGETS, PAYLOAD, TARGETS - error / 3),
    }


@pytest.fixture
def statistics():
    """Two twins, twice as bad the second; errors fall with 1 + N, by half if misjudged."""
    numbers = np.repeat([0, 3, 9, 3, 9], 2)
    mean = 0.006 * np.tile([1.0, 2.0], 5) / (1 + numbers)
    mean[6:] *= 2
    return pd.DataFrame(
        {
            "method": np.repeat(["combined", "adapted", "misjudged"], [2, 4, 4]),
            "n_measurements": numbers,
            "twin": np.tile([0, 1], 5),
            "mean_error": mean,
            "p95_error": 3 * mean,
            "max_error": 4 * mean,
        }
    )


@pytest.mark.parametrize(("axis", "sign"), [("x", 1), ("y", -1)])
def test_every_payload_of_every_point_has_a_bar(frames, axis, sign):
    figure = campaign_figures._figure_errors_by_point(frames, axis)
    for axes, scale in zip(figure.axes, (1, 3), strict=True):
        bars = sorted(
            (p for p in axes.patches if isinstance(p, Rectangle)), key=lambda bar: bar.get_x()
        )
        np.testing.assert_allclose(
            [bar.get_height() for bar in bars], sign * np.arange(1, 10) / scale
        )
        middle = [bar.get_x() + bar.get_width() / 2 for bar in bars]
        np.testing.assert_array_equal(np.round(middle), np.repeat([0, 1, 2], 3))
        assert all(np.diff(middle) > [bar.get_width() for bar in bars[:-1]])
    labels = [text.get_text() for text in figure.axes[1].get_xticklabels()]
    assert labels == ["1\n(3.8, 0.15)", "2\n(3.8, 0.95)", "3\n(2.2, 1.75)"]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()


def dots(axes):
    return np.array([line.get_xydata()[0] for line in axes.lines if line.get_marker() == "o"]), [
        line.get_markerfacecolor() for line in axes.lines if line.get_marker() == "o"
    ]


def test_achieved_points_are_drawn_in_mm_from_the_target(frames):
    axes = campaign_figures._figure_achieved(frames, np.array([3.8, 0.95])).axes[0]
    found, faces = dots(axes)
    away = -np.outer([4.0, 5.0, 6.0], [1.0, -1.0])
    np.testing.assert_allclose(found, np.concatenate([away, away / 3]), atol=1e-9)
    assert [face == "white" for face in faces] == [True] * 3 + [False] * 3
    (cross,) = (line for line in axes.lines if line.get_marker() == "+")
    np.testing.assert_array_equal(cross.get_xydata(), [[0, 0]])
    assert axes.get_aspect() == 1
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert right - left == pytest.approx(top - bottom)
    assert left < -6 and right > 0 and bottom < 0 and top > 6


def test_points_reached_exactly_still_have_a_frame():
    perfect = campaign_errors(POINTS, np.zeros(3), POINTS)
    both = {"none": perfect, "combined": perfect}
    axes = campaign_figures._figure_achieved(both, POINTS[0]).axes[0]
    assert np.ptp(axes.get_xlim()) > 1


@pytest.mark.parametrize("pushes", [None, np.array([False, True, False])])
def test_measured_points_are_numbered_where_they_are(geometry, pushes):
    strokes = inverse_with_smallest_extension(geometry, POINTS).strokes
    axes = campaign_figures._figure_measured_points(geometry, strokes, POINTS, pushes).axes[0]
    assert [text.get_text() for text in axes.texts] == ["1", "2", "3"]
    np.testing.assert_array_equal([text.xy for text in axes.texts], POINTS)
    markers = [line for line in axes.lines if line.get_marker() == "o"]
    np.testing.assert_array_equal([line.get_xydata()[0] for line in markers], POINTS)
    pushing = [line.get_markerfacecolor() == "white" for line in markers]
    assert pushing == (pushes.tolist() if pushes is not None else [False] * 3)
    # the last links drawn end in the last point
    tips = [line.get_xydata()[-1] for line in axes.lines if line.get_color() == style.ORANGE]
    np.testing.assert_allclose(tips, POINTS, atol=1e-9)
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    assert (low < [-0.09, 0]).all() and (high > POINTS.max(axis=0)).all()


def test_adaptation_shows_mean_and_band_of_the_twins(statistics):
    goals = {3: 0.003, 9: 0.002}
    panels = campaign_figures._figure_adaptation(statistics, goals).axes
    for axes, factor in zip(panels, (1, 3), strict=True):
        curve = next(line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_allclose(curve.get_xdata(), [0, 3, 9])
        np.testing.assert_allclose(curve.get_ydata(), factor * np.array([9, 2.25, 0.9]))
        squares = next(line for line in axes.lines if line.get_marker() == "s")
        np.testing.assert_allclose(squares.get_xdata(), [3, 9])
        np.testing.assert_allclose(squares.get_ydata(), factor * np.array([4.5, 1.8]))
        (band,) = axes.collections
        edge = band.get_paths()[0].vertices
        for x, mean in zip([0, 3, 9], [9, 2.25, 0.9], strict=True):
            here = factor * mean * np.array([2 / 3, 4 / 3])
            assert set(np.round(edge[edge[:, 0] == x, 1], 9)) == set(np.round(here, 9))
    marks = [line for line in panels[0].lines if line.get_marker() == "v"]
    np.testing.assert_allclose([line.get_xydata()[0] for line in marks], [[3, 3], [9, 2]])
    assert not [line for line in panels[1].lines if line.get_marker() == "v"]


def test_figures_are_written_and_depend_on_the_data_alone(tmp_path, geometry, frames, statistics):
    strokes = inverse_with_smallest_extension(geometry, POINTS).strokes
    draw = {
        "points": lambda path: campaign_figures.measured_points(
            path, geometry, strokes, POINTS, [True, False, True]
        ),
        "dx": lambda path: campaign_figures.errors_by_point(path, frames, "x"),
        "about": lambda path: campaign_figures.achieved(path, frames, (3.8, 0.15)),
        "adaptation": lambda path: campaign_figures.adaptation(path, statistics, {9: 0.002}),
    }
    for name, function in draw.items():
        first, second = tmp_path / f"{name}.png", tmp_path / f"{name}2.png"
        function(first)
        function(second)
        assert first.read_bytes()[:4] == b"\x89PNG"
        assert first.read_bytes() == second.read_bytes()


def test_figures_refuse_what_they_cannot_show(tmp_path, geometry, frames, statistics):
    path = tmp_path / "figure.png"
    with pytest.raises(DataError, match="no target \\(1, 2\\) m"):
        campaign_figures.achieved(path, frames, (1.0, 2.0))
    with pytest.raises(DataError, match="expected 'x' or 'y'"):
        campaign_figures.errors_by_point(path, frames, "z")
    with pytest.raises(DataError, match=r"campaign: expected \['combined'\] too"):
        campaign_figures.errors_by_point(path, {"none": frames["none"]}, "x")
    spoilt = frames["none"].assign(error_x=np.nan)
    with pytest.raises(DataError, match="campaign, none: error_x is not finite"):
        campaign_figures.errors_by_point(path, {**frames, "none": spoilt}, "x")
    with pytest.raises(DataError, match="expected one each"):
        campaign_figures.measured_points(path, geometry, np.zeros((2, 3)), POINTS)
    with pytest.raises(DataError, match="pushes"):
        campaign_figures.measured_points(path, geometry, np.zeros((3, 3)), POINTS, [True])
    with pytest.raises(DataError, match="mean_error must be positive"):
        campaign_figures.adaptation(path, statistics.assign(mean_error=0.0))
    assert not path.exists()


def published(name):
    return read_csv(REFERENCE / f"{name}.csv", campaign_tables.PUBLISHED_COLUMNS, ("statistic",))


def test_tables_have_the_published_values_beside_ours(frames):
    theirs = published("measured_errors")
    table = campaign_tables.measured_errors_table(campaign_table(frames), theirs)
    assert list(table.columns) == [
        *("compensation", "statistic", "0 kg", "0 kg published", "86 kg", "86 kg published"),
        *("172 kg", "172 kg published", "all", "all published"),
    ]
    assert table["compensation"].tolist() == ["without"] * 6 + ["with"] * 6
    row = table[(table["compensation"] == "with") & (table["statistic"] == "mean |dX| (mm)")]
    np.testing.assert_allclose(
        row.iloc[0, 2:].astype(float), [4 / 3, 8.2, 5 / 3, 8.2, 2, 7.9, 5 / 3, 8.1]
    )
    largest = table[table["statistic"] == "max R (mm)"]
    np.testing.assert_array_equal(largest["172 kg published"], [28.9, 15.6])
    np.testing.assert_array_equal(largest["all published"], [28.8, 16.6])
    np.testing.assert_allclose(largest["all"], [9 * np.sqrt(2), 3 * np.sqrt(2)])
    assert markdown(table, 1).count("\n") == 14


def test_text_of_the_thesis_agrees_with_its_tables():
    measured = published("measured_errors").set_index("statistic")
    reference = published("measured_reference_errors").set_index("statistic")
    both = ["none_all", "combined_all"]
    assert measured.loc["max_error", both].tolist() == [28.8, 16.6]
    assert measured.loc["mean_error", both].tolist() == [15.5, 10.7]
    assert reference.loc["max_error", both].tolist() == [27.5, 11.0]
    assert reference.loc["mean_error", both].tolist() == [10.6, 4.7]
    assert (reference["combined_0_kg"] == 0).all()
    # 28.9 beside 28.8 is the one entry that cannot be
    impossible = [
        (name, method)
        for table in (measured, reference)
        for name in table.index
        for method in ("none", "combined")
        if name.startswith("max")
        and table.loc[name, [f"{method}_{p}_kg" for p in (0, 86, 172)]].max()
        != table.loc[name, f"{method}_all"]
    ]
    assert impossible == [("max_error", "none")]


def test_other_payloads_have_nothing_published(frames):
    other = {name: frame.assign(payload=frame["payload"] / 2) for name, frame in frames.items()}
    table = campaign_tables.measured_errors_table(
        campaign_table(other), published("measured_errors")
    )
    assert {"43 kg", "43 kg published", "86 kg published"} <= set(table.columns)
    assert table["43 kg published"].isna().all()
    assert table["86 kg published"].notna().all()
    assert table["all published"].isna().all()
    with pytest.raises(DataError, match="published measured errors: expected"):
        campaign_tables.measured_errors_table(
            campaign_table(other), published("measured_errors").iloc[1:]
        )
    assert set(published("measured_errors")["statistic"]) == set(STATISTICS)


def test_adaptation_table_counts_from_the_unadapted(statistics):
    table = campaign_tables.adaptation_table(statistics)
    assert table["method"].tolist() == ["combined", *["adapted"] * 2, *["misjudged"] * 2]
    assert table["N"].tolist() == [0, 3, 9, 3, 9]
    np.testing.assert_allclose(table["mean R (mm)"], [9, 2.25, 0.9, 4.5, 1.8])
    np.testing.assert_allclose(table["95th percentile of R (mm)"], [27, 6.75, 2.7, 13.5, 5.4])
    np.testing.assert_allclose(table["mean R of the worst crane (mm)"], [12, 3, 1.2, 6, 2.4])
    np.testing.assert_allclose(table["max R (mm)"], [48, 12, 4.8, 24, 9.6])
    np.testing.assert_allclose(table["ratio to unadapted"], [1, 0.25, 0.1, 0.5, 0.2])
    with pytest.raises(DataError, match="expected the unadapted first"):
        campaign_tables.adaptation_table(statistics[statistics["n_measurements"] > 0])
