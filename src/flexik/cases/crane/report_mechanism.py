"""The crane drawn: links and pins of rigid poses, and the loaded crane over its rigid pose."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.kinematics.crane import pose
from flexik.machines.crane import CraneGeometry
from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

Array = NDArray[np.float64]
Points = dict[str, Array]

BEAMS = ("pillar", "lift", "jib", "extension")
# Half of the depth drawn, m; the sections are known by their stiffness, not by their outline
HALF_DEPTH = {"pillar": 0.085, "lift": 0.095, "jib": 0.085, "extension": 0.055}
COLOUR = dict(zip(BEAMS, ("#5A5A5A", style.BLUE, style.VERMILION, style.ORANGE), strict=True))
# Colour and width of the links, and the corners that they are drawn through
LINK_LOOKS = {
    "pillar": {"color": COLOUR["pillar"], "linewidth": 1.6},
    "cylinder": {"color": style.GREY, "linewidth": 0.7},
    "lift arm": {"color": COLOUR["lift"], "linewidth": 1.6},
    "rocker, coupler": {"color": style.GREEN, "linewidth": 0.7},
    "jib": {"color": COLOUR["jib"], "linewidth": 1.6},
    "extension": {"color": COLOUR["extension"], "linewidth": 1.6},
}
LINKS = (
    ("pillar", "foot lift_pivot"),
    ("cylinder", "lift_cylinder_base lift_cylinder_head"),
    ("cylinder", "jib_cylinder_base rocker_head"),
    ("lift arm", "lift_pivot jib_pivot"),
    ("rocker, coupler", "rocker_pivot rocker_head coupler_pin"),
    ("jib", "jib_pivot coupler_pin extension_start"),
    ("extension", "extension_start tip"),
)

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
ROOM = np.array([[-0.95, -0.5], [0.9, 0.9]])  # about all points, for labels, m


def links(geometry: CraneGeometry, strokes: Array) -> pd.DataFrame:
    """Axes of links and cylinders at `strokes` (k, 3) in m, drawn between their pins.

    Columns crane (number of the strokes), link (of LINK_LOOKS), piece, x, y in m; as in Rouvinen
    1999, figure 4.4.
    """
    pins = {name: np.asarray(places) for name, places in pose(geometry, strokes)._asdict().items()}
    pins["foot"] = np.column_stack([pins["lift_pivot"][:, 0], np.zeros(len(strokes))])
    rows = [
        {"crane": k, "link": link, "piece": f"{k} {piece}", "x": x, "y": y}
        for k in range(len(strokes))
        for piece, (link, corners) in enumerate(LINKS)
        for x, y in (pins[corner][k] for corner in corners.split())
    ]
    return pd.DataFrame(rows)


def crane(geometry: CraneGeometry, shape: Mapping[str, Any]) -> Drawing:
    """The loaded crane, deflection enlarged, over its rigid pose.

    shape : strokes (3,) in m; payload in kg; exaggeration of the deflection; beams and reference:
        for each of BEAMS the nodes (k, 2) in m, in equilibrium and rigid; tip, rigid_tip (2,) in m.
    """
    reference = {name: np.asarray(shape["reference"][name], dtype=float) for name in BEAMS}
    bent = {
        name: nodes + float(shape["exaggeration"]) * (np.asarray(shape["beams"][name]) - nodes)
        for name, nodes in reference.items()
    }
    strokes, rigid_tip = np.asarray(shape["strokes"], dtype=float), reference["extension"][-1]
    posed = pose(geometry, strokes[None])
    names = {letter: field for letter, (field, _, _) in PINS.items()} | {"H": "rocker_head"}
    rigid = {letter: np.asarray(getattr(posed, field)[0]) for letter, field in names.items()}
    pins, angle = _carry_pins(rigid, reference, bent), float(posed.lift_angle[0])
    every = [*reference.values(), *bent.values(), np.array(list(rigid.values()))]
    every.append(bent["extension"][-1:] - [0.0, 0.35])  # the weight
    low, high = (f(np.concatenate(every), axis=0) for f in (np.min, np.max))
    low, high = low + ROOM[0], high + ROOM[1]
    height = float(np.clip((style.WIDTH - 0.7) * (high - low)[1] / (high - low)[0] + 1.1, 3.5, 9.0))
    return draw(
        chart,
        *_rigid(reference, rigid),
        *_ground(bent["pillar"][0]),
        *_beams(bent, pins),
        *_cylinders(geometry, pins),
        *_ends([rigid_tip, bent["extension"][-1]], bent, pins),
        _texts([("rigid tip", rigid_tip, (9.0, 7.0), "left")]),
        *_labels(bent, pins, strokes, angle, float(shape["payload"])),
        x=Axis("x (m)", limits=(low[0], high[0])),
        y=Axis("y (m)", limits=(low[1], high[1])),
        equal=True,
        height=height,
        titles=_title(shape),
    )


def _title(shape: Mapping[str, Any]) -> str:
    x, y = MM * (np.asarray(shape["tip"]) - np.asarray(shape["rigid_tip"]))
    sideways = f"{abs(x):.1f} mm {'forward' if x >= 0 else 'back'}"
    vertical = f"{abs(y):.1f} mm {'up' if y > 0 else 'down'}"
    return (
        f"Log crane with {shape['payload']:g} kg at its tip, in static equilibrium. "
        f"Tip deflection {np.hypot(x, y):.1f} mm ({sideways}, {vertical}); "
        f"drawn {shape['exaggeration']:g} times larger; grey: rigid"
    )


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
    return moved + _turned(float(turn), point - feet[k])


def _turned(angle: float, vector: Any) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ np.asarray(vector)


def _outline(axis: Array, half: float) -> Array:
    """Outline (2k, 2) of a beam of depth 2 `half` along the polyline `axis` (k, 2)."""
    tangent = np.gradient(axis, axis=0)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    normal = half * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.concatenate([axis + normal, (axis - normal)[::-1]])


def _layer(points: Any, mark: str, **look: Any) -> Layer:
    frame = pd.DataFrame(np.asarray(points, dtype=float), columns=["x", "y"])
    return Layer(frame, "x", "y", mark, label="", look=look)


def _rigid(reference: Points, pins: Points) -> list[Layer]:
    grey = {"color": "#F0F0F0", "edgecolor": style.GREY, "linewidth": 0.8, "zorder": 1}
    bodies = [_layer(_outline(reference[b], HALF_DEPTH[b]), "area", **grey) for b in BEAMS]
    rods = [[pins[letter] for letter in letters] for letters in ("CD", "EH", "FHI")]
    return bodies + [_layer(r, "-", color=style.GREY, linewidth=0.8, zorder=1) for r in rods]


def _ground(foot: Array) -> list[Layer]:
    """Ground at the flange, and the torsion spring that holds the pillar."""
    turns = np.linspace(0.0, 5 * np.pi, 200)[:, None]
    spiral = foot + (0.012 + 0.013 * turns) * np.hstack([np.cos(turns), np.sin(turns)])
    left, low = foot - [0.55, 0.24]
    hatch = [[[x, low], [x - 0.1, low - 0.12]] for x in np.linspace(left + 0.1, left + 1.1, 10)]
    lines = [[[left, low], [left + 1.1, low]], *hatch]
    ground = [_layer(line, "-", linewidth=1.0, color=style.INK, zorder=2) for line in lines]
    return [_layer(spiral, "-", color=style.PURPLE, linewidth=2, zorder=6), *ground]


def _beams(bent: Points, pins: Points) -> list[Layer]:
    """Beams, and the rigid arms from their axes to pins beside them."""
    found = []
    for name in BEAMS:
        look, layer = {"color": COLOUR[name]}, 2.8 if name == "extension" else 3.0
        for letter, (_, beam, _) in PINS.items():
            if beam == name or (name == "jib" and letter == "G"):
                arm = [_nearest(bent[name], pins[letter]), pins[letter]]
                found.append(_layer(arm, "-", linewidth=9, zorder=layer - 0.1, **look))
        outline = _outline(bent[name], HALF_DEPTH[name])
        found.append(_layer(outline, "area", zorder=layer, **look))
    dashed = {"color": "white", "linewidth": 1.0, "linestyle": (0, (5, 4)), "zorder": 3.1}
    return [*found, _layer([bent["extension"][0], bent["jib"][-1]], "-", **dashed)]


def _nearest(axis: Array, pin: Array) -> Array:
    fine = np.linspace(0, len(axis) - 1, 400)
    points = np.column_stack([np.interp(fine, np.arange(len(axis)), c) for c in axis.T])
    return points[np.argmin(np.hypot(*(points - pin).T))]


def _cylinders(geometry: CraneGeometry, pins: Points) -> list[Layer]:
    """Cylinders, rocker and coupler."""
    found = []
    lengths = geometry.lift_cylinder_length, geometry.jib_cylinder_length
    for (base, head), length in zip((("C", "D"), ("E", "H")), lengths, strict=True):
        start, end = pins[base], pins[head]
        barrel = start + 0.9 * length * (end - start) / np.hypot(*(end - start))
        dark = {"color": "#3D3D3D", "solid_capstyle": "butt"}
        found.append(_layer([start, end], "-", color="#A6A6A6", linewidth=4, zorder=4))
        found.append(_layer([start, barrel], "-", linewidth=8, zorder=4.1, **dark))
    rods = [pins[letter] for letter in "FHI"]
    return [*found, _layer(rods, "-", color=style.GREEN, linewidth=6, zorder=4.2)]


def _ends(tips: list[Array], bent: Points, pins: Points) -> list[Layer]:
    """Pads where extension and jib touch, pins, the rigid and the loaded one of the `tips`."""
    pads, ink = [bent["extension"][0], bent["jib"][-1]], {"color": style.INK, "zorder": 7}
    white = ink | {"markerfacecolor": "white"}
    return [
        _layer(pads, "s", markersize=5.5, markeredgecolor="white", **ink),
        _layer(list(pins.values()), "o", markersize=6, **white),
        _layer(tips, "-", linewidth=1.4, **ink),
        _layer(tips[:1], "o", markersize=8, **white),
        _layer(tips[1:], "o", markersize=8, **ink),
    ]


def _labels(
    bent: Points, pins: Points, strokes: Array, angle: float, payload: float
) -> list[Layer]:
    lift, jib, extension = (f"stroke {MM * s:.0f} mm" for s in strokes)
    ends = {name: (bent[name][0], bent[name][-1]) for name in BEAMS}
    pads = ends["extension"][0], ends["jib"][1]
    tip, boxed = ends["extension"][1], {"facecolor": style.PALE, "edgecolor": style.INK}
    over = tuple(_turned(angle, (-24.0, 44.0)))

    def middle(a: Array, b: Array, share: float = 0.5) -> Array:
        return (1 - share) * a + share * b

    named = [
        ("pillar", middle(*ends["pillar"]), (-40.0, 0.0), "right"),
        ("ground spring", ends["pillar"][0], (50.0, 0.0), "left"),
        ("lift arm", middle(pins["B"], pins["G"], 0.6), (12.0, -30.0), "left"),
        (f"lift cylinder\n{lift}", middle(pins["C"], pins["D"]), (28.0, -8.0), "left"),
        (f"jib cylinder\n{jib}", middle(pins["E"], pins["H"], 0.4), over, "right"),
        ("rocker", middle(pins["F"], pins["H"]), (-40.0, 45.0), "right"),
        ("coupler", middle(pins["H"], pins["I"]), (34.0, 34.0), "left"),
        ("jib", middle(*pads), (-28.0, -34.0), "right"),
        ("rear pad", pads[0], (4.0, 46.0), "center"),
        ("front pad", pads[1], (20.0, 34.0), "left"),
        (f"extension\n{extension}", middle(pads[1], tip), (-20.0, -44.0), "right"),
    ]
    letters = {letter: offset for letter, (_, _, offset) in PINS.items()} | dict([HEAD])
    pin_names = [
        (letter, pins[letter], offset if letter in "BC" else _turned(angle, offset), "center")
        for letter, offset in letters.items()
    ]
    weight = [(f"{payload:g} kg", tip, (0.0, -32.0), "center")]
    return [
        _texts(named, leader=True),
        _texts([*pin_names, ("loaded tip", tip, (11.0, 2.0), "left")]),
        _texts(weight, leader=True, bbox={"boxstyle": "square,pad=0.4", **boxed}, path_effects=[]),
    ]


def _texts(rows: list[tuple[str, Array, Any, str]], **look: Any) -> Layer:
    columns = [(text, *point, *offset, side) for text, point, offset, side in rows]
    frame = pd.DataFrame(columns, columns=["text", "x", "y", "dx", "dy", "side"])
    return Layer(frame, "x", "y", "text", text="text", look={"fontsize": 9.5, **look})
