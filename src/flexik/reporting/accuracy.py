"""Picture of the error of all methods against what a query of theirs costs."""

import itertools

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.reporting import style
from flexik.reporting.chart import Array, Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

FAMILIES = {
    "published": "of the thesis",
    "selected": "the same, sizes by selection error",
    "variants": "variants",
    "beyond": "beyond the thesis",
}
# Points a decade of the axes of that picture, and of its letters
LABEL_SCALE, LABEL_WIDTH, LABEL_HEIGHT = np.array([45.0, 75.0]), 4.0, 8.5
LEAST = 1e-5  # mm; smaller errors are drawn as this
FAMILY_COLOURS = (style.VERMILION, style.ORANGE, style.GREY, style.BLUE)


def figure(compared: pd.DataFrame) -> Drawing:
    """Error at random targets against time and memory, all methods; those of the thesis apart."""
    costs = {"microseconds": "a query in a batch (us)", "kilobytes": "numbers (kB)"}
    frames = []
    for panel in costs:
        known = compared[compared["method"] != "none"].dropna(subset=[panel])
        frames.append(known[known[panel] > 0].assign(cost=known[panel], panel=panel))
    frame = pd.concat(frames)
    frame["kind"] = frame["group"].map(FAMILIES)
    frame = frame.sort_values(["panel", "workspace_mean"], ascending=[True, False])
    text = frame["method"].str.replace("_", " ")
    drawn = frame.assign(error=np.maximum(frame["workspace_mean"], LEAST / MM))
    heights = [h for _, rows in drawn.groupby("panel", sort=False) for h in _heights(rows)]
    names = frame.assign(text=text, dx=5.0, dy=heights, side="left")
    colours = {
        name: {"color": c} for name, c in zip(FAMILIES.values(), FAMILY_COLOURS, strict=True)
    }
    small = {"fontsize": 7.0, "path_effects": []}
    return draw(
        chart,
        Layer(frame, "cost", "workspace_mean", "o", "kind", look={"markersize": 7.0}),
        Layer(names, "cost", "workspace_mean", "text", text="text", look=small),
        x={panel: Axis(label, log=True, margin=0.15) for panel, label in costs.items()},
        y=Axis("mean error at random targets (mm)", MM, log=True, least=LEAST),
        panel="panel",
        panels=tuple(costs),
        titles="",
        columns=2,
        height=8.0,
        looks=colours,
    )


def _heights(rows: pd.DataFrame) -> list[float]:
    """Of labels right of the dots of a panel."""
    at = LABEL_SCALE * np.log10(rows[["cost", "error"]].to_numpy())
    return _apart(at, LABEL_WIDTH * rows["method"].str.len().to_numpy(), LABEL_HEIGHT)


def _apart(at: Array, widths: NDArray, height: float) -> list[float]:
    """By how much labels that begin at `at` (n, 2) move up, so that none lies on another.

    In the order given, each by as little as the ones before it leave; all in points.
    """
    taken: list[tuple[float, float, float]] = []
    moves = []
    for (x, y), width in zip(at, widths, strict=True):
        steps = (sign * step for step in itertools.count() for sign in (1.0, -1.0))
        move = next(
            step
            for step in steps
            if all(
                abs(y + step - other) >= height or x >= end or x + width <= begin
                for begin, end, other in taken
            )
        )
        taken.append((x, x + width, y + move))
        moves.append(move)
    return moves
