"""Kinds of figures over reporting.chart: strips, bars, ours beside published, distributions, sizes.

All take a tidy frame, names of columns and axes with units; further options are those of chart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer, Rule, chart

MARKED = {0.5: "o", 0.99: "D"}  # quantiles with a mark on a distribution
BAND = "#F3F3F3"
DETAIL = 100  # numbers of a sequence that are enlarged
BEST, MEDIAN = "selection error, best start", "selection error, median"
SPAN, TRAINING = "selection error, best to worst start", "training error"


def strips(
    *layers: Layer,
    category: str,
    names: Mapping[Any, str],
    y: Any,
    spread: str | None = None,
    x_label: str = "",
    rotation: float = 90.0,
    **options: Any,
) -> Figure:
    """Dots, or bars, of every category side by side; the `x` of the layers is made here.

    category, names : column that tells the category, and what to write below each, in order.
    spread : column whose values (the same in all layers) are set apart within a category.
    """
    order = {value: k for k, value in enumerate(names)}
    values = sorted({v for layer in layers for v in layer.frame[spread]}) if spread else [None]
    step = 0.8 / len(values)
    moved = []
    for layer in layers:
        place = layer.frame[category].map(order).astype(float)
        if spread:
            offsets = {v: step * (k - (len(values) - 1) / 2) for k, v in enumerate(values)}
            place = place + layer.frame[spread].map(offsets)
        frame = layer.frame.assign(place=place)
        moved.append(replace(layer, frame=frame, x="place", width=0.92 * step))
    ticks = dict(enumerate(names.values()))
    x = Axis(x_label, limits=(-0.6, len(ticks) - 0.4), ticks=ticks, rotation=rotation)
    figure = chart(*moved, x=x, y=y, **options)
    for axes in figure.axes:
        axes.grid(visible=False, axis="x")
        for k in range(1, len(ticks), 2):  # categories told apart by bands
            axes.axvspan(k - 0.5, k + 0.5, color=BAND, zorder=0)
    return figure


def beside(
    frame: pd.DataFrame,
    category: str,
    value: str,
    published: str,
    x: Axis | Mapping[Any, Axis],
    *,
    hue: str | None = None,
    panel: str | None = None,
    numbers: str = ".2f",
    **options: Any,
) -> Figure:
    """Our values filled, published ones (NaN: none) open, a line a category, the first on top.

    numbers : format of the numbers beside the dots; "" for none.
    """
    categories = {value: k for k, value in enumerate(dict.fromkeys(frame[category]))}
    frame = frame.assign(place=frame[category].map(categories), row=np.arange(len(frame)))
    keep = ["place", "row", *filter(None, (hue, panel))]
    ours, theirs = (frame[[*keep, k]].rename(columns={k: "at"}) for k in (value, published))
    theirs = theirs.dropna(subset="at")
    both = pd.concat([ours[ours["row"].isin(theirs["row"])], theirs])
    open_dot = {"markersize": 9.0, "fillstyle": "none", "zorder": 2.2}
    open_dot |= {} if hue else {"color": style.INK}
    grey = {"color": style.GREY, "linewidth": 1.2, "zorder": 1.5}
    labels = ("{}", "{}, published") if hue else ("ours", "published")
    layers = [
        Layer(both, "at", "place", "-", group="row", label="", look=grey),
        Layer(ours, "at", "place", "o", hue, label=labels[0], look={"markersize": 6.0}),
        Layer(theirs, "at", "place", "o", hue, label=labels[1], look=open_dot),
    ]
    if numbers:
        for rows, dy, colour in ((theirs, -12.0, style.INK), (ours, 12.0, style.BLUE)):
            texts = rows.assign(text=[format(v, numbers) for v in rows["at"]], dy=dy)
            look = {"color": colour}
            layers.append(Layer(texts, "at", "place", "text", text="text", look=look))
        given = {None: x} if isinstance(x, Axis) else x
        wide = {name: replace(axis, margin=0.12) for name, axis in given.items()}
        x = wide.get(None, wide)
    ticks = {k: str(name) for name, k in categories.items()}
    y = Axis(ticks=ticks, limits=(len(ticks) - 0.45, -0.55))
    options = {"share": "y", "height": 1.3 + (0.6 if numbers else 0.42) * len(ticks), **options}
    shown = [layer for layer in layers if len(layer.frame)]
    return chart(*shown, x=x, y=y, panel=panel, **options)


def distribution(
    frame: pd.DataFrame,
    value: str,
    hue: str,
    x: Axis | Mapping[Any, Axis],
    *,
    what: str = "conditions",
    panel: str | None = None,
    of_all: bool = False,
    **options: Any,
) -> Figure:
    """Share of the rows with at most each value, a line for every value of `hue`.

    In one panel MARKED are marked on the curves and written in the legend.

    what : the rows, in words.
    of_all : share of all rows, those without a number (failed) among them.
    """
    keys = [hue, *([panel] if panel else [])]
    layers, marks = [], []
    for names, rows in frame.groupby(keys, sort=False):
        values = np.sort(rows[value].dropna().to_numpy(dtype=float))
        share = 100.0 * np.arange(1, len(values) + 1) / (len(rows) if of_all else len(values))
        curve = pd.DataFrame({"at": [values[0], *values], "share": [0.0, *share]})
        named: dict[str, Any] = dict(zip(keys, names, strict=True))
        curve, label = curve.assign(**named), str(names[0])
        if isinstance(x, Axis) and not panel:
            found = {q: int(np.searchsorted(share, 100 * q - 1e-9)) for q in MARKED}
            label += f": {', '.join(style.digits(x.scale * values[k]) for k in found.values())}"
            for q, k in found.items():
                look = {"marker": MARKED[q], "markersize": 5.5}
                mark = curve.iloc[[k + 1]]
                marks.append(Layer(mark, "at", "share", "o", hue, label="", look=look))
        layers.append(Layer(curve, "at", "share", "steps", hue, label=label))
    if marks:
        text = " and ".join(f"{100 * q:g} %" for q in MARKED)
        options.setdefault("legend", f"value at {text} of the {what} (circle, diamond)")
    y = Axis(f"{what} with at most this error (%)", limits=(0, 101.5), ticks=(0, 25, 50, 75, 99))
    options = {"height": 5.2, "share": "y", **options}
    return chart(*layers, *marks, x=x, y=y, panel=panel, **options)


def sizes(
    frame: pd.DataFrame,
    *,
    panel: str | None = None,
    chosen: Mapping[Any, int | None] | int | None = None,
    published: Mapping[Any, int | None] | int | None = None,
    band: bool = True,
    x_label: str = "hidden neurons (1)",
    **options: Any,
) -> Figure:
    """Training and selection error (learning.size_selection.by_size) against the network's size.

    chosen, published : sizes to mark, by panel or for all.
    band : show the band from the best to the worst start, and the median.
    """
    orange = {"color": style.ORANGE, "marker": "s"}
    layers = [
        Layer(frame, "n_hidden", "selection_error", "o-", label=BEST),
        Layer(frame, "n_hidden", "training_error", "o-", label=TRAINING, look=orange),
    ]
    if band:
        sky, worst = {"color": style.SKY}, "worst_selection_error"
        layers = [
            Layer(frame, "n_hidden", "selection_error", "band", to=worst, label=SPAN, look=sky),
            Layer(frame, "n_hidden", "median_selection_error", label=MEDIAN, look=sky),
            *layers,
        ]
    rules = []
    marks = (("chosen", chosen, style.CHOSEN), ("published", published, style.PUBLISHED))
    for label, given, look in marks:
        for name, size in (given if isinstance(given, Mapping) else {None: given}).items():
            if size is not None:
                text = f"{label} size" if panel else f"{label}: {size}"
                rules.append(Rule("x", size, text, look, panel=name))
    y = Axis("root mean square error, normalised (1)", log=True)
    few = sorted(set(frame["n_hidden"]))
    x = Axis(x_label, integer=True, ticks=few if len(few) <= 15 and panel is None else None)
    return chart(*layers, x=x, y=y, panel=panel, rules=rules, **options)


def sequences(parts: Mapping[str, Sequence[float]], colours: Sequence[str]) -> Figure:
    """Numbers in their order, mapped onto [-1, 1], and the first of them enlarged beside.

    parts : numbers of a row of panels, by its title.
    colours : of the rows.
    """
    layers: list[Layer] = []
    titles: dict[str, str] = {}
    for (title, values), colour in zip(parts.items(), colours, strict=False):
        numbers = np.asarray(values, dtype=float)
        low, high = numbers.min(), numbers.max()
        normalised = 2 * (numbers - low) / (high - low) - 1 if high > low else 0 * numbers
        whole = pd.DataFrame({"number": np.arange(1, len(numbers) + 1), "value": normalised})
        first = f"first {min(DETAIL, len(whole))} of {title}"
        titles |= {title: title, first: "" if titles else first.removesuffix(f" of {title}")}
        small, large = {"markersize": 1.5}, {"markersize": 3, "linewidth": 0.8}
        shown = (title, whole, ".", small), (first, whole[:DETAIL], ".-", large)
        layers += [
            Layer(rows.assign(panel=name), "number", "value", mark, look={"color": colour, **look})
            for name, rows, mark, look in shown
        ]
    x = {name: Axis("vector number") for name in titles}
    y = Axis("normalised (1)", limits=(-1.12, 1.12), ticks=(-1, 0, 1))
    layout: dict[str, Any] = {"columns": 2, "widths": (3, 1.3), "share": "y"}
    layout["height"] = 0.6 + 1.75 * len(parts)
    return chart(*layers, x=x, y=y, panel="panel", titles=titles, **layout)
