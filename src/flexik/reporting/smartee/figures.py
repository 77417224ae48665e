"""Figures of the SmartEE's report."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from flexik.reporting import style

Array = NDArray[np.float64]

COLOURS = (
    *(style.BLUE, style.VERMILION, style.GREEN, style.ORANGE),
    *(style.PURPLE, style.SKY, style.INK, style.GREY),
)
DASHES = ("-", "--", ":", "-.")
LABELS = {
    "elbow": "norm of the elbow errors",
    "position": "position error",
    "orientation": "norm of the orientation errors",
}
# Errors below are rounding and drawn here, rad
LEAST = 1e-15


def pose_errors(
    path: Path | str, quantity: str, unit: str, errors: Mapping[str, Array], published: float
) -> None:
    """Errors over the validation poses, a line a network, and the published peak.

    Parameters
    ----------
    path
        PNG to write.
    quantity, unit
        Of LABELS, and of the errors.
    errors
        (n,) by label of the network, in the order of the poses.
    published
        Peak, in `unit`.

    Raises
    ------
    DataError
        If an error is not finite.
    """
    style.finite("errors over the poses", errors)
    style.write_png(path, _figure_pose_errors, quantity, unit, errors, published)


def starts(path: Path | str, runs: pd.DataFrame, success: float) -> None:
    """Share of the starts that end below each error, a panel a spread, a line a trainer.

    Parameters
    ----------
    path
        PNG to write.
    runs
        Rows of learning.starts.FIELDS.
    success
        Error that counts as success.
    """
    style.require("study of starts", runs.columns, ("trainer", "spread", "error"))
    style.write_png(path, _figure_starts, runs, success)


def newton_steps(path: Path | str, curves: Mapping[str, Mapping[int, float]]) -> None:
    """Peak elbow error (rad) against Newton steps, a line for every place to start from."""
    style.write_png(path, _figure_newton_steps, curves)


def outside(path: Path | str, curves: Mapping[str, pd.DataFrame], n_bins: int) -> None:
    """Elbow error against the extent of the pose: median and peak in each of `n_bins`.

    Parameters
    ----------
    path
        PNG to write.
    curves
        Columns extent and elbow_error (rad) by label.
    n_bins
        Of equal width, from 0 to the largest extent.
    """
    for label, table in curves.items():
        style.require(f"errors of {label}", table.columns, ("extent", "elbow_error"))
    style.write_png(path, _figure_outside, curves, n_bins)


def sizes(path: Path | str, tables: Mapping[str, pd.DataFrame], published: int) -> None:
    """Training and selection error against the number of hidden neurons.

    Parameters
    ----------
    path
        PNG to write.
    tables
        Frames of learning.size_selection.by_size, by the poses learnt from.
    published
        Number of neurons to mark.
    """
    columns = ("n_hidden", "training_error", "selection_error", "worst_selection_error")
    for table in tables.values():
        style.require("study of sizes", table.columns, columns)
    style.write_png(path, _figure_sizes, tables, published)


def _figure_pose_errors(
    quantity: str, unit: str, errors: Mapping[str, Array], published: float
) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 3.6))
    axes = figure.add_subplot()
    for colour, (label, values) in zip(COLOURS, errors.items(), strict=False):
        axes.plot(np.arange(1, len(values) + 1), values, color=colour, linewidth=1.0, label=label)
    axes.axhline(published, color=style.INK, linestyle="--", linewidth=1.2, label="published peak")
    axes.set_xlim(1, max(len(values) for values in errors.values()))
    axes.set_ylim(0.0, None)
    axes.set_xlabel("validation pose")
    axes.set_ylabel(f"{LABELS[quantity]} ({unit})")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_above(axes, len(errors) + 1)
    return figure


def _figure_starts(runs: pd.DataFrame, success: float) -> Figure:
    spreads = list(dict.fromkeys(runs["spread"]))
    figure = Figure(figsize=(style.WIDTH, 4.4))
    panels = np.atleast_1d(figure.subplots(1, len(spreads), sharey=True, sharex=True))
    for axes, spread in zip(panels, spreads, strict=True):
        part = runs[runs["spread"] == spread]
        for k, (trainer, group) in enumerate(part.groupby("trainer", sort=False)):
            values = np.sort(group["error"].dropna().to_numpy())
            share = 100.0 * np.arange(1, len(values) + 1) / len(group)
            axes.step(
                np.repeat(values, 2)[: 2 * len(values)],
                np.column_stack([np.r_[0.0, share[:-1]], share]).ravel(),
                where="post",
                color=COLOURS[k % len(COLOURS)],
                linestyle=DASHES[k // len(COLOURS)],
                linewidth=1.6,
                label=str(trainer),
            )
        axes.axvline(success, color=style.INK, linestyle="--", linewidth=1.0, label="success")
        axes.set_xscale("log")
        axes.set_ylim(0.0, 102.0)
        axes.set_title(f"starts {spread}")
        axes.set_xlabel("mean squared error, normalised")
    panels[0].set_ylabel("starts with at most this error (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _figure_newton_steps(curves: Mapping[str, Mapping[int, float]]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 4.2))
    axes = figure.add_subplot()
    for colour, (label, errors) in zip(COLOURS, errors_drawn(curves).items(), strict=False):
        axes.plot(
            list(errors), list(errors.values()), "o-", color=colour, markersize=5, label=label
        )
    axes.set_yscale("log")
    axes.set_xlabel("Newton steps")
    axes.set_ylabel("peak elbow error (rad)")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def errors_drawn(curves: Mapping[str, Mapping[int, float]]) -> dict[str, dict[int, float]]:
    """`curves` without what is not finite, rounding drawn as LEAST."""
    return {
        label: {k: max(value, LEAST) for k, value in errors.items() if np.isfinite(value)}
        for label, errors in curves.items()
    }


def _figure_outside(curves: Mapping[str, pd.DataFrame], n_bins: int) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 4.4))
    axes = figure.add_subplot()
    largest = max(table["extent"].max() for table in curves.values())
    edges = np.linspace(0.0, largest, n_bins + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for colour, (label, table) in zip(COLOURS, curves.items(), strict=False):
        bins = np.clip(np.digitize(table["extent"], edges) - 1, 0, n_bins - 1)
        grouped = table["elbow_error"].groupby(bins)
        for statistic, dash in (("median", "-"), ("max", ":")):
            values = grouped.agg(statistic).reindex(range(n_bins)).to_numpy(dtype=float)
            name = {"median": "median", "max": "peak"}[statistic]
            axes.plot(
                middles,
                np.maximum(values, LEAST),
                color=colour,
                linestyle=dash,
                linewidth=1.7,
                label=f"{label}, {name}",
            )
    axes.axvline(1.0, color=style.GREY, linestyle="--", linewidth=1.0)
    axes.set_yscale("log")
    axes.set_xlim(0.0, largest)
    axes.set_xlabel("extent of the pose (1: the edge of the box)")
    axes.set_ylabel("elbow error (rad)")
    figure.legend(loc="outside lower center", ncols=len(curves))
    return figure


def _figure_sizes(tables: Mapping[str, pd.DataFrame], published: int) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 4.0))
    axes = figure.add_subplot()
    x: list[int] = []
    for colour, (poses, table) in zip(COLOURS, tables.items(), strict=False):
        x = table["n_hidden"].tolist()
        for column, label, dash in (
            ("training_error", "training error", "--"),
            ("selection_error", "selection, best start", "-"),
            ("worst_selection_error", "selection, worst start", ":"),
        ):
            name = f"{poses}: {label}"
            axes.plot(x, table[column], marker="o", color=colour, linestyle=dash, label=name)
    axes.axvline(published, color=style.INK, linestyle="--", linewidth=1.0, label="published M")
    axes.set_yscale("log")
    axes.set_xlabel("hidden neurons M")
    axes.set_ylabel("root mean square error, normalised")
    axes.set_xticks(x)
    axes.legend()
    return figure


def _legend_above(axes: Axes, n_columns: int) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=n_columns)
