"""Figures of the six-joint arm; mm and degrees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.fanuc.parts.tables import COMMANDED_FIELDS, JOINT_FIELDS, array
from flexik.cases.fanuc.report_results import Results, label
from flexik.cases.fanuc.section import EXACT, LOOKED_UP, WHOLE
from flexik.datasets.tables import Field
from flexik.kinematics.serial_arm import frames
from flexik.reporting import kinds, style
from flexik.reporting.chart import Axis, Layer, Rule, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import DEGREES, MM

SHARE = Axis("share of the path's duration (1)")
# Errors below are round-off, mm and degrees
FLOOR = 1e-7
BY_JOINT: dict[str, Any] = {"panel": "joint", "columns": 2, "height": 8.0}
ERRORS = {
    "error": Axis("position error (mm)", MM, log=True, least=FLOOR),
    "orientation_error": Axis("orientation error (deg)", DEGREES, log=True, least=FLOOR),
}


def looks(results: Results) -> dict[Any, dict[str, Any]]:
    """Colour, line and marker of every method, the same in all figures."""
    fixed = {
        WHOLE: {"color": style.ORANGE, "linestyle": "-"},
        EXACT: {"color": style.INK, "linestyle": "-"},
        LOOKED_UP[0]: {"color": style.GREY, "linestyle": ":"},
        LOOKED_UP[1]: {"color": style.GREY, "linestyle": "-"},
    }
    colours = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)
    for k, name in enumerate(results.networks):
        line = style.DASHES[k // len(colours) % len(style.DASHES)]
        look = {"color": colours[k % len(colours)], "linestyle": line, "marker": "+x.*"[k % 4]}
        fixed[name] = look
    return fixed


def trainer_kinds(results: Results) -> list[str]:
    """Kinds of the trainers of the path's networks, each once."""
    return list(dict.fromkeys(_kind(results, name) for name in results.networks))


def _kind(results: Results, name: str) -> str:
    section = results.section
    return section.trainers[section.networks[name].trainer].kind


def figures(results: Results) -> dict[str, Drawing]:
    """All figures."""
    of_kind = {
        kind: [name for name in results.networks if _kind(results, name) == kind]
        for kind in trainer_kinds(results)
    }
    shown = of_kind.get("back_propagation", results.networks)
    return {
        "arm": _arm(results),
        **{f"training_error_{k}": _training(results, names) for k, names in of_kind.items()},
        "path_tracking": _tracking(results, shown),
        "path_tracking_errors": _tracking_errors(results),
        "path_errors": _path_errors(results),
        **{f"study_{name}": _study(results, name) for name in results.studies},
        "off_path": _off_path(results),
        "whole_workspace": _whole_workspace(results),
    }


