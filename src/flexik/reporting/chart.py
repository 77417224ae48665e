"""Panels of lines, points, bands, bars, areas and texts: what nearly every figure is made of.

A chart is a list of layers over tidy frames; a column names the panel of a row, another its hue.
"""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.style import Look

Array = NDArray[np.float64]

SPAN = 1e5  # greatest over least value of a logarithmic axis; what is less is drawn as the least
LEGEND_CHARACTERS = 92  # of a line of the legend
TITLE_CHARACTERS = 92  # of the titles of a row of panels
HALO = [withStroke(linewidth=3, foreground="white")]


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    label : quantity and unit, "error (mm)".
    scale : factor from the column to that unit.
    log, linear_below : logarithmic; linear below this value (in the unit), also of negative ones.
    least : smaller values are drawn as this (in the unit); default: the greatest over SPAN.
    limits : in the unit; None leaves an end to the data.
    margin : about the data, as a share of its extent.
    ticks : values, or texts by value.
    """

    label: str = ""
    scale: float = 1.0
    log: bool = False
    linear_below: float | None = None
    least: float | None = None
    limits: tuple[float | None, float | None] | None = None
    ticks: Sequence[float] | Mapping[Any, str] | None = None
    rotation: float = 0.0
    integer: bool = False
    margin: float = 0.05


@dataclass(frozen=True)
class Layer:
    """Rows of a frame drawn in one way.

    frame : tidy; without the chart's panel column it is drawn in every panel.
    x, y : names of columns.
    mark : "-", "--", "o", "o-", "." and so on as in Axes.plot; "steps"; "band" between the columns
        y and `to`; "bars" of `width`; "area" filled; "text" of the column `text`.
    hue : column whose values have colours (chart's `looks`) and entries in the legend.
    group : column whose values are lines of their own.
    label : entry of the legend; with a hue "{}" stands for its value, "" leaves it out.
    look : keywords of Axes.plot that go before those of the hue.
    """

    frame: pd.DataFrame
    x: str
    y: str
    mark: str = "-"
    hue: str | None = None
    group: str | None = None
    label: str | None = None
    look: Look = field(default_factory=dict)
    to: str = ""
    text: str = ""
    width: float = 0.8


@dataclass(frozen=True)
class Rule:
    """A straight line at `value` (in the unit of the axis) across the `panel`, or all of them."""

    axis: Literal["x", "y"]
    value: float
    label: str = ""
    look: Look = field(default_factory=lambda: style.PUBLISHED)
    panel: Any = None


def chart(
    *layers: Layer,
    x: Axis | Mapping[Any, Axis],
    y: Axis | Mapping[Any, Axis],
    panel: str | None = None,
    panels: Sequence[Any] | None = None,
    titles: Mapping[Any, str] | str | None = None,
    looks: Mapping[Any, Look] | None = None,
    rules: Sequence[Rule] = (),
    columns: int = 3,
    height: float | None = None,
    width: float = style.WIDTH,
    widths: Sequence[float] | None = None,
    share: str = "xy",
    equal: bool = False,
    legend: str = "",
) -> Figure:
    """Draw layers in panels, a legend above all.

    Parameters
    ----------
    layers
        What to draw, the first below the others.
    x, y
        Axes, of all panels or by panel.
    panel, panels
        Column that tells the panel of a row; the panels in order, by default as they come.
    titles
        By panel (default: its name, "" for none); a text: title of the only panel.
    looks
        Colour, line and marker by value of a hue, see style.looks.
    rules
        Straight lines.
    columns, width, height, widths
        Panels in a row; size of the figure in inches; relative widths of the columns.
    share
        "x", "y", "xy" or "": axes that all panels have in common.
    equal
        One scale for x and y: a plane.
    legend
        Heading of the legend.

    Raises
    ------
    DataError
        If a layer has no row, lacks a column, or nothing of it is finite.
    """
    for layer in layers:
        _check(layer, panel)
    names = [None] if panel is None else list(panels or _values(layers, panel))
    if not isinstance(titles, Mapping):
        titles = dict.fromkeys(names, titles or "") if panel is None else {}
    looks = {**_looks_of(layers), **(looks or {})}
    columns = min(columns, len(names))
    rows = -(-len(names) // columns)
    size = (width, height or (1.1 + (4.0 if rows * columns == 1 else 2.5) * rows))
    figure = Figure(figsize=size)
    grid = figure.subplots(
        *(rows, columns),
        sharex="x" in share,
        sharey="y" in share,
        squeeze=False,
        width_ratios=widths,
    ).ravel()
    of_panel = [_axis(x, name) for name in names], [_axis(y, name) for name in names]
    # one label for all panels in a row or column
    one = columns > 1 and isinstance(x, Axis), rows > 1 and isinstance(y, Axis)
    for k, (axes, name) in enumerate(zip(grid, names, strict=False)):
        scales, inside = (of_panel[0][k], of_panel[1][k]), [_rows(la, panel, name) for la in layers]
        drawn = [list(zip(layers, inside, strict=True)), [(la, la.frame) for la in layers]]
        least = [_least(drawn[isinstance(x, Axis)], "x"), _least(drawn[isinstance(y, Axis)], "y")]
        for layer, rows_of in zip(layers, inside, strict=True):
            if len(rows_of):
                _draw(axes, layer, rows_of, scales, least, looks)
        for rule in rules:
            if rule.panel is None or rule.panel == name:
                line = axes.axvline if rule.axis == "x" else axes.axhline
                line(rule.value, label=rule.label or None, zorder=1.6, **rule.look)
        title = titles.get(name, "" if name is None else str(name))
        wrapped = (textwrap.fill(line, TITLE_CHARACTERS // columns) for line in title.splitlines())
        axes.set_title("\n".join(wrapped))
        if equal:
            axes.set_aspect("equal", adjustable="box")
    for k, axes in enumerate(grid):
        if k >= len(names):
            axes.set_axis_off()
            continue
        below = k + columns < len(names)
        axes.xaxis.set_tick_params(labelbottom="x" not in share or not below)
        _set_axis(axes, of_panel[0][k], "x", one[0] or (below and "x" in share))
        _set_axis(axes, of_panel[1][k], "y", one[1] or (k % columns > 0 and "y" in share))
    if one[0]:
        figure.supxlabel(of_panel[0][0].label, fontsize=10)
    if one[1]:
        figure.supylabel(of_panel[1][0].label, fontsize=10)
    _legend(figure, grid[: len(names)], legend)
    return figure


def _check(layer: Layer, panel: str | None) -> None:
    needed = [layer.x, layer.y, layer.hue, layer.group, layer.to, layer.text]
    style.require(f"layer {layer.label or layer.y}", layer.frame.columns, filter(None, needed))
    values = layer.frame[[layer.x, layer.y]].to_numpy(dtype=float)
    if not np.isfinite(values).all(axis=1).any():
        raise DataError(f"layer {layer.label or layer.y}: expected finite numbers, found none")
    if np.isinf(values).any():
        raise DataError(f"layer {layer.label or layer.y}: a number is infinite")


def _values(layers: Iterable[Layer], column: str) -> list[Any]:
    frames = (layer.frame for layer in layers if column in layer.frame)
    return list(dict.fromkeys(value for frame in frames for value in frame[column]))


def _looks_of(layers: Iterable[Layer]) -> dict[Any, dict[str, Any]]:
    hues = (v for layer in layers if layer.hue for v in layer.frame[layer.hue])
    return style.looks(dict.fromkeys(hues))


def _axis(axis: Axis | Mapping[Any, Axis], name: Any) -> Axis:
    return axis if isinstance(axis, Axis) else axis[name]


def _rows(layer: Layer, panel: str | None, name: Any) -> pd.DataFrame:
    if panel is None or panel not in layer.frame:
        return layer.frame
    return layer.frame[layer.frame[panel] == name]


def _least(drawn: Iterable[tuple[Layer, pd.DataFrame]], which: Literal["x", "y"]) -> float:
    """Least value drawn on a logarithmic axis without one of its own, in the unit of the column."""
    found = [
        rows[name].to_numpy(dtype=float)
        for layer, rows in drawn
        for name in ((layer.x,) if which == "x" else filter(None, (layer.y, layer.to)))
    ]
    values = np.concatenate(found)
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return 1.0
    return max(float(positive.min()) / 1.3, float(positive.max()) / SPAN)


def _place(values: pd.Series, axis: Axis, least: float) -> Array:
    numbers = axis.scale * values.to_numpy(dtype=float)
    if axis.least is not None or (axis.log and axis.linear_below is None):
        numbers = np.maximum(numbers, axis.scale * least if axis.least is None else axis.least)
    return numbers


def _draw(
    axes: Axes,
    layer: Layer,
    rows: pd.DataFrame,
    scales: tuple[Axis, Axis],
    least: Sequence[float],
    looks: Mapping[Any, Look],
) -> None:
    keys = [key for key in (layer.hue, layer.group) if key]
    parts = rows.groupby(keys, sort=False) if keys else [((), rows)]
    for values, part in parts:
        hue = values[0] if layer.hue else None
        look = dict(looks.get(hue, {})) if layer.hue else {"color": style.BLUE}
        label = layer.label
        if layer.hue:
            label = str(hue) if label is None else label.format(hue)
        at_x = _place(part[layer.x], scales[0], least[0])
        at_y = _place(part[layer.y], scales[1], least[1])
        if layer.mark == "text":
            _write(axes, at_x, at_y, part, layer)
            continue
        if layer.mark in ("band", "bars", "area"):
            other = _place(part[layer.to], scales[1], least[1]) if layer.to else at_y
            _fill(axes, at_x, at_y, other, layer, look | dict(layer.look), label)
            continue
        axes.plot(at_x, at_y, label=label or None, **_line(layer, look))


def _line(layer: Layer, look: dict[str, Any]) -> dict[str, Any]:
    """Keywords of Axes.plot for a mark: its dash or marker goes before that of the hue."""
    mark = "-" if layer.mark == "steps" else layer.mark
    dash = next((d for d in ("--", "-.", "-", ":") if d in mark), "")
    marker = mark.replace(dash, "") if dash else mark
    if not dash:
        look["linestyle"] = "none"
    elif dash != "-":
        look["linestyle"] = dash
    if not marker:
        look.pop("marker", None)
    elif marker != "o" or "marker" not in look:
        look["marker"] = marker
    if layer.mark == "steps":
        look["drawstyle"] = "steps-post"
    return {"markersize": 4.0, "linewidth": 1.5} | look | dict(layer.look)


def _fill(
    axes: Axes, x: Array, y: Array, other: Array, layer: Layer, look: dict[str, Any], label: Any
) -> None:
    colour, label = look.pop("color"), label or None
    for key in ("linestyle", "marker"):
        look.pop(key, None)
    if layer.mark == "band":
        look = {"alpha": 0.25, "linewidth": 0} | look
        axes.fill_between(x, y, other, color=colour, label=label, **look)
    elif layer.mark == "bars":
        axes.bar(x, y, layer.width, color=colour, label=label, **look)
        axes.axhline(0.0, color=style.GREY, linewidth=0.8)
    else:
        look = {"edgecolor": "white", "linewidth": 0.6, "facecolor": colour} | look
        axes.add_patch(Polygon(np.column_stack([x, y]), label=label, **look))
        axes.update_datalim(np.column_stack([x, y]))


def _write(axes: Axes, x: Array, y: Array, rows: pd.DataFrame, layer: Layer) -> None:
    """Texts beside points: columns dx and dy (points), side; with look leader=True a line to it."""
    look = dict(layer.look)
    leader = {"arrowstyle": "-", "color": style.GREY, "linewidth": 0.8, "shrinkB": 0}
    arrow = leader if look.pop("leader", False) else None
    columns = {"dx": 0.0, "dy": 0.0, "side": "center"}
    given = [list(rows.get(k, pd.Series([v] * len(rows)))) for k, v in columns.items()]
    for at_x, at_y, text, dx, dy, side in zip(x, y, rows[layer.text], *given, strict=True):
        axes.annotate(
            *(str(text), (at_x, at_y), (dx, dy)),
            textcoords="offset points",
            arrowprops=arrow,
            **{"ha": side, "va": "center", "fontsize": 9, "path_effects": HALO, "zorder": 8} | look,
        )


def _set_axis(axes: Axes, axis: Axis, which: Literal["x", "y"], hidden: bool) -> None:
    own = axes.xaxis if which == "x" else axes.yaxis
    axes.set_xmargin(axis.margin) if which == "x" else axes.set_ymargin(axis.margin)
    if axis.log:
        axes.set(**{f"{which}scale": "log"})
        _log_ticks(axes, axis, which)
    elif axis.linear_below is not None:
        _symmetric(axes, axis.linear_below, which)
    else:
        own.set_major_formatter(FuncFormatter(lambda value, _: style.signed(round(value, 12))))
        own.set_major_locator(MaxNLocator("auto", integer=axis.integer, steps=[1, 2, 2.5, 5, 10]))
    if axis.limits is not None:
        axes.set(**{f"{which}lim": axis.limits})
    if axis.ticks is not None:
        texts = [style.signed(v) for v in axis.ticks]
        if isinstance(axis.ticks, Mapping):
            texts = list(axis.ticks.values())
        own.set_ticks(list(axis.ticks), texts, rotation=axis.rotation)
        own.set_minor_locator(NullLocator())
    if not hidden:
        own.set_label_text(axis.label)


def _log_ticks(axes: Axes, axis: Axis, which: Literal["x", "y"]) -> None:
    """Decades, or 1, 2, 5 if there are few, as decimals, or all as powers of ten."""
    own = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    few = high / low < 300
    own.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=8))
    own.set_minor_locator(NullLocator())
    if low > 2e-4 and high < 3e5:
        own.set_major_formatter(FuncFormatter(lambda value, _: style.signed(value)))
    else:
        own.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))


def _power(value: float) -> str:
    factor, power = f"{value:.0e}".split("e")
    times = "" if factor == "1" else rf"{factor}\times"
    return f"${times}10^{{{int(power)}}}$"


def _symmetric(axes: Axes, linear: float, which: Literal["x", "y"]) -> None:
    """Linear about zero, logarithmic beyond: small and large errors are read in one picture."""
    own = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.dataLim.intervalx if which == "x" else axes.dataLim.intervaly
    set_scale = axes.set_xscale if which == "x" else axes.set_yscale
    set_scale("symlog", linthresh=linear, linscale=0.45)
    largest = max(abs(low), abs(high), 10 * linear)
    decades = [linear * 10.0**k for k in range(int(np.ceil(np.log10(largest / linear))) + 1)]
    signs = [-t for t in decades[::-1]] if low < -linear else []
    own.set_ticks([*signs, 0.0, *decades], [style.signed(t) for t in [*signs, 0.0, *decades]])
    own.set_minor_locator(NullLocator())
    top = 1.35 * largest
    axes.set(**{f"{which}lim": (-top if signs else -0.15 * linear, top)})


def _legend(figure: Figure, panels: Iterable[Axes], heading: str) -> None:
    """One legend above all panels, as wide as its texts allow."""
    entries: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if not entries:
        return
    longest = max(len(label) for label in entries) + 6
    columns = max(1, min(len(entries), LEGEND_CHARACTERS // longest))
    legend = figure.legend(
        list(entries.values()),
        list(entries),
        loc="outside upper center",
        ncols=columns,
        title=heading or None,
    )
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):  # the dots of many points are small
            handle.set_markersize(max(handle.get_markersize(), 5.0))
