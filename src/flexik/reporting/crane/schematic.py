"""The crane drawn: its links and pins, rigid and bent by its load."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.text import Annotation
from numpy.typing import NDArray

from flexik.kinematics.crane import CraneGeometry, pose
from flexik.reporting import style
from flexik.reporting.style import MM

Array = NDArray[np.float64]
Points = dict[str, Array]

BEAMS = ("pillar", "lift", "jib", "extension")
SHAPE_KEYS = ("strokes", "payload", "exaggeration", "beams", "reference", "tip", "rigid_tip")

# Half of the depth drawn, m; the sections are known by their stiffness, not by their outline
HALF_DEPTH = {"pillar": 0.085, "lift": 0.095, "jib": 0.085, "extension": 0.055}
COLOUR = {
    "pillar": "#5A5A5A",
    "lift": style.BLUE,
    "jib": style.VERMILION,
    "extension": style.ORANGE,
}

# Pins, the beam each one moves with, and where its letter stands (points, in the lift frame)
PINS = {
    "C": ("lift_cylinder_base", "pillar", (14.0, -5.0)),
    "B": ("lift_pivot", "pillar", (-13.0, 8.0)),
    "D": ("lift_cylinder_head", "lift", (16.0, -10.0)),
    "E": ("jib_cylinder_base", "lift", (-3.0, 15.0)),
    "F": ("rocker_pivot", "lift", (-12.0, -14.0)),
    "G": ("jib_pivot", "lift", (8.0, -16.0)),
    "I": ("coupler_pin", "jib", (17.0, 6.0)),
}
HEAD = ("H", (-3.0, 16.0))


def crane(path: Path | str, geometry: CraneGeometry, shape: Mapping[str, Any]) -> None:
    """Draw the loaded crane, deflection enlarged, over its rigid pose.

    Parameters
    ----------
    path
        PNG to write.
    geometry
        Rigid dimensions, m.
    shape
        `strokes` (3,) in m; `payload` in kg; `exaggeration` of the deflection; `beams` and
        `reference`: for each of BEAMS the node positions (k, 2) in m, in equilibrium and rigid;
        `tip` and `rigid_tip` (2,) in m.

    Raises
    ------
    DataError
        If an entry is missing or not finite.
    """
    style.write_png(path, _figure_crane, geometry, shape)


def draw_links(axes: Axes, geometry: CraneGeometry, strokes: Array, width: float = 1.0) -> None:
    """Axes of the rigid links and cylinders at `strokes` (3,) in m; `width` of the beams in points.

    The links are drawn between their pins, as in Rouvinen 1999, figure 4.4.
    """
    pins = {name: np.asarray(p[0]) for name, p in pose(geometry, strokes)._asdict().items()}
    foot = np.array([pins["lift_pivot"][0], 0.0])
    lines = [
        (("foot", "lift_pivot"), COLOUR["pillar"], 1.6),
        (("lift_cylinder_base", "lift_cylinder_head"), style.GREY, 0.7),
        (("jib_cylinder_base", "rocker_head"), style.GREY, 0.7),
        (("lift_pivot", "jib_pivot"), COLOUR["lift"], 1.6),
        (("rocker_pivot", "rocker_head", "coupler_pin"), style.GREEN, 0.7),
        (("jib_pivot", "coupler_pin", "extension_start"), COLOUR["jib"], 1.6),
        (("extension_start", "tip"), COLOUR["extension"], 1.6),
    ]
    for names, colour, weight in lines:
        corners = np.array([foot if name == "foot" else pins[name] for name in names])
        axes.plot(*corners.T, color=colour, linewidth=weight * width, solid_capstyle="round")


def _figure_crane(geometry: CraneGeometry, shape: Mapping[str, Any]) -> Figure:
    style.require("crane shape", shape, SHAPE_KEYS)
    for key in ("beams", "reference"):
        style.require(f"crane shape, {key}", shape[key], BEAMS)
        style.finite(f"crane shape, {key}", {beam: shape[key][beam] for beam in BEAMS})
    numbers = ("strokes", "payload", "exaggeration", "tip", "rigid_tip")
    style.finite("crane shape", {key: shape[key] for key in numbers})
    reference = {name: np.asarray(shape["reference"][name], dtype=float) for name in BEAMS}
    bent = {
        name: nodes + float(shape["exaggeration"]) * (np.asarray(shape["beams"][name]) - nodes)
        for name, nodes in reference.items()
    }
    strokes = np.asarray(shape["strokes"], dtype=float)
    rigid_pins = _rigid_pins(geometry, strokes)
    pins = _carry_pins(rigid_pins, reference, bent)

    weight = bent["extension"][-1] - [0.0, 0.35]
    extent = _extent([*reference.values(), *bent.values(), *rigid_pins.values(), weight])
    size = extent[1] - extent[0]
    height = float(np.clip((style.WIDTH - 0.7) * size[1] / size[0] + 1.1, 3.5, 9.0))
    figure = Figure(figsize=(style.WIDTH, height))
    axes = figure.add_subplot()
    style.plane(axes)
    axes.set_xlim(extent[0, 0], extent[1, 0])
    axes.set_ylim(extent[0, 1], extent[1, 1])

    _draw_rigid(axes, reference, rigid_pins)
    _draw_ground(axes, bent["pillar"][0])
    _draw_cylinders(axes, geometry, pins)
    _draw_beams(axes, bent, pins)
    _draw_pads(axes, bent)
    lift_angle = float(pose(geometry, strokes).lift_angle[0])
    _label_pins(axes, pins, lift_angle)
    _label_links(axes, bent, pins, strokes, lift_angle)
    _draw_tip(axes, reference["extension"][-1], bent["extension"][-1], float(shape["payload"]))
    axes.set_title(_title(shape))
    return figure


def _title(shape: Mapping[str, Any]) -> str:
    x, y = MM * (np.asarray(shape["tip"]) - np.asarray(shape["rigid_tip"]))
    sideways = f"{abs(x):.1f} mm {'forward' if x >= 0 else 'back'}"
    vertical = f"{abs(y):.1f} mm {'up' if y > 0 else 'down'}"
    return (
        f"Log crane with {shape['payload']:g} kg at its tip, in static equilibrium\n"
        f"Tip deflection {np.hypot(x, y):.1f} mm ({sideways}, {vertical}); "
        f"drawn {shape['exaggeration']:g} times larger; grey: rigid"
    )


def _rigid_pins(geometry: CraneGeometry, strokes: Array) -> Points:
    rigid = pose(geometry, strokes)._asdict()
    names = {letter: field for letter, (field, _, _) in PINS.items()} | {HEAD[0]: "rocker_head"}
    return {letter: np.asarray(rigid[field][0]) for letter, field in names.items()}


def _carry_pins(rigid: Points, reference: Points, bent: Points) -> Points:
    """Pins moved with their beams; H keeps the lengths of its rods to first order."""
    pins = {
        letter: _carry(reference[beam], bent[beam], rigid[letter])
        for letter, (_, beam, _) in PINS.items()
    }
    rods = np.array([rigid["H"] - rigid["F"], rigid["H"] - rigid["I"]])
    ends = np.array([pins["F"] - rigid["F"], pins["I"] - rigid["I"]])
    return pins | {"H": rigid["H"] + np.linalg.solve(rods, np.sum(rods * ends, axis=1))}


def _carry(reference: Array, bent: Array, point: Array) -> Array:
    """Move `point` (2,) with the nearest segment of a polyline (k, 2), as if fixed to it."""
    start, along = reference[:-1], np.diff(reference, axis=0)
    share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    feet = start + share[:, None] * along
    k = int(np.argmin(np.hypot(*(point - feet).T)))
    moved = bent[k] + share[k] * (bent[k + 1] - bent[k])
    turn = np.subtract(*(np.arctan2(d[1], d[0]) for d in (bent[k + 1] - bent[k], along[k])))
    c, s = np.cos(turn), np.sin(turn)
    return moved + np.array([[c, -s], [s, c]]) @ (point - feet[k])


def _extent(shapes: list[Array]) -> Array:
    """Lower left and upper right corner (2, 2) of all points, with room for labels, m."""
    points = np.concatenate([np.atleast_2d(shape) for shape in shapes])
    room = np.array([[-0.95, -0.5], [0.9, 0.9]])
    return np.array([points.min(axis=0), points.max(axis=0)]) + room


def _outline(axis: Array, half: float) -> Array:
    """Outline (2k, 2) of a beam of depth 2 `half` along the polyline `axis` (k, 2)."""
    tangent = np.gradient(axis, axis=0)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    normal = half * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.concatenate([axis + normal, (axis - normal)[::-1]])


def _draw_rigid(axes: Axes, reference: Points, pins: Points) -> None:
    for name in BEAMS:
        outline = _outline(reference[name], HALF_DEPTH[name])
        axes.add_patch(Polygon(outline, facecolor="#F0F0F0", edgecolor=style.GREY, linewidth=0.8))
    for letters in ("CD", "EH", "FHI"):
        corners = np.array([pins[letter] for letter in letters])
        axes.plot(*corners.T, color=style.GREY, linewidth=0.8, zorder=1)


def _draw_beams(axes: Axes, bent: Points, pins: Points) -> None:
    for name in BEAMS:
        colour, layer = COLOUR[name], 3.0 if name != "extension" else 2.8
        for letter, (_, beam, _) in PINS.items():
            if beam == name or (name == "jib" and letter == "G"):
                _lug(axes, bent[name], pins[letter], colour, layer)
        axes.add_patch(
            Polygon(
                _outline(bent[name], HALF_DEPTH[name]),
                facecolor=colour,
                edgecolor="white",
                linewidth=0.6,
                zorder=layer,
            )
        )
    hidden = np.concatenate([bent["extension"][:1], bent["jib"][-1:]])
    axes.plot(*hidden.T, color="white", linewidth=1.0, linestyle=(0, (5, 4)), zorder=3.1)


def _lug(axes: Axes, axis: Array, pin: Array, colour: str, layer: float) -> None:
    """Draw the rigid arm from a beam's axis to a pin beside it."""
    fine = np.column_stack(
        [np.interp(np.linspace(0, len(axis) - 1, 400), np.arange(len(axis)), c) for c in axis.T]
    )
    foot = fine[np.argmin(np.hypot(*(fine - pin).T))]
    axes.plot(*np.array([foot, pin]).T, color=colour, linewidth=9, zorder=layer - 0.1)


