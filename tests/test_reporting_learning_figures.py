"""The figure of the size selection: what it shows, where, and what it refuses."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.crane import learning_figures


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture
def sizes():
    n_hidden = np.arange(4, 13)
    least = 0.5 / n_hidden
    return pd.DataFrame(
        {
            "n_hidden": n_hidden,
            "training_error": 1.1 * least,
            "selection_error": least,
            "median_selection_error": 1.5 * least,
            "worst_selection_error": 3.0 * least,
        }
    )


def lines_of(figure):
    return {line.get_label(): line for line in figure.axes[0].lines}


def test_every_column_is_drawn_under_its_name(sizes):
    figure = learning_figures._figure_size_selection(sizes, 12, 8, 0.0)
    lines = lines_of(figure)
    drawn = {
        "selection error of the best restart": "selection_error",
        "training error of the best restart": "training_error",
        "median selection error of restarts": "median_selection_error",
    }
    for label, column in drawn.items():
        np.testing.assert_array_equal(lines[label].get_xdata(), sizes["n_hidden"])
        np.testing.assert_array_equal(lines[label].get_ydata(), sizes[column])
    (band,) = figure.axes[0].collections
    corners = band.get_paths()[0].vertices
    assert corners[:, 1].min() == sizes["selection_error"].min()
    assert corners[:, 1].max() == sizes["worst_selection_error"].max()
    assert list(lines["chosen: 12"].get_xdata()) == [12, 12]
    assert list(lines["published: 8"].get_xdata()) == [8, 8]


def test_without_a_published_size_there_is_no_mark(sizes):
    lines = lines_of(learning_figures._figure_size_selection(sizes, 9, None, 0.0))
    assert "chosen: 9" in lines
    assert not [label for label in lines if label.startswith("published")]


def test_labels_carry_units_and_the_title_the_rule(sizes):
    axes = learning_figures._figure_size_selection(sizes, 12, 8, 0.0).axes[0]
    assert axes.get_xlabel().endswith("(1)") and axes.get_ylabel().endswith("(1)")
    assert axes.get_title(loc="left") == "Choice: size of the least selection error"
    axes = learning_figures._figure_size_selection(sizes, 9, 8, 0.05).axes[0]
    assert axes.get_title(loc="left").endswith("within 5 % of the least")


@pytest.mark.parametrize("rows", [slice(None), slice(0, 2), slice(0, 1)])
def test_the_legend_lies_beyond_the_axes_and_ticks_are_whole(sizes, rows):
    figure = learning_figures._figure_size_selection(sizes[rows], 4, 8, 0.0)
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    (axes,) = figure.axes
    (legend,) = figure.legends
    assert axes.get_legend() is None
    assert legend.get_window_extent().y0 > axes.bbox.y1
    assert all(tick == round(tick) for tick in axes.get_xticks())


def test_same_bytes_and_a_clear_error(tmp_path, sizes):
    paths = [tmp_path / "first.png", tmp_path / "second.png"]
    for path in paths:
        learning_figures.size_selection(path, sizes, 12, None, 0.0)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with pytest.raises(DataError, match=r"size selection.*worst_selection_error"):
        learning_figures.size_selection(
            tmp_path / "third.png", sizes.drop(columns="worst_selection_error"), 12, None, 0.0
        )
    assert sorted(tmp_path.iterdir()) == paths
