"""Figures of a measuring campaign and of what a few measurements teach (Rouvinen 1999, 4.6)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from numpy.typing import ArrayLike, NDArray

from flexik.datasets.crane_measured.campaign import METHODS
from flexik.datasets.crane_measured.fields import ADAPTED, MISJUDGED
from flexik.errors import DataError
from flexik.evaluation.crane_measured.campaign import KEYS
from flexik.kinematics.crane import CraneGeometry, inverse_with_smallest_extension
from flexik.reporting import style
from flexik.reporting.crane.schematic import COLOUR, draw_links
from flexik.reporting.style import MM

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Colours = dict[float, Any]  # by payload, kg

CAMPAIGN_COLUMNS = ("point", *KEYS, "reached_x", "reached_y", "error_x", "error_y")
TITLES = {"none": "without compensation", "combined": "with compensation"}
ADAPTATION_COLUMNS = {
    "mean_error": "mean R (mm)",
    "p95_error": "95th percentile of R (mm)",
}

MARGIN = 0.6  # m about what is drawn of the working area
RASTER = 0.01  # m between the points that tell the working area
GOAL_WIDTH = 0.07  # of the largest number of measurements, either side
BARS = 0.8  # of the distance between two points that their bars fill


def measured_points(
    path: Path | str,
    geometry: CraneGeometry,
    strokes: ArrayLike,
    points: ArrayLike,
    jib_pushes: ArrayLike | None = None,
) -> None:
    """Measured points in the working area, with the crane that reaches them (after figure 4.20).

    Parameters
    ----------
    path
        PNG to write.
    geometry
        Rigid dimensions, m.
    strokes
        Strokes (k, 3) in m that the links are drawn at.
    points
        Points (k, 2) in m, drawn as numbers from 1 on in their order.
    jib_pushes
        (k,) true where the jib cylinder pushes, false where it pulls; not marked if None.

    Raises
    ------
    DataError
        If the numbers of strokes, points and forces differ, or one is not finite.
    """
    arrays = np.asarray(strokes, dtype=float), np.asarray(points, dtype=float)
    pushes = None if jib_pushes is None else np.asarray(jib_pushes, dtype=bool)
    style.write_png(path, _figure_measured_points, geometry, *arrays, pushes)


def errors_by_point(path: Path | str, frames: Mapping[str, pd.DataFrame], axis: str) -> None:
    """Errors dX or dY of every point, a bar for every payload (after figures 4.22 and 4.23).

    Parameters
    ----------
    path
        PNG to write.
    frames
        Frames of evaluation.crane_measured.campaign.campaign_errors, `none` and `combined`, of the
        same conditions.
    axis
        `x` or `y`.

    Raises
    ------
    DataError
        If a frame or column is missing, or a value is not finite.
    """
    style.write_png(path, _figure_errors_by_point, frames, axis)


def achieved(path: Path | str, frames: Mapping[str, pd.DataFrame], target: ArrayLike) -> None:
    """Points reached about one target, in mm from it (after figures 4.24 and 4.25).

    Parameters
    ----------
    path
        PNG to write.
    frames
        See `errors_by_point`.
    target
        One of the targets, (2,) in m.

    Raises
    ------
    DataError
        As `errors_by_point` does, and if `target` is none of the targets.
    """
    style.write_png(path, _figure_achieved, frames, np.asarray(target, dtype=float))


def adaptation(
    path: Path | str, table: pd.DataFrame, goals: Mapping[int, float] | None = None
) -> None:
    """Mean and 95th percentile of the error against the number of measurements.

    Parameters
    ----------
    path
        PNG to write.
    table
        As evaluation.crane_measured.statistics.adaptation_statistics makes it. The lines are means
        over the twins, the band of `adapted` reaches from the best twin to the worst. N = 0 is the
        first method, which is adapted.
    goals
        Mean error (m) to fall below, by number of measurements.

    Raises
    ------
    DataError
        If a column is missing, or an error is not a positive number.
    """
    style.write_png(path, _figure_adaptation, table, dict(goals or {}))


def _figure_measured_points(
    geometry: CraneGeometry, strokes: Array, points: Array, pushes: Flags | None
) -> Figure:
    n = len(points)
    if strokes.shape != (n, 3) or points.shape != (n, 2) or not n:
        raise DataError(f"measured points: {strokes.shape=}, {points.shape=}, expected one each")
    if pushes is not None and pushes.shape != (n,):
        raise DataError(f"measured points: {pushes.shape=}, expected ({n},)")
    style.finite("measured points", {"strokes": strokes, "points": points})
    figure = Figure(figsize=(style.WIDTH, 7.4))
    axes = figure.add_subplot()
    for row in strokes:
        draw_links(axes, geometry, row[None], width=1.3)
    corners = np.concatenate([line.get_xydata() for line in axes.lines])
    for line in axes.lines:
        line.set_alpha(0.45)
    low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
    _draw_working_area(axes, geometry, low, high)
    for k, (x, y) in enumerate(points):
        look = _dot(pushes is not None and bool(pushes[k]))
        axes.plot([x], [y], "o", markersize=15, zorder=4, **look)
        axes.annotate(
            f"{k + 1}",
            (x, y),
            ha="center",
            va="center_baseline",
            color=look["markeredgecolor"],
            fontsize=9.5,
            fontweight="bold",
            zorder=5,
        )
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    style.plane(axes)
    _legend_of_points(figure, pushes, bool((strokes[:, 2] > 0).any()))
    return figure


def _dot(pushes: bool) -> dict[str, Any]:
    """Look of a point; no colour of a link is in it."""
    inside, around = ("white", style.INK) if pushes else (style.INK, "white")
    return {"color": style.INK, "markerfacecolor": inside, "markeredgecolor": around}


def _draw_working_area(axes: Axes, geometry: CraneGeometry, low: Array, high: Array) -> None:
    """Pale where the rigid crane reaches, between the corners `low` and `high`."""
    n_x, n_y = np.ceil((high - low) / RASTER).astype(int) + 1
    x, y = np.linspace(low[0], high[0], n_x), np.linspace(low[1], high[1], n_y)
    raster = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    reached = inverse_with_smallest_extension(geometry, raster).reached.reshape(n_y, n_x)
    axes.contourf(x, y, reached.astype(float), levels=[0.5, 1.5], colors=["#F0F0F0"], zorder=0)


def _legend_of_points(figure: Figure, pushes: Flags | None, extended: bool) -> None:
    names = {"measured point": False}
    if pushes is not None:
        names = {"jib cylinder pulls": False, "jib cylinder pushes": True}
    handles: dict[str, Line2D | Patch] = {
        name: Line2D([], [], marker="o", markersize=9, linestyle="none", **_dot(pushing))
        for name, pushing in names.items()
    }
    handles["rigid working area"] = Patch(facecolor="#F0F0F0", edgecolor=style.PALE)
    colours = {"lift arm": COLOUR["lift"], "jib": COLOUR["jib"]}
    if extended:
        colours["extension"] = COLOUR["extension"]
    colours |= {"rocker, coupler": style.GREEN, "cylinder": style.GREY}
    for name, colour in colours.items():
        handles[name] = Line2D([], [], color=colour, linewidth=2)
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside upper center",
        ncols=4,
        columnspacing=1.4,
        handletextpad=0.5,
    )


def _checked(frames: Mapping[str, pd.DataFrame]) -> list[pd.DataFrame]:
    style.require("campaign", frames, METHODS)
    for method in METHODS:
        style.require(f"campaign, {method}", frames[method].columns, CAMPAIGN_COLUMNS)
        values = {name: frames[method][name] for name in CAMPAIGN_COLUMNS}
        style.finite(f"campaign, {method}", values)
    return [frames[method] for method in METHODS]


def _figure_errors_by_point(frames: Mapping[str, pd.DataFrame], axis: str) -> Figure:
    both = _checked(frames)
    if axis not in ("x", "y"):
        raise DataError(f"errors by point: {axis=}, expected 'x' or 'y'")
    colours: Colours = dict(style.payload_colours(pd.concat(both)["payload"]))
    names = both[0].drop_duplicates("point")
    figure = Figure(figsize=(style.WIDTH, 6.2))
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, method, frame in zip(panels, METHODS, both, strict=True):
        _draw_bars(axes, frame, f"error_{axis}", colours)
        axes.set_title(TITLES[method])
        axes.set_ylabel(f"d{axis.upper()} (mm)")
    panels[1].set_xticks(
        names["point"],
        [
            f"{point + 1}\n{style.coordinates(x, y)}"
            for point, x, y in zip(
                names["point"], names["target_x"], names["target_y"], strict=True
            )
        ],
        fontsize=8.5,
    )
    panels[1].set_xlim(-0.6, len(names) - 0.4)
    panels[1].set_xlabel("measured point, x and y in m")
    handles = [Patch(color=colour) for colour in colours.values()]
    labels = [f"{payload:g} kg" for payload in colours]
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _draw_bars(axes: Axes, frame: pd.DataFrame, key: str, colours: Colours) -> None:
    width = BARS / len(colours)
    for k, (payload, colour) in enumerate(colours.items()):
        rows = frame[frame["payload"] == payload]
        place = rows["point"] + width * (k - (len(colours) - 1) / 2)
        axes.bar(place, MM * rows[key], 0.92 * width, color=colour)
    axes.axhline(0.0, color=style.GREY, linewidth=0.8)
    axes.grid(visible=False, axis="x")
    style.true_minus(axes)


def _figure_achieved(frames: Mapping[str, pd.DataFrame], target: Array) -> Figure:
    both = _checked(frames)
    colours = style.payload_colours(pd.concat(both)["payload"])
    figure = Figure(figsize=(6.4, 6.6))
    axes = figure.add_subplot()
    drawn = [np.zeros((1, 2))]
    for frame, filled in zip(both, (False, True), strict=True):
        of_target = (frame["target_x"] == target[0]) & (frame["target_y"] == target[1])
        rows = frame[of_target].sort_values("payload")
        if rows.empty:
            raise DataError(f"achieved points: no target {style.coordinates(*target)} m")
        away = MM * (rows[["reached_x", "reached_y"]].to_numpy() - target)
        axes.plot(*away.T, color=style.GREY, linewidth=0.9, linestyle="-" if filled else "--")
        for (x, y), payload in zip(away, rows["payload"], strict=True):
            colour = colours[payload]
            face = colour if filled else "white"
            axes.plot(
                [x], [y], "o", color=colour, markerfacecolor=face, markersize=8, markeredgewidth=1.8
            )
        drawn.append(away)
    axes.plot([0.0], [0.0], "+", color=style.INK, markersize=18, markeredgewidth=1.6)
    _square(axes, np.concatenate(drawn))
    axes.set_title(f"Points reached about {style.coordinates(*target)} m")
    axes.set_xlabel("x from the target (mm)")
    axes.set_ylabel("y from the target (mm)")
    _legend_of_achieved(figure, colours)
    return figure


def _square(axes: Axes, points: Array) -> None:
    """Equal scales and a square frame about `points`."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = 0.62 * max(float(np.ptp(points, axis=0).max()), 4.0)
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        aspect="equal",
    )
    style.true_minus(axes)
    axes.xaxis.set_major_formatter(lambda value, _: style.signed(value))