def _arm(results: Results) -> Drawing:
    """The arm halfway along the path, from the side and from above."""
    path = results.path.sort_values("share")
    middle = array(path, JOINT_FIELDS)[len(path) // 2 : len(path) // 2 + 1]
    found = frames(results.arm, middle)
    links, turn = found.origin[0], found.rotation[0]
    # elbow: where the forearm begins, so that the links are drawn as they are
    elbow = links[3] - results.arm.a[2] * turn[3][:, 0]
    base = np.array([0.0, 0.0, results.arm.d[0]])
    points = np.vstack([links[0], base, links[1:3], elbow, links[3:]])

    def seen(values: np.ndarray) -> pd.DataFrame:
        views = {"from the side": (0, 2), "from above": (0, 1)}
        return pd.concat(
            pd.DataFrame({"view": view, "a": values[:, a], "b": values[:, b]})
            for view, (a, b) in views.items()
        )

    taught = seen(path[["x", "y", "z"]].to_numpy())
    return draw(
        chart,
        Layer(
            taught, "a", "b", look={"color": style.ORANGE, "linewidth": 1.2}, label="taught path"
        ),
        Layer(seen(points), "a", "b", look={"color": style.BLUE, "linewidth": 2.5}, label="arm"),
        Layer(
            seen(links), "a", "b", "o", look={"color": style.INK, "markersize": 3.5}, label="frames"
        ),
        x=Axis("x (m)"),
        y={"from the side": Axis("z (m)"), "from above": Axis("y (m)")},
        panel="view",
        columns=2,
        share="",
        equal=True,
        height=4.2,
    )


def _by_joint(frame: pd.DataFrame, **columns: Sequence[Field]) -> pd.DataFrame:
    """Rows of share and method by joint, with `columns` of all six joints under one name."""
    keep = frame[[name for name in ("share", "method") if name in frame]]
    parts = [
        keep.assign(
            joint=f"joint {k + 1}",
            **{name: frame[fields[k].name] for name, fields in columns.items()},
        )
        for k in range(len(JOINT_FIELDS))
    ]
    return pd.concat(parts)


def _training(results: Results, names: list[str]) -> Drawing:
    """All starts of some networks; the median start in full."""
    keys = ["network", "restart", "joint"]
    curves = results.curves.merge(results.starts[[*keys, "is_median"]], on=keys)
    curves = curves[curves["network"].isin(names)].sort_values([*keys, "iteration"])
    curves["joint"] = "joint " + curves["joint"].astype(str)
    parts = [
        (0, {"linewidth": 0.5, "alpha": 0.35, "marker": ""}, ""),
        (1, {"linewidth": 0.9, "alpha": 0.9, "marker": ""}, "{}"),
    ]
    return draw(
        chart,
        *(
            Layer(rows, "iteration", "training_error", "-", "network", "restart", text, look)
            for median, look, text in parts
            if len(rows := curves[curves["is_median"] == median])
        ),
        x=Axis("passes over the training samples (1)"),
        y=Axis("rms error (% of range)", 100.0, log=True),
        share="x",
        looks=looks(results),
        **BY_JOINT,
    )


def _tracking(results: Results, names: list[str]) -> Drawing:
    rows = results.of("path")
    taught = _by_joint(results.path[results.path["is_test"] == 1], angle=JOINT_FIELDS)
    found = _by_joint(rows[rows["method"].isin(names)], angle=COMMANDED_FIELDS)
    small = {"markersize": 3.0, "markeredgewidth": 0.7}
    return draw(
        chart,
        Layer(
            taught, "share", "angle", look={"color": style.INK, "linewidth": 1.4}, label="taught"
        ),
        Layer(found, "share", "angle", "o", "method", look=small),
        x=SHARE,
        y=Axis("angle (deg)", DEGREES),
        share="x",
        looks=looks(results),
        **BY_JOINT,
    )


def _tracking_errors(results: Results) -> Drawing:
    rows = results.of("path")
    rows = rows[rows["method"].isin(results.section.path_methods)]
    found = _by_joint(rows, angle=COMMANDED_FIELDS, taught=JOINT_FIELDS)
    found = found.assign(error=(found["angle"] - found["taught"]).abs())
    return draw(
        chart,
        Layer(found, "share", "error", "-", "method", look={"linewidth": 0.9, "marker": ""}),
        x=SHARE,
        y=Axis("error (deg)", DEGREES, log=True, least=FLOOR),
        share="x",
        looks=looks(results),
        **BY_JOINT,
    )


def _path_errors(results: Results) -> Drawing:
    rows = results.of("path")
    rows = rows[rows["method"] != EXACT].melt(["share", "method"], list(ERRORS), "kind")
    return draw(
        chart,
        Layer(rows, "share", "value", "-", "method", look={"linewidth": 1.0, "marker": ""}),
        x=SHARE,
        y=ERRORS,
        looks=looks(results),
        titles=dict.fromkeys(ERRORS, ""),
        panel="kind",
        columns=1,
        share="x",
        height=6.0,
    )


def _study(results: Results, varied: str) -> Drawing:
    groups = results.studies[varied].groupby("value")
    errors = groups.agg(
        least=("error_percent", "min"),
        largest=("error_percent", "max"),
        median=("error_percent", "median"),
        training=("training_percent", "median"),
    ).reset_index()
    blue, orange = {"color": style.BLUE, "marker": "o"}, {"color": style.ORANGE, "marker": "s"}
    band = {"color": style.SKY, "alpha": 0.3}
    return draw(
        chart,
        Layer(
            errors,
            "value",
            "least",
            "band",
            to="largest",
            look=band,
            label="total error, all starts",
        ),
        Layer(
            errors,
            "value",
            "median",
            "o-",
            look=blue,
            label="total error on the test samples, median",
        ),
        Layer(
            *(errors, "value", "training", "s--"),
            look=orange,
            label="the same on the training samples, median",
        ),
        x=Axis(
            f"{varied.replace('n_hidden', 'hidden neurons').replace('_', ' ')} (1)",
            log=True,
            ticks=list(errors["value"]),
        ),
        y=Axis("mean absolute error (% of range)", log=True),
        titles=f"joint {getattr(results.section.studies, varied).joint}",
        height=4.0,
    )


def _off_path(results: Results) -> Drawing:
    rows = results.of("off_path")
    rows = rows[rows["method"] != EXACT]
    last = results.n_steps
    means = rows.groupby(["method", "n_steps", "distance"], sort=False)[
        ["error", "orientation_error", "reached"]
    ].mean()
    contents = {
        "mean position error (mm)": ("error", 0, Axis("", MM, log=True)),
        "mean orientation error (deg)": ("orientation_error", 0, Axis("", DEGREES, log=True)),
        "reached after 1 Newton step (%)": ("reached", 1, Axis("", 100.0, limits=(-4.0, 104.0))),
        f"reached after {last} Newton steps (%)": (
            *("reached", last),
            Axis("", 100.0, limits=(-4.0, 104.0)),
        ),
    }
    distances = results.section.conditions.off_path.distances
    table = pd.concat(
        means.xs(n_steps, level="n_steps")[column].rename("value").reset_index().assign(panel=title)
        for title, (column, n_steps, _) in contents.items()
    )
    table["place"] = table["distance"].map(distances.index)
    ticks = {k: f"{MM * distance:g}" for k, distance in enumerate(distances)}
    return draw(
        chart,
        Layer(table, "place", "value", "o-", "method", look={"markersize": 3.5, "marker": "o"}),
        x=Axis("distance from the path (mm)", ticks=ticks),
        y={title: axis for title, (_, _, axis) in contents.items()},
        looks=looks(results),
        panel="panel",
        columns=2,
        share="x",
        height=7.0,
    )


def _whole_workspace(results: Results) -> Drawing:
    rows = results.of("random_poses").melt(["label"], list(ERRORS), "kind", "error_of_kind")
    limits = results.section.success
    # the colour the method has elsewhere, the more steps the darker; none as light as paper
    shades = style.shades(range(-results.n_steps, 3), "Oranges_r")
    colours = {label(WHOLE, k): shades[-k] for k in range(results.n_steps + 1)}
    cut = {"color": style.GREY, "linestyle": "--"}
    return draw(
        kinds.distribution,
        *(rows, "error_of_kind", "label", ERRORS),
        panel="kind",
        what="poses",
        looks=colours | {EXACT: {"color": style.INK}},
        rules=[
            Rule("x", MM * limits.position, "counts as reached", cut, panel="error"),
            Rule("x", DEGREES * limits.orientation, "", cut, panel="orientation_error"),
        ],
        titles=dict.fromkeys(ERRORS, ""),
        columns=2,
        height=4.4,
    )
