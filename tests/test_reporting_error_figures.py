"""Error figures in the cases beside the published one: one payload, nothing published."""

import numpy as np
import pandas as pd
import pytest

from flexik.evaluation.errors import STATISTICS, comparison
from flexik.reporting import style
from flexik.reporting.crane import error_figures


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture
def compared():
    """Make rows of 1 to 6 mm, tenfold without compensation; nothing is published of new."""
    ours = {name: 1e-3 * k for k, name in enumerate(STATISTICS, start=1)}
    published = pd.DataFrame(
        {
            "statistic": list(STATISTICS),
            "none": 11.0 * np.arange(1, 7),
            "combined": 2.0 * np.arange(1, 7),
        }
    )
    by_method = {"none": {name: 10 * v for name, v in ours.items()}, "new": ours, "ga": ours}
    return comparison(by_method, published, {"new": None, "ga": "combined"})


def dots(axes, filled):
    """Positions (n, 2) of the dots, filled ours or open published ones."""
    found = [
        np.column_stack(line.get_data())
        for line in axes.lines
        if line.get_marker() == "o" and (line.get_markerfacecolor() != "white") == filled
    ]
    return np.concatenate(found)


def test_comparison_has_a_dot_for_every_known_value(compared):
    figure = error_figures._figure_method_comparison(compared)
    for axes, row in zip(figure.axes, (6, 3), strict=True):
        np.testing.assert_allclose(dots(axes, filled=True), [[10 * row, 0], [row, 1], [row, 2]])
        np.testing.assert_allclose(dots(axes, filled=False), [[11 * row, 0], [2 * row, 2]])
        expected = [10 * row, 11 * row, row, row, 2 * row]
        texts = [text.get_text() for text in axes.texts]
        assert sorted(texts) == sorted(f"{value:.2f}" for value in expected)
        low, high = axes.get_xlim()
        assert low < row and 11 * row < high
        assert not axes.patches
    ticks = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert ticks == ["none", "new", "ga"]


def test_a_line_joins_ours_with_the_published(compared):
    axes = error_figures._figure_method_comparison(compared).axes[1]
    joined = [line.get_xydata() for line in axes.lines if line.get_marker() == "None"]
    drawn = [line for line in joined if np.isfinite(line).all()]
    np.testing.assert_allclose(drawn, [[[30, 0], [33, 0]], [[3, 2], [6, 2]]])


@pytest.mark.parametrize(("payloads", "offsets"), [([120.0], [0.0]), ([30.0, 50.0], [-0.34, 0.34])])
def test_dots_lie_about_the_tick_of_their_point(payloads, offsets):
    n = 3 * len(payloads)
    frame = pd.DataFrame(
        {
            "point": np.repeat(np.arange(3), len(payloads)),
            "target_x": np.repeat([1.0, 2.0, 3.0], len(payloads)),
            "target_y": 1.0,
            "payload": np.tile(payloads, 3),
            "error_x": np.linspace(-0.01, 0.01, n),
            "error_y": 0.002,
            "error": 0.01,
            "status": 0,
        }
    )
    axes = error_figures._figure_positioning_errors(frame, frame, "combined").axes[0]
    expected = (np.arange(3)[:, None] + offsets).ravel()
    np.testing.assert_allclose(axes.lines[0].get_xdata(), expected)
