"""Figures of the SmartEE's report."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from flexik.cases.smartee.parts.poses import geometry_of, in_box
from flexik.cases.smartee.report_results import GOALS, QUANTITIES, STEPS, Results
from flexik.cases.smartee.section import (
    CENTRE,
    OUTSIDE,
    PREVIOUS,
    PUBLISHED,
    RANDOM,
    VALIDATION,
)
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
    looks = style.looks(results.section.methods)
    return {
        "mechanism": mechanism(results),
        **{f"{quantity}_errors": pose_errors(results, quantity, looks) for quantity in QUANTITIES},
        "starts": starts(results),
        "newton_steps": newton_steps(results),
        "outside": outside(results),
        "sizes": draw(
            kinds.sizes,
            results.sizes,
            panel="poses",
            titles={name: f"learnt from {name}" for name in results.section.studies.sizes.poses},
            published=dict.fromkeys(
                results.section.studies.sizes.poses,
                results.section.networks[PUBLISHED].sizes[0][0],
            ),
            x_label="hidden neurons M (1)",
        ),
    }


def pose_errors(results: Results, quantity: str, looks: dict) -> Drawing:
    """Errors over the validation poses, a line a network, and the published peak."""
    frame = pd.concat(results.groups[name, 0, VALIDATION] for name in GOALS)
    peak = Rule("y", MM * results.published[quantity], "published peak")
    return draw(
        chart,
        Layer(
            frame.assign(number=frame["point"] + 1)[["number", "method", QUANTITIES[quantity]]],
            "number",
            QUANTITIES[quantity],
            "-",
            hue="method",
            look={"linewidth": 1.0},
        ),
        x=Axis("validation pose", integer=True),
        y=Axis(LABELS[quantity], MM, limits=(0.0, None)),
        looks=looks,
        rules=[peak],
        height=3.6,
    )


def starts(results: Results) -> Drawing:
    """Share of the starts that end below each error, a panel a spread, a line a trainer."""
    given = results.section.studies.starts
    return draw(
        kinds.distribution,
        results.starts[["trainer", "spread", "error"]],
        "error",
        "trainer",
        Axis("mean squared error, normalised (1)", log=True),
        what="starts",
        panel="spread",
        of_all=True,
        titles={spread: f"starts {spread}" for spread in given.spreads},
        looks=style.looks(given.trainers),
        rules=[Rule("x", given.success, "success")],
        share="xy",
        columns=2,
    )


def newton_steps(results: Results) -> Drawing:
    """Peak elbow error against Newton steps, a line for every place to start from."""
    conditions = results.section.conditions
    lines = [(name, RANDOM, f"from {name}, random poses") for name in (CENTRE, *GOALS)]
    for name, poses in conditions.items():
        if poses.kind == "path":
            label = f"from the previous of {poses.n_samples} samples of the path"
            lines.append((PREVIOUS, name, label))
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
    tables = {
        name if n_steps == 0 else f"{name} + {n_steps} steps": results.groups[
            name, n_steps, OUTSIDE
        ]
        for name in GOALS
        for n_steps in (0, STEPS)
    }
    largest = max(table["extent"].max() for table in tables.values())
    edges = np.linspace(0.0, largest, N_BINS + 1)
    rows = []
    for name, table in tables.items():
        bins = np.clip(np.digitize(table["extent"], edges) - 1, 0, N_BINS - 1)
        found = table["error"].groupby(bins).agg(["median", "max"]).reset_index(names="bin")
        middles = 0.5 * (edges[1:] + edges[:-1])[found["bin"]]
        rows.append(found.assign(method=name, extent=middles))
    frame = pd.concat(rows)
    return draw(
        chart,
        Layer(frame, "extent", "median", "-", hue="method", label="{}, median"),
        Layer(frame, "extent", "max", ":", hue="method", label="{}, peak"),
        x=Axis("extent of the pose (1: the edge of the box)", limits=(0.0, largest)),
        y=Axis("elbow error (rad)", log=True, least=LEAST),
        looks={name: {"color": c} for name, c in zip(tables, style.COLOURS, strict=False)},
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
    layers = []
    for leg in range(N_LEGS):
        turn = (joints[0, leg, 2] + np.linspace(-ARC, ARC, 61))[:, None]
        circle = np.cos(turn) * circles.along[0, leg] + np.sin(turn) * circles.across[0, leg]
        circle = elbows[leg] + circles.radius * circle
        layers.append(_line(circle, "", "--", style.GREY, 1.0))
        for ends, colour, name in (
            ((bases[leg], elbows[leg]), style.BLUE, "first link"),
            ((elbows[leg], tips[leg]), style.ORANGE, "second link"),
        ):
            layers.append(_line(ends, name if leg == 0 else "", "-", colour, 4.0))
    for ring, colour, name in ((bases, style.GREY, "base"), (tips, style.GREEN, "plate")):
        layers.append(_line([*ring, ring[0]], name, "-", colour, 2.0))
    for points, colour, name in (
        (bases, style.BLUE, "pitch and roll, actuated"),
        (elbows, style.INK, "elbow, passive"),
        (tips, style.GREEN, "ball joint"),
    ):
        layers.append(_line(points, name, "o", colour, 6.0))
    return draw(plane.space, *layers)


def _line(
    points: Sequence[np.ndarray] | np.ndarray, label: str, mark: str, colour: str, size: float
) -> Layer:
    frame = pd.DataFrame(np.array(points), columns=["x", "y", "z"])
    look = {"color": colour, "markersize" if mark == "o" else "linewidth": size}
    return Layer(frame, "x", "y", mark, label=label, look=look)
