"""Figures of the elastic arm; frames in, PNG out."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.style import MM

Array = NDArray[np.float64]

VARIABLES = {"dx": "dx (mm)", "dy": "dy (mm)", "dphi": "dphi (mrad)"}
PAIRS = (
    ("theta_1", "theta_1 (deg)"),
    ("theta_2", "theta_2 (deg)"),
    ("p_x", "p_x (m)"),
    ("p_y", "p_y (m)"),
)


def deformation(
    path: Path | str, readings: pd.DataFrame, shown: pd.DataFrame, link: int, theta_1: float
) -> None:
    """Deformation of `link` (1 or 2) against theta_2 by payload, at `theta_1` in rad.

    After figures 8 to 13 of the paper: lines of the model (`readings`) and dots of the gauges
    (`shown`), a row for every reading. Raises DataError if no reading has that angle.
    """
    rows = np.isclose(readings["theta_1"], theta_1)
    if not rows.any():
        raise DataError(f"figure of link {link}: no reading at theta_1 = {theta_1:g} rad")
    style.write_png(path, _figure_deformation, readings[rows], shown[rows], link)


def target_and_network(path: Path | str, table: pd.DataFrame, r: Mapping[str, float]) -> None:
    """Angles and tip by the network against their targets (after figures 15 to 18 of the paper).

    table : columns theta_1, theta_2, p_x, p_y and the same with network_ before, and `part`.
    r : correlation by the name of a panel, over the held-out readings.
    """
    style.write_png(path, _figure_target_and_network, table, r)


def network_comparison(
    path: Path | str, r: Mapping[str, Array], published: Mapping[str, Array]
) -> None:
    """One minus R of both angles on held-out readings by network (after figures 19 to 22).

    r, published : (2,) by label of the network.
    """
    for name, values in r.items():
        if not (values < 1.0).all():
            raise DataError(f"network comparison: R of {name} is {values}, expected less than 1")
    style.write_png(path, _figure_network_comparison, r, published)


def error_over_targets(path: Path | str, frames: Mapping[str, pd.DataFrame]) -> None:
    """Error at every target, a panel for every method.

    frames : columns target_x, target_y and error in m, by label.
    """
    style.write_png(path, _figure_error_over_targets, frames)


def _figure_deformation(readings: pd.DataFrame, shown: pd.DataFrame, link: int) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 3.1))
    colours = style.payload_colours(readings["payload"])
    for axes, (name, label) in zip(
        np.atleast_1d(figure.subplots(1, 3)), VARIABLES.items(), strict=True
    ):
        column = f"{name}_{link}"
        for payload, rows in readings.groupby("payload"):
            colour = colours[float(str(payload))]
            theta_2 = np.degrees(rows["theta_2"])
            axes.plot(theta_2, MM * rows[column], color=colour, label=f"{payload:g} kg")
            axes.plot(
                theta_2, MM * shown.loc[rows.index, column], ".", color=colour, markersize=3.5
            )
        axes.set_title(label)
        axes.set_xlabel("theta_2 (deg)")
    figure.axes[0].plot([], [], ".", color=style.GREY, label="gauges")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    return figure


def _figure_target_and_network(table: pd.DataFrame, r: Mapping[str, float]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 7.2))
    held_out = (table["part"] == "held_out").to_numpy()
    for axes, (name, label) in zip(figure.subplots(2, 2).ravel(), PAIRS, strict=True):
        scale = np.degrees if name.startswith("theta") else np.asarray
        target, found = scale(table[name].to_numpy()), scale(table[f"network_{name}"].to_numpy())
        for rows, colour, text, size in (
            (~held_out, style.SKY, "training and selection", 9),
            (held_out, style.VERMILION, "held out", 13),
        ):
            axes.scatter(target[rows], found[rows], size, color=colour, label=text, linewidths=0)
        ends = np.array([target.min(), target.max()])
        axes.plot(ends, ends, color=style.INK, linewidth=0.8, zorder=0)
        axes.set_title(f"{label}: R = {r[name]:.6f}")
        axes.set_xlabel("target")
        axes.set_ylabel("network")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _figure_network_comparison(r: Mapping[str, Array], published: Mapping[str, Array]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 0.9 + 0.42 * len(r)))
    axes = figure.subplots()
    places = np.arange(len(r))[::-1]
    marks = ((style.BLUE, "o", "theta_1"), (style.VERMILION, "s", "theta_2"))
    for k, (colour, mark, name) in enumerate(marks):
        values = [1.0 - found[k] for found in r.values()]
        axes.plot(values, places, mark, color=colour, label=name)
        for label, place in zip(r, places, strict=True):
            if label in published and np.isfinite(published[label][k]):
                axes.plot(
                    [1.0 - published[label][k]],
                    [place],
                    mark,
                    markersize=10,
                    markerfacecolor="none",
                    color=colour,
                    label=f"{name}, published",
                )
    axes.set_xscale("log")
    axes.set_yticks(places, list(r))
    axes.set_ylim(-0.6, len(r) - 0.4)
    axes.set_xlabel("1 \N{MINUS SIGN} R on held-out readings (less is better)")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _figure_error_over_targets(frames: Mapping[str, pd.DataFrame]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 3.6))
    errors = np.concatenate([MM * frame["error"].to_numpy() for frame in frames.values()])
    least = max(float(errors.max()) * 1e-5, float(errors.min()))
    norm = LogNorm(least, float(errors.max()))
    panels: list[Axes] = list(np.atleast_1d(figure.subplots(1, len(frames), sharey=True)))
    for axes, (label, frame) in zip(panels, frames.items(), strict=True):
        drawn = axes.scatter(
            frame["target_x"],
            frame["target_y"],
            7,
            np.maximum(MM * frame["error"], least),
            norm=norm,
            cmap="viridis",
            linewidths=0,
        )
        style.plane(axes)
        axes.set_title(label, fontsize=9.5)
    for axes in panels[1:]:
        axes.set_ylabel("")
    figure.colorbar(drawn, ax=panels, label="error (mm)", shrink=0.8)
    return figure
