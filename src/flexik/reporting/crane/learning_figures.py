"""Figures of training and size selection."""

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexik.reporting import style

# Sizes that each get a tick
FEW_SIZES = 15

SIZE_COLUMNS = (
    "n_hidden",
    "training_error",
    "selection_error",
    "median_selection_error",
    "worst_selection_error",
)


def size_selection(
    path: Path | str, sizes: pd.DataFrame, chosen: int, published: int | None, tolerance: float
) -> None:
    """Training and selection error against the number of hidden neurons, and the choice.

    Parameters
    ----------
    path
        PNG to write.
    sizes
        Frame of learning.size_selection.by_size; errors of normalised outputs.
    chosen, published
        Numbers of hidden neurons to mark; None: nothing published.
    tolerance
        With which the choice was made, relative.

    Raises
    ------
    DataError
        If a column is missing.
    """
    style.write_png(path, _figure_size_selection, sizes, chosen, published, tolerance)


def _figure_size_selection(
    sizes: pd.DataFrame, chosen: int, published: int | None, tolerance: float
) -> Figure:
    style.require("size selection", sizes.columns, SIZE_COLUMNS)
    figure = Figure(figsize=(style.WIDTH, 4.6))
    axes = figure.add_subplot()
    x = sizes["n_hidden"]
    axes.fill_between(
        x,
        sizes["selection_error"],
        sizes["worst_selection_error"],
        color=style.SKY,
        alpha=0.3,
        linewidth=0,
        label="best to worst selection error of restarts",
    )
    axes.plot(
        x,
        sizes["median_selection_error"],
        color=style.SKY,
        label="median selection error of restarts",
    )
    axes.plot(
        x,
        sizes["selection_error"],
        color=style.BLUE,
        label="selection error of the best restart",
        marker="o",
        ms=3.5,
    )
    axes.plot(
        x,
        sizes["training_error"],
        color=style.ORANGE,
        label="training error of the best restart",
        marker="o",
        ms=3.5,
    )
    axes.axvline(chosen, color=style.VERMILION, linewidth=1.5, label=f"chosen: {chosen}")
    if published is not None:
        axes.axvline(published, color=style.GREY, linestyle="--", label=f"published: {published}")
    axes.set_yscale("log")
    if len(x) <= FEW_SIZES:
        axes.set_xticks(x)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("hidden neurons (1)")
    axes.set_ylabel("root mean square error, normalised (1)")
    rule = "size of the least selection error"
    if tolerance > 0:
        rule = f"smallest size with a selection error within {100 * tolerance:g} % of the least"
    axes.set_title(f"Choice: {rule}")
    # beyond the axes, where no line can run through it
    figure.legend(loc="outside upper center", ncols=2)
    return figure