def _legend_of_achieved(figure: Figure, colours: Colours) -> None:
    handles = [
        Line2D([], [], color=style.INK, marker="+", markersize=12, linestyle="none"),
        *(
            Line2D([], [], color=c, marker="o", markersize=7, linestyle="none")
            for c in colours.values()
        ),
    ]
    labels = ["target", *(f"{payload:g} kg" for payload in colours)]
    look: dict[str, Any] = {"color": style.GREY, "marker": "o", "markersize": 7, "linewidth": 0.9}
    handles.append(Line2D([], [], markerfacecolor="white", linestyle="--", **look))
    handles.append(Line2D([], [], **look))
    labels += TITLES.values()
    figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=3,
        columnspacing=1.4,
    )


def _figure_adaptation(table: pd.DataFrame, goals: dict[int, float]) -> Figure:
    style.require("adaptation", table.columns, ("method", "n_measurements", *ADAPTATION_COLUMNS))
    for name in ADAPTATION_COLUMNS:
        if table.empty or not ((table[name] > 0) & np.isfinite(table[name])).all():
            raise DataError(f"adaptation: {name} must be positive and finite")
    own = table["method"].isin([table["method"].iloc[0], ADAPTED])
    groups = table[own].groupby("n_measurements")
    misjudged = table[table["method"] == MISJUDGED].groupby("n_measurements")
    numbers = np.unique(table["n_measurements"]).astype(float)
    figure = Figure(figsize=(style.WIDTH, 4.4))
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, (name, label) in zip(panels, ADAPTATION_COLUMNS.items(), strict=True):
        errors = MM * groups[name].agg(["mean", "min", "max"])
        axes.fill_between(
            numbers, errors["min"], errors["max"], color=style.SKY, alpha=0.3, linewidth=0
        )
        axes.plot(numbers, errors["mean"], "o-", color=style.BLUE, markersize=4.5)
        worse = MM * misjudged[name].mean()
        axes.plot(worse.index, worse, "s", color=style.ORANGE, markersize=5.5, fillstyle="none")
        for x, y in zip(numbers, errors["mean"], strict=True):
            axes.annotate(
                f"{y:.1f}",
                (x, y),
                (-1, -13),
                textcoords="offset points",
                ha="right",
                fontsize=8.5,
            )
        axes.set_yscale("log", subs=())
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.margins(x=0.09)
        axes.set_xticks(numbers)
        axes.set_title(label)
        axes.set_xlabel("measured points N")
    panels[0].set_ylabel("error (mm), logarithmic")
    for number, goal in goals.items():
        width = GOAL_WIDTH * numbers.max()  # short: it is a goal for this number only
        ends = (number - width, number + width)
        panels[0].plot(ends, (MM * goal,) * 2, color=style.VERMILION, linewidth=0.9)
        panels[0].plot([number], [MM * goal], "v", color=style.VERMILION, markersize=5.5)
    _legend_of_adaptation(figure, bool(goals))
    return figure


def _legend_of_adaptation(figure: Figure, goals: bool) -> None:
    handles: dict[str, Line2D | Patch] = {
        "mean over the cranes": Line2D([], [], color=style.BLUE, marker="o", markersize=4.5),
        "from the best crane to the worst": Patch(color=style.SKY, alpha=0.3),
        "mean, misjudged": Line2D(
            [], [], color=style.ORANGE, marker="s", markersize=5.5, fillstyle="none", linewidth=0
        ),
    }
    if goals:
        handles["goal"] = Line2D(
            [], [], color=style.VERMILION, marker="v", markersize=5.5, linewidth=0.9
        )
    figure.legend(
        list(handles.values()), list(handles), loc="outside upper center", ncols=len(handles)
    )
