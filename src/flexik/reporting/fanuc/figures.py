"""Figures of the six-joint arm; mm and degrees."""

import itertools
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from flexik.datasets.fanuc.tables import COMMANDED, JOINTS, joints_of_rows
from flexik.kinematics.serial_arm import frames
from flexik.reporting import style
from flexik.reporting.fanuc import notes, tables
from flexik.reporting.fanuc.results import EXACT, LOOKED_UP, WHOLE, Results
from flexik.reporting.style import MM

DEGREES = 180.0 / np.pi
# Of the networks of the path, in their order; more of them in broken lines
COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)
LINES = ("-", "--", ":", "-.")
FIXED = {
    WHOLE: (style.ORANGE, "-"),
    EXACT: (style.INK, "-"),
    LOOKED_UP[0]: (style.GREY, ":"),
    LOOKED_UP[1]: (style.GREY, "-"),
}
DURATION = "share of the path's duration (1)"
# Errors below are round-off, mm and degrees
FLOOR = 1e-7


def write_figures(results: Results, folder: Path) -> None:
    """Write all figures."""
    write = style.write_png
    write(folder / "arm.png", _arm, results)
    for kind in trainer_kinds(results):
        write(folder / f"training_error_{kind}.png", _training_error, results, kind)
    write(folder / "path_tracking.png", _path_tracking, results)
    write(folder / "path_tracking_errors.png", _tracking_errors, results)
    write(folder / "study_n_hidden.png", _study, results, "n_hidden")
    write(folder / "study_learning_factor.png", _study, results, "learning_factor")
    write(folder / "path_errors.png", _path_errors, results)
    write(folder / "off_path.png", _off_path, results)
    write(folder / "whole_workspace.png", _whole_workspace, results)


def trainer_kinds(results: Results) -> list[str]:
    """Kinds of the trainers of the path's networks, each once."""
    fanuc = results.fanuc
    return list(dict.fromkeys(fanuc.trainers[n.trainer].kind for n in fanuc.networks.values()))


def _trained_by(results: Results, kind: str) -> list[str]:
    """Networks that a trainer of `kind` trained."""
    fanuc = results.fanuc
    return [n for n, each in fanuc.networks.items() if fanuc.trainers[each.trainer].kind == kind]


