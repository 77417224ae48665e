"""Figures of a measuring campaign and of what a few measurements teach (Rouvinen 1999, 4.6)."""

import numpy as np
import pandas as pd

from flexik.cases.crane.report_mechanism import LINK_LOOKS, links
from flexik.kinematics.crane import CraneGeometry, smallest_extension
from flexik.planar.measured.fields import METHODS, TARGET
from flexik.reporting import kinds, style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

TITLES = {"none": "without compensation", "combined": "with compensation"}
# Figures of tables 4.2 and 4.3
NAMED_POINTS = np.array([[3.8, 0.15], [3.8, 0.95]])

MARGIN = 0.6  # m about what is drawn of the working area
RASTER = 0.025  # m between the points that tell the working area


def campaign_figures(
    errors: pd.DataFrame, geometry: CraneGeometry, strokes: np.ndarray, pushes: np.ndarray
) -> dict[str, Drawing]:
    """Figures by name of the frame `errors` of campaign_errors.

    strokes : (k, 3) in m, of the rigid crane at the targets.
    pushes : (k,) whether its jib cylinder pushes there.
    """
    points = errors.drop_duplicates("point")[TARGET].to_numpy()
    columns = [f"{origin}error_{axis}" for origin in ("", "reference_") for axis in "xy"]
    return {
        "measured_points": _points(geometry, strokes, points, pushes),
        **{
            f"measured_{name.replace('error', 'errors')}": _errors(errors, name) for name in columns
        },
        **{
            f"measured_point_{number}": _achieved(errors, target)
            for number, target in enumerate(named_points(points), start=1)
        },
    }


def named_points(points: np.ndarray) -> np.ndarray:
    """The two points of figures 4.24 and 4.25, or the last two where those are not measured."""
    same = [np.isclose(points, point).all(axis=1) for point in NAMED_POINTS]
    there = [points[rows][0] for rows in same if rows.any()]
    return np.array(there) if len(there) == len(same) else points[-2:]


def _points(
    geometry: CraneGeometry, strokes: np.ndarray, points: np.ndarray, pushes: np.ndarray
) -> Drawing:
    """Measured points in the working area, with the crane that reaches them (figure 4.20)."""
    drawn = links(geometry, strokes)
    if not (strokes[:, 2] > 0).any():
        drawn = drawn[drawn["link"] != "extension"]
    corners = drawn[["x", "y"]].to_numpy()
    low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
    lines = (np.arange(a + RASTER / 2, b, RASTER) for a, b in zip(low, high, strict=True))
    raster = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    inside = raster[np.isfinite(smallest_extension(geometry, raster))]
    area = pd.DataFrame(inside, columns=["x", "y"])
    dots = pd.DataFrame(points, columns=["x", "y"]).assign(text=np.arange(1, len(points) + 1))
    does = "jib cylinder pulls", "jib cylinder pushes"
    dots["does"] = np.where(pushes, does[1], does[0])
    pale = {"color": "#F0F0F0", "markersize": 3.6, "markeredgewidth": 0, "zorder": 0}
    looks = {
        does[0]: {"color": style.INK, "markeredgecolor": "white"},
        does[1]: {"color": style.INK, "markerfacecolor": "white"},
    }
    number = {"fontsize": 9.5, "fontweight": "bold", "path_effects": []}
    numbers = [
        Layer(rows, "x", "y", "text", text="text", look=number | {"color": colour})
        for name, colour in ((does[1], style.INK), (does[0], "white"))
        if len(rows := dots[dots["does"] == name])
    ]
    return draw(
        chart,
        Layer(area, "x", "y", "s", label="rigid working area", look=pale),
        Layer(drawn, "x", "y", "-", "link", "piece", look={"alpha": 0.45}),
        # a smaller one for the legend lies below
        Layer(dots, "x", "y", "o", "does", look={"markersize": 9, "zorder": 3.9}),
        Layer(dots, "x", "y", "o", "does", label="", look={"markersize": 15, "zorder": 4}),
        *numbers,
        x=Axis("x (m)", limits=(low[0], high[0])),
        y=Axis("y (m)", limits=(low[1], high[1])),
        looks=looks | LINK_LOOKS,
        equal=True,
        height=7.4,
    )


def _errors(errors: pd.DataFrame, column: str) -> Drawing:
    """Errors of every point, a bar for every payload (figures 4.22 and 4.23)."""
    points = errors.drop_duplicates("point")
    names = {
        row["point"]: f"{row['point'] + 1}\n{style.coordinates(row['target_x'], row['target_y'])}"
        for row in points[["point", *TARGET]].to_dict("records")
    }
    return draw(
        kinds.strips,
        Layer(errors, "point", column, "bars", "payload", label="{:g} kg"),
        category="point",
        names=names,
        spread="payload",
        x_label="measured point, x and y in m",
        rotation=0,
        y=Axis(f"d{column[-1].upper()} (mm)", MM),
        panel="method",
        panels=METHODS,
        titles=TITLES,
        looks=style.shades(errors["payload"]),
        columns=1,
        height=6.2,
    )


def _achieved(errors: pd.DataFrame, target: np.ndarray) -> Drawing:
    """Points reached about one target, from it (figures 4.24 and 4.25)."""
    rows = errors[(errors[TARGET] == target).all(axis=1)]
    rows = rows.assign(x=-rows["error_x"], y=-rows["error_y"])
    layers = []
    for method, mark, face in (("none", "--", {"markerfacecolor": "white"}), ("combined", "-", {})):
        of_method, label = rows[rows["method"] == method], "" if face else "{:g} kg"
        path = {"color": style.GREY, "linewidth": 0.9, "marker": "o", "markersize": 7, **face}
        dot = {"markersize": 8, "markeredgewidth": 1.8, **face}
        layers += [
            Layer(of_method, "x", "y", f"o{mark}", label=TITLES[method], look=path),
            Layer(of_method, "x", "y", "o", "payload", label=label, look=dot),
        ]
    cross = {"color": style.INK, "markersize": 18, "markeredgewidth": 1.6}
    origin = pd.DataFrame({"x": [0.0], "y": [0.0]})
    around = np.vstack([MM * rows[["x", "y"]].to_numpy(), np.zeros(2)])
    middle = (around.min(axis=0) + around.max(axis=0)) / 2
    half = 0.62 * max(float(np.ptp(around, axis=0).max()), 4.0)
    across, up = ((m - half, m + half) for m in middle)
    return draw(
        chart,
        Layer(origin, "x", "y", "+", label="target", look=cross),
        *layers,
        x=Axis("x from the target (mm)", MM, limits=across),
        y=Axis("y from the target (mm)", MM, limits=up),
        looks=style.shades(rows["payload"]),
        titles=f"Points reached about {style.coordinates(*target)} m",
        equal=True,
        width=6.4,
        height=6.6,
    )
