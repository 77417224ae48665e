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
MICRO = 1e6
# Least 1 - R that is drawn: nothing less differs from zero by rounding
ROUND_OFF = float(np.finfo(np.float64).eps)
MARKED = {0.5: "o", 0.99: "D"}  # quantiles with a mark on the distribution
PAIRS = (
    ("theta_1", "theta_1 (deg)"),
    ("theta_2", "theta_2 (deg)"),
    ("p_x", "p_x (m)"),
    ("p_y", "p_y (m)"),
)


def deformation(
    path: Path | str,
    readings: pd.DataFrame,
    exact: pd.DataFrame,
    noisy: pd.DataFrame,
    link: int,
    theta_1: float,
) -> None:
    """Deformation of `link` (1 or 2) against theta_2 by payload, at `theta_1` in rad.

    After figures 8 to 13 of the paper: lines of the model (`readings`) and dots of the gauges with
    noise (`noisy`), a row for every reading; dx by the gauges, which is far less than the model's,
    in a panel of its own, there lines of the gauges without noise (`exact`). Raises DataError if no
    reading has that angle.
    """
    rows = np.isclose(readings["theta_1"], theta_1)
    if not rows.any():
        raise DataError(f"figure of link {link}: no reading at theta_1 = {theta_1:g} rad")
    style.write_png(path, _figure_deformation, readings[rows], exact[rows], noisy[rows], link)


def target_and_network(
    path: Path | str, table: pd.DataFrame, r: Mapping[str, float], published: Mapping[str, float]
) -> None:
    """Angles and tip by the network against their targets (after figures 15 to 18 of the paper).

    table : columns theta_1, theta_2, p_x, p_y and the same with network_ before, and `part`.
    r : correlation by the name of a panel, over the held-out readings.
    published : the same of the paper, where there is one.
    """
    style.write_png(path, _figure_target_and_network, table, r, published)


def network_comparison(
    path: Path | str, r: Mapping[str, Array], published: Mapping[str, Array]
) -> None:
    """One minus R of both angles on held-out readings by network (after figures 19 to 22).

    r, published : (2,) by label of the network; an R that rounds to 1 is drawn at ROUND_OFF.
    """
    style.write_png(path, _figure_network_comparison, r, published)


def error_distribution(path: Path | str, frames: Mapping[str, pd.DataFrame]) -> None:
    """Share of the targets with an error below each value, a line for every method.

    frames : column error in m, by label.
    """
    style.write_png(path, _figure_error_distribution, frames)


def error_over_targets(path: Path | str, frames: Mapping[str, pd.DataFrame]) -> None:
    """Error at every target, a panel for every method.

    frames : columns target_x, target_y and error in m, by label.
    """
    style.write_png(path, _figure_error_over_targets, frames)


def _figure_deformation(
    readings: pd.DataFrame, exact: pd.DataFrame, noisy: pd.DataFrame, link: int
) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 5.6))
    colours = style.payload_colours(readings["payload"])
    # title, lines, dots, scale
    dx, dy, dphi = (f"{name}_{link}" for name in VARIABLES)
    panels = (
        (f"dx of the model {_unit('dx')}", readings[dx], None, MM),
        ("dx by the gauges (micrometres)", exact[dx], noisy[dx], MICRO),
        (f"dy {_unit('dy')}", readings[dy], noisy[dy], MM),
        (f"dphi {_unit('dphi')}", readings[dphi], noisy[dphi], MM),
    )
    for axes, (title, lines, dots, scale) in zip(
        figure.subplots(2, 2, sharex=True).ravel(), panels, strict=True
    ):
        for payload, rows in readings.groupby("payload"):
            colour, theta_2 = colours[float(str(payload))], np.degrees(rows["theta_2"])
            axes.plot(theta_2, scale * lines[rows.index], color=colour, label=f"{payload:g} kg")
            if dots is not None:
                axes.plot(theta_2, scale * dots[rows.index], ".", color=colour, markersize=3.5)
        axes.set_title(title)
        axes.xaxis.set_tick_params(labelbottom=True)
        axes.set_xlabel("theta_2 (deg)")
    figure.axes[0].plot([], [], ".", color=style.GREY, label="gauges with noise")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    return figure


def _unit(name: str) -> str:
    return VARIABLES[name].removeprefix(f"{name} ")


def _figure_target_and_network(
    table: pd.DataFrame, r: Mapping[str, float], published: Mapping[str, float]
) -> Figure:
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
        title = f"held-out R = {r[name]:.6f}"
        if np.isfinite(published.get(name, np.nan)):
            title += f" (published {published[name]:.6f})"
        axes.set_title(title, fontsize=9.5)
        unit = label.removeprefix(name)
        axes.set_xlabel(f"{name}, target{unit}")
        axes.set_ylabel(f"{name}, network{unit}")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _figure_network_comparison(r: Mapping[str, Array], published: Mapping[str, Array]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 0.9 + 0.42 * len(r)))
    axes = figure.subplots()
    places = np.arange(len(r))[::-1]
    marks = ((style.BLUE, "o", "theta_1"), (style.VERMILION, "s", "theta_2"))
    for k, (colour, mark, name) in enumerate(marks):
        values = [max(1.0 - found[k], ROUND_OFF) for found in r.values()]
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


def _figure_error_distribution(frames: Mapping[str, pd.DataFrame]) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 5.8))
    axes = figure.add_subplot(xlabel="error (mm), logarithmic", xscale="log")
    colours = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.INK)
    dashes: tuple[str, ...] = ("-", "--", ":")
    for k, (label, frame) in enumerate(frames.items()):
        colour, dash = colours[k % len(colours)], dashes[k // len(colours) % len(dashes)]
        errors = MM * frame["error"]
        share = 100 * np.linspace(0.0, 1.0, len(errors))
        # between two targets as the quantiles of the tables, linearly
        numbers = []
        for q, mark in MARKED.items():
            value = float(errors.quantile(q))
            axes.plot([value], [100 * q], mark, color=colour, markersize=5.5)
            numbers.append(np.format_float_positional(value, 3, fractional=False, trim="-"))
        axes.plot(
            np.sort(errors),
            share,
            color=colour,
            linestyle=dash,
            label=f"{label}: {', '.join(numbers)}",
        )
    axes.set(ylim=(0, 101.5), yticks=(0, 25, 50, 75, 99))
    axes.set_ylabel("targets with at most this error (%)")
    title = "method: error in mm at 50 % (circle) and 99 % (diamond) of the targets"
    figure.legend(loc="outside upper center", ncols=2, title=title)
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
