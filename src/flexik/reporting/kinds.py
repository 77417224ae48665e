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
SIZE_LOOKS: dict[str, style.Look] = {
    "selection error, best start": {"color": style.BLUE, "marker": "o"},
    "selection error, median": {"color": style.SKY, "linestyle": "-", "marker": ""},
    "training error": {"color": style.ORANGE, "linestyle": "-", "marker": "s"},
}


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
    """Dots, or bars, of every category side by side.

    Parameters
    ----------
    layers
        Their `x` is made here; "bars" of the values of `spread` stand beside each other.
    category, names
        Column that tells the category, and what to write below each, in order.
    spread
        Column whose values (the same in all layers) are set apart within a category.
    """
    order = {value: k for k, value in enumerate(names)}
    values = sorted({v for layer in layers for v in layer.frame[spread]}) if spread else []
    step = 0.8 / max(len(values), 1)
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
    names: Mapping[Any, str] | None = None,
    numbers: str = ".2f",
    **options: Any,
) -> Figure:
    """Our values filled, published ones open, a line for every category, the first on top.

    Parameters
    ----------
    frame
        Columns category, value, published (NaN: none), hue, panel.
    names
        What to write for a category.
    numbers
        Format of the numbers beside the dots; "" for none.
    """
    categories = list(dict.fromkeys(frame[category]))
    frame = frame.assign(place=frame[category].map({c: k for k, c in enumerate(categories)}))
    frame = frame.assign(row=np.arange(len(frame)))
    keep = ["place", "row", *filter(None, (hue, panel))]
    ours, theirs = (frame[[*keep, k]].rename(columns={k: "at"}) for k in (value, published))
    theirs = theirs.dropna(subset="at")
    both = pd.concat([ours[ours["row"].isin(theirs["row"])], theirs])
    open_dot = {"markersize": 9.0, "fillstyle": "none", "zorder": 2.2}
    if hue is None:
        open_dot["color"] = style.INK
    ours_label, their_label = ("{}", "{}, published") if hue else ("ours", "published")
    layers = [Layer(ours, "at", "place", "o", hue, label=ours_label, look={"markersize": 6.0})]
    if len(theirs):
        grey = {"color": style.GREY, "linewidth": 1.2, "zorder": 1.5}
        layers.insert(0, Layer(both, "at", "place", "-", group="row", label="", look=grey))
        layers.append(Layer(theirs, "at", "place", "o", hue, label=their_label, look=open_dot))
    if numbers:
        for rows, dy, colour in ((theirs, -12.0, style.INK), (ours, 12.0, style.BLUE)):
            if len(rows):
                texts = rows.assign(text=[format(v, numbers) for v in rows["at"]], dy=dy)
                look = {"color": colour}
                layers.append(Layer(texts, "at", "place", "text", text="text", look=look))
    ticks = {k: (names or {}).get(c, str(c)) for k, c in enumerate(categories)}
    y = Axis(ticks=ticks, limits=(len(ticks) - 0.45, -0.55))
    if numbers:  # room for them
        by_panel = x if isinstance(x, Mapping) else {None: x}
        wide = {name: replace(axis, margin=0.12) for name, axis in by_panel.items()}
        x = wide if isinstance(x, Mapping) else wide[None]
    height = 1.3 + (0.6 if numbers else 0.42) * len(ticks)
    defaults: dict[str, Any] = {"height": height, "share": "y"}
    return chart(*layers, x=x, y=y, panel=panel, **defaults | options)


def distribution(
    frame: pd.DataFrame,
    value: str,
    hue: str,
    x: Axis | Mapping[Any, Axis],
    *,
    what: str = "conditions",
    panel: str | None = None,
    quantiles: bool = True,
    of_all: bool = False,
    **options: Any,
) -> Figure:
    """Share of the rows with at most each value, a line for every value of `hue`.

    Parameters
    ----------
    what
        The rows, in words.
    quantiles
        Mark MARKED on the curves and write them in the legend (for one panel only).
    of_all
        Share of all rows, those without a number (failed) among them.
    """
    axis, curves, marks = x, [], []
    for keys, rows in frame.groupby([hue, *([panel] if panel else [])], sort=False):
        values = np.sort(rows[value].dropna().to_numpy(dtype=float))
        share = 100.0 * np.arange(1, len(values) + 1) / (len(rows) if of_all else len(values))
        named: dict[str, Any] = dict(zip([hue, *([panel] if panel else [])], keys, strict=True))
        steps = {"at": [values[0], *values], "share": [0.0, *share]}
        found = {q: np.searchsorted(share, 100 * q - 1e-9) for q in MARKED}
        label = str(keys[0])
        if quantiles and not panel and isinstance(axis, Axis):
            label += f": {', '.join(_three(axis.scale * values[k]) for k in found.values())}"
            for q, k in found.items():
                marks.append(named | {"q": q, "at": values[k], "share": share[k]})
        curves.append(pd.DataFrame(steps).assign(**named, label=label))
    table = pd.concat(curves)
    looks = {**style.looks(dict.fromkeys(frame[hue])), **options.pop("looks", {})}
    layers = [
        Layer(rows, "at", "share", "steps", hue, label=str(label))
        for label, rows in table.groupby("label", sort=False)
    ]
    for q, shape in MARKED.items():
        rows = pd.DataFrame([mark for mark in marks if mark["q"] == q])
        if len(rows):
            look = {"marker": shape, "markersize": 5.5}
            layers.append(Layer(rows, "at", "share", "o", hue, label="", look=look))
    if marks:
        text = " and ".join(f"{100 * q:g} %" for q in MARKED)
        options.setdefault("legend", f"value at {text} of the {what} (circle, diamond)")
    ticks = (0, 25, 50, 75, 99)
    y = Axis(f"{what} with at most this error (%)", limits=(0, 101.5), ticks=ticks)
    defaults: dict[str, Any] = {"height": 5.2, "share": "y"}
    return chart(*layers, x=x, y=y, panel=panel, looks=looks, **defaults | options)