def _line(results: Results, name: str) -> dict[str, Any]:
    """Colour and line of a method, the same in all figures."""
    if name in FIXED:
        colour, line = FIXED[name]
    else:
        number = results.networks.index(name)
        colour = COLOURS[number % len(COLOURS)]
        line = LINES[number // len(COLOURS) % len(LINES)]
    return {"color": colour, "linestyle": line}


def _arm(results: Results) -> Figure:
    """The arm halfway along the path, from the side and from above."""
    path = pd.concat([results.training, results.test]).sort_values("share")
    middle = joints_of_rows(path)[len(path) // 2 : len(path) // 2 + 1]
    links = frames(results.arm, middle).origin[0]
    # elbow: where the forearm begins, so that the links are drawn as they are
    turn = frames(results.arm, middle).rotation[0]
    elbow = links[3] - results.arm.a[2] * turn[3][:, 0]
    base = np.array([0.0, 0.0, results.arm.d[0]])
    points = np.vstack([links[0], base, links[1:3], elbow, links[3:]])
    figure = Figure(figsize=(style.WIDTH, 4.2))
    for axes, (a, b), names in zip(
        figure.subplots(1, 2), ((0, 2), (0, 1)), (("x", "z"), ("x", "y")), strict=True
    ):
        columns = [path[name].to_numpy() for name in names]
        axes.plot(*columns, color=style.ORANGE, linewidth=1.2, label="taught path")
        axes.plot(points[:, a], points[:, b], color=style.BLUE, linewidth=2.5, label="arm")
        axes.plot(links[:, a], links[:, b], "o", color=style.INK, markersize=3.5, label="frames")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel(f"{names[0]} (m)")
        axes.set_ylabel(f"{names[1]} (m)")
        axes.set_title("from the side" if names[1] == "z" else "from above")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _panels(figure: Figure, y_label: str, x_label: str) -> list[Axes]:
    """One for each joint."""
    panels = figure.subplots(3, 2, sharex=True)
    for axes in panels[:, 0]:
        axes.set_ylabel(y_label)
    for axes in panels[-1]:
        axes.set_xlabel(x_label)
    for number, axes in enumerate(panels.ravel(), start=1):
        axes.set_title(f"joint {number}")
    return list(panels.ravel())


def _training_error(results: Results, kind: str) -> Figure:
    """All starts of the networks that trainers of `kind` trained; the median start in full."""
    figure = Figure(figsize=(style.WIDTH, 8.0))
    panels = _panels(figure, "rms error (% of range)", "passes over the training samples (1)")
    starts = results.starts
    for number, axes in enumerate(panels, start=1):
        for name in _trained_by(results, kind):
            of_name = starts[(starts["network"] == name) & (starts["joint"] == number)]
            for start, is_median in zip(of_name["restart"], of_name["is_median"], strict=True):
                curves = results.curves
                curve = curves[
                    (curves["network"] == name)
                    & (curves["joint"] == number)
                    & (curves["restart"] == start)
                ]
                axes.plot(
                    curve["iteration"],
                    100 * curve["training_error"],
                    **_line(results, name),
                    linewidth=0.9 if is_median else 0.5,
                    alpha=0.9 if is_median else 0.35,
                    label=name if is_median else None,
                )
        axes.set_yscale("log")
        style.true_minus(axes)
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=2)
    return figure


def _path_tracking(results: Results) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 8.0))
    panels = _panels(figure, "angle (deg)", DURATION)
    names = _trained_by(results, "back_propagation") or results.networks
    for k, axes in enumerate(panels):
        taught = results.test
        axes.plot(
            taught["share"], DEGREES * taught[JOINTS[k]], color=style.INK, lw=1.4, label="taught"
        )
        for name, marker in zip(names, itertools.cycle("+x.*v^"), strict=False):
            frame = results.path_errors[results.path_errors["method"] == name]
            axes.plot(
                frame["share"],
                DEGREES * frame[COMMANDED[k]],
                marker,
                color=_line(results, name)["color"],
                markersize=3,
                markeredgewidth=0.7,
                label=name,
            )
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _tracking_errors(results: Results) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 8.0))
    panels = _panels(figure, "error (deg)", DURATION)
    for k, axes in enumerate(panels):
        for name in results.of_path:
            frame = results.path_errors[results.path_errors["method"] == name]
            error = DEGREES * np.abs(frame[COMMANDED[k]] - frame[JOINTS[k]])
            line = _line(results, name)
            axes.plot(frame["share"], np.maximum(error, FLOOR), **line, linewidth=0.9, label=name)
        axes.set_yscale("log")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _study(results: Results, varied: str) -> Figure:
    table = tables.study(results, varied)
    figure = Figure(figsize=(style.WIDTH, 4.0))
    axes = figure.add_subplot()
    x = table.iloc[:, 0].astype(float)
    axes.fill_between(
        x,
        table["least (%)"],
        table["largest (%)"],
        color=style.SKY,
        alpha=0.3,
        linewidth=0,
        label="total error, all starts",
    )
    axes.plot(
        x,
        table["median total error (%)"],
        "o-",
        color=style.BLUE,
        markersize=4,
        label="total error on the test samples, median",
    )
    axes.plot(
        x,
        table["median training error (%)"],
        "s--",
        color=style.ORANGE,
        markersize=4,
        label="the same on the training samples, median",
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(x, [f"{value:g}" for value in x])
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.minorticks_off()
    style.true_minus(axes)
    axes.set_xlabel(f"{notes.NAMES[varied]} (1)")
    axes.set_ylabel("mean absolute error (% of range)")
    axes.set_title(f"joint {results.fanuc.study.joint}")
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def _path_errors(results: Results) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 6.0))
    panels = figure.subplots(2, 1, sharex=True)
    names = [*results.of_path, WHOLE]
    kinds = (
        ("position_error", MM, "position error (mm)"),
        ("orientation_error", DEGREES, "orientation error (deg)"),
    )
    for axes, (column, unit, text) in zip(panels, kinds, strict=True):
        for name in names:
            frame = results.path_errors[results.path_errors["method"] == name]
            error = np.maximum(unit * frame[column], FLOOR)
            axes.plot(frame["share"], error, **_line(results, name), linewidth=1.0, label=name)
        axes.set_yscale("log")
        axes.set_ylabel(text)
    panels[-1].set_xlabel(DURATION)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _off_path(results: Results) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 7.0))
    panels = figure.subplots(2, 2, sharex=True).ravel()
    names = [*results.of_path, WHOLE]
    distances = results.fanuc.off_path.distances
    places = np.arange(len(distances))
    last = results.fanuc.refinement.n_steps
    success = tables.off_path_success(results).set_index("method")
    contents = (
        (tables.off_path(results, "position_error", MM), 0, "mean position error (mm)"),
        (tables.off_path(results, "orientation_error", DEGREES), 0, "mean orientation error (deg)"),
        (success.reset_index(), 1, "reached after 1 Newton step (%)"),
        (success.reset_index(), last, f"reached after {last} Newton steps (%)"),
    )
    for axes, (table, n_steps, text) in zip(panels, contents, strict=True):
        rows = table.set_index("method")
        for name in names:
            values = rows.loc[tables.label(name, n_steps)].to_numpy(dtype=float)
            line = _line(results, name)
            axes.plot(places, values, marker="o", **line, markersize=3.5, label=name)
        axes.set_title(text)
        if "error" in text:
            axes.set_yscale("log")
            style.true_minus(axes)
        else:
            axes.set_ylim(-4, 104)
        axes.set_xticks(places, [f"{MM * distance:g}" for distance in distances])
    for axes in panels[2:]:
        axes.set_xlabel("distance from the path (mm)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _whole_workspace(results: Results) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 4.4))
    panels = figure.subplots(1, 2, sharey=True)
    frame, success = results.workspace, results.fanuc.success
    kinds = (
        ("position_error", MM, "position error (mm)", success.position),
        ("orientation_error", DEGREES, "orientation error (deg)", success.orientation),
    )
    n_curves = results.fanuc.refinement.n_steps + 1
    # the colour the method has elsewhere, the more steps the darker
    shades = mpl.colormaps["Oranges"](np.linspace(0.35, 1.0, n_curves))
    curves: list[tuple[str, int, Any]] = [(WHOLE, k, shades[k]) for k in range(n_curves)]
    curves.append((EXACT, 0, FIXED[EXACT][0]))
    for axes, (column, unit, text, limit) in zip(panels, kinds, strict=True):
        for name, n_steps, colour in curves:
            chosen = frame[(frame["method"] == name) & (frame["n_steps"] == n_steps)]
            values = np.sort(np.maximum(unit * chosen[column].to_numpy(), FLOOR))
            share = 100.0 * np.arange(1, len(values) + 1) / len(values)
            axes.plot(values, share, color=colour, label=tables.label(name, n_steps))
        axes.axvline(unit * limit, color=style.GREY, linestyle="--", label="counts as reached")
        axes.set_xscale("log")
        axes.set_xlabel(text)
    panels[0].set_ylabel("poses with at most this error (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure
