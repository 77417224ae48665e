"""Figures: what they show, and bytes that depend on the data alone."""

import struct

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Polygon

from flexik.errors import DataError
from flexik.evaluation.errors import STATISTICS
from flexik.kinematics.crane import forward, pose
from flexik.positioning.crane.initial import initial_positions
from flexik.reporting import style
from flexik.reporting.crane import error_figures
from flexik.reporting.crane import figures as crane_figures
from flexik.reporting.crane import schematic as crane_schematic


@pytest.fixture(autouse=True)
def _house_style():
    with style.house_style():
        yield


@pytest.fixture(scope="module")
def grid(geometry):
    """Make a coarse grid in the order of the real one, with a smooth deflection."""
    extension, lift, jib, payload = (
        a.ravel()
        for a in np.meshgrid(
            [0.0, 0.8, 1.6],
            np.linspace(0, 0.535, 4),
            np.linspace(0, 0.78, 4),
            [50.0, 200.0, 500.0],
            indexing="ij",
        )
    )
    rigid = forward(geometry, np.column_stack([lift, jib, extension]))
    status = np.where(rigid[:, 0] >= 0, 0, 1)
    status[1] = 2
    tip = rigid + np.outer(payload, [2e-5, -2e-4]) * rigid[:, :1] ** 2 / 10
    tip[status != 0] = np.nan
    return pd.DataFrame(
        {
            "lift_stroke": lift,
            "jib_stroke": jib,
            "extension_stroke": extension,
            "payload": payload,
            "rigid_x": rigid[:, 0],
            "rigid_y": rigid[:, 1],
            "tip_x": tip[:, 0],
            "tip_y": tip[:, 1],
            "status": status,
        }
    )


@pytest.fixture(scope="module")
def shape(geometry):
    """Axes near the rigid links, and a rotation of everything beyond the pillar by 0.02 rad."""
    strokes = np.array([0.3, 0.3, 1.2])
    rigid = pose(geometry, strokes[None])
    ends = {
        "pillar": ([0.0, -0.3], [0.0, 1.115]),
        "lift": (rigid.lift_pivot[0], rigid.jib_pivot[0]),
        "jib": (rigid.coupler_pin[0], rigid.extension_start[0] - [0.2, -0.1]),
        "extension": (rigid.coupler_pin[0] * 0.3 + rigid.tip[0] * 0.7, rigid.tip[0]),
    }
    reference = {name: np.linspace(*pair, 5) for name, pair in ends.items()}
    c, s = np.cos(0.02), np.sin(0.02)
    turn = np.array([[c, s], [-s, c]])
    pivot = rigid.lift_pivot[0]
    beams = {
        name: nodes if name == "pillar" else pivot + (nodes - pivot) @ turn.T
        for name, nodes in reference.items()
    }
    return {
        "strokes": strokes.tolist(),
        "payload": 470.0,
        "exaggeration": 5.0,
        "beams": {name: nodes.tolist() for name, nodes in beams.items()},
        "reference": {name: nodes.tolist() for name, nodes in reference.items()},
        "tip": beams["extension"][-1].tolist(),
        "rigid_tip": reference["extension"][-1].tolist(),
    }


def error_frame(points, payloads, scale, seed):
    targets = np.repeat(points, len(payloads), axis=0)
    error = np.random.default_rng(seed).normal(0, scale, targets.shape)
    return pd.DataFrame(
        {
            "point": np.repeat(np.arange(len(points)), len(payloads)),
            "target_x": targets[:, 0],
            "target_y": targets[:, 1],
            "payload": np.tile(payloads, len(points)),
            "error_x": error[:, 0],
            "error_y": error[:, 1],
            "error": np.hypot(*error.T),
            "status": 0,
        }
    )


@pytest.fixture
def errors(points, payloads):
    return error_frame(points, payloads, 0.05, 0), error_frame(points, payloads, 0.003, 1)


@pytest.fixture
def comparison():
    rows = np.arange(1.0, 7.0)
    return pd.DataFrame(
        {"none": 10 * rows, "none published": 11 * rows, "new": rows, "combined": rows},
        index=list(STATISTICS),
    )