def _draw_cylinders(axes: Axes, geometry: CraneGeometry, pins: Points) -> None:
    for base, head, barrel in (
        ("C", "D", 0.9 * geometry.lift_cylinder_length),
        ("E", "H", 0.9 * geometry.jib_cylinder_length),
    ):
        start, end = pins[base], pins[head]
        along = (end - start) / np.hypot(*(end - start))
        axes.plot(*np.array([start, end]).T, color="#A6A6A6", linewidth=4, zorder=4)
        middle = np.array([start, start + barrel * along])
        axes.plot(*middle.T, color="#3D3D3D", linewidth=8, zorder=4.1, solid_capstyle="butt")
    rods = np.array([pins[letter] for letter in "FHI"])
    axes.plot(*rods.T, color=style.GREEN, linewidth=6, zorder=4.2, solid_joinstyle="round")


def _draw_pads(axes: Axes, bent: Points) -> None:
    """Mark the extension's rear end and the jib's front end, where the two touch."""
    for end in (bent["extension"][0], bent["jib"][-1]):
        axes.plot(*end, marker="s", markersize=7, color="white", zorder=5)
        axes.plot(*end, marker="s", markersize=4.5, color=style.INK, zorder=5.1)


def _draw_ground(axes: Axes, foot: Array) -> None:
    """Ground at the flange, and the torsion spring that holds the pillar."""
    turns = np.linspace(0.0, 5 * np.pi, 200)
    radius = 0.012 + 0.013 * turns
    spiral = foot + np.column_stack([radius * np.cos(turns), radius * np.sin(turns)])
    axes.plot(*spiral.T, color=style.PURPLE, linewidth=2, zorder=6)
    left, right = foot[0] - 0.55, foot[0] + 0.55
    low = foot[1] - 0.24
    axes.plot([left, right], [low, low], color=style.INK, linewidth=1.4, zorder=2)
    for x in np.linspace(left + 0.1, right, 10):
        axes.plot([x, x - 0.1], [low, low - 0.12], color=style.INK, linewidth=0.8, zorder=2)


