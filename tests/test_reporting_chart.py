"""Kinds of figures: what they show, and bytes that depend on the data alone."""

import struct

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.patches import Polygon

from flexik.errors import DataError
from flexik.reporting import kinds, plane, style
from flexik.reporting.chart import Axis, Layer, Rule, chart


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture
def frame():
    """Two methods in two panels, errors in m."""
    rng = np.random.default_rng(0)
    methods, panels = np.repeat(["none", "combined"], 8), np.tile(["a", "b"], 8)
    error = rng.uniform(1e-4, 1e-1, 16)
    given = {"method": methods, "panel": panels, "x": np.arange(16) % 8, "error": error}
    return pd.DataFrame(given).assign(y=np.arange(16) // 4, group=np.arange(16) % 2)


def lines(axes, label):
    return [line for line in axes.lines if line.get_label() == label]


def texts(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


X, Y = Axis("x (1)"), Axis("error (mm)", style.MM)
FIGURES = {
    "chart": lambda f: chart(Layer(f, "x", "error", "o-", "method"), x=X, y=Y, panel="panel"),
    "strips": lambda f: kinds.strips(
        Layer(f, "x", "error", "bars", "method"),
        category="panel",
        names={"a": "A", "b": "B"},
        spread="method",
        y=Y,
    ),
    "beside": lambda f: kinds.beside(f[:8].assign(p=np.nan), "x", "error", "p", X),
    "distribution": lambda f: kinds.distribution(f, "error", "method", Y),
    "sequences": lambda f: kinds.sequences({"error": f["error"]}, style.COLOURS),
    "maps": lambda f: plane.maps(f, "x", "y", "error", "method", label="e (mm)", cell=1.0),
    "space": lambda f: plane.space(Layer(f, "x", "error", "-"), z="y"),
}


@pytest.mark.parametrize("name", FIGURES)
def test_same_bytes_without_metadata_whatever_the_users_settings(frame, tmp_path, name):
    style.write_png(tmp_path / "a.png", FIGURES[name], frame)
    with mpl.rc_context({"font.size": 20, "savefig.dpi": 30, "axes.grid": False}):
        style.write_png(tmp_path / "b.png", FIGURES[name], frame.copy())
        assert mpl.rcParams["font.size"] == 20
    data = (tmp_path / "a.png").read_bytes()
    assert data == (tmp_path / "b.png").read_bytes()
    chunks, place = [], 8
    while place < len(data):
        (length,) = struct.unpack(">I", data[place : place + 4])
        chunks.append(data[place + 4 : place + 8])
        place += 12 + length
    assert set(chunks) == {b"IHDR", b"pHYs", b"IDAT", b"IEND"}


def test_failed_drawing_leaves_the_old_file(tmp_path):
    (tmp_path / "a.png").write_bytes(b"old")
    with pytest.raises(ZeroDivisionError):
        style.write_png(tmp_path / "a.png", lambda: 1 / 0)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a.png", b"old")]


def test_a_hue_has_one_look_and_selected_ones_are_dashed():
    looks = style.looks(["none", "a", "b", "a_selected"], ("_selected",))
    assert looks["a_selected"]["color"] == looks["a"]["color"] != looks["b"]["color"]
    assert (looks["a"]["linestyle"], looks["a_selected"]["linestyle"]) == ("-", "--")
    many = style.looks(range(20), ("_selected",))
    assert len({tuple(look.items()) for look in many.values()}) == 20
    shades = style.shades([3.0, 1.0, 3.0])
    assert list(shades) == [1.0, 3.0] and shades[1.0] != shades[3.0]


def test_rows_are_drawn_in_their_panel_hue_and_unit(frame):
    figure = chart(
        Layer(frame, "x", "error", "o-", "method", look={"markersize": 3}),
        Layer(frame[:2].drop(columns="panel"), "x", "error", ".", label="everywhere"),
        x=X,
        y=Y,
        panel="panel",
        titles={"b": "second"},
        looks={"none": {"color": style.GREEN}},
        rules=[Rule("y", 5.0, "published", panel="b")],
        legend="heading",
    )
    first, second = figure.axes
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["a", "second"]
    (line,) = lines(first, "none")
    rows = frame[(frame["panel"] == "a") & (frame["method"] == "none")]
    np.testing.assert_allclose(line.get_xydata(), np.c_[rows["x"], 1e3 * rows["error"]])
    assert line.get_color() == style.GREEN
    assert lines(first, "everywhere") and lines(second, "everywhere")
    assert not lines(first, "published") and lines(second, "published")
    assert texts(figure) == ["none", "combined", "everywhere", "published"]
    assert figure.legends[0].get_title().get_text() == "heading"
    assert figure.get_supxlabel() == "x (1)" and first.get_ylabel() == "error (mm)"
    assert second.get_ylabel() == "" and first.get_ylim() == second.get_ylim()


def test_axes_by_panel_have_their_own_units_and_scales(frame):
    axes_of = {"a": Axis("a (mm)", style.MM), "b": Axis("b (um)", style.MICRO, log=True)}
    figure = chart(Layer(frame, "x", "error"), x=X, y=axes_of, panel="panel", share="x")
    assert [axes.get_ylabel() for axes in figure.axes] == ["a (mm)", "b (um)"]
    assert [axes.get_yscale() for axes in figure.axes] == ["linear", "log"]
    for axes, scale in zip(figure.axes, (1e3, 1e6), strict=True):
        assert axes.lines[0].get_ydata().max() < 1.0001 * scale * frame["error"].max()


def test_a_logarithmic_axis_shows_zero_at_its_edge_and_round_off_at_the_least():
    frame = pd.DataFrame({"x": [0, 1, 2, 3], "y": [0.0, 2.0, 20.0, 2e9]})
    (axes,) = chart(Layer(frame[:3], "x", "y"), x=X, y=Axis(log=True)).axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [2 / 1.3, 2, 20])
    (axes,) = chart(Layer(frame, "x", "y"), x=X, y=Axis(log=True)).axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [2e4, 2e4, 2e4, 2e9])
    (axes,) = chart(Layer(frame, "x", "y"), x=X, y=Axis(scale=10, log=True, least=5)).axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [5, 20, 200, 2e10])


