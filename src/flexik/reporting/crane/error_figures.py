"""Positioning errors drawn: condition by condition, and methods beside the published ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexik.errors import DataError
from flexik.positioning.method import REACHED
from flexik.reporting import style
from flexik.reporting.style import MM

KEYS = ("target_x", "target_y", "payload")
ERROR_COLUMNS = ("point", *KEYS, "error_x", "error_y", "error", "status")
ERROR_ROWS = {"error_x": "dX (mm)", "error_y": "dY (mm)", "error": "R (mm)"}

# Errors below this are drawn on a linear scale, above on a logarithmic one, mm
LINEAR_BELOW = 1.0

COMPARED = {"mean_error": "mean R (mm)", "max_error": "max R (mm)"}
OURS, THEIRS = style.BLUE, style.INK
PUBLISHED = " published"  # ends the name of a published column


def positioning_errors(
    path: Path | str, uncompensated: pd.DataFrame, compensated: pd.DataFrame, label: str
) -> None:
    """Errors without and with compensation at every test condition (Rouvinen 1999, figure 4.8).

    Parameters
    ----------
    path
        PNG to write.
    uncompensated, compensated
        Frames of the same conditions with ERROR_COLUMNS, SI units.
    label
        Name of the compensating method.

    Raises
    ------
    DataError
        If a column is missing, the conditions differ, or an error is not finite.
    """
    style.write_png(path, _figure_positioning_errors, uncompensated, compensated, label)


def method_comparison(path: Path | str, statistics: pd.DataFrame) -> None:
    """Mean and largest error of every method, ours beside the published one.

    Parameters
    ----------
    path
        PNG to write.
    statistics
        In mm, indexed by the names of evaluation.errors.STATISTICS; columns `label` and, where
        there is one, `label published`, as evaluation.errors.comparison makes them.

    Raises
    ------
    DataError
        If a row of COMPARED is missing or a value is not positive; published ones may be NaN.
    """
    style.write_png(path, _figure_method_comparison, statistics)


def _figure_positioning_errors(
    uncompensated: pd.DataFrame, compensated: pd.DataFrame, label: str
) -> Figure:
    _check_errors(uncompensated, compensated)
    colours = style.payload_colours(compensated["payload"])
    place = _places(compensated, list(colours))
    names = compensated.drop_duplicates("point")
    largest = MM * max(uncompensated["error"].max(), compensated["error"].max())

    figure = Figure(figsize=(style.WIDTH, 8.2))
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(1.25, 1.25, 1))
    for axes, (key, axis_label) in zip(panels, ERROR_ROWS.items(), strict=True):
        axes.plot(
            place, MM * uncompensated[key], "o", color=style.GREY, markersize=3.2, fillstyle="none"
        )
        _draw_compensated(axes, place, compensated, key, colours)
        _error_scale(axes, largest, signed=key != "error")
        axes.set_ylabel(axis_label)
        for k in range(1, len(names), 2):  # groups told apart by bands
            axes.axvspan(k - 0.5, k + 0.5, color="#F3F3F3", zorder=0)
    panels[-1].set_xticks(
        range(len(names)),
        [
            style.coordinates(x, y)
            for x, y in zip(names["target_x"], names["target_y"], strict=True)
        ],
        rotation=90,
    )
    panels[-1].set_xlim(-0.6, len(names) - 0.4)
    panels[-1].set_xlabel(
        "test point, x and y in m (errors: linear scale below 1 mm, logarithmic above)"
    )
    _error_legend(figure, colours, label, bool((compensated["status"] != REACHED).any()))
    return figure


def _check_errors(uncompensated: pd.DataFrame, compensated: pd.DataFrame) -> None:
    for name, frame in (("uncompensated", uncompensated), ("compensated", compensated)):
        style.require(f"{name} errors", frame.columns, ERROR_COLUMNS)
        style.finite(f"{name} errors", {key: frame[key] for key in ERROR_ROWS})
    if len(uncompensated) != len(compensated) or any(
        not np.array_equal(uncompensated[key], compensated[key]) for key in KEYS
    ):
        raise DataError("uncompensated and compensated errors are of different conditions")


def _draw_compensated(
    axes: Axes,
    place: pd.Series,
    errors: pd.DataFrame,
    key: str,
    colours: dict[float, tuple[float, ...]],
) -> None:
    """Errors `key` coloured by payload, a dot where the method succeeded and else a cross."""
    for payload, colour in colours.items():
        for reached, marker in ((True, "o"), (False, "x")):
            rows = (errors["payload"] == payload) & ((errors["status"] == REACHED) == reached)
            axes.plot(place[rows], MM * errors.loc[rows, key], marker, color=colour, markersize=4)


def _places(frame: pd.DataFrame, payloads: list[float]) -> pd.Series:
    """Abscissa of every condition: its point's number, spread by payload."""
    offsets = np.linspace(-0.34, 0.34, len(payloads)) if len(payloads) > 1 else [0.0]
    spread = dict(zip(payloads, offsets, strict=True))
    return pd.factorize(frame["point"])[0] + frame["payload"].map(spread)