def _draw_tip(axes: Axes, rigid: Array, bent: Array, payload: float) -> None:
    axes.annotate(
        "",
        tuple(bent),
        tuple(rigid),
        arrowprops={"arrowstyle": "-|>", "color": style.INK, "linewidth": 1.4, "shrinkB": 4},
        zorder=7,
    )
    axes.add_patch(Circle(tuple(rigid), 0.05, facecolor="white", edgecolor=style.INK, zorder=7))
    axes.add_patch(Circle(tuple(bent), 0.05, color=style.INK, zorder=7))
    _text(axes, "rigid tip", rigid, (9.0, 7.0), "left")
    _text(axes, "loaded tip", bent, (11.0, 2.0), "left")
    weight = _text(axes, f"{payload:g} kg", bent, (0.0, -32.0), "center", leader=True)
    weight.set_path_effects([])
    weight.set_bbox({"boxstyle": "square,pad=0.4", "facecolor": style.PALE, "edgecolor": style.INK})


def _label_pins(axes: Axes, pins: Points, lift_angle: float) -> None:
    offsets = {letter: offset for letter, (_, _, offset) in PINS.items()} | dict([HEAD])
    for letter, offset in offsets.items():
        axes.add_patch(
            Circle(tuple(pins[letter]), 0.036, facecolor="white", edgecolor=style.INK, zorder=6)
        )
        offset = offset if letter in "BC" else _turned(lift_angle, offset)
        _text(axes, letter, pins[letter], offset, "center", 10.5)