def _three(value: float) -> str:
    return np.format_float_positional(value, 3, fractional=False, trim="-")


def sizes(
    frame: pd.DataFrame,
    *,
    panel: str | None = None,
    chosen: Mapping[Any, int] | int | None = None,
    published: Mapping[Any, int] | int | None = None,
    band: bool = True,
    x_label: str = "hidden neurons (1)",
    y: Axis | None = None,
    **options: Any,
) -> Figure:
    """Training and selection error against the size of the network.

    Parameters
    ----------
    frame
        Rows of learning.size_selection.by_size, and the column `panel`.
    chosen, published
        Sizes to mark, by panel or for all.
    band
        Show the band from the best to the worst start, and the median where there is one.
    """
    columns = {"selection error, best start": "selection_error", "training error": "training_error"}
    known = frame[["selection_error", "training_error"]].notna().all(axis=1)
    layers = [
        Layer(frame[known], "n_hidden", column, "o-", label=label, look=SIZE_LOOKS[label])
        for label, column in columns.items()
    ]
    if band and "worst_selection_error" in frame:
        label = "selection error, best to worst start"
        span = Layer(frame, "n_hidden", "selection_error", "band", to="worst_selection_error")
        layers.insert(0, replace(span, look={"color": style.SKY}, label=label))
    if band and "median_selection_error" in frame:
        label = "selection error, median"
        median = Layer(frame, "n_hidden", "median_selection_error", label=label)
        layers.insert(1, replace(median, look=SIZE_LOOKS[label]))
    rules = []
    marks = (("chosen", chosen, style.CHOSEN), ("published", published, style.PUBLISHED))
    for label, sizes_of, look in marks:
        by_panel = sizes_of if isinstance(sizes_of, Mapping) else {None: sizes_of}
        for name, size in by_panel.items():
            if size is not None:
                text = f"{label} size" if panel else f"{label}: {size}"
                rules.append(Rule("x", size, text, look, panel=name))
    y = y or Axis("root mean square error, normalised (1)", log=True)
    few = sorted(set(frame["n_hidden"]))
    x = Axis(x_label, integer=True, ticks=few if len(few) <= 15 and panel is None else None)
    return chart(*layers, x=x, y=y, panel=panel, rules=rules, **options)


def sequences(
    parts: Mapping[str, Sequence[float]], colours: Sequence[str], *, detail: int = 100
) -> Figure:
    """Numbers in their order, mapped onto [-1, 1], and the first of them enlarged beside.

    Parameters
    ----------
    parts
        Numbers of a row of panels, by its title.
    colours
        Of the rows.
    """
    layers: list[Layer] = []
    titles: dict[str, str] = {}
    panels: list[str] = []
    for (title, values), colour in zip(parts.items(), colours, strict=False):
        numbers = np.asarray(values, dtype=float)
        low, high = numbers.min(), numbers.max()
        normalised = 2 * (numbers - low) / (high - low) - 1 if high > low else 0 * numbers
        every = pd.DataFrame({"number": np.arange(1, len(numbers) + 1), "value": normalised})
        first = f"first {min(detail, len(every))} of {title}"
        titles |= {title: title, first: f"first {min(detail, len(every))}" if not panels else ""}
        panels += [title, first]
        whole, few = every.assign(panel=title), every[:detail].assign(panel=first)
        look = {"color": colour}
        layers.append(Layer(whole, "number", "value", ".", look=look | {"markersize": 1.5}))
        layers.append(
            Layer(few, "number", "value", ".-", look=look | {"markersize": 3, "linewidth": 0.8})
        )
    return chart(
        *layers,
        x={name: Axis("vector number") for name in panels},
        y=Axis("normalised (1)", limits=(-1.12, 1.12), ticks=(-1, 0, 1)),
        panel="panel",
        panels=panels,
        titles=titles,
        columns=2,
        widths=(3, 1.3),
        share="y",
        height=0.6 + 1.75 * len(parts),
    )