def _error_scale(axes: Axes, largest: float, signed: bool) -> None:
    """Linear about zero, logarithmic beyond: 5 mm and 130 mm are both read in one picture."""
    axes.set_yscale("symlog", linthresh=LINEAR_BELOW, linscale=0.45)
    decades = [10.0**k for k in range(int(np.ceil(np.log10(max(largest, 10.0)))) + 1)]
    ticks = [0.0, *decades]
    axes.set_yticks([-t for t in decades[::-1]] + ticks if signed else ticks)
    axes.minorticks_off()
    style.true_minus(axes)
    top = 1.35 * max(largest, 10.0)
    axes.set_ylim(-top if signed else -0.15, top)
    if signed:
        axes.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=0.5)


def _error_legend(
    figure: Figure, colours: dict[float, tuple[float, ...]], label: str, failed: bool
) -> None:
    def mark(colour: object, **options: object) -> Line2D:
        look = {"marker": "o", "markersize": 5, "linestyle": "none"} | options
        return Line2D([], [], color=colour, **look)  # type: ignore[arg-type]

    handles = [mark(style.GREY, fillstyle="none")]
    texts = ["uncompensated"]
    for k, (payload, colour) in enumerate(colours.items()):
        handles.append(mark(colour))
        texts.append(f"{label}: {payload:g} kg" if k == 0 else f"{payload:g} kg")
    if failed:
        handles.append(mark(style.INK, marker="x"))
        texts.append("failed")
    figure.legend(
        handles,
        texts,
        loc="outside upper center",
        ncols=len(handles),
        columnspacing=1.0,
        handletextpad=0.1,
    )


def _figure_method_comparison(statistics: pd.DataFrame) -> Figure:
    style.require("statistics", statistics.index, COMPARED)
    labels = [str(c) for c in statistics.columns if not str(c).endswith(PUBLISHED)]
    rows = {name: statistics.loc[name].astype(float).to_dict() for name in COMPARED}
    for name, row in rows.items():
        for column, value in row.items():
            unknown = str(column).endswith(PUBLISHED) and np.isnan(value)
            if not (unknown or 0 < value < np.inf):
                raise DataError(f"{name} of {column}: {value}, expected a positive number")

    figure = Figure(figsize=(style.WIDTH, 1.3 + 0.62 * len(labels)))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (name, axis_label) in zip(panels, COMPARED.items(), strict=True):
        ours = [rows[name][label] for label in labels]
        published = [rows[name].get(label + PUBLISHED, np.nan) for label in labels]
        known = [value for value in (*ours, *published) if np.isfinite(value)]
        axes.set_xscale("log")
        axes.set_xlim(min(known) / 2, 2 * max(known))  # room for the numbers
        for k, pair in enumerate(zip(ours, published, strict=True)):
            axes.plot(pair, (k, k), color=style.GREY, linewidth=1.2, zorder=1.5)
        _dots(axes, published, THEIRS, 1)
        _dots(axes, ours, OURS, -1)
        axes.set_xlabel(f"{axis_label}, logarithmic")
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.grid(visible=False, axis="y")
    panels[0].set_yticks(range(len(labels)), labels)
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    handles = [
        Line2D([], [], linestyle="none", color=colour, **_dot(colour)) for colour in (OURS, THEIRS)
    ]
    figure.legend(handles, ["ours", "published"], loc="outside upper center", ncols=2)
    return figure


def _dot(colour: str) -> dict[str, Any]:
    """Look of a dot: ours filled, the published ones open and larger, so that both are seen."""
    ours = colour == OURS
    return {
        "marker": "o",
        "markersize": 6.5 if ours else 9.5,
        "markerfacecolor": OURS if ours else "white",
    }


def _dots(axes: Axes, values: list[float], colour: str, side: int) -> None:
    """Dots at `values`, their numbers below (`side` 1) or above (-1) them; none for NaN."""
    for k, value in enumerate(values):
        if np.isnan(value):
            continue
        axes.plot([value], [k], linestyle="none", color=colour, **_dot(colour))
        axes.annotate(
            f"{value:.2f}",
            (value, k),
            (0, -13 * side),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=9,
            color=colour,
        )
