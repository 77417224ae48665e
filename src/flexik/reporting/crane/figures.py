"""Figures of the crane's training grid and test points; frames in, PNG out."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from flexik.errors import DataError
from flexik.kinematics.crane import CraneGeometry
from flexik.reporting import style
from flexik.reporting.crane.schematic import COLOUR, draw_links
from flexik.reporting.style import MM

Array = NDArray[np.float64]

STROKES = ("lift_stroke", "jib_stroke", "extension_stroke")
GRID_COLUMNS = (*STROKES, "payload", "rigid_x", "rigid_y", "tip_x", "tip_y", "status")
KEPT = 0  # status of a grid vector that was solved

# Vectors shown enlarged beside the whole sequence
DETAIL = 100
COLUMNS = 7  # of small pictures


def training_points(
    path: Path | str, grid: pd.DataFrame, geometry: CraneGeometry | None = None
) -> None:
    """Rigid and flexible tips of the kept grid vectors (Rouvinen 1999, figure 3.4).

    Parameters
    ----------
    path
        PNG to write.
    grid
        GRID_COLUMNS, SI units; rows whose status is not KEPT are left out.
    geometry
        If given, the crane at half its strokes is drawn for scale.

    Raises
    ------
    DataError
        If a column is missing, no row is kept, or a kept row is not finite.
    """
    style.write_png(path, _figure_training_points, grid, geometry)


def test_points(path: Path | str, points: ArrayLike, grid: pd.DataFrame) -> None:
    """Test points (k, 2) in m over the training points (Rouvinen 1999, figure 4.2).

    Raises DataError as `training_points` does.
    """
    style.write_png(path, _figure_test_points, np.asarray(points, dtype=float), grid)


def initial_positions(
    path: Path | str, geometry: CraneGeometry, strokes: ArrayLike, points: ArrayLike
) -> None:
    """Links of the rigid crane at the initial `strokes` (k, 3) of `points` (k, 2), in m.

    Rouvinen 1999, figure 4.4, with a picture for every point. Raises DataError if the numbers of
    strokes and points differ.
    """
    arrays = np.asarray(strokes, dtype=float), np.asarray(points, dtype=float)
    style.write_png(path, _figure_initial_positions, geometry, *arrays)


def sequences(path: Path | str, grid: pd.DataFrame) -> None:
    """Normalised strokes and payload of the kept vectors in order (Rouvinen 1999, figure 4.5).

    Raises DataError as `training_points` does.
    """
    style.write_png(path, _figure_sequences, grid)


def normalised_deflection(path: Path | str, grid: pd.DataFrame) -> None:
    """Normalised flexible minus rigid tip of the kept vectors (Rouvinen 1999, figure 4.6).

    Raises DataError as `training_points` does.
    """
    style.write_png(path, _figure_normalised_deflection, grid)


def normalised_rigid(path: Path | str, grid: pd.DataFrame) -> None:
    """Normalised tip of the rigid model at the kept vectors (Rouvinen 1999, figure 4.12).

    Raises DataError as `training_points` does.
    """
    style.write_png(path, _figure_normalised_points, grid, "rigid", "rigid tip")


def normalised_tip(path: Path | str, grid: pd.DataFrame) -> None:
    """Normalised tip of the flexible model at the kept vectors (Rouvinen 1999, figure 4.17).

    Raises DataError as `training_points` does.
    """
    style.write_png(path, _figure_normalised_points, grid, "tip", "flexible tip")


def normalised_difference(path: Path | str, values: ArrayLike) -> None:
    """Normalised flexible tip minus trained rigid network (Rouvinen 1999, figure 4.13).

    Parameters
    ----------
    path
        PNG to write.
    values
        Differences (n, 2) in m, in the order of the kept grid vectors.

    Raises
    ------
    DataError
        If `values` has another shape, no row, or is not finite.
    """
    style.write_png(path, _figure_normalised_difference, np.asarray(values, dtype=float))


def _kept(grid: pd.DataFrame) -> pd.DataFrame:
    style.require("training grid", grid.columns, GRID_COLUMNS)
    kept = grid.loc[grid["status"] == KEPT, list(GRID_COLUMNS)]
    if kept.empty:
        raise DataError("training grid: no vector is kept")
    style.finite("kept training grid", {name: kept[name] for name in GRID_COLUMNS})
    return kept


def _normalised(values: Array) -> Array:
    """Map onto [-1, 1]; a constant becomes zero."""
    low, high = values.min(), values.max()
    return np.zeros_like(values) if low == high else 2 * (values - low) / (high - low) - 1


def _figure_training_points(grid: pd.DataFrame, geometry: CraneGeometry | None) -> Figure:
    kept = _kept(grid)
    figure = Figure(figsize=(7.0, 9.2))
    axes = figure.add_subplot()
    if geometry is not None:
        draw_links(axes, geometry, np.array(geometry.stroke_maximum)[None] / 2, width=2.0)
    colours = style.payload_colours(kept["payload"])
    tips = _draw_tips(axes, kept, colours, size=5)
    bar = figure.colorbar(tips, ax=axes, shrink=0.5, ticks=list(colours), label="payload (kg)")
    bar.ax.minorticks_off()
    axes.set_title(f"Tips of {len(kept)} training vectors: rigid +, flexible coloured")
    style.plane(axes)

    deflection = np.hypot(kept["tip_x"] - kept["rigid_x"], kept["tip_y"] - kept["rigid_y"])
    x, y = kept[["tip_x", "tip_y"]].to_numpy()[np.argmax(deflection)]
    detail = axes.inset_axes((0.72, 0.8, 0.28, 0.2))
    _draw_tips(detail, kept, colours, size=14)
    detail.set(xlim=(x - 0.6, x + 0.1), ylim=(y - 0.35, y + 0.55), xticks=(), yticks=())
    detail.set_aspect("equal")
    detail.spines[:].set_visible(True)
    detail.set_xlabel("frame enlarged", fontsize=9)
    frame = axes.indicate_inset_zoom(detail, edgecolor=style.INK)
    for line in frame.connectors or ():  # they would cross the points
        line.set_visible(False)
    return figure


def _draw_tips(
    axes: Axes, kept: pd.DataFrame, colours: dict[float, tuple[float, ...]], size: float
) -> PathCollection:
    rigid = kept[["rigid_x", "rigid_y"]].drop_duplicates()
    axes.plot(
        rigid["rigid_x"], rigid["rigid_y"], "+", color=style.INK, markersize=5, markeredgewidth=0.7
    )
    return axes.scatter(
        kept["tip_x"],
        kept["tip_y"],
        s=size,
        linewidths=0,
        c=kept["payload"],
        cmap=ListedColormap(list(colours.values())),
        norm=BoundaryNorm(_borders(list(colours)), len(colours)),
        zorder=2.5,
    )


def _borders(values: list[float]) -> Array:
    """Borders of the colours of a scale, half-way between sorted `values`."""
    if len(values) == 1:
        return np.array([values[0] - 1.0, values[0] + 1.0])
    middle = (np.array(values[1:]) + np.array(values[:-1])) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def _figure_test_points(points: Array, grid: pd.DataFrame) -> Figure:
    kept = _kept(grid)
    figure = Figure(figsize=(6.2, 9.2))
    axes = figure.add_subplot()
    tips = kept[["tip_x", "tip_y"]].to_numpy()
    axes.plot(*tips.T, ".", color="#B8B8B8", markersize=2.5)
    axes.plot(*points.T, "o", color=style.VERMILION, markeredgecolor="white", markersize=9)
    for x, y in points:
        axes.annotate(
            style.coordinates(x, y),
            (x, y),
            (0, 8),
            textcoords="offset points",
            ha="center",
            fontsize=9,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"},
        )
    axes.set_title(f"{len(points)} test points (vermilion) over the training tips (grey)")
    style.plane(axes)
    return figure


def _figure_initial_positions(geometry: CraneGeometry, strokes: Array, points: Array) -> Figure:
    if strokes.shape != (len(points), 3) or points.shape != (len(strokes), 2):
        raise DataError(f"initial positions: {strokes.shape=}, {points.shape=}, expected one each")
    rows = -(-(len(points) + 1) // COLUMNS)
    figure = Figure(figsize=(style.WIDTH, 0.5 + 1.95 * rows))
    panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).flat
    for row, point, axes in zip(strokes, points, panels, strict=False):
        draw_links(axes, geometry, row[None])
        axes.plot(*point, "o", color=style.INK, fillstyle="none", markersize=5)
        axes.set_title(style.coordinates(*point), fontsize=9.5, loc="center", pad=3)
        axes.set_aspect("equal")
        axes.tick_params(labelsize=8, length=2)
    low = np.minimum(points.min(axis=0), [-0.6, 0.0]) - 0.4
    high = np.maximum(points.max(axis=0), [2.0, 4.0]) + 0.4
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set(xticks=np.arange(0, high[0], 2), yticks=np.arange(np.ceil(low[1] / 2) * 2, high[1], 2))
    for axes in panels:  # what the pictures left over
        axes.set_axis_off()
    _legend_of_links(figure)
    figure.supxlabel("x (m)", fontsize=10)
    figure.supylabel("y (m)", fontsize=10)
    return figure


def _legend_of_links(figure: Figure) -> None:
    labels = {
        "pillar": COLOUR["pillar"],
        "lift arm": COLOUR["lift"],
        "jib": COLOUR["jib"],
        "extension": COLOUR["extension"],
        "rocker, coupler": style.GREEN,
        "cylinder": style.GREY,
    }
    handles = [Line2D([], [], color=colour, linewidth=2) for colour in labels.values()]
    handles.append(Line2D([], [], color=style.INK, marker="o", fillstyle="none", linestyle="none"))
    figure.legend(
        handles, [*labels, "test point"], loc="outside upper center", ncols=7, columnspacing=1.0
    )


def _figure_sequences(grid: pd.DataFrame) -> Figure:
    kept = _kept(grid)
    units = dict.fromkeys(STROKES, ("mm", MM)) | {"payload": ("kg", 1.0)}
    colours = (COLOUR["lift"], COLOUR["jib"], COLOUR["extension"], style.PURPLE)
    figure = Figure(figsize=(style.WIDTH, 7.0))
    panels = figure.subplots(4, 2, sharex="col", sharey=True, width_ratios=(3, 1.3))
    for (whole, detail), (name, (unit, scale)), colour in zip(
        panels, units.items(), colours, strict=True
    ):
        values = kept[name].to_numpy()
        label = name.replace("_", " ")
        _sequence(whole, detail, _normalised(values), colour)
        low, high = scale * values.min(), scale * values.max()
        whole.set_title(f"{label}: {style.signed(low)} to {style.signed(high)} {unit}", fontsize=10)
        whole.set_ylabel("normalised (1)")
    panels[0, 1].set_title(f"first {min(DETAIL, len(kept))}", fontsize=10)
    for axes in panels[-1]:
        axes.set_xlabel("vector number")
    return figure


def _sequence(whole: Axes, detail: Axes, values: Array, colour: str) -> None:
    number = np.arange(1, len(values) + 1)
    whole.plot(number, values, ".", color=colour, markersize=1.5)
    detail.plot(number[:DETAIL], values[:DETAIL], ".-", color=colour, markersize=3, linewidth=0.8)
    whole.set(ylim=(-1.12, 1.12), yticks=(-1, 0, 1), xlim=(-0.01 * len(values), 1.01 * len(values)))
    style.true_minus(whole)


def _figure_normalised_deflection(grid: pd.DataFrame) -> Figure:
    kept = _kept(grid)
    return _figure_pair(_points(kept, "tip") - _points(kept, "rigid"), "deflection", "mm", MM)


def _figure_normalised_points(grid: pd.DataFrame, which: str, what: str) -> Figure:
    return _figure_pair(_points(_kept(grid), which), what, "m", 1.0)


def _figure_normalised_difference(values: Array) -> Figure:
    if values.ndim != 2 or values.shape[1] != 2 or not len(values):
        raise DataError(f"normalised difference: {values.shape=}, expected (n, 2) with n > 0")
    style.finite("normalised difference", {"values": values})
    return _figure_pair(values, "flexible tip minus trained rigid network", "mm", MM)


def _points(kept: pd.DataFrame, which: str) -> Array:
    return kept[[f"{which}_x", f"{which}_y"]].to_numpy()


def _figure_pair(values: Array, what: str, unit: str, scale: float) -> Figure:
    """Sequences of the two columns of `values`, whose ranges stand in the titles times `scale`."""
    figure = Figure(figsize=(style.WIDTH, 5.6))
    panels = figure.subplots(2, 2, sharex="col", sharey=True, width_ratios=(3, 1.3))
    digits = 1 if unit == "mm" else 2
    for (whole, detail), axis, column, colour in zip(
        panels, ("x", "y"), values.T, (style.BLUE, style.VERMILION), strict=True
    ):
        _sequence(whole, detail, _normalised(column), colour)
        low, high = (style.signed(round(scale * v, digits)) for v in (column.min(), column.max()))
        whole.set_title(f"{what} in {axis}: {low} to {high} {unit}", fontsize=10)
        whole.set_ylabel("normalised (1)")
    panels[0, 1].set_title(f"first {min(DETAIL, len(values))}", fontsize=10)
    for axes in panels[-1]:
        axes.set_xlabel("vector number")
    return figure