def _turned(angle: float, offset: tuple[float, float]) -> tuple[float, float]:
    c, s = np.cos(angle), np.sin(angle)
    return (c * offset[0] - s * offset[1], s * offset[0] + c * offset[1])


def _label_links(axes: Axes, bent: Points, pins: Points, strokes: Array, lift_angle: float) -> None:
    over_lift = _turned(lift_angle, (-24.0, 44.0))
    lift, jib, extension = (f"{MM * s:.0f} mm" for s in strokes)
    outer = (bent["jib"][-1] + bent["extension"][-1]) / 2
    labels = [
        ("pillar", bent["pillar"][[0, -1]].mean(axis=0), (-40.0, 0.0), "right"),
        ("ground spring", bent["pillar"][0], (50.0, 0.0), "left"),
        ("lift arm", 0.4 * pins["B"] + 0.6 * pins["G"], (12.0, -30.0), "left"),
        (f"lift cylinder\nstroke {lift}", (pins["C"] + pins["D"]) / 2, (28.0, -8.0), "left"),
        (f"jib cylinder\nstroke {jib}", 0.6 * pins["E"] + 0.4 * pins["H"], over_lift, "right"),
        ("rocker", (pins["F"] + pins["H"]) / 2, (-40.0, 45.0), "right"),
        ("coupler", (pins["H"] + pins["I"]) / 2, (34.0, 34.0), "left"),
        ("jib", (bent["extension"][0] + bent["jib"][-1]) / 2, (-28.0, -34.0), "right"),
        ("rear pad", bent["extension"][0], (4.0, 46.0), "center"),
        ("front pad", bent["jib"][-1], (20.0, 34.0), "left"),
        (f"extension\nstroke {extension}", outer, (-20.0, -44.0), "right"),
    ]
    for text, point, offset, side in labels:
        _text(axes, text, point, offset, side, leader=True)


def _text(
    axes: Axes,
    text: str,
    point: Array,
    offset: tuple[float, float],
    side: str,
    size: float = 9.5,
    leader: bool = False,
) -> Annotation:
    """Write `text` beside `point`, `offset` points away, on a white halo."""
    arrow = {"arrowstyle": "-", "color": style.GREY, "linewidth": 0.8, "shrinkA": 1, "shrinkB": 0}
    note = axes.annotate(
        text,
        tuple(point),
        offset,
        textcoords="offset points",
        ha=side,
        va="center",
        fontsize=size,
        zorder=8,
        arrowprops=arrow if leader else None,
    )
    note.set_path_effects([effects.withStroke(linewidth=3, foreground="white")])
    return note
