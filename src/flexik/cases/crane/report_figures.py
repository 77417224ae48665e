"""Figures of the crane's report, after those of Rouvinen 1999; lengths in m until drawn."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from flexik.cases.crane.parts.fields import STROKES, on_line
from flexik.cases.crane.report_mechanism import LINK_LOOKS, crane, links
from flexik.cases.crane.report_results import Results
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import REACHED
from flexik.planar.fields import deflection
from flexik.reporting import accuracy, curves, kinds, plane, style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

X, Y = Axis("x (m)"), Axis("y (m)")
ERROR_ROWS = {"error_x": "dX (mm)", "error_y": "dY (mm)", "error": "R (mm)"}
CELL = 0.25  # m, side of a square of the error map
# Variants of a method have its hue
VARIANTS = ("_selected", "_ga", "_gauss_newton")


def figures(results: Results) -> dict[str, Drawing]:
    """All figures by name."""
    return {
        "crane": crane(results.section.geometry, results.shape),
        "training_points": _training_points(results),
        "test_points": _test_points(results),
        "initial_positions": _initial_positions(results),
        **_sequences(results),
        **_errors(results),
        **_sizes(results),
        "training_race": _race(results.training_curves),
        "under_and_overfitting": _fitting(results),
        **({"learning_curves": curves.figure(results.curves)} if len(results.curves) else {}),
    }


def _sequences(results: Results) -> dict[str, Drawing]:
    """What networks take and learn, in the order of the samples."""
    kept, difference = results.kept, "flexible tip minus trained rigid network"
    inputs = {name.replace("_", " "): kept[name].to_numpy() for name in (*STROKES, "payload")}
    colours = [LINK_LOOKS[name]["color"] for name in ("lift arm", "jib", "extension")]
    found = {"sequences": _sequence(inputs, ("mm", "mm", "mm", "kg"), [*colours, style.PURPLE])}
    learnt = {
        "deflection": ("deflection", "mm", deflection(kept)),
        "rigid": ("rigid tip", "m", kept[["rigid_x", "rigid_y"]].to_numpy()),
        "tip": ("flexible tip", "m", kept[["tip_x", "tip_y"]].to_numpy()),
        **{f"difference_{k}": (difference, "mm", v) for k, v in results.corrections.items()},
    }
    for name, (what, unit, values) in learnt.items():
        parts = {f"{what} in {axis}": column for axis, column in zip("xy", values.T, strict=True)}
        drawn = _sequence(parts, (unit, unit), (style.BLUE, style.VERMILION))
        found[f"normalised_{name}"] = drawn
    return found


def _sequence(
    parts: Mapping[str, np.ndarray], units: Sequence[str], colours: Sequence[str]
) -> Drawing:
    titled = {}
    for (name, values), unit in zip(parts.items(), units, strict=True):
        ends, digits = np.array([values.min(), values.max()]), 2 if unit == "m" else 1
        low, high = ((MM if unit == "mm" else 1.0) * ends).round(digits)
        titled[f"{name}: {style.signed(low)} to {style.signed(high)} {unit}"] = values
    return draw(kinds.sequences, titled, colours)


def _training_points(results: Results) -> Drawing:
    """All training points, and enlarged those about the largest deflection."""
    geometry = results.section.geometry
    kept = results.kept.sort_values("payload", ascending=False, kind="stable")
    far = int(np.hypot(*deflection(kept).T).argmax())
    tip = kept[["tip_x", "tip_y"]].to_numpy()[far]
    low, high = tip - np.array([0.6, 0.35]), tip + np.array([0.1, 0.55])
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]], low])
    frame = pd.DataFrame(corners, columns=["x", "y"]).assign(panel="all")
    rigid = kept.drop_duplicates(["rigid_x", "rigid_y"])
    plus = {"color": style.INK, "markersize": 5, "markeredgewidth": 0.7, "zorder": 2.6}
    parts = links(geometry, np.array(geometry.stroke_maximum)[None] / 2)
    ink, tips = {"color": style.INK, "linewidth": 0.9}, ("tip_x", "tip_y")
    dots, small = {"markersize": 5, "markeredgewidth": 0}, {"markersize": 3}
    return draw(
        chart,
        Layer(parts.assign(panel="all"), "x", "y", "-", "link", "piece", label=""),
        Layer(rigid, "rigid_x", "rigid_y", "+", label="rigid", look=plus),
        Layer(kept.assign(panel="all"), *tips, ".", "payload", label="{:g} kg", look=dots | small),
        Layer(kept.assign(panel="enlarged"), *tips, "o", "payload", label="", look=dots),
        Layer(frame, "x", "y", "-", label="", look=ink),
        x={"all": X, "enlarged": Axis("x (m)", limits=(low[0], high[0]))},
        y={"all": Y, "enlarged": Axis("y (m)", limits=(low[1], high[1]))},
        panel="panel",
        panels=("all", "enlarged"),
        titles={
            "all": f"Tips of {len(kept)} training vectors",
            "enlarged": "the frame enlarged",
        },
        columns=2,
        widths=(1.6, 1),
        equal=True,
        height=8.6,
        looks=style.shades(kept["payload"]) | LINK_LOOKS,
    )


def _test_points(results: Results) -> Drawing:
    points = pd.DataFrame(results.points, columns=["x", "y"])
    named = points.assign(text=[style.coordinates(*p) for p in results.points], dy=10.0)
    white = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    grey = {"color": "#B8B8B8", "markersize": 2.5}
    dot = {"color": style.VERMILION, "markeredgecolor": "white", "markersize": 9}
    return draw(
        chart,
        Layer(results.kept, "tip_x", "tip_y", ".", label="training tips", look=grey),
        Layer(points, "x", "y", "o", label=f"{len(points)} test points", look=dot),
        Layer(named, "x", "y", "text", text="text", look={"bbox": white, "path_effects": []}),
        x=X,
        y=Y,
        equal=True,
        width=6.2,
        height=9.2,
    )


def _initial_positions(results: Results) -> Drawing:
    names = [style.coordinates(*point) for point in results.points]
    manipulator = CraneManipulator(results.section.geometry)
    initial = manipulator.initial_positions(np.array(results.points))
    parts = links(manipulator.geometry, initial)
    parts["point"] = [names[k] for k in parts["crane"]]
    points = pd.DataFrame(results.points, columns=["x", "y"]).assign(point=names)
    dot = {"color": style.INK, "fillstyle": "none", "markersize": 5}
    return draw(
        chart,
        Layer(parts, "x", "y", "-", hue="link", group="piece"),
        Layer(points, "x", "y", "o", label="test point", look=dot),
        x=X,
        y=Y,
        panel="point",
        columns=7,
        equal=True,
        height=0.9 + 1.95 * np.ceil(len(names) / 7),
        looks=LINK_LOOKS,
    )


def _errors(results: Results) -> dict[str, Drawing]:
    looks, groups = style.looks(("none", *results.methods), VARIANTS), results.groups
    names = ["none", *groups["published"], *groups["selected"], results.best]
    shown = {name: results.workspace[name] for name in names}
    over_workspace = pd.concat(shown, names=["method"]).reset_index(level="method")
    found = {
        "accuracy_and_cost": accuracy.figure(results.compare()),
        "method_comparison": _comparison(results),
        "error_map": draw(
            plane.maps,
            *(over_workspace, "target_x", "target_y", "error", "method"),
            label="error (mm)",
            scale=MM,
            cell=CELL,
        ),
        "error_distribution": draw(
            kinds.distribution,
            *(over_workspace, "error", "method", Axis("error (mm)", MM, log=True)),
            looks=looks,
        ),
        "tolerance_study": _tolerances(
            results.tolerances, results.published["tolerance_study"], looks
        ),
    }
    for label in (*groups["published"], *groups["selected"], *groups["variants"]):
        found[f"positioning_errors_{label}"] = _positioning_errors(
            results.errors["none"], results.errors[label], label
        )
    cost = results.query_cost().drop(columns="published").dropna()
    return found | ({"query_cost": _cost(cost, looks)} if len(cost) else {})


def _comparison(results: Results) -> Drawing:
    names, axes = list(results.statistics), {}
    compared, rows = results.compared(names), []
    for what in ("mean", "max"):
        axes[what] = Axis(f"{what} R (mm)", log=True)
        values = compared.loc[f"{what}_error"].to_numpy()
        columns = {"ours": values[::2], "published": values[1::2]}
        rows.append(pd.DataFrame({"method": names, "what": what, **columns}))
    return draw(
        kinds.beside,
        *(pd.concat(rows, ignore_index=True), "method", "ours", "published", axes),
        panel="what",
        titles="",
        columns=2,
    )


def _positioning_errors(none: pd.DataFrame, frame: pd.DataFrame, label: str) -> Drawing:
    """Errors without and with compensation at every condition (figure 4.8)."""
    keys = ["point", "payload", "status"]
    before, after = (f.melt(keys, list(ERROR_ROWS), "row", "value") for f in (none, frame))
    reached = after["status"] == REACHED
    names = frame.drop_duplicates("point").set_index("point")[["target_x", "target_y"]]
    grey = {"color": style.GREY, "fillstyle": "none", "markersize": 3.2}
    layers = [Layer(before, "point", "value", "o", label="uncompensated", look=grey)]
    for rows, mark, text in ((after[reached], "o", label), (after[~reached], "x", "failed")):
        if len(rows):
            text += ": {:g} kg"
            layers.append(Layer(rows, "point", "value", mark, hue="payload", label=text))
    return draw(
        kinds.strips,
        *layers,
        category="point",
        names={point: style.coordinates(x, y) for point, x, y in names.itertuples()},
        spread="payload",
        y={row: Axis(text, MM, linear_below=1.0) for row, text in ERROR_ROWS.items()},
        x_label="test point, x and y in m (errors: linear scale below 1 mm, logarithmic above)",
        panel="row",
        titles="",
        columns=1,
        height=8.2,
        looks=style.shades(frame["payload"]),
    )


def _tolerances(ours: pd.DataFrame, theirs: pd.DataFrame, looks: Mapping) -> Drawing:
    """Mean error and iterations against the tolerance of the search (chapter 4)."""
    ours = ours.sort_values("tolerance")
    errors, counts = (ours.assign(panel=panel) for panel in ("error", "iterations"))
    published = theirs.assign(panel="iterations")
    mean, thin = ("tolerance", "mean_iterations"), {"linewidth": 0.7, "markersize": 2.5}
    open_dot, small = {"fillstyle": "none", "markersize": 7}, {"fillstyle": "none"}
    return draw(
        chart,
        Layer(errors, "tolerance", "mean_error", "o-", "method", label="{}, mean"),
        Layer(counts, *mean, "o-", "method", label=""),
        Layer(counts, "tolerance", "max_iterations", "o-", "method", label="", look=thin),
        Layer(published, *mean, "o", "method", label="{}, published", look=open_dot),
        Layer(published, "tolerance", "max_iterations", "o", "method", label="", look=small),
        x=Axis("tolerance (1)", log=True),
        y={
            "error": Axis("mean R (mm)", MM, log=True),
            "iterations": Axis("iterations (1)", log=True, least=1.0),
        },
        panel="panel",
        titles={"error": "", "iterations": "iterations: mean, and largest (thin, small)"},
        columns=2,
        height=4.6,
        looks=looks,
    )


def _cost(cost: pd.DataFrame, looks: Mapping) -> Drawing:
    """Mean error of every method against what a target costs it."""
    counts, alone, batch = (
        cost[["method", "mean R (mm)"]].assign(cost=cost[name], panel=panel)
        for panel, name in (
            ("operations", "operations"),
            ("time", "single (us)"),
            ("time", "batched (us)"),
        )
    )
    time = pd.concat([alone, batch])
    grey, dot = {"color": style.GREY, "linewidth": 0.8, "zorder": 1.5}, {"markersize": 6.5}
    white = dot | {"markerfacecolor": "white"}
    return draw(
        chart,
        Layer(time, "cost", "mean R (mm)", "-", group="method", label="", look=grey),
        Layer(counts, "cost", "mean R (mm)", "o", "method", look=dot),
        Layer(batch, "cost", "mean R (mm)", "o", "method", label="", look=white),
        Layer(alone, "cost", "mean R (mm)", "o", "method", label="", look=dot),
        x={
            "operations": Axis("operations for a target (1)", log=True),
            "time": Axis("time for a target (us)", log=True),
        },
        y=Axis("mean R (mm)", log=True),
        panel="panel",
        panels=("operations", "time"),
        titles={"operations": "", "time": "alone (filled) or in a batch (open)"},
        columns=2,
        height=4.8,
        looks=looks,
    )


def _sizes(results: Results) -> dict[str, Drawing]:
    if not results.studies:
        return {}
    frames = {name: sizes for name, (sizes, _) in results.studies.items()}
    published = {name: results.published_size(name) for name in frames}
    chosen = {name: size for name, (_, size) in results.studies.items()}
    found = {}
    for name, sizes in frames.items():
        tolerance = 100 * results.section.networks[name].select.tolerance  # type: ignore[union-attr]
        rule = f"smallest size within {tolerance:g} %" if tolerance else "size"
        rule = f"Choice: {rule} of the least selection error"
        options = {"chosen": chosen[name], "published": published[name], "titles": rule}
        found[f"size_selection_{name}"] = draw(kinds.sizes, sizes, **options)
    found["size_selections"] = draw(
        kinds.sizes,
        pd.concat([sizes.assign(network=name) for name, sizes in frames.items()]),
        panel="network",
        chosen=chosen,
        published=published,
        titles={
            name: f"{name}\nchosen {size}, published {published[name] or 'none'}"
            for name, size in chosen.items()
        },
        band=False,
    )
    return found


def _race(curves: pd.DataFrame) -> Drawing:
    ends = curves.groupby("trainer", sort=False).tail(1)
    return draw(
        chart,
        Layer(curves, "seconds", "error", "-", "trainer", look={"linewidth": 1.8}),
        Layer(ends, "seconds", "error", "o", "trainer", label="", look={"marker": "o"}),
        x=Axis("time (s)", log=True),
        y=Axis("root mean square error, normalised (1)", log=True),
        looks=style.looks(curves["trainer"].unique()),
        height=5.0,
    )


def _fitting(results: Results) -> Drawing:
    """Networks of several sizes along a slice (figures 2.9 and 2.10)."""
    curves = results.fitting
    line = results.section.studies.fitting
    samples = results.kept[on_line(results.kept, line.jib, line.extension, line.payload)]
    samples = samples.assign(y=samples["tip_y"] - samples["rigid_y"])
    sizes = sorted(curves["n_hidden"].unique())
    titles = {n: f"{n} hidden neurons" for n in sizes}
    if len(sizes) > 1:
        titles[sizes[0]] += ": too few"
        titles[sizes[-1]] += ": too many"
    shown = MM * np.concatenate([curves["model_y"], samples["y"]])
    # the network no further beyond truth and samples than half their range
    allowed = 0.5 * np.ptp(shown)
    network = np.clip(MM * curves["network_y"], shown.min() - allowed, shown.max() + allowed)
    low, high = min(shown.min(), network.min()), max(shown.max(), network.max())
    margin, lift = 0.05 * (high - low) or 1.0, "lift_stroke"
    ink = {"color": style.INK, "linewidth": 1.0}
    red, blue = {"color": style.VERMILION, "linewidth": 1.8}, {"markersize": 4.5}
    held = "grid samples, left out of the training"
    return draw(
        chart,
        Layer(curves, lift, "model_y", "-", label="flexible model", look=ink),
        Layer(curves, lift, "network_y", "-", label="network", look=red),
        Layer(samples, lift, "y", "o", label=held, look=blue),
        x=Axis("lift stroke (m)"),
        y=Axis("vertical deflection (mm)", MM, limits=(low - margin, high + margin)),
        panel="n_hidden",
        panels=sizes,
        titles=titles,
        columns=len(sizes),
        height=3.9,
    )
