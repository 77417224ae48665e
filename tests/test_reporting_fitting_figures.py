"""Figures of what networks are trained on and how they fit: what they show, what they refuse."""

import itertools

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from flexik.errors import DataError
from flexik.learning.size_selection import by_size
from flexik.reporting import style
from flexik.reporting.crane import figures as crane_figures
from flexik.reporting.crane import fitting_figures

PANELS = ("2 hidden neurons: too few", "14 hidden neurons", "200 hidden neurons: too many")


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture
def grid():
    """Make 150 solved vectors and one that was not."""
    n = 151
    t = np.linspace(0.0, 1.0, n)
    frame = pd.DataFrame(
        {
            "lift_stroke": t,
            "jib_stroke": t,
            "extension_stroke": t,
            "payload": 50.0,
            "rigid_x": 1.0 + 5.0 * np.sin(7.0 * t),
            "rigid_y": -3.0 + 10.0 * t,
            "status": 0,
        }
    )
    frame["tip_x"], frame["tip_y"] = frame["rigid_x"] + 0.01, frame["rigid_y"] - 0.1 * t
    frame.loc[70, "status"] = 2
    frame.loc[70, ["tip_x", "tip_y"]] = np.nan
    return frame


@pytest.fixture
def curves():
    x = np.linspace(0.0, 0.5, 60)
    truth = -30 + 200 * (x - 0.2) ** 2
    networks = (np.full_like(x, -27.0), truth + 0.05, truth + 2 * np.sin(120 * x))
    frames = [
        pd.DataFrame({"panel": panel, "x": x, "truth": truth, "network": network})
        for panel, network in zip(PANELS, networks, strict=True)
    ]
    return pd.concat(frames, ignore_index=True)


@pytest.fixture
def samples(curves):
    few = curves.groupby("panel", sort=False).nth(slice(0, None, 10))
    return few.rename(columns={"truth": "value"})[["panel", "x", "value"]]


@pytest.fixture
def studies():
    def study(sizes, scale):
        runs = [(n, restart, scale / n * (1 + restart)) for n in sizes for restart in range(2)]
        frame = pd.DataFrame(runs, columns=["n_hidden", "restart", "selection_error"])
        frame["training_error"] = 0.8 * frame["selection_error"]
        frame.loc[frame["n_hidden"] == 8, ["selection_error", "training_error"]] = np.nan
        return by_size(frame)

    names = ("deflection", "direct", "modular_rigid", "modular_difference", "inverse")
    return {name: study(range(4, 13), 10.0**-k) for k, name in enumerate(names, start=1)}


CHOSEN = dict.fromkeys(("deflection", "direct", "modular_rigid", "modular_difference"), 12)
CHOSEN |= {"inverse": 7}
PUBLISHED = {"deflection": 14, "direct": 18, "modular_rigid": None}


@pytest.fixture
def writers(grid, curves, samples, studies):
    difference = grid.loc[grid["status"] == 0, ["tip_x", "tip_y"]] - 1.0
    return {
        "rigid": lambda path: crane_figures.normalised_rigid(path, grid),
        "tip": lambda path: crane_figures.normalised_tip(path, grid),
        "difference": lambda path: crane_figures.normalised_difference(path, difference),
        "fitting": lambda path: fitting_figures.under_and_overfitting(path, curves, samples),
        "sizes": lambda path: fitting_figures.size_selections(path, studies, CHOSEN, PUBLISHED),
    }


