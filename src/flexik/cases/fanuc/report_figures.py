"""Figures of the six-joint arm; mm and degrees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.fanuc.parts.tables import COMMANDED_FIELDS, JOINT_FIELDS, arm_of, array
from flexik.cases.fanuc.report_results import VARIED, Results, label
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
ERRORS = {
    "error": Axis("position error (mm)", MM, log=True, least=FLOOR),
    "orientation_error": Axis("orientation error (deg)", DEGREES, log=True, least=FLOOR),
}
THIN = {"linewidth": 0.9, "marker": ""}
REACHED = Axis("", 100.0, limits=(-4.0, 104.0))


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


def figures(results: Results) -> dict[str, Drawing]:
    """All figures."""
    shown = results.by_trainer.get("back_propagation", results.networks)
    look = looks(results)
    by_joint = {"panel": "joint", "columns": 2, "height": 8.0, "share": "x", "looks": look}
    rows = results.of("path")
    taught = _by_joint(results.path[results.path["is_test"] == 1], angle=JOINT_FIELDS)
    found = _by_joint(rows, angle=COMMANDED_FIELDS, taught=JOINT_FIELDS)
    found["error"] = (found["angle"] - found["taught"]).abs()
    ink, dots = {"color": style.INK, "linewidth": 1.4}, {"markersize": 3.0, "markeredgewidth": 0.7}
    of_path = found[found["method"].isin(results.section.path_methods)]
    ends = rows[rows["method"] != EXACT].melt(["share", "method"], list(ERRORS), "kind")
    return {
        "arm": _arm(results),
        **{
            f"training_error_{kind}": draw(
                chart,
                *_training(results, names),
                x=Axis("passes over the training samples (1)"),
                y=Axis("rms error (% of range)", 100.0, log=True),
                **by_joint,
            )
            for kind, names in results.by_trainer.items()
        },
        "path_tracking": draw(
            chart,
            Layer(taught, "share", "angle", look=ink, label="taught"),
            Layer(found[found["method"].isin(shown)], "share", "angle", "o", "method", look=dots),
            x=SHARE,
            y=Axis("angle (deg)", DEGREES),
            **by_joint,
        ),
        "path_tracking_errors": draw(
            chart,
            Layer(of_path, "share", "error", "-", "method", look=THIN),
            x=SHARE,
            y=Axis("error (deg)", DEGREES, log=True, least=FLOOR),
            **by_joint,
        ),
        "path_errors": draw(
            chart,
            Layer(ends, "share", "value", "-", "method", look=THIN),
            x=SHARE,
            y=ERRORS,
            titles="",
            **by_joint | {"panel": "kind", "columns": 1, "height": 6.0},
        ),
        **{f"study_{name}": _study(results, name) for name in results.studies},
        "off_path": _off_path(results, look),
        "whole_workspace": _whole_workspace(results),
    }


def _arm(results: Results) -> Drawing:
    """The arm halfway along the path, from the side and from above."""
    path, arm = results.path.sort_values("share"), arm_of(results.section.machine.joints)
    middle = array(path, JOINT_FIELDS)[len(path) // 2 : len(path) // 2 + 1]
    found = frames(arm, middle)
    links, turn = found.origin[0], found.rotation[0]
    # elbow: where the forearm begins, so that the links are drawn as they are
    elbow = links[3] - arm.a[2] * turn[3][:, 0]
    base = np.array([0.0, 0.0, arm.d[0]])
    points = np.vstack([links[0], base, links[1:3], elbow, links[3:]])

    def seen(values: np.ndarray) -> pd.DataFrame:
        views = {"from the side": (0, 2), "from above": (0, 1)}
        return pd.concat(
            pd.DataFrame({"view": view, "a": values[:, a], "b": values[:, b]})
            for view, (a, b) in views.items()
        )

    taught, thin = seen(path[["x", "y", "z"]].to_numpy()), {"linewidth": 1.2, "color": style.ORANGE}
    wide, dots = {"linewidth": 2.5}, {"markersize": 3.5, "color": style.INK}
    return draw(
        chart,
        Layer(taught, "a", "b", label="taught path", look=thin),
        Layer(seen(points), "a", "b", label="arm", look=wide),
        Layer(seen(links), "a", "b", "o", label="frames", look=dots),
        x=Axis("x (m)"),
        y={"from the side": Axis("z (m)"), "from above": Axis("y (m)")},
        panel="view",
        share="",
        equal=True,
        height=4.2,
    )


def _by_joint(frame: pd.DataFrame, **columns: Sequence[Field]) -> pd.DataFrame:
    """Rows of share and method by joint, with `columns` of all six joints under one name."""
    keep = frame[[name for name in ("share", "method") if name in frame]]
    parts = (
        keep.assign(joint=f"joint {k + 1}", **{n: frame[of[k].name] for n, of in columns.items()})
        for k in range(len(JOINT_FIELDS))
    )
    return pd.concat(parts)


def _training(results: Results, names: list[str]) -> list[Layer]:
    """All starts of some networks; the median start in full."""
    keys = ["network", "restart", "joint"]
    curves = results.curves.merge(results.starts[[*keys, "is_median"]], on=keys)
    curves = curves[curves["network"].isin(names)].sort_values([*keys, "iteration"])
    curves["joint"] = "joint " + curves["joint"].astype(str)
    pale = {"linewidth": 0.5, "alpha": 0.35, "marker": ""}
    place = ("iteration", "training_error", "-", "network", "restart")
    return [
        Layer(rows, *place, *(("{}", THIN) if is_median else ("", pale)))
        for is_median, rows in curves.groupby("is_median")
    ]


def _study(results: Results, varied: str) -> Drawing:
    errors = results.study_statistics(varied)
    orange, sky = {"color": style.ORANGE}, {"color": style.SKY}
    spread, training = "total error, all starts", "the same on the training samples, median"
    median = "total error on the test samples, median"
    return draw(
        chart,
        Layer(errors, "value", "least", "band", to="largest", look=sky, label=spread),
        Layer(errors, "value", "median", "o-", label=median),
        Layer(errors, "value", "training", "s--", look=orange, label=training),
        x=Axis(f"{VARIED[varied]} (1)", log=True, ticks=list(errors["value"])),
        y=Axis("mean absolute error (% of range)", log=True),
        titles=f"joint {getattr(results.section.studies, varied).joint}",
        height=4.0,
    )


def _off_path(results: Results, look: dict[Any, dict[str, Any]]) -> Drawing:
    rows, last = results.of("off_path"), results.n_steps
    groups = rows[rows["method"] != EXACT].groupby(["method", "n_steps", "distance"], sort=False)
    means = groups[["error", "orientation_error", "reached"]].mean()
    contents = {
        "mean position error (mm)": ("error", 0, Axis("", MM, log=True)),
        "mean orientation error (deg)": ("orientation_error", 0, Axis("", DEGREES, log=True)),
        "reached after 1 Newton step (%)": ("reached", 1, REACHED),
        f"reached after {last} Newton steps (%)": ("reached", last, REACHED),
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
        looks=look,
        panel="panel",
        columns=2,
        height=7.0,
    )


def _whole_workspace(results: Results) -> Drawing:
    rows = results.of("random_poses").melt(["label"], list(ERRORS), "kind", "of_kind")
    limits = results.section.success
    # the colour the method has elsewhere, the more steps the darker; none as light as paper
    shades = style.shades(range(-results.n_steps, 3), "Oranges_r")
    colours = {label(WHOLE, k): shades[-k] for k in range(results.n_steps + 1)}
    cut = {"color": style.GREY, "linestyle": "--"}
    return draw(
        kinds.distribution,
        *(rows, "of_kind", "label", ERRORS),
        panel="kind",
        what="poses",
        looks=colours | {EXACT: {"color": style.INK}},
        rules=[
            Rule("x", MM * limits.position, "counts as reached", cut, "error"),
            Rule("x", DEGREES * limits.orientation, "", cut, "orientation_error"),
        ],
        titles="",
        height=4.4,
    )
