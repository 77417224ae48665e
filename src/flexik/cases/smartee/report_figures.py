"""Figures of the SmartEE's report."""

import itertools
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee.parts.poses import geometry_of, in_box
from flexik.cases.smartee.report_results import GOALS, QUANTITIES, STEPS, Results
from flexik.cases.smartee.section import CENTRE, OUTSIDE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.kinematics.smartee import (
    N_LEGS,
    base_points,
    elbow_circles,
    inverse,
    leg_tips,
    rotation_zyz,
)
from flexik.reporting import kinds, plane, style
from flexik.reporting.chart import Axis, Layer, Rule, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

LABELS = {
    "elbow": "norm of the elbow errors (mrad)",
    "position": "position error (mm)",
    "orientation": "norm of the orientation errors (mrad)",
}
# Errors below are rounding and drawn here, rad
LEAST = 1e-15
# Pose of the picture, in half extents of the box: x, y, z, ZYZ angles
DRAWN = np.array([[1.0, 0.5, 0.5, 0.0, 1.0, 0.0]])
ARC = 0.6  # rad of the tip circle drawn to each side
N_BINS = 20  # of the extent


def figures(results: Results) -> dict[str, Drawing]:
    """Figures by name."""
    given = results.section.studies.starts
    sizes, published = results.section.studies.sizes.poses, results.section.networks[PUBLISHED]
    return {
        "mechanism": mechanism(results),
        **{f"{quantity}_errors": pose_errors(results, quantity) for quantity in QUANTITIES},
        "starts": draw(
            kinds.distribution,
            *(results.starts[["trainer", "spread", "error"]], "error", "trainer"),
            Axis("mean squared error, normalised (1)", log=True),
            what="starts",
            panel="spread",
            of_all=True,
            titles={spread: f"starts {spread}" for spread in given.spreads},
            rules=[Rule("x", given.success, "success")],
            share="xy",
            columns=2,
        ),
        "newton_steps": newton_steps(results),
        "outside": outside(results),
        "sizes": draw(
            kinds.sizes,
            results.sizes,
            panel="poses",
            titles={name: f"learnt from {name}" for name in sizes},
            published=dict.fromkeys(sizes, published.sizes[0][0]),
            x_label="hidden neurons M (1)",
        ),
    }


def pose_errors(results: Results, quantity: str) -> Drawing:
    """Errors over the validation poses, a line a network, and the published peak."""
    frame = pd.concat(results.groups[name, 0, VALIDATION] for name in GOALS)
    frame = frame.assign(number=frame["point"] + 1)[["number", "method", QUANTITIES[quantity]]]
    return draw(
        chart,
        Layer(frame, "number", QUANTITIES[quantity], "-", "method", look={"linewidth": 1.0}),
        x=Axis("validation pose", integer=True),
        y=Axis(LABELS[quantity], MM, limits=(0.0, None)),
        rules=[Rule("y", MM * results.published[quantity], "published peak")],
        height=3.6,
    )


def newton_steps(results: Results) -> Drawing:
    """Peak elbow error against Newton steps, a line for every place to start from."""
    lines = [(name, RANDOM, f"from {name}, random poses") for name in (CENTRE, *GOALS)]
    lines += [
        (PREVIOUS, name, f"from the previous of {poses.n_samples} samples of the path")
        for name, poses in results.section.conditions.items()
        if poses.kind == "path"
    ]
    frame = pd.DataFrame(
        {"start": label, "n_steps": n_steps, "error": results.peak(method, n_steps, name)}
        for method, name, label in lines
        for n_steps in results.section.methods[method].n_steps
    )
    return draw(
        chart,
        Layer(frame.dropna(), "n_steps", "error", "o-", hue="start", look={"markersize": 5.0}),
        x=Axis("Newton steps", integer=True),
        y=Axis("peak elbow error (rad)", log=True, least=LEAST),
    )


def outside(results: Results) -> Drawing:
    """Elbow error against the extent of the pose: median and peak in each of N_BINS."""
    tables = {}
    for name in GOALS:
        tables[name] = results.groups[name, 0, OUTSIDE]
        tables[f"{name} + {STEPS} steps"] = results.groups[name, STEPS, OUTSIDE]
    rows = pd.concat(table.assign(method=name) for name, table in tables.items())
    largest = rows["extent"].max()
    edges = np.linspace(0.0, largest, N_BINS + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    rows["extent"] = middles[np.clip(np.digitize(rows["extent"], edges) - 1, 0, N_BINS - 1)]
    errors = rows.groupby(["method", "extent"], sort=False)["error"]
    frame = errors.agg(["median", "max"]).reset_index().sort_values("extent", kind="stable")
    return draw(
        chart,
        Layer(frame, "extent", "median", "-", hue="method", label="{}, median"),
        Layer(frame, "extent", "max", ":", hue="method", label="{}, peak"),
        x=Axis("extent of the pose (1: the edge of the box)", limits=(0.0, largest)),
        y=Axis("elbow error (rad)", log=True, least=LEAST),
        rules=[Rule("x", 1.0, look={"color": style.GREY, "linestyle": "--", "linewidth": 1.0})],
        height=4.6,
    )


def mechanism(results: Results) -> Drawing:
    """Legs, plate and arcs of the tip circles in a pose, after figure 2 of the paper."""
    geometry = geometry_of(results.section.machine)
    pose = in_box(results.section.samples.box, DRAWN)
    joints = inverse(geometry, pose[:, :3], rotation_zyz(pose[:, 3:])).joints
    circles = elbow_circles(geometry, joints[..., :2])
    tips, elbows = leg_tips(circles, joints[..., 2])[0], circles.centre[0]
    bases = base_points(geometry)
    lines = []
    for leg in range(N_LEGS):
        turn = (joints[0, leg, 2] + np.linspace(-ARC, ARC, 61))[:, None]
        circle = np.cos(turn) * circles.along[0, leg] + np.sin(turn) * circles.across[0, leg]
        first, second = ("first link", "second link") if leg == 0 else ("", "")
        lines += [
            (elbows[leg] + circles.radius * circle, "", "--", style.GREY, 1.0),
            ([bases[leg], elbows[leg]], first, "-", style.BLUE, 4.0),
            ([elbows[leg], tips[leg]], second, "-", style.ORANGE, 4.0),
        ]
    lines += [
        ([*bases, bases[0]], "base", "-", style.GREY, 2.0),
        ([*tips, tips[0]], "plate", "-", style.GREEN, 2.0),
        (bases, "pitch and roll, actuated", "o", style.BLUE, 6.0),
        (elbows, "elbow, passive", "o", style.INK, 6.0),
        (tips, "ball joint", "o", style.GREEN, 6.0),
    ]
    return draw(plane.space, *itertools.starmap(_line, lines))


def _line(points: Any, label: str, mark: str, colour: str, size: float) -> Layer:
    frame = pd.DataFrame(np.array(points), columns=["x", "y", "z"])
    look = {"color": colour, "markersize" if mark == "o" else "linewidth": size}
    return Layer(frame, "x", "y", mark, label=label, look=look)