@pytest.mark.parametrize("name", ["rigid", "tip", "difference", "fitting", "sizes"])
def test_same_bytes_every_time(writers, tmp_path, name):
    paths = [tmp_path / "first.png", tmp_path / "second.png"]
    for path in paths:
        writers[name](path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == paths


@pytest.mark.parametrize("which", ["rigid", "tip"])
def test_normalised_points_are_the_kept_ones_mapped_onto_minus_one_to_one(grid, which):
    axes = crane_figures._figure_normalised_points(grid, which, "some tip").axes
    kept = grid[grid["status"] == 0]
    for (whole, detail), axis in zip((axes[:2], axes[2:]), "xy", strict=True):
        values = kept[f"{which}_{axis}"].to_numpy()
        number, drawn = whole.lines[0].get_data()
        np.testing.assert_array_equal(number, np.arange(1, 151))
        expected = np.interp(values, [values.min(), values.max()], [-1, 1])
        np.testing.assert_allclose(drawn, expected, atol=1e-14)
        np.testing.assert_array_equal(detail.lines[0].get_ydata(), drawn[:100])
        title = whole.get_title(loc="left")
        assert title.startswith(f"some tip in {axis}: ") and title.endswith(" m")
    assert axes[2].get_title(loc="left").startswith("some tip in y: −3 to ")
    assert axes[1].get_title(loc="left") == "first 100"


def test_the_difference_is_told_in_mm():
    values = np.column_stack([[-0.0712, 0.01, 0.09], [-0.166, 0.0, 0.0034]])
    axes = crane_figures._figure_normalised_difference(values).axes
    expected = ("in x: −71.2 to 90 mm", "in y: −166 to 3.4 mm")
    for panel, text, column in zip(axes[::2], expected, values.T, strict=True):
        assert panel.get_title(loc="left") == f"flexible tip minus trained rigid network {text}"
        y = np.interp(column, [column[0], column[2]], [-1, 1])
        np.testing.assert_allclose(panel.lines[0].get_ydata(), y, atol=1e-14)
        assert panel.get_ylabel() == "normalised (1)"
    assert axes[1].get_title(loc="left") == "first 3"


def test_normalised_figures_refuse_what_does_not_fit(tmp_path, grid):
    path = tmp_path / "figure.png"
    for write in (crane_figures.normalised_rigid, crane_figures.normalised_tip):
        with pytest.raises(DataError, match="tip_y"):
            write(path, grid.drop(columns="tip_y"))
        with pytest.raises(DataError, match="tip_x is not finite"):
            write(path, grid.assign(status=0))
    for values in (np.zeros((5, 3)), np.zeros(4), np.zeros((0, 2))):
        with pytest.raises(DataError, match=r"normalised difference.*expected \(n, 2\)"):
            crane_figures.normalised_difference(path, values)
    with pytest.raises(DataError, match="normalised difference: values is not finite"):
        crane_figures.normalised_difference(path, [[1.0, np.nan]])
    assert not list(tmp_path.iterdir())


def test_every_panel_shows_its_own_curves_and_samples(curves, samples):
    figure = fitting_figures._figure_under_and_overfitting(curves, samples, "x (m)", "y (mm)")
    assert [axes.get_title(loc="left").replace("\n", " ") for axes in figure.axes] == list(PANELS)
    for axes, panel in zip(figure.axes, PANELS, strict=True):
        curve, dots = (frame[frame["panel"] == panel] for frame in (curves, samples))
        truth, network, drawn = axes.lines
        np.testing.assert_array_equal(truth.get_xydata(), curve[["x", "truth"]])
        np.testing.assert_array_equal(network.get_xydata(), curve[["x", "network"]])
        np.testing.assert_array_equal(drawn.get_xydata(), dots[["x", "value"]])
        assert drawn.get_linestyle() == "None"
        assert axes.get_xlabel() == "x (m)"
        assert axes.get_ylim() == figure.axes[0].get_ylim()
    assert figure.axes[0].get_ylabel() == "y (mm)"
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["flexible model", "network", "grid samples, left out of the training"]


def test_a_wild_network_does_not_hide_the_truth(curves, samples):
    shown = np.concatenate([curves["truth"], samples["value"]])
    span = shown.max() - shown.min()
    wild = curves.assign(network=curves["network"] * 100)
    low, high = fitting_figures._limits(wild, samples)
    assert low < shown.min() and high > shown.max()
    assert high - low < 2.3 * span
    low, high = fitting_figures._limits(curves, samples)
    assert low < curves["network"].min() and high > curves["network"].max()
    flat = curves.assign(truth=1.0, network=1.0), samples.assign(value=1.0)
    low, high = fitting_figures._limits(*flat)
    assert low < 1.0 < high


def test_titles_of_three_panels_keep_apart(curves, samples):
    figure = fitting_figures._figure_under_and_overfitting(curves, samples, "x (m)", "y (mm)")
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    boxes = [axes.get_tightbbox() for axes in figure.axes]
    assert all(a.x1 < b.x0 + 1 for a, b in itertools.pairwise(boxes))
    assert boxes[-1].x1 <= figure.bbox.x1


@pytest.mark.parametrize("n", [1, 5])
def test_every_network_has_a_panel_with_errors_and_marks(studies, n):
    some = {name: studies[name] for name in list(studies)[:n]}
    figure = fitting_figures._figure_size_selections(some, CHOSEN, PUBLISHED)
    panels = [axes for axes in figure.axes if axes.axison]
    for axes, (name, sizes) in zip(panels, some.items(), strict=True):
        selection, training, *marks = axes.lines
        np.testing.assert_array_equal(
            selection.get_xydata(), sizes[["n_hidden", "selection_error"]]
        )
        np.testing.assert_array_equal(training.get_ydata(), sizes["training_error"])
        assert np.isnan(selection.get_ydata()).sum() == 1  # a size whose runs all failed
        size = PUBLISHED.get(name)
        expected = [CHOSEN[name]] if size is None else [CHOSEN[name], size]
        assert [line.get_xdata()[0] for line in marks] == expected
        first, second = axes.get_title(loc="left").split("\n")
        assert first == name and f"chosen {CHOSEN[name]}" in second
        assert ("published" in second) == (len(marks) == 2)
        assert axes.get_yscale() == "log"
        assert all(tick == round(tick) for tick in axes.get_xticks())
    assert figure._supxlabel.get_text() == "hidden neurons (1)"


def test_panels_of_networks_do_not_overlap(studies):
    figure = fitting_figures._figure_size_selections(studies, CHOSEN, PUBLISHED)
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    boxes = [axes.get_tightbbox() for axes in figure.axes if axes.axison]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    (legend,) = figure.legends
    assert legend.get_window_extent().y0 > max(box.y1 for box in boxes)


def test_fitting_figures_refuse_what_does_not_fit(tmp_path, curves, samples, studies):
    path = tmp_path / "figure.png"
    draw, sizes = fitting_figures.under_and_overfitting, fitting_figures.size_selections
    with pytest.raises(DataError, match=r"fitting curves.*network"):
        draw(path, curves.drop(columns="network"), samples)
    with pytest.raises(DataError, match=r"fitting samples.*value"):
        draw(path, curves, samples.drop(columns="value"))
    with pytest.raises(DataError, match=r"fitting curves: truth is not finite"):
        draw(path, curves.assign(truth=np.inf), samples)
    with pytest.raises(DataError, match=r"fitting samples: x is not finite"):
        draw(path, curves, samples.assign(x=np.nan))
    with pytest.raises(DataError, match=r"panels of the fitting curves.*elsewhere"):
        draw(path, curves, samples.assign(panel="elsewhere"))
    with pytest.raises(DataError, match=r"fitting curves: expected rows"):
        draw(path, curves[:0], samples[:0])
    with pytest.raises(DataError, match=r"a study for every network"):
        sizes(path, {}, {}, {})
    with pytest.raises(DataError, match=r"chosen sizes.*inverse"):
        sizes(path, studies, {k: v for k, v in CHOSEN.items() if k != "inverse"}, {})
    for column in ("training_error", "selection_error"):
        less = studies["direct"].drop(columns=column)
        with pytest.raises(DataError, match=rf"size selection of direct.*{column}"):
            sizes(path, studies | {"direct": less}, CHOSEN, PUBLISHED)
        for value in (np.nan, np.inf):
            broken = studies["direct"].assign(**{column: value})
            with pytest.raises(DataError, match=rf"of direct: {column} is not finite"):
                sizes(path, studies | {"direct": broken}, CHOSEN, PUBLISHED)
    assert not list(tmp_path.iterdir())
