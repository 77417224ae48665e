"""Figures of methods side by side: what they show, and what they refuse."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.crane import method_figures


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


def errors(scale, seed=0, n=300):
    """Errors of `scale` m at targets of a sector with a hole."""
    rng = np.random.default_rng(seed)
    angle, radius = rng.uniform(-0.7, 1.2, n), rng.uniform(2.0, 6.0, n)
    return pd.DataFrame(
        {
            "target_x": radius * np.cos(angle),
            "target_y": radius * np.sin(angle),
            "error": scale * rng.uniform(0.1, 1.0, n),
        }
    )


@pytest.fixture
def frames():
    return {"none": errors(0.1), "combined": errors(4e-3, 1), "modular": errors(5e-3, 2)}


@pytest.fixture
def studies():
    tolerance = np.array([1e-5, 1e-7, 1e-8])
    return {
        name: pd.DataFrame(
            {
                "tolerance": tolerance,
                "mean_error": scale * np.array([2.0, 1.1, 1.0]),
                "mean_iterations": np.array([0.0, 2.5, 3.0]) * factor,
                "max_iterations": np.array([1.0, 4.0, 6.0]) * factor,
            }
        )
        for name, scale, factor in (("direct", 2e-3, 1), ("modular", 3e-3, 20))
    }


@pytest.fixture
def published():
    return pd.DataFrame(
        {
            "method": ["direct", "direct", "another"],
            "tolerance": [1e-5, 1e-7, 1e-7],
            "mean_iterations": [114, 129, 127],
            "max_iterations": [155, 232, 163],
        }
    )


@pytest.fixture
def curves():
    seconds = np.array([0.0, 0.1, 1.0, 10.0])
    return pd.concat(
        pd.DataFrame({"trainer": name, "seconds": seconds, "error": 0.5 / (1 + rate * seconds)})
        for name, rate in (("Levenberg-Marquardt", 30.0), ("gradient descent", 0.1))
    )


@pytest.fixture
def table():
    return pd.DataFrame(
        {
            "method": ["none", "combined", "direct_inverse", "combined_ga", "modular"],
            "operations": [60, 900, 26000, 42000, 52000],
            "microseconds_single": [40, 120, 2000, 9000, 3100],
            "microseconds_batched": [0.4, 3.0, 90.0, 600.0, 130.0],
            "mean_error": [31.9, 1.8, 4.0, 3.9, 4.2],
        }
    )


@pytest.fixture
def writers(frames, studies, published, curves, table):
    return {
        "map": lambda path: method_figures.error_map(path, frames),
        "distribution": lambda path: method_figures.error_distribution(path, frames),
        "tolerance": lambda path: method_figures.tolerance_study(path, studies, published),
        "race": lambda path: method_figures.training_race(path, curves),
        "operations": lambda path: method_figures.operations(path, table),
    }


@pytest.mark.parametrize("name", ["map", "distribution", "tolerance", "race", "operations"])
def test_same_bytes_every_time(writers, tmp_path, name):
    paths = [tmp_path / "first.png", tmp_path / "second.png"]
    for path in paths:
        writers[name](path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == paths


def cells(axes):
    """Means in mm by corner of the square, of a panel of the map."""
    (mesh,) = axes.collections
    corners = mesh.get_coordinates()[:-1, :-1].reshape(-1, 2)
    values = mesh.get_array().ravel()
    known = ~np.ma.getmaskarray(values)
    return dict(zip(map(tuple, corners[known]), values[known].data, strict=True))


def test_a_cell_holds_the_mean_of_its_targets_and_payloads():
    frame = pd.DataFrame(
        {
            # 1.25 belongs to the square that it begins; the second and third are one target
            "target_x": [1.0, 1.25, 1.25, 2.9],
            "target_y": [-0.1, 0.3, 0.3, 0.3],
            "error": [0.001, 0.002, 0.006, 0.05],
        }
    )
    figure = method_figures._figure_error_map({"mine": frame})
    found = cells(figure.axes[0])
    assert found == {
        (1.0, -0.25): pytest.approx(1.0),
        (1.25, 0.25): pytest.approx(4.0),
        (2.75, 0.25): pytest.approx(50.0),
    }


@pytest.mark.parametrize("n", [1, 4, 5, 8])
def test_every_method_has_a_panel_of_the_same_scales(n):
    frames = {f"method {k}": errors(10.0**-k, k) for k in range(1, n + 1)}
    figure = method_figures._figure_error_map(frames)
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    *panels, bar = figure.axes
    panels = [axes for axes in panels if axes.axison]
    assert [axes.get_title(loc="left") for axes in panels] == list(frames)
    norms = {(axes.collections[0].norm.vmin, axes.collections[0].norm.vmax) for axes in panels}
    assert len(norms) == 1
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    assert all(axes.get_aspect() == 1.0 for axes in panels)
    assert "(mm)" in bar.get_xlabel()
    assert all(axes.get_xlabel() == "x (m)" for axes in panels[-min(n, 2) :])
    size = figure.get_size_inches()
    assert size[0] == style.WIDTH and size[1] < 9.4
    boxes = [axes.get_tightbbox() for axes in panels]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


def test_errors_below_the_scale_are_coloured_as_its_least_and_not_left_white():
    frames = {"exact": errors(0.1).assign(error=0.0), "none": errors(0.1)}
    figure = method_figures._figure_error_map(frames)
    norm = figure.axes[0].collections[0].norm
    assert norm.vmin > 0
    assert set(cells(figure.axes[0]).values()) == {norm.vmin}
    assert len(cells(figure.axes[0])) == len(cells(figure.axes[1]))


def test_ticks_of_the_colours_are_decades():
    figure = method_figures._figure_error_map({"a": errors(0.1), "b": errors(1e-3)})
    bar = figure.axes[-1]
    assert [text.get_text() for text in bar.get_xticklabels()] == ["0.1", "1", "10", "100"]


def test_the_distribution_rises_by_a_condition_at_every_error():
    frame = pd.DataFrame({"target_x": 1.0, "target_y": 2.0, "error": [0.003, 0.001, 0.002, 0.02]})
    figure = method_figures._figure_error_distribution({"mine": frame})
    (axes,) = figure.axes
    line = next(line for line in axes.lines if line.get_drawstyle() == "steps-post")
    expected = [[1, 0], [1, 25], [2, 50], [3, 75], [20, 100]]
    np.testing.assert_allclose(line.get_xydata(), expected)
    dots = [line.get_xydata()[0] for line in axes.lines if line.get_drawstyle() == "default"]
    np.testing.assert_allclose(dots, [[2, 50], [20, 100]])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["mine: 2, 20"]
    assert axes.get_xscale() == "log" and "(mm)" in axes.get_xlabel()


def test_marks_lie_on_the_lines_at_half_and_at_nearly_all_conditions(frames):
    figure = method_figures._figure_error_distribution(frames)
    (axes,) = figure.axes
    marks = {q: method_figures.MARKED[q] for q in (0.5, 0.99)}
    for q, shape in marks.items():
        dots = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == shape]
        expected = [
            1e3 * np.quantile(f["error"], q, method="inverted_cdf") for f in frames.values()
        ]
        np.testing.assert_allclose(np.array(dots)[:, 0], expected)
        np.testing.assert_allclose(np.array(dots)[:, 1], 100 * q, atol=0.2)


def test_an_error_of_zero_is_drawn_at_the_edge():
    frames = {"exact": errors(0.1).assign(error=0.0), "none": errors(0.1)}
    (axes,) = method_figures._figure_error_distribution(frames).axes
    for line in axes.lines:
        assert (line.get_xdata() >= axes.get_xlim()[0] * (1 - 1e-12)).all()


def test_the_tolerance_study_shows_its_columns(studies, published):
    figure = method_figures._figure_tolerance_study(studies, published)
    left, right = figure.axes
    for line, study in zip(left.lines, studies.values(), strict=True):
        rows = study.sort_values("tolerance")
        np.testing.assert_allclose(line.get_xdata(), rows["tolerance"])
        np.testing.assert_allclose(line.get_ydata(), 1e3 * rows["mean_error"])
    drawn = [line.get_ydata() for line in right.lines]
    for study in studies.values():
        rows = study.sort_values("tolerance")
        for column in ("mean_iterations", "max_iterations"):
            assert any(np.array_equal(values, rows[column]) for values in drawn)
    mean, largest = right.lines[:2]
    assert mean.get_linewidth() > largest.get_linewidth()
    assert right.get_ylim()[0] == 0.0 and right.get_ylim()[1] > 232
    assert left.get_yscale() == left.get_xscale() == right.get_xscale() == "log"
    assert left.get_ylabel() == "mean R (mm)"


def test_published_iterations_are_open_marks_of_their_methods_colour(studies, published):
    figure = method_figures._figure_tolerance_study(studies, published)
    right = figure.axes[1]
    marks = [line for line in right.lines if line.get_linestyle() == "None"]
    assert [line.get_color() for line in marks] == [style.BLUE] * 2 + [style.INK] * 2
    expected = [[114, 129], [155, 232], [127], [163]]
    assert [list(line.get_ydata()) for line in marks] == expected
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["direct", "modular", "direct, published", "another, published"]
    nothing = method_figures._figure_tolerance_study(studies, published[:0])
    assert len(nothing.axes[1].lines) == 4


def test_the_race_begins_at_the_left_edge_and_ends_with_a_dot(curves):
    figure = method_figures._figure_training_race(curves)
    (axes,) = figure.axes
    lines = [line for line in axes.lines if len(line.get_xdata()) > 1]
    for line, (name, rows) in zip(lines, curves.groupby("trainer", sort=False), strict=True):
        assert line.get_label() == name
        assert line.get_xdata()[0] == pytest.approx(axes.get_xlim()[0])
        np.testing.assert_array_equal(line.get_xdata()[1:], rows["seconds"][1:])
        np.testing.assert_array_equal(line.get_ydata(), rows["error"])
    ends = [line.get_xydata()[0] for line in axes.lines if len(line.get_xdata()) == 1]
    np.testing.assert_allclose(ends, [[10, 0.5 / 301], [10, 0.25]])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["Levenberg-Marquardt", "gradient descent"]
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_costs_are_joined_and_in_place(table):
    figure = method_figures._figure_operations(table)
    left, right = figure.axes
    dots = [line.get_xydata()[0] for line in left.lines]
    np.testing.assert_allclose(dots, table[["operations", "mean_error"]])
    joined = [line.get_xydata() for line in right.lines if len(line.get_xdata()) == 2]
    times = table[["microseconds_batched", "microseconds_single"]]
    np.testing.assert_allclose(np.array(joined)[:, :, 0], times)
    opened = [line.get_xdata()[0] for line in right.lines if line.get_markerfacecolor() == "white"]
    np.testing.assert_allclose(opened, table["microseconds_batched"])


@pytest.mark.parametrize("crowd", [1.0, 0.1])
def test_labels_of_costs_cover_neither_each_other_nor_dots(table, crowd):
    for name in method_figures.COST_COLUMNS:  # closer together on the logarithmic scale
        middle = table[name].median()
        table[name] = middle * (table[name] / middle) ** crowd
    figure = method_figures._figure_operations(table)
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    for axes, name in zip(figure.axes, ("operations", "microseconds_single"), strict=True):
        assert [text.get_text() for text in axes.texts] == list(table["method"])
        boxes = [super(type(text), text).get_window_extent() for text in axes.texts]
        for k, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:k])
            spots = axes.transData.transform(table[[name, "mean_error"]])
            assert not any(box.contains(*spot) for spot in spots)
            assert figure.bbox.x0 < box.x0 and box.x1 < figure.bbox.x1


@given(st.floats(1e-9, 1e9), st.floats(1.0, 1e6))
def test_ticks_lie_within_the_scale_and_decades_are_enough(low, ratio):
    ticks = method_figures._ticks(low, low * ratio)
    assert all(low <= tick <= low * ratio for tick in ticks)
    assert ticks == sorted(set(ticks))
    assert len(ticks) <= 9
    if ratio >= 5:
        assert len(ticks) >= 2


def test_texts_of_ticks_are_all_decimals_or_all_powers():
    assert method_figures._texts([0.002, 1.0, 50.0]) == ["0.002", "1", "50"]
    assert method_figures._texts([1e-7, 2e-5, 1.0]) == [
        *("$10^{-7}$", r"$2\times10^{-5}$", "$10^{0}$")
    ]


def test_eight_methods_are_told_apart():
    looks = method_figures._looks("abcdefgh")
    assert len({look["color"] for look in looks.values()}) == 8
    more = method_figures._looks("abcdefghijkl").values()
    assert len({tuple(look.values()) for look in more}) == 12


def test_refusals_of_errors_name_the_method(tmp_path, frames):
    path = tmp_path / "figure.png"
    for write in (method_figures.error_map, method_figures.error_distribution):
        with pytest.raises(DataError, match="a frame for every method"):
            write(path, {})
        with pytest.raises(DataError, match=r"errors of combined.*target_y"):
            write(path, frames | {"combined": frames["combined"].drop(columns="target_y")})
        with pytest.raises(DataError, match=r"errors of none: error is not finite"):
            write(path, frames | {"none": frames["none"].assign(error=np.nan)})
        with pytest.raises(DataError, match=r"errors of none: error is -1, expected no negative"):
            write(path, frames | {"none": frames["none"].assign(error=-1.0)})
        with pytest.raises(DataError, match=r"errors of none: expected rows"):
            write(path, frames | {"none": frames["none"][:0]})
    assert not list(tmp_path.iterdir())


def test_other_refusals_name_what_is_wrong(tmp_path, studies, published, curves, table):
    path = tmp_path / "figure.png"
    with pytest.raises(DataError, match=r"tolerance study.*a frame for every method"):
        method_figures.tolerance_study(path, {}, published)
    with pytest.raises(DataError, match=r"study of direct: mean_error is 0, expected positive"):
        exact = studies["direct"].assign(mean_error=0.0)
        method_figures.tolerance_study(path, studies | {"direct": exact}, published)
    with pytest.raises(DataError, match=r"published tolerances.*max_iterations"):
        method_figures.tolerance_study(path, studies, published.drop(columns="max_iterations"))
    with pytest.raises(DataError, match=r"published tolerances: mean_iterations is not finite"):
        method_figures.tolerance_study(path, studies, published.assign(mean_iterations=np.nan))
    with pytest.raises(DataError, match=r"training race.*trainer"):
        method_figures.training_race(path, curves.drop(columns="trainer"))
    with pytest.raises(DataError, match=r"training race: error is 0, expected positive"):
        method_figures.training_race(path, curves.assign(error=0.0))
    with pytest.raises(DataError, match=r"every time is 0 s"):
        method_figures.training_race(path, curves.assign(seconds=0.0))
    with pytest.raises(DataError, match=r"operations.*method"):
        method_figures.operations(path, table.drop(columns="method"))
    with pytest.raises(DataError, match=r"operations: mean_error is 0, expected positive"):
        method_figures.operations(path, table.assign(mean_error=0.0))
    assert not list(tmp_path.iterdir())
