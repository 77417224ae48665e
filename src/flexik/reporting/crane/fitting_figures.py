"""Too small and too large networks: what they make of a slice, and the errors of all sizes."""

import textwrap
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from flexik.errors import DataError
from flexik.reporting import style

CURVE_COLUMNS = ("x", "truth", "network")
SAMPLE_COLUMNS = ("x", "value")
SIZE_COLUMNS = ("n_hidden", "training_error", "selection_error")
COLUMNS = 3  # of panels of the size selections


def under_and_overfitting(
    path: Path | str,
    curves: pd.DataFrame,
    samples: pd.DataFrame,
    x_label: str = "stroke (m)",
    y_label: str = "deflection (mm)",
) -> None:
    """Networks of several sizes along a slice (Rouvinen 1999, figures 2.9 and 2.10).

    Parameters
    ----------
    path
        PNG to write.
    curves
        Column `panel` (title to show) and CURVE_COLUMNS, in the order of x: m, mm and mm. Where a
        network leaves truth and samples by more than half their range, it leaves the panel.
    samples
        Column `panel`, of the same panels, and SAMPLE_COLUMNS: samples of the slice that no network
        was trained on, m and mm.
    x_label, y_label
        Labels of the axes with their units.

    Raises
    ------
    DataError
        If there are no curves, a column is missing, a value is not finite, or a sample is of a
        panel without curve.
    """
    style.write_png(path, _figure_under_and_overfitting, curves, samples, x_label, y_label)


def size_selections(
    path: Path | str,
    studies: Mapping[str, pd.DataFrame],
    chosen: Mapping[str, int],
    published: Mapping[str, int | None],
) -> None:
    """Training and selection error against the number of hidden neurons, a panel a network.

    Parameters
    ----------
    path
        PNG to write.
    studies
        By name of the network: frames of learning.size_selection.by_size. A size whose restarts
        all failed holds NaN and leaves a gap.
    chosen, published
        Numbers of hidden neurons to mark by name; nothing published: None or no entry.

    Raises
    ------
    DataError
        If there is no study, a column or a choice is missing, or a panel would have no error or
        an infinite one.
    """
    style.write_png(path, _figure_size_selections, studies, chosen, published)


def _figure_under_and_overfitting(
    curves: pd.DataFrame, samples: pd.DataFrame, x_label: str, y_label: str
) -> Figure:
    style.require("fitting curves", curves.columns, ("panel", *CURVE_COLUMNS))
    style.require("fitting samples", samples.columns, ("panel", *SAMPLE_COLUMNS))
    style.finite("fitting curves", {name: curves[name] for name in CURVE_COLUMNS})
    style.finite("fitting samples", {name: samples[name] for name in SAMPLE_COLUMNS})
    titles = list(curves["panel"].unique())
    if not titles:
        raise DataError("fitting curves: expected rows, found none")
    style.require("panels of the fitting curves", titles, samples["panel"].unique())

    figure = Figure(figsize=(style.WIDTH, 3.9))
    panels = figure.subplots(1, len(titles), sharex=True, sharey=True, squeeze=False)[0]
    for axes, title in zip(panels, titles, strict=True):
        curve, dots = (frame[frame["panel"] == title] for frame in (curves, samples))
        axes.plot(
            curve["x"], curve["truth"], color=style.INK, linewidth=1.0, label="flexible model"
        )
        axes.plot(
            curve["x"], curve["network"], color=style.VERMILION, linewidth=1.8, label="network"
        )
        axes.plot(
            *(dots["x"], dots["value"], "o"),
            color=style.BLUE,
            markersize=4.5,
            label="grid samples, left out of the training",
        )
        axes.set_title(textwrap.fill(title, 84 // len(titles)), fontsize=10)
        axes.set_xlabel(x_label)
    panels[0].set_ylim(*_limits(curves, samples))
    panels[0].set_ylabel(y_label)
    style.true_minus(panels[0])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _limits(curves: pd.DataFrame, samples: pd.DataFrame) -> tuple[float, float]:
    """Limits of y: all truth and samples, and the network no further than half their range."""
    shown = np.concatenate([curves["truth"], samples["value"]])
    low, high = shown.min(), shown.max()
    allowed = 0.5 * (high - low)
    network = np.clip(curves["network"], low - allowed, high + allowed)
    low, high = min(low, network.min()), max(high, network.max())
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _figure_size_selections(
    studies: Mapping[str, pd.DataFrame],
    chosen: Mapping[str, int],
    published: Mapping[str, int | None],
) -> Figure:
    if not studies:
        raise DataError("size selections: expected a study for every network, found none")
    style.require("chosen sizes", chosen, studies)
    columns = min(len(studies), COLUMNS)
    rows = -(-len(studies) // columns)
    figure = Figure(figsize=(style.WIDTH, 1.2 + 2.6 * rows))
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for axes, (name, sizes) in zip(panels, studies.items(), strict=False):
        _draw_sizes(axes, name, sizes)
        marks = [f"chosen {chosen[name]}"]
        axes.axvline(chosen[name], color=style.VERMILION, linewidth=1.5, zorder=1.5)
        if (size := published.get(name)) is not None:
            axes.axvline(size, color=style.GREY, linestyle="--", zorder=1.5)
            marks.append(f"published {size}")
        axes.set_title(f"{textwrap.fill(name, 90 // columns)}\n{', '.join(marks)}", fontsize=9.5)
    for axes in panels[: len(studies)]:
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))
    for axes in panels[len(studies) :]:
        axes.set_axis_off()
    figure.supxlabel("hidden neurons (1)", fontsize=10)
    figure.supylabel("root mean square error, normalised (1)", fontsize=10)
    figure.legend(
        handles=[
            *panels[0].lines[:2],
            Line2D([], [], color=style.VERMILION, label="chosen size"),
            Line2D([], [], color=style.GREY, linestyle="--", label="published size"),
        ],
        loc="outside upper center",
        ncols=4,
        columnspacing=1.2,
    )
    return figure


def _draw_sizes(axes: Axes, name: str, sizes: pd.DataFrame) -> None:
    style.require(f"size selection of {name}", sizes.columns, SIZE_COLUMNS)
    style.finite(f"size selection of {name}", {"n_hidden": sizes["n_hidden"]})
    looks = {"selection_error": style.BLUE, "training_error": style.ORANGE}
    for column, colour in looks.items():
        errors = sizes[column].to_numpy(dtype=float)
        if np.isinf(errors).any() or not np.isfinite(errors).any():
            raise DataError(f"size selection of {name}: {column} is not finite")
        label = column.replace("_", " ")
        axes.plot(sizes["n_hidden"], errors, color=colour, label=label, marker="o", markersize=3.5)
