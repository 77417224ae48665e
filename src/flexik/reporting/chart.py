"""Panels of lines, points, bands, bars, areas and texts: what nearly every figure is made of.

A chart is a list of layers over tidy frames; a column names the panel of a row, another its hue.
"""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

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
CHARACTERS = 92  # of a line of the legend, and of the titles of a row of panels
HALO = [withStroke(linewidth=3, foreground="white")]
LEADER = {"arrowstyle": "-", "color": style.GREY, "linewidth": 0.8, "shrinkB": 0}


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    label : quantity and unit, "error (mm)".
    scale : factor from the column to that unit, in which the others are.
    log, linear_below : logarithmic; linear below this value, also of negative numbers.
    least : smaller values are drawn as this; default of a logarithmic axis: the greatest over SPAN.
    limits : None leaves an end to the data.
    ticks : values, or texts by value.
    margin : about the data, as a share of its extent.
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
        y and `to`; "bars" of `width`; "area" filled; "text" of the column `text`, at dx and dy
        points, side, with a line to it if the look has leader=True.
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
    """A straight line at `value` (in the unit) of axis "x" or "y", in one `panel` or all."""

    axis: str
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
    share: str | None = None,
    equal: bool = False,
    legend: str = "",
) -> Figure:
    """Draw layers, the first below the others, in panels, a legend above all.

    x, y : axes, of all panels or by panel.
    panel, panels : column that tells the panel of a row; the panels in order, as they come if None.
    titles : by panel (default: its name), or the same for all, "" for none.
    looks : colour, line and marker by value of a hue, see style.looks.
    columns, width, height, widths : panels in a row; inches; relative widths of the columns.
    share : "x", "y", "xy" or "": axes that all panels have in common; None: those not by panel.
    equal : one scale for x and y.
    legend : its heading.

    Raises DataError if a layer lacks a column, is infinite, or has no finite row.
    """
    for layer in layers:
        _check(layer)
    names = list(panels or _panels(layers, panel))
    columns = min(columns, len(names))
    rows = -(-len(names) // columns)
    height = height or 1.1 + (4.0 if len(names) == 1 else 2.5) * rows
    figure = Figure(figsize=(width, height))
    options: dict[str, Any] = {"squeeze": False, "width_ratios": widths}
    if share is None:
        share = "".join(k for k, axis in zip("xy", (x, y), strict=True) if isinstance(axis, Axis))
    grid = figure.subplots(rows, columns, sharex="x" in share, sharey="y" in share, **options)
    hues = {value: None for layer in layers if layer.hue for value in layer.frame[layer.hue]}
    looks = {**style.looks(hues), **(looks or {})}
    for axes, name in zip(grid.ravel(), names, strict=False):
        inside = [(layer, _inside(layer, panel, name)) for layer in layers]
        at_x, at_y = (_for_panel(a, name, inside, k) for a, k in ((x, "x"), (y, "y")))
        for layer, frame in inside:
            _draw(axes, layer, frame, at_x, at_y, looks)
        for rule in rules:
            if rule.panel in (None, name):
                line = axes.axvline if rule.axis == "x" else axes.axhline
                line(rule.value, label=rule.label or None, zorder=1.6, **rule.look)
        title = titles if isinstance(titles, str) else (titles or {}).get(name, name)
        title = "" if title is None else str(title)
        lines = (textwrap.fill(line, CHARACTERS // columns) for line in title.splitlines())
        axes.set(title="\n".join(lines), **({"aspect": "equal"} if equal else {}))
    _set_all(figure, grid, names, (x, y), share)
    _legend(figure, legend)
    return figure


def _check(layer: Layer) -> None:
    needed = [layer.x, layer.y, layer.hue, layer.group, layer.to, layer.text]
    what = f"layer {layer.label or layer.y}"
    style.require(what, layer.frame.columns, filter(None, needed))
    values = layer.frame[[layer.x, layer.y]].to_numpy(dtype=float)
    if np.isinf(values).any() or not np.isfinite(values).all(axis=1).any():
        raise DataError(f"{what}: expected finite numbers")


def _panels(layers: Iterable[Layer], panel: str | None) -> Iterable[Any]:
    if panel is None:
        return [None]
    return dict.fromkeys(v for layer in layers if panel in layer.frame for v in layer.frame[panel])


def _inside(layer: Layer, panel: str | None, name: Any) -> pd.DataFrame:
    everywhere = panel is None or panel not in layer.frame
    return layer.frame if everywhere else layer.frame[layer.frame[panel] == name]


def _for_panel(
    given: Axis | Mapping[Any, Axis],
    name: Any,
    inside: Iterable[tuple[Layer, pd.DataFrame]],
    which: str,
) -> Axis:
    """Axis of the panel `name` with the least value that it shows, if it is logarithmic."""
    axis = given if isinstance(given, Axis) else given[name]
    if not axis.log or axis.least is not None:
        return axis
    numbers = [
        # one axis of all panels begins where all of their data does
        (layer.frame if axis is given else rows)[column].to_numpy(dtype=float)
        for layer, rows in inside
        for column in ([layer.x] if which == "x" else filter(None, (layer.y, layer.to)))
    ]
    values = np.concatenate(numbers)
    positive = values[np.isfinite(values) & (values > 0)]
    least = max(positive.min() / 1.3, positive.max() / SPAN) if positive.size else 1.0
    return replace(axis, least=axis.scale * float(least))


def _place(values: pd.Series, axis: Axis) -> Array:
    numbers = axis.scale * values.to_numpy(dtype=float)
    return numbers if axis.least is None else np.maximum(numbers, axis.least)


def _draw(
    axes: Axes, layer: Layer, frame: pd.DataFrame, x: Axis, y: Axis, looks: Mapping[Any, Look]
) -> None:
    if frame.empty:
        return
    keys = [key for key in (layer.hue, layer.group) if key]
    for values, rows in frame.groupby(keys, sort=False) if keys else [((), frame)]:
        hue = values[0] if layer.hue else None
        look = dict(looks[hue]) if layer.hue else {"color": style.BLUE}
        label = layer.label
        if layer.hue:
            label = str(hue) if label is None else label.format(hue)
        at_x, at_y = _place(rows[layer.x], x), _place(rows[layer.y], y)
        if layer.mark == "text":
            _write(axes, at_x, at_y, rows, layer)
        elif layer.mark in ("band", "bars", "area"):
            to = _place(rows[layer.to or layer.y], y)
            _fill(axes, (at_x, at_y, to), layer, {"color": look["color"], **layer.look}, label)
        else:
            axes.plot(at_x, at_y, label=label or None, **_line(layer, look))


def _line(layer: Layer, look: dict[str, Any]) -> dict[str, Any]:
    """Keywords of Axes.plot: the dash or marker of the mark goes before that of the hue."""
    mark = "-" if layer.mark == "steps" else layer.mark
    dash = next((d for d in ("--", "-.", "-", ":") if d in mark), "")
    marker = mark.replace(dash, "") if dash else mark
    if dash != "-":
        look["linestyle"] = dash or "none"
    if not marker:
        look.pop("marker", None)
    elif marker != "o" or "marker" not in look:
        look["marker"] = marker
    if layer.mark == "steps":
        look["drawstyle"] = "steps-post"
    return {"markersize": 4.0, "linewidth": 1.5} | look | dict(layer.look)


def _fill(
    axes: Axes, at: tuple[Array, Array, Array], layer: Layer, look: dict[str, Any], label: Any
) -> None:
    x, y, to = at
    if layer.mark == "band":
        axes.fill_between(x, y, to, label=label or None, **{"alpha": 0.25, "linewidth": 0} | look)
    elif layer.mark == "bars":
        axes.bar(x, y, layer.width, label=label or None, **look)
        axes.axhline(0.0, color=style.GREY, linewidth=0.8)
    else:
        edge = {"edgecolor": "white", "linewidth": 0.6, "facecolor": look.pop("color")}
        axes.add_patch(Polygon(np.column_stack([x, y]), label=label or None, **edge | look))
        axes.update_datalim(np.column_stack([x, y]))


def _write(axes: Axes, x: Array, y: Array, rows: pd.DataFrame, layer: Layer) -> None:
    look: dict[str, Any] = {"va": "center", "fontsize": 9, "path_effects": HALO, "zorder": 8}
    look |= {"textcoords": "offset points", **layer.look}
    look["arrowprops"] = LEADER if look.pop("leader", False) else None
    places = pd.DataFrame({"dx": 0.0, "dy": 0.0, "side": "center"}, index=rows.index)
    places.update(rows)
    for text, *at, dx, dy, side in zip(rows[layer.text], x, y, *places.to_numpy().T, strict=True):
        axes.annotate(str(text), tuple(at), (dx, dy), ha=side, **look)


def _set_all(figure: Figure, grid: Any, names: Sequence[Any], both: Any, share: str) -> None:
    """Scales, ticks and labels; one label for all panels where one axis is that of all."""
    shape = grid.shape
    for k, axes in enumerate(grid.ravel()):
        if k >= len(names):
            axes.set_axis_off()
            continue
        below, beside = k + shape[1] < len(names), k % shape[1] > 0
        axes.xaxis.set_tick_params(labelbottom="x" not in share or not below)
        for which, of_all, inner, n in zip("xy", both, (below, beside), shape[::-1], strict=True):
            axis = of_all if isinstance(of_all, Axis) else of_all[names[k]]
            _set_axis(axes, axis, which)
            if n > 1 and axis is of_all:
                getattr(figure, f"sup{which}label")(axis.label, fontsize=10)
            elif not (inner and which in share):
                axes.set(**{f"{which}label": axis.label})


def _set_axis(axes: Axes, axis: Axis, which: str) -> None:
    own = axes.xaxis if which == "x" else axes.yaxis
    getattr(axes, f"set_{which}margin")(axis.margin)
    if axis.log:
        axes.set(**{f"{which}scale": "log"})
        low, high = own.get_view_interval()
        # 1, 2, 5 beside few decades; decimals, or all as powers of ten
        subs = (1.0, 2.0, 5.0) if high / low < 300 else (1.0,)
        own.set_major_locator(LogLocator(subs=subs, numticks=8))
        own.set_minor_locator(NullLocator())
        decimals = low > 2e-4 and high < 3e5
        write = style.signed if decimals else _power
        own.set_major_formatter(FuncFormatter(lambda value, _: write(value)))
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


def _power(value: float) -> str:
    factor, power = f"{value:.0e}".split("e")
    times = "" if factor == "1" else rf"{factor}\times"
    return f"${times}10^{{{int(power)}}}$"


def _symmetric(axes: Axes, linear: float, which: str) -> None:
    """Linear about zero, logarithmic beyond: small and large errors are read in one picture."""
    own = axes.xaxis if which == "x" else axes.yaxis
    low, high = own.get_data_interval()
    getattr(axes, f"set_{which}scale")("symlog", linthresh=linear, linscale=0.45)
    largest = max(abs(low), abs(high), 10 * linear)
    decades = [linear * 10.0**k for k in range(int(np.ceil(np.log10(largest / linear))) + 1)]
    ticks = [*(-t for t in decades[::-1] if low < -linear), 0.0, *decades]
    own.set_ticks(ticks, [style.signed(t) for t in ticks])
    own.set_minor_locator(NullLocator())
    top = 1.35 * largest
    axes.set(**{f"{which}lim": (-top if low < -linear else -0.15 * linear, top)})


def _legend(figure: Figure, heading: str) -> None:
    """One legend above all panels, as wide as its texts allow."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        longest = max(len(label) for label in entries) + 6
        columns = max(1, min(len(entries), CHARACTERS // longest))
        options: dict[str, Any] = {"loc": "outside upper center", "title": heading or None}
        legend = figure.legend(list(entries.values()), list(entries), ncols=columns, **options)
        for drawn in legend.legend_handles:
            if isinstance(drawn, Line2D):  # the dots of many points are small
                drawn.set_markersize(max(drawn.get_markersize(), 5.0))