@pytest.mark.parametrize(
    ("values", "ticks"),
    [([1.0, 30.0], {"1", "2", "5", "10", "20"}), ([1e-6, 1e-3], {"$10^{-6}$", "$10^{-4}$"})],
)
def test_ticks_are_all_decimals_or_all_powers(values, ticks):
    figure = chart(Layer(pd.DataFrame({"x": [0, 1], "y": values}), "x", "y"), x=X, y=Axis(log=True))
    figure.draw_without_rendering()
    assert ticks <= {text.get_text() for text in figure.axes[0].get_yticklabels()}


def test_a_symmetric_axis_shows_small_and_large_errors_of_both_signs():
    for values, ticks in (([-30.0, 0.5], ["−100", "−10", "−1"]), ([0.1, 30.0], [])):
        frame = pd.DataFrame({"x": [0, 1], "y": values})
        (axes,) = chart(Layer(frame, "x", "y"), x=X, y=Axis(linear_below=1.0)).axes
        shown = [text.get_text() for text in axes.get_yticklabels()]
        assert shown == [*ticks, "0", "1", "10", "100"]
        low, high = axes.get_ylim()
        assert high > 30 and (low < -30) == bool(ticks)


def test_bands_areas_bars_and_texts(frame):
    rows = frame[:4].assign(top=2 * frame["error"][:4], text=list("pqrs"), dx=3.0)
    figure = chart(
        Layer(rows, "x", "error", "band", to="top", label="band"),
        Layer(rows, "x", "error", "area", look={"color": style.GREEN}),
        Layer(rows, "x", "error", "bars", width=0.5),
        Layer(rows, "x", "error", "text", text="text", look={"leader": True}),
        x=X,
        y=Y,
    )
    (axes,) = figure.axes
    area = next(p for p in axes.patches if isinstance(p, Polygon))
    assert mpl.colors.to_hex(area.get_facecolor()) == style.GREEN.lower()
    bars = [p for p in axes.patches if isinstance(p, mpl.patches.Rectangle)]
    np.testing.assert_allclose([bar.get_height() for bar in bars], 1e3 * rows["error"])
    assert [(t.get_text(), t.xyann) for t in axes.texts] == [(k, (3.0, 0.0)) for k in "pqrs"]
    band = axes.collections[0].get_paths()[0].vertices
    assert band[:, 1].max() == pytest.approx(1e3 * rows["top"].max())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"error": np.inf}, "finite"),
        ({"error": np.nan}, "finite"),
        ({"method": None}, "method"),
    ],
)
def test_a_layer_that_cannot_be_drawn_is_refused(frame, change, message):
    frame = frame.drop(columns="method") if "method" in change else frame.assign(**change)
    with pytest.raises(DataError, match=message):
        chart(Layer(frame, "x", "error", hue="method", label="l"), x=X, y=Y)


def test_strips_set_values_of_a_category_apart(frame):
    names = {"b": "B", "a": "A"}
    layer = Layer(frame[:8].assign(n=1), "n", "error", "o", "group")
    figure = kinds.strips(layer, category="panel", names=names, spread="group", y=Y)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["B", "A"]
    places = np.concatenate([line.get_xdata() for line in axes.lines])
    assert set(np.round(places, 3)) == {-0.2 + 1, 0.2}


def test_ours_stand_beside_the_published():
    frame = pd.DataFrame({"k": ["a", "b"], "ours": [1.5, 2.0], "theirs": [3.0, np.nan]})
    (axes,) = kinds.beside(frame, "k", "ours", "theirs", Axis("R (mm)", log=True)).axes
    (ours,), (theirs,) = lines(axes, "ours"), lines(axes, "published")
    assert ours.get_xydata().tolist() == [[1.5, 0], [2, 1]]
    assert theirs.get_xydata().tolist() == [[3, 0]] and theirs.get_fillstyle() == "none"
    assert [text.get_text() for text in axes.texts] == ["3.00", "1.50", "2.00"]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["a", "b"]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first on top


def test_a_distribution_rises_by_a_row_at_every_value_and_marks_its_quantiles():
    errors = np.linspace(0.001, 0.2, 200)
    frame = pd.DataFrame({"error": errors[::-1], "method": "m"})
    figure = kinds.distribution(frame, "error", "method", Axis("error (mm)", 1e3, log=True))
    curve, half, nearly_all = figure.axes[0].lines
    np.testing.assert_allclose(curve.get_ydata(), np.arange(201) / 2)
    np.testing.assert_allclose(curve.get_xdata()[1:], 1e3 * errors)
    np.testing.assert_allclose(half.get_xydata(), [[100, 50]])
    np.testing.assert_allclose(nearly_all.get_xydata(), [[198, 99]])
    assert texts(figure) == ["m: 100, 198"]
    failed = frame.assign(error=frame["error"].where(frame["error"] > 0.1))
    failed = kinds.distribution(failed, "error", "method", X, of_all=True, panel="method")
    assert failed.axes[0].lines[0].get_ydata().max() == 50


def test_sizes_mark_the_choice_and_the_published_in_their_panel():
    sizes = pd.DataFrame({"n_hidden": [10, 20], "training_error": [0.2, 0.1]})
    for name, factor in (("selection", 1.1), ("median_selection", 1.2), ("worst_selection", 1.3)):
        sizes[f"{name}_error"] = factor * sizes["training_error"]
    figure = kinds.sizes(sizes, chosen=20, published=14)
    marks = {line.get_label(): line.get_xdata()[0] for line in figure.axes[0].lines}
    assert marks["chosen: 20"] == 20 and marks["published: 14"] == 14
    both = pd.concat([sizes.assign(net=name) for name in "ab"])
    options = {"chosen": {"a": 10, "b": 20}, "published": {"a": None, "b": 15}, "band": False}
    figure = kinds.sizes(both, panel="net", **options)
    for axes, chosen, n_published in zip(figure.axes, (10, 20), (0, 1), strict=True):
        assert lines(axes, "chosen size")[0].get_xdata()[0] == chosen
        assert len(lines(axes, "published size")) == n_published


def test_sequences_are_mapped_onto_minus_one_to_one(monkeypatch):
    monkeypatch.setattr(kinds, "DETAIL", 2)
    figure = kinds.sequences({"a": np.arange(5.0), "b": np.ones(5)}, style.COLOURS)
    whole, first, constant, _ = (axes.lines[0].get_ydata() for axes in figure.axes)
    assert whole.tolist() == [-1, -0.5, 0, 0.5, 1] and first.tolist() == [-1, -0.5]
    assert set(constant) == {0.0}
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["a", "first 2", "b", ""]


def test_a_cell_of_a_map_holds_the_mean_of_its_rows_and_empty_ones_nothing():
    frame = pd.DataFrame({"x": [0.1, 0.2, 1.5], "y": 0.5, "e": [1.0, 3.0, 0.0], "m": "m"})
    figure = plane.maps(frame.assign(y=[0.5, 0.5, 1.5]), *"xyem", label="e (mm)", cell=1.0)
    (mesh,) = (c for c in figure.axes[0].collections if isinstance(c, QuadMesh))
    cells = mesh.get_array()
    assert cells[0, 0] == 2.0 and cells.mask.tolist() == [[False, True], [True, False]]
    assert cells[1, 1] == mesh.norm.vmin > 0  # zero is drawn as the least
    dots = plane.maps(frame, *"xyem", label="e (mm)", scale=10.0).axes[0].collections[0]
    assert dots.get_array().max() == 30


def test_maps_share_their_scales_over_at_most_two_rows():
    frame = pd.DataFrame({"x": range(18), "y": range(18), "e": 1.0, "m": np.arange(18) % 9})
    panels = plane.maps(frame, *"xyem", label="e").axes[:-1]
    assert len([axes for axes in panels if axes.axison]) == 9
    assert len({axes.get_xlim() for axes in panels}) == 1
