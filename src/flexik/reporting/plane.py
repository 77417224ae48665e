"""Figures over the plane and in space: maps of a value, and mechanisms of three dimensions."""

import textwrap
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from flexik.reporting import style
from flexik.reporting.chart import SPAN, Layer

Array = NDArray[np.float64]

# bright is bad; neither end is white, which is left to the empty squares
MAP = ListedColormap(mpl.colormaps["magma"](np.linspace(0.08, 0.95, 256)))
STEPS = [float(f"{m}e{k}") for k in range(-18, 19) for m in (1, 2, 5)]


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
) -> Figure:
    """Value over the plane (m), a panel for every value of `panel`, bright where it is large.

    label, scale : quantity and unit of the colours; factor to it.
    cell : side of the squares whose mean is drawn; None draws a dot for every row.
    """
    parts = {str(name): rows for name, rows in frame.groupby(panel, sort=False)}
    edges = [_edges(frame[k].to_numpy(dtype=float), cell or 1.0) for k in (x, y)]
    drawn = {
        name: scale * (_means(rows, x, y, value, edges) if cell else rows[value].to_numpy())
        for name, rows in parts.items()
    }
    known = np.concatenate([v[np.isfinite(v)] for v in drawn.values()])
    least = max(float(known.min()), float(known.max()) / SPAN)
    low, high = max(s for s in STEPS if s <= least), min(s for s in STEPS if s >= known.max())
    look = {"cmap": MAP, "norm": LogNorm(low, high)}
    n = len(parts)
    columns = n if n <= columns else min(columns, -(-n // 2))
    rows = -(-n // columns)
    height = min((style.WIDTH - 0.8) / columns * np.ptp(frame[y]) / np.ptp(frame[x]), 3.7)
    figure = Figure(figsize=(style.WIDTH, 0.95 + rows * (height + 0.3)), layout="compressed")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for k, (axes, (name, values)) in enumerate(zip(panels, drawn.items(), strict=False)):
        values = np.maximum(values, low)
        if cell:
            shown: Any = axes.pcolormesh(*edges, np.ma.masked_invalid(values.T), **look)
        else:
            shown = axes.scatter(*(parts[name][c] for c in (x, y)), 7, values, linewidths=0, **look)
        axes.set(title=textwrap.fill(name, 88 // columns), aspect="equal")
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        if k + columns >= n:
            axes.tick_params(labelbottom=True)
            axes.set_xlabel("x (m)")
        axes.set_ylabel("" if k % columns else "y (m)")
    for axes in panels[n:]:
        axes.set_axis_off()
    place: dict[str, Any] = {"location": "bottom", "shrink": 0.7, "aspect": 45}
    extend = "min" if (known < low).any() else "neither"
    bar = figure.colorbar(shown, ax=list(panels), extend=extend, **place)
    bar.set_label(label + (f", mean in squares of {cell:g} m" if cell else ""))
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


def space(*layers: Layer, z: str = "z") -> Figure:
    """Lines ("-", "--") and dots ("o") of layers in space, mm; `z` is the third coordinate, m."""
    figure = Figure(figsize=(style.WIDTH, 5.6))
    axes: Any = figure.add_subplot(projection="3d")
    for layer in layers:
        dot = {"linestyle": "none", "marker": "o"}
        look = dot if layer.mark == "o" else {"linestyle": layer.mark}
        data = (style.MM * layer.frame[name] for name in (layer.x, layer.y, z))
        axes.plot(*data, label=layer.label or None, **look | dict(layer.look))
    axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
    axes.set_aspect("equal")
    axes.view_init(elev=18.0, azim=-50.0)
    entries = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside right upper")
    return figure
