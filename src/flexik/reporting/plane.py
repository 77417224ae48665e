"""Figures over the plane and in space: maps of a value, and mechanisms of three dimensions."""

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer

Array = NDArray[np.float64]

# bright is bad; neither end is white, which is left to the empty squares
MAP = ListedColormap(mpl.colormaps["magma"](np.linspace(0.08, 0.95, 256)))
STEPS = [float(f"{m}e{k}") for k in range(-18, 19) for m in (1, 2, 5)]
MILLIMETRES = tuple(Axis(f"{k} (mm)", style.MM) for k in "xyz")
SPAN = 1e5  # greatest over least value told apart


def maps(
    frame: pd.DataFrame,
    x: str,
    y: str,
    value: str,
    panel: str,
    *,
    label: str,
    scale: float = 1.0,
    cell: float | None = None,
    columns: int = 5,
    unit: str = "m",
) -> Figure:
    """Value over the plane, a panel for every value of `panel`, bright where it is large.

    Parameters
    ----------
    frame
        Columns x, y, value, panel; a row for every place.
    label, scale
        Quantity and unit of the colours; factor to it.
    cell
        Side of the squares whose mean is drawn; None draws a dot for every row.
    unit
        Of x and y.
    """
    names = list(dict.fromkeys(frame[panel]))
    parts = dict(iter(frame.groupby(panel, sort=False)))
    edges = [_edges(frame[k].to_numpy(dtype=float), cell or 1.0) for k in (x, y)]
    drawn = {
        name: _means(rows, x, y, value, edges) if cell else rows[value].to_numpy(dtype=float)
        for name, rows in parts.items()
    }
    known = scale * np.concatenate([v[np.isfinite(v)] for v in drawn.values()])
    least = max(float(known.min()), float(known.max()) / SPAN)
    low, high = max(s for s in STEPS if s <= least), min(s for s in STEPS if s >= known.max())
    norm = LogNorm(low, high)
    columns = min(columns, len(names) if len(names) <= columns else -(-len(names) // 2))
    rows = -(-len(names) // columns)
    spans = [np.ptp(frame[k]) for k in (x, y)]
    height = min((style.WIDTH - 0.8) / columns * spans[1] / spans[0], 3.7)
    figure = Figure(figsize=(style.WIDTH, 0.95 + rows * (height + 0.3)), layout="compressed")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for k, axes in enumerate(panels):
        if k >= len(names):
            axes.set_axis_off()
            continue
        values = np.maximum(scale * drawn[names[k]], low)
        if cell:
            shown = axes.pcolormesh(*edges, np.ma.masked_invalid(values.T), cmap=MAP, norm=norm)
        else:
            places = parts[names[k]][x], parts[names[k]][y]
            shown = axes.scatter(*places, 7, values, cmap=MAP, norm=norm, linewidths=0)
        axes.set_title(textwrap.fill(str(names[k]), 88 // columns), fontsize=9.5)
        axes.set_aspect("equal")
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        if k + columns >= len(names):
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(f"x ({unit})")
        if k % columns == 0:
            axes.set_ylabel(f"y ({unit})")
    extend = "min" if (known < low).any() else "neither"
    bar = figure.colorbar(
        shown, ax=list(panels), location="bottom", shrink=0.7, aspect=45, extend=extend
    )
    bar.set_label(label + (f", mean in squares of {cell:g} {unit}" if cell else ""))
    ticks = [s for s in STEPS[::3] if low <= s <= high]
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.ax.minorticks_off()
    return figure


def _edges(values: Array, cell: float) -> Array:
    return cell * np.arange(np.floor(values.min() / cell), np.floor(values.max() / cell) + 2)


def _means(rows: pd.DataFrame, x: str, y: str, value: str, edges: list[Array]) -> Array:
    """Mean value in every square (columns of x, rows of y), NaN in empty ones."""
    places = rows[x].to_numpy(), rows[y].to_numpy()
    number = np.histogram2d(*places, bins=edges)[0]
    total = np.histogram2d(*places, bins=edges, weights=rows[value].to_numpy())[0]
    return np.divide(total, number, out=np.full_like(total, np.nan), where=number > 0)


def space(
    *layers: Layer,
    z: str = "z",
    axes_of: Sequence[Axis] = MILLIMETRES,
    looks: dict[Any, Any] | None = None,
    view: tuple[float, float] = (18.0, -50.0),
    height: float = 5.6,
) -> Figure:
    """Lines and dots of layers in space, as reporting.chart draws them in the plane.

    Parameters
    ----------
    z
        Column of the third coordinate.
    axes_of
        Labels and scales, by default of mm.
    view
        Elevation and azimuth, degrees.
    """
    figure = Figure(figsize=(style.WIDTH, height))
    axes: Any = figure.add_subplot(projection="3d")
    looks = looks or {}
    for layer in layers:
        keys = [key for key in (layer.hue, layer.group) if key]
        parts = layer.frame.groupby(keys, sort=False) if keys else [((), layer.frame)]
        for values, rows in parts:
            look = dict(looks.get(values[0], {})) if layer.hue else {}
            label = str(values[0]) if layer.hue and layer.label is None else layer.label
            columns = (layer.x, layer.y, z)
            points = [a.scale * rows[k] for a, k in zip(axes_of, columns, strict=True)]
            mark = {"linestyle": "none", "marker": "o"} if layer.mark == "o" else {}
            mark |= {"linestyle": "--"} if layer.mark == "--" else {}
            axes.plot(*points, label=label or None, **(look | mark | dict(layer.look)))
    for axis, which in zip(axes_of, "xyz", strict=True):
        axes.set(**{f"{which}label": axis.label})
    axes.set_aspect("equal")
    axes.view_init(elev=view[0], azim=view[1])
    entries = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside right upper")
    return figure
