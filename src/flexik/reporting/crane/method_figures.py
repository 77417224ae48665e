"""Methods side by side: where they err, how often, and what their accuracy costs."""

import textwrap
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.ticker import MaxNLocator, NullLocator
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike, NDArray

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.style import MM

Array = NDArray[np.float64]

ERROR_COLUMNS = ("target_x", "target_y", "error")
TOLERANCE_COLUMNS = ("tolerance", "mean_error", "mean_iterations", "max_iterations")
PUBLISHED_COLUMNS = ("tolerance", "mean_iterations", "max_iterations")
RACE_COLUMNS = ("seconds", "error")
COST_COLUMNS = ("operations", "microseconds_single", "microseconds_batched", "mean_error")

CELL = 0.25  # m, side of a square of the error map
COLUMNS = 4  # of panels of the error map
SPAN = 1e5  # greatest over least error told apart; what is smaller is drawn as the least
MARKED = {0.5: "o", 0.99: "D"}  # shares of the conditions with a mark on the distribution

# Ticks of logarithmic scales: decades where there are enough of them, else the others too
STEPS = [float(f"{m}e{k}") for k in range(-18, 19) for m in (1, 2, 5)]

COLOURS = (
    *(style.BLUE, style.VERMILION, style.GREEN, style.ORANGE),
    *(style.PURPLE, style.SKY, style.INK, style.GREY),
)
DASHES = ("-", "--", ":", "-.")

# Places of a label about its point: which side in x and y, and how far in points
SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
BESIDE: dict[str, Any] = {"xytext": (0, 0), "textcoords": "offset points", "fontsize": 9}
LEADER = {"arrowstyle": "-", "color": style.GREY, "linewidth": 0.7}
PLACES = tuple((dx, dy, far) for far in (8, 20, 36) for dx, dy in SIDES)


def error_map(path: Path | str, frames: Mapping[str, pd.DataFrame]) -> None:
    """Mean error in every square of CELL of the working area, a panel for every method.

    Parameters
    ----------
    path
        PNG to write.
    frames
        Errors by label of the method, ERROR_COLUMNS in m, a row for every target and payload.

    Raises
    ------
    DataError
        If there is no frame or no row, a column is missing, or a value is negative (errors) or
        not finite.
    """
    style.write_png(path, _figure_error_map, frames)


def error_distribution(path: Path | str, frames: Mapping[str, pd.DataFrame]) -> None:
    """Share of the conditions with an error below each value, a line for every method.

    Parameters and errors are those of `error_map`. What is below the scale, zero among it, is
    drawn at its edge.
    """
    style.write_png(path, _figure_error_distribution, frames)


def tolerance_study(
    path: Path | str, studies: Mapping[str, pd.DataFrame], published: pd.DataFrame
) -> None:
    """Mean error and iterations against the tolerance of the search (Rouvinen 1999, chapter 4).

    Parameters
    ----------
    path
        PNG to write.
    studies
        By label of the method: TOLERANCE_COLUMNS, mean_error in m, iterations of a target.
    published
        Column `method` and PUBLISHED_COLUMNS; may have no rows. A method that is among `studies`
        has its colour.

    Raises
    ------
    DataError
        If there is no study, a column is missing, or a value is not finite or out of range.
    """
    style.write_png(path, _figure_tolerance_study, studies, published)


def training_race(path: Path | str, curves: pd.DataFrame) -> None:
    """Training error against time, a line for every trainer.

    Parameters
    ----------
    path
        PNG to write.
    curves
        Column `trainer` (labels to show) and RACE_COLUMNS, in the order of time: seconds from the
        start and root mean square of the normalised output errors. What was at 0 s is drawn at
        the left edge of the logarithmic axis.

    Raises
    ------
    DataError
        If a column is missing, or a value is not finite, negative (seconds) or not positive
        (error).
    """
    style.write_png(path, _figure_training_race, curves)


def operations(path: Path | str, table: pd.DataFrame) -> None:
    """Mean error of every method against what a target costs it.

    Parameters
    ----------
    path
        PNG to write.
    table
        Column `method` (labels to show) and COST_COLUMNS: arithmetic operations and time for a
        target, computed alone and in a batch, in microseconds; mean_error in mm.

    Raises
    ------
    DataError
        If a column is missing or a value is not finite and positive.
    """
    style.write_png(path, _figure_operations, table)


def _check(
    what: str, frames: Mapping[str, pd.DataFrame], columns: Sequence[str], positive: Sequence[str]
) -> None:
    """Refuse frames without rows or `columns`; numbers but targets are >= 0, or > 0."""
    if not frames:
        raise DataError(f"{what}: expected a frame for every method, found none")
    for label, frame in frames.items():
        name = f"{what} of {label}" if label else what
        style.require(name, frame.columns, columns)
        if frame.empty:
            raise DataError(f"{name}: expected rows, found none")
        style.finite(name, {column: frame[column] for column in columns})
        for column in columns:
            least = frame[column].min()
            if column in positive and least <= 0:
                raise DataError(f"{name}: {column} is {least:g}, expected positive numbers")
            if least < 0 and not column.startswith("target"):
                raise DataError(f"{name}: {column} is {least:g}, expected no negative number")