@pytest.fixture
def writers(geometry, grid, shape, points, errors, comparison):
    """Every figure of the room as a function of its path."""
    strokes = initial_positions(geometry, points)
    figures, drawn = crane_figures, error_figures
    return {
        "crane": lambda path: crane_schematic.crane(path, geometry, shape),
        "training": lambda path: figures.training_points(path, grid, geometry),
        "test": lambda path: figures.test_points(path, points, grid),
        "initial": lambda path: figures.initial_positions(path, geometry, strokes, points),
        "sequences": lambda path: figures.sequences(path, grid),
        "deflection": lambda path: figures.normalised_deflection(path, grid),
        "errors": lambda path: drawn.positioning_errors(path, *errors, "combined"),
        "comparison": lambda path: drawn.method_comparison(path, comparison),
    }


FIGURES = (
    *("crane", "training", "test", "initial"),
    *("sequences", "deflection", "errors", "comparison"),
)


def chunks(data):
    """Names of a PNG's chunks, and its width and height."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    names, at = [], 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        names.append(data[at + 4 : at + 8].decode())
        at += length + 12
    return names, struct.unpack(">II", data[16:24])


@pytest.mark.parametrize("name", FIGURES)
def test_same_bytes_without_metadata_whatever_the_users_settings(writers, tmp_path, name):
    first, second = tmp_path / "first.png", tmp_path / "second.png"
    writers[name](first)
    with mpl.rc_context(
        {"font.size": 20.0, "axes.linewidth": 9.0, "ytick.major.width": 5.0, "figure.dpi": 40.0}
    ):
        before = dict(mpl.rcParams)
        writers[name](second)
        assert dict(mpl.rcParams) == before
    assert first.read_bytes() == second.read_bytes()
    names, (width, height) = chunks(first.read_bytes())
    assert not {"tEXt", "iTXt", "zTXt", "tIME"} & set(names)
    assert 900 <= width <= 1200 and height <= 1400
    assert sorted(p.name for p in tmp_path.iterdir()) == ["first.png", "second.png"]


def test_failed_drawing_leaves_the_old_file(tmp_path):
    path = tmp_path / "figure.png"
    path.write_bytes(b"old")
    broken = style.Figure(figsize=(1, 1))
    broken.text(0.5, 0.5, "$\\nonsense$")  # only fails when drawn
    with pytest.raises(ValueError, match="nonsense"):
        style.write_png(path, lambda: broken)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["figure.png"]


def labels(figure):
    return [
        text
        for axes in figure.axes
        for text in (axes.get_xlabel(), axes.get_ylabel())
        if text and "frame" not in text and text != "vector number"
    ] + [t.get_text() for t in (figure._supxlabel, figure._supylabel) if t is not None]


def test_labels_carry_units(geometry, grid, shape, points, errors, comparison):
    built = [
        crane_schematic._figure_crane(geometry, shape),
        crane_figures._figure_training_points(grid, None),
        crane_figures._figure_test_points(points, grid),
        crane_figures._figure_initial_positions(
            geometry, initial_positions(geometry, points), points
        ),
        crane_figures._figure_sequences(grid),
        crane_figures._figure_normalised_deflection(grid),
        error_figures._figure_positioning_errors(*errors, "combined"),
        error_figures._figure_method_comparison(comparison),
    ]
    for figure in built:
        found = labels(figure)
        assert len(found) >= 2
        units = ("(m)", "in m", "(mm)", "(kg)", "(1)")
        assert all(any(unit in text for unit in units) for text in found), found


def test_training_points_show_every_kept_vector_and_no_other(grid):
    axes = crane_figures._figure_training_points(grid, None).axes[0]
    kept = grid[grid["status"] == 0]
    assert 0 < len(kept) < len(grid)
    np.testing.assert_array_equal(axes.collections[0].get_offsets(), kept[["tip_x", "tip_y"]])
    rigid = np.column_stack(axes.lines[0].get_data())
    np.testing.assert_array_equal(rigid, kept[["rigid_x", "rigid_y"]].drop_duplicates())
    assert str(len(kept)) in axes.get_title(loc="left")


def test_test_points_are_marked_and_named(points, grid):
    axes = crane_figures._figure_test_points(points, grid).axes[0]
    np.testing.assert_array_equal(np.column_stack(axes.lines[1].get_data()), points)
    texts = [t.get_text() for t in axes.texts]
    assert len(texts) == 25 and texts[0] == "(1, 7)" and texts[5] == "(2, −3.95)"


def test_initial_positions_end_near_their_points(geometry, points):
    strokes = initial_positions(geometry, points)
    figure = crane_figures._figure_initial_positions(geometry, strokes, points)
    panels = [axes for axes in figure.axes if axes.axison]
    assert len(panels) == len(points)
    tips = forward(geometry, strokes)
    for axes, point, expected in zip(panels, points, tips, strict=True):
        *_, extension, target = axes.lines
        tip = np.column_stack(extension.get_data())[-1]
        assert np.hypot(*(tip - point)) < 0.2  # strokes are rounded to centimetres
        np.testing.assert_array_equal(tip, expected)
        np.testing.assert_array_equal(np.ravel(target.get_data()), point)
    limits = np.array([panels[0].get_xlim(), panels[0].get_ylim()])
    assert (points > limits[:, 0]).all() and (points < limits[:, 1]).all()


def test_sequences_are_the_kept_columns_mapped_onto_minus_one_to_one(grid):
    kept = grid[grid["status"] == 0]
    axes = crane_figures._figure_sequences(grid).axes
    columns = ("lift_stroke", "jib_stroke", "extension_stroke", "payload")
    for panel, name in zip(axes[::2], columns, strict=True):
        number, values = panel.lines[0].get_data()
        np.testing.assert_array_equal(number, np.arange(1, len(kept) + 1))
        assert values.min() == -1 and values.max() == 1
        expected = np.interp(kept[name], [kept[name].min(), kept[name].max()], [-1, 1])
        np.testing.assert_allclose(values, expected, atol=1e-14)
    assert axes[6].get_title(loc="left") == "payload: 50 to 500 kg"
    assert axes[4].get_title(loc="left") == "extension stroke: 0 to 1600 mm"


def test_deflection_is_flexible_minus_rigid(grid):
    kept = grid[grid["status"] == 0]
    axes = crane_figures._figure_normalised_deflection(grid).axes
    drop = (kept["tip_y"] - kept["rigid_y"]).to_numpy()
    values = axes[2].lines[0].get_ydata()
    assert np.argmin(values) == np.argmin(drop) and np.argmax(values) == np.argmax(drop)
    assert f"−{-1e3 * drop.min():.1f} to" in axes[2].get_title(loc="left")


def test_constant_values_are_normalised_to_zero():
    np.testing.assert_array_equal(crane_figures._normalised(np.full(3, 7.0)), np.zeros(3))


def test_errors_are_drawn_in_mm_with_failures_as_crosses(errors):
    uncompensated, compensated = errors
    compensated.loc[[3, 60], "status"] = 2
    figure = error_figures._figure_positioning_errors(uncompensated, compensated, "combined")
    for axes, key in zip(figure.axes, ("error_x", "error_y", "error"), strict=True):
        np.testing.assert_array_equal(axes.lines[0].get_ydata(), 1e3 * uncompensated[key])
        coloured = [line for line in axes.lines[1:] if line.get_marker() in "ox"]
        drawn = np.concatenate([line.get_ydata() for line in coloured])
        np.testing.assert_array_equal(np.sort(drawn), np.sort(1e3 * compensated[key]))
        crosses = [y for li in coloured if li.get_marker() == "x" for y in li.get_ydata()]
        expected = 1e3 * compensated.loc[[3, 60], key]
        np.testing.assert_array_equal(np.sort(crosses), np.sort(expected))
        low, high = axes.get_ylim()
        assert low < min(drawn.min(), axes.lines[0].get_ydata().min())
        assert high > max(drawn.max(), axes.lines[0].get_ydata().max())
    ticks = [t.get_text() for t in figure.axes[-1].get_xticklabels()]
    assert len(ticks) == 25 and ticks[3] == "(1, −2)"
    texts = [t.get_text() for t in figure.legends[0].get_texts()]
    assert texts[1] == "combined: 30 kg" and texts[-1] == "failed"


def test_conditions_keep_apart_in_the_error_figure(errors):
    figure = error_figures._figure_positioning_errors(*errors, "combined")
    place = np.sort(figure.axes[0].lines[0].get_xdata())
    assert len(place) == 125 and np.diff(place).min() > 0.1


def test_crane_title_states_the_deflection(geometry, shape):
    title = crane_schematic._figure_crane(geometry, shape).axes[0].get_title(loc="left")
    x, y = 1e3 * (np.array(shape["tip"]) - shape["rigid_tip"])
    assert f"Tip deflection {np.hypot(x, y):.1f} mm" in title
    assert f"{-y:.1f} mm down" in title
    assert "drawn 5 times larger" in title and "470 kg" in title


def test_crane_is_drawn_within_its_axes(geometry, shape):
    axes = crane_schematic._figure_crane(geometry, shape).axes[0]
    box = np.array([axes.get_xlim(), axes.get_ylim()]).T
    outlines = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    assert len(outlines) == 8  # four beams, rigid and bent
    corners = np.concatenate([outline.get_xy() for outline in outlines])
    assert (corners > box[0]).all() and (corners < box[1]).all()


def test_no_label_of_the_crane_leaves_its_axes(geometry, shape):
    figure = crane_schematic._figure_crane(geometry, shape)
    figure.draw(FigureCanvasAgg(figure).get_renderer())
    (axes,) = figure.axes
    assert len(axes.texts) > 20
    for text in axes.texts:
        box = text.get_window_extent()
        assert axes.bbox.y0 < box.y0 and box.y1 < axes.bbox.y1 - 5, text.get_text()


def test_a_pin_moves_with_its_beam_as_a_rigid_body():
    reference = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    # second half turned left by a quarter about its start
    bent = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    carried = crane_schematic._carry(reference, bent, np.array([1.5, 0.2]))
    np.testing.assert_allclose(carried, [0.8, 0.5], atol=1e-15)
    beyond = crane_schematic._carry(reference, bent, np.array([2.0, -0.1]))
    np.testing.assert_allclose(beyond, [1.1, 1.0], atol=1e-15)


def test_rods_keep_their_lengths_to_first_order(geometry, shape):
    strokes = np.array(shape["strokes"])
    rigid = crane_schematic._rigid_pins(geometry, strokes)
    reference = {name: np.array(nodes) for name, nodes in shape["reference"].items()}
    change = {}
    for factor in (1e-2, 1e-3):
        bent = {
            name: nodes + factor * (np.array(shape["beams"][name]) - nodes)
            for name, nodes in reference.items()
        }
        pins = crane_schematic._carry_pins(rigid, reference, bent)
        change[factor] = max(
            abs(np.hypot(*(pins["H"] - pins[end])) - np.hypot(*(rigid["H"] - rigid[end])))
            for end in "FI"
        )
    assert change[1e-3] < 0.02 * change[1e-2]


def test_crane_errors_name_what_is_wrong(tmp_path, geometry, shape):
    path = tmp_path / "crane.png"
    without = {key: value for key, value in shape.items() if key != "rigid_tip"}
    with pytest.raises(DataError, match="rigid_tip"):
        crane_schematic.crane(path, geometry, without)
    with pytest.raises(DataError, match=r"beams.*jib"):
        crane_schematic.crane(path, geometry, shape | {"beams": {"pillar": [[0, 0]]}})
    with pytest.raises(DataError, match="tip is not finite"):
        crane_schematic.crane(path, geometry, shape | {"tip": [np.nan, 0.0]})
    assert not list(tmp_path.iterdir())


def test_grid_errors_name_what_is_wrong(tmp_path, geometry, grid, points):
    path = tmp_path / "grid.png"
    with pytest.raises(DataError, match="tip_y"):
        crane_figures.sequences(path, grid.drop(columns="tip_y"))
    with pytest.raises(DataError, match="no vector is kept"):
        crane_figures.training_points(path, grid.assign(status=1))
    with pytest.raises(DataError, match="tip_x is not finite"):
        crane_figures.normalised_deflection(path, grid.assign(status=0))
    with pytest.raises(DataError, match="initial positions"):
        crane_figures.initial_positions(path, geometry, np.zeros((24, 3)), points)
    assert not list(tmp_path.iterdir())


def test_error_figures_refuse_what_does_not_fit(tmp_path, errors, comparison):
    uncompensated, compensated = errors
    path = tmp_path / "errors.png"
    with pytest.raises(DataError, match="different conditions"):
        error_figures.positioning_errors(path, uncompensated[::-1], compensated, "x")
    with pytest.raises(DataError, match="different conditions"):
        error_figures.positioning_errors(path, uncompensated[:-1], compensated, "x")
    with pytest.raises(DataError, match=r"compensated errors.*error_y"):
        error_figures.positioning_errors(
            path, uncompensated, compensated.drop(columns="error_y"), "x"
        )
    with pytest.raises(DataError, match="max_error"):
        error_figures.method_comparison(path, comparison.drop(index="max_error"))
    with pytest.raises(DataError, match="mean_error of none"):
        error_figures.method_comparison(path, comparison.assign(none=0.0))
    assert not list(tmp_path.iterdir())
