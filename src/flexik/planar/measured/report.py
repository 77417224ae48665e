"""Tables and a figure of a measured machine, and of what a few measurements give."""

from collections.abc import Mapping

import pandas as pd

from flexik.planar.measured.fields import ADAPTED, MISJUDGED
from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM
from flexik.reporting.tables import Column, Table, mm, table

STATISTICS = {"mean_error": "mean R (mm)", "p95_error": "95th percentile of R (mm)"}
GOAL_WIDTH = 0.07  # of the largest number of measurements, either side


def by_twin(adaptation: pd.DataFrame) -> pd.DataFrame:
    """Errors (m) over the targets of each machine as built: mean, 95th percentile, largest.

    adaptation : a table of fields.ADAPTATION.
    """
    keys = ["method", "n_measurements", "twin"]
    groups = adaptation.groupby(keys, sort=False)["error"]
    found = groups.agg(mean_error="mean", p95_error=lambda e: e.quantile(0.95), max_error="max")
    order = {name: k for k, name in enumerate(adaptation["method"].unique())}
    return found.reset_index().sort_values(
        keys, key=lambda c: c.map(order) if c.name == "method" else c, ignore_index=True
    )


def prediction_table(predictions: pd.DataFrame) -> Table:
    """Distances of the measured points from their predictions, nominal and adapted."""
    errors = {name: predictions[f"{name}_error"].dropna() for name in ("nominal", "adapted")}
    rows = [
        {"machine": name, "n": len(e), "mean": e.mean(), "p95": e.quantile(0.95), "max": e.max()}
        for name, e in errors.items()
        if len(e)
    ]
    columns = {"machine": "machine", "measurements": "n", "mean (mm)": mm("mean", 1)}
    return table(rows, {**columns, "95th percentile (mm)": mm("p95", 1), "max (mm)": mm("max", 1)})


def offset_table(offsets: pd.DataFrame) -> Table:
    """Offsets before and after measuring, in mm, mrad and percent, standard deviations after +-."""
    scale = offsets["unit"].map({"m": MM, "rad": MM, "1": 100.0})
    names = {"expected": "expected", "expected_deviation": "+- before"}
    names |= {"identified": "identified", "deviation": "+- after"}
    scaled = {title: scale * offsets[name] for name, title in names.items()}
    unit = offsets["unit"].map({"m": "mm", "rad": "mrad", "1": "%"})
    return Table(pd.DataFrame({"offset": offsets["offset"], "unit": unit, **scaled}), 3)


def adaptation_table(adapted: pd.DataFrame) -> Table:
    """Means over the machines, and their worst; the first method is the one that is adapted."""
    groups = adapted.groupby(["method", "n_measurements"], sort=False)
    rows = groups.agg(
        mean=("mean_error", "mean"),
        p95=("p95_error", "mean"),
        worst=("mean_error", "max"),
        most=("max_error", "max"),
    ).reset_index()
    return table(
        rows.assign(ratio=rows["mean"] / rows["mean"].iloc[0]),
        {
            "method": "method",
            "N": "n_measurements",
            "mean R (mm)": mm("mean"),
            "95th percentile of R (mm)": mm("p95"),
            "mean R of the worst machine (mm)": mm("worst"),
            "max R (mm)": mm("most"),
            "ratio to unadapted": Column("ratio"),
        },
    )


def adaptation_figure(adapted: pd.DataFrame, goals: Mapping[int, float] | None = None) -> Drawing:
    """Mean and 95th percentile of the error against the number of measurements.

    adapted : result of by_twin. The lines are means over the machines, the band of `adapted`
        reaches from the best machine to the worst. N = 0 is the first method, which is adapted.
    goals : mean error (m) to fall below, by number of measurements, if any.
    """
    long = adapted.melt(["method", "n_measurements"], list(STATISTICS), "panel", "error")
    own = long[long["method"].isin([adapted["method"].iloc[0], ADAPTED])]
    keys = ["panel", "n_measurements"]
    spread = own.groupby(keys)["error"].agg(["mean", "min", "max"]).reset_index()
    wrong = long[long["method"] == MISJUDGED].groupby(keys)["error"].mean().reset_index()
    named = spread.assign(text=[f"{MM * v:.1f}" for v in spread["mean"]], dx=-2.0, dy=-10.0)
    named, numbers = named.assign(side="right"), sorted(set(long["n_measurements"]))
    at, twins = "n_measurements", "from the best machine to the worst"
    sky, small = {"color": style.SKY, "alpha": 0.3}, {"fontsize": 8.5, "path_effects": []}
    square = {"color": style.ORANGE, "markersize": 5.5, "fillstyle": "none"}
    marked = {"color": style.VERMILION, "linewidth": 0.9, "marker": "v", "markevery": [1]}
    layers = [
        Layer(spread, at, "min", "band", to="max", label=twins, look=sky),
        Layer(spread, at, "mean", "o-", label="mean over the machines"),
        Layer(named, at, "mean", "text", text="text", look=small),
    ]
    if len(wrong):
        layers.append(Layer(wrong, at, "error", "s", label="mean, misjudged", look=square))
    width = GOAL_WIDTH * numbers[-1]  # short: a goal is for its number only
    for k, (number, goal) in enumerate((goals or {}).items()):
        line = pd.DataFrame({at: [number - width, number, number + width], "error": goal})
        line["panel"] = "mean_error"
        layers.append(Layer(line, at, "error", "-", label="" if k else "goal", look=marked))
    return draw(
        chart,
        *layers,
        x=Axis("measured points N", ticks=numbers, margin=0.12),
        y=Axis("error (mm), logarithmic", MM, log=True),
        panel="panel",
        panels=tuple(STATISTICS),
        titles=STATISTICS,
        columns=2,
        height=4.4,
    )