def _looks(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Colour and dashes by label: the fifth to eighth differ from the others by both."""
    return {
        label: {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k // 4 % len(DASHES)]}
        for k, label in enumerate(labels)
    }


def _ticks(low: float, high: float, enough: int = 3) -> list[float]:
    """Ticks of a logarithmic scale from `low` to `high`."""
    decades, steps = ([v for v in values if low <= v <= high] for values in (STEPS[::3], STEPS))
    return decades if len(decades) >= enough else steps


def _texts(ticks: Iterable[float]) -> list[str]:
    """Labels of `ticks` among STEPS: decimals, or all as powers of ten if one is far from 1."""
    if all(1e-3 <= tick <= 1e5 for tick in ticks):
        return [style.signed(tick) for tick in ticks]
    parts = [f"{tick:.0e}".split("e") for tick in ticks]
    factors = ["" if factor == "1" else rf"{factor}\times" for factor, _ in parts]
    return [f"${f}10^{{{int(power)}}}$" for f, (_, power) in zip(factors, parts, strict=True)]


def _logarithmic(axes: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
    """Logarithmic x or y axis from `low` to `high` and a little further, sparingly labelled."""
    low, high = low / 1.3, 1.3 * high
    axes.set(**{f"{which}scale": "log", f"{which}lim": (low, high)})
    axis = axes.xaxis if which == "x" else axes.yaxis
    ticks = _ticks(low, high)
    axis.set_ticks(ticks, _texts(ticks))
    axis.set_minor_locator(NullLocator())


def _range(values: ArrayLike) -> tuple[float, float]:
    """Least and greatest of `values` >= 0 on a logarithmic scale: not zero, SPAN apart at most."""
    numbers = np.asarray(values, dtype=float)
    greatest = float(numbers.max()) or 1.0
    return max(float(numbers.min()), greatest / SPAN), greatest


def _cell_means(frame: pd.DataFrame, edges: Sequence[Array]) -> Array:
    """Mean error in mm in every square (columns of x, rows of y), NaN in empty ones."""
    targets = frame["target_x"].to_numpy(), frame["target_y"].to_numpy()
    number = np.histogram2d(*targets, bins=edges)[0]
    total = np.histogram2d(*targets, bins=edges, weights=MM * frame["error"].to_numpy())[0]
    return np.divide(total, number, out=np.full_like(total, np.nan), where=number > 0)


def _figure_error_map(frames: Mapping[str, pd.DataFrame]) -> Figure:
    _check("errors", frames, ERROR_COLUMNS, ())
    targets = pd.concat([frame[["target_x", "target_y"]] for frame in frames.values()]).to_numpy()
    first, last = (np.floor(v / CELL) for v in (targets.min(axis=0), targets.max(axis=0)))
    edges = [CELL * np.arange(a, b + 2) for a, b in zip(first, last, strict=True)]
    maps = {label: _cell_means(frame, edges) for label, frame in frames.items()}
    known = np.concatenate([cells[np.isfinite(cells)] for cells in maps.values()])
    low, high = _range(known)
    low, high = STEPS[bisect_right(STEPS, low) - 1], STEPS[bisect_right(STEPS, high)]

    columns = len(maps) if len(maps) <= COLUMNS else min(-(-len(maps) // 2), COLUMNS)
    rows = -(-len(maps) // columns)
    width, height = (edge[-1] - edge[0] for edge in edges)
    panel = min((style.WIDTH - 0.8) / columns * height / width, 3.7)
    figure = Figure(figsize=(style.WIDTH, 0.95 + rows * (panel + 0.3)), layout="compressed")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, (label, cells) in zip(panels, maps.items(), strict=False):
        # neither end of the colours is white, which is left to the empty squares
        colours = ListedColormap(mpl.colormaps["magma_r"](np.linspace(0.1, 0.95, 256)))
        drawn = np.ma.masked_invalid(np.maximum(cells, low).T)
        mesh = axes.pcolormesh(*edges, drawn, cmap=colours, norm=LogNorm(low, high))
        axes.set_title(textwrap.fill(label, 88 // columns), fontsize=9.5)
        axes.set_aspect("equal")
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    for axes in panels[max(len(maps) - columns, 0) : len(maps)]:  # nothing is below them
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("x (m)")
    for axes in panels[::columns]:
        axes.set_ylabel("y (m)")
    for axes in panels[len(maps) :]:
        axes.set_axis_off()
    extend = "min" if (known < low).any() else "neither"
    bar = figure.colorbar(
        mesh, ax=list(panels), location="bottom", shrink=0.7, aspect=45, extend=extend
    )
    bar.set_label(f"mean error in squares of {CELL:g} m (mm)")
    ticks = _ticks(low, high, enough=2)
    bar.set_ticks(ticks, labels=_texts(ticks))
    bar.ax.minorticks_off()
    return figure


def _figure_error_distribution(frames: Mapping[str, pd.DataFrame]) -> Figure:
    _check("errors", frames, ERROR_COLUMNS, ())
    low, high = _range(pd.concat([MM * frame["error"] for frame in frames.values()]))
    figure = Figure(figsize=(style.WIDTH, 5.4))
    axes = figure.add_subplot(xlabel="error (mm), logarithmic")
    for (label, frame), look in zip(frames.items(), _looks(frames).values(), strict=True):
        errors = np.sort(MM * frame["error"].to_numpy())
        share = 100 * np.arange(1, len(errors) + 1) / len(errors)
        drawn = np.maximum(errors, low / 1.3)  # zero has no place on the scale: at its edge
        numbers = []
        for q, shape in MARKED.items():
            k = np.searchsorted(share, 100 * q - 1e-9)  # first whose share is not below q
            axes.plot(drawn[k], share[k], shape, color=look["color"], markersize=5.5)
            numbers.append(np.format_float_positional(errors[k], 3, fractional=False, trim="-"))
        steps = [drawn[0], *drawn], [0.0, *share]
        axes.plot(*steps, drawstyle="steps-post", label=f"{label}: {', '.join(numbers)}", **look)
    _logarithmic(axes, "x", low, high)
    axes.set(ylim=(0, 101.5), yticks=(0, 25, 50, 75, 99))
    axes.set_ylabel("conditions with at most this error (%)")
    title = "method: error in mm at 50 % (circle) and 99 % (diamond) of its conditions"
    figure.legend(loc="outside upper center", ncols=2, title=title)
    return figure


def _figure_tolerance_study(studies: Mapping[str, pd.DataFrame], published: pd.DataFrame) -> Figure:
    _check("tolerance study", studies, TOLERANCE_COLUMNS, TOLERANCE_COLUMNS[:2])
    style.require("published tolerances", published.columns, ("method", *PUBLISHED_COLUMNS))
    every = list(studies.values())
    if not published.empty:
        _check("published tolerances", {"": published}, PUBLISHED_COLUMNS, ("tolerance",))
        every.append(published)
    numbers = pd.concat(every)

    figure = Figure(figsize=(style.WIDTH, 4.6))
    errors, iterations = figure.subplots(1, 2)
    looks = _looks(studies)
    handles = {}
    for label, study in studies.items():
        look = looks[label] | {"marker": "o", "markersize": 4}
        rows = study.sort_values("tolerance")
        x = rows["tolerance"]
        (handles[label],) = errors.plot(x, MM * rows["mean_error"], **look)
        iterations.plot(x, rows["mean_iterations"], **look)
        iterations.plot(x, rows["max_iterations"], linewidth=0.7, **looks[label])
    for k, (method, rows) in enumerate(published.groupby("method", sort=False)):
        look = {"color": looks.get(str(method), {"color": style.INK})["color"]}
        look |= {"marker": "sD^v"[k % 4], "linestyle": "none", "fillstyle": "none"}
        (handle,) = iterations.plot(rows["tolerance"], rows["mean_iterations"], **look)
        iterations.plot(rows["tolerance"], rows["max_iterations"], markersize=3.5, **look)
        handles[f"{method}, published"] = handle
    for axes in (errors, iterations):
        _logarithmic(axes, "x", numbers["tolerance"].min(), numbers["tolerance"].max())
        axes.set_xlabel("tolerance (1), logarithmic")
    _logarithmic(errors, "y", MM * numbers["mean_error"].min(), MM * numbers["mean_error"].max())
    errors.set_ylabel("mean R (mm)")
    iterations.set_yscale("symlog", linthresh=1.0, linscale=0.4)  # a search may need none
    top = 1.3 * max(numbers["max_iterations"].max(), 1.0)
    ticks = [0.0, *_ticks(1.0, top)]
    iterations.set_yticks(ticks, ["0", *_texts(ticks[1:])])
    iterations.minorticks_off()
    iterations.set(ylim=(0, top), ylabel="iterations (1)")
    iterations.set_title("iterations: mean (marks), largest (thin, small)", fontsize=10)
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=2)
    return figure


def _figure_training_race(curves: pd.DataFrame) -> Figure:
    style.require("training race", curves.columns, ("trainer", *RACE_COLUMNS))
    _check("training race", {"": curves}, RACE_COLUMNS, ("error",))
    high = curves["seconds"].max()
    if high == 0:
        raise DataError("training race: every time is 0 s, expected later ones too")
    low = curves.loc[curves["seconds"] > 0, "seconds"].min()
    figure = Figure(figsize=(style.WIDTH, 5.0))
    axes = figure.add_subplot()
    groups = {str(label): rows for label, rows in curves.groupby("trainer", sort=False)}
    for (label, rows), look in zip(groups.items(), _looks(groups).values(), strict=True):
        seconds = np.maximum(rows["seconds"], low / 1.3)
        axes.plot(seconds, rows["error"], label=label, linewidth=1.8, **look)
        axes.plot(seconds.iloc[-1], rows["error"].iloc[-1], "o", color=look["color"], markersize=5)
    _logarithmic(axes, "x", low, high)
    _logarithmic(axes, "y", curves["error"].min(), curves["error"].max())
    axes.set(xlabel="time (s), logarithmic", ylabel="root mean square error, normalised (1)")
    figure.legend(loc="outside upper center", ncols=min(len(groups), 3))
    return figure


def _figure_operations(table: pd.DataFrame) -> Figure:
    style.require("operations", table.columns, ("method", *COST_COLUMNS))
    _check("operations", {"": table}, COST_COLUMNS, COST_COLUMNS)
    figure = Figure(figsize=(style.WIDTH, 4.8))
    panels = figure.subplots(1, 2, sharey=True)
    counts, alone, batched, errors = table[list(COST_COLUMNS)].to_numpy(dtype=float).T
    for k, look in enumerate(_looks(str(k) for k in range(len(table))).values()):
        dot = {"marker": "o", "color": look["color"], "linestyle": "none", "markersize": 7}
        panels[0].plot(counts[k], errors[k], **dot)
        panels[1].plot((batched[k], alone[k]), [errors[k]] * 2, color=style.GREY, zorder=1.5)
        panels[1].plot(batched[k], errors[k], **dot | {"markerfacecolor": "white"})
        panels[1].plot(alone[k], errors[k], **dot)
    for axes, costs in zip(panels, (counts, np.concatenate([alone, batched])), strict=True):
        _logarithmic(axes, "x", costs.min(), 4.0 * costs.max())  # room for labels
    _logarithmic(panels[0], "y", errors.min() / 1.2, 1.2 * errors.max())
    panels[0].set(xlabel="operations for a target (1)", ylabel="mean R (mm)")
    panels[1].set_xlabel("time for a target (µs)")
    panels[1].set_title("alone (filled) or in a batch (open)", fontsize=10)
    figure.draw_without_rendering()  # settles the layout, which the places of the labels need
    for axes, ends in zip(panels, ((counts, counts), (alone, batched)), strict=True):
        spans = np.stack([np.column_stack([end, errors]) for end in ends], axis=1)
        _name_spans(axes, spans, table["method"].astype(str))
    return figure


def _name_spans(axes: Axes, spans: Array, labels: Iterable[str]) -> None:
    """Write labels beside the starts of `spans` (n, start and end, x and y), over no other."""
    pixels = axes.transData.transform(spans.reshape(-1, 2)).reshape(spans.shape)
    taken = [Bbox(pair).padded(6.0) for pair in np.sort(pixels, axis=1)]
    for k, (label, start) in enumerate(zip(labels, spans[:, 0], strict=True)):
        # under the dots, so that the leader ends at their edge
        text = axes.annotate(label, tuple(start), arrowprops=LEADER, zorder=1.9, **BESIDE)
        text.set_in_layout(False)
        costs = []
        for place in PLACES:
            box = _moved(text, place)
            away = np.hypot(*(pixels[:, 0] - np.clip(pixels[:, 0], box.min, box.max)).T)
            strangers = (away < away[k]).sum()  # dots a reader would rather take for the label's
            costs.append(_covered(box, taken, axes.bbox) + strangers)
        taken.append(_moved(text, PLACES[int(np.argmin(costs))]))


def _moved(text: Annotation, place: tuple[int, int, int]) -> Bbox:
    """Box in pixels of `text`, without its leader, once it is moved to `place`."""
    dx, dy, far = place
    text.set(position=(far * dx, far * dy))
    text.set(ha=("center", "left", "right")[dx], va=("center", "bottom", "top")[dy])
    text.get_window_extent()  # brings it there, and includes the leader
    return Text.get_window_extent(text)


def _covered(box: Bbox, taken: Iterable[Bbox], inside: Bbox) -> float:
    """Pixels that `box` covers of the boxes `taken`, and those that it has beyond `inside`."""

    def common(other: Any) -> float:
        shared = Bbox.intersection(box, other)
        return 0.0 if shared is None else float(shared.width * shared.height)

    return sum(common(other) for other in taken) + common(box) - common(inside)
