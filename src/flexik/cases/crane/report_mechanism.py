"""The crane drawn: links and pins of rigid poses, and the loaded crane over its rigid pose."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.kinematics.crane import CraneGeometry, pose
from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

Array = NDArray[np.float64]
Points = Mapping[str, Array]

# Colour, and half of the depth drawn, m; sections are known by their stiffness, not their outline
BEAMS: dict[str, tuple[str, float]] = {
    "pillar": ("#5A5A5A", 0.085),
    "lift": (style.BLUE, 0.095),
    "jib": (style.VERMILION, 0.085),
    "extension": (style.ORANGE, 0.055),
}
# Links, and the pins that each is drawn through
LINK_LOOKS: dict[str, dict[str, Any]] = {
    "pillar": {"color": BEAMS["pillar"][0], "linewidth": 1.6},
    "cylinder": {"color": style.GREY, "linewidth": 0.7},
    "lift arm": {"color": BEAMS["lift"][0], "linewidth": 1.6},
    "rocker, coupler": {"color": style.GREEN, "linewidth": 0.7},
    "jib": {"color": BEAMS["jib"][0], "linewidth": 1.6},
    "extension": {"color": BEAMS["extension"][0], "linewidth": 1.6},
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
# Pins, the beam each one moves with, and where its letter stands (points; in the lift frame, but
# for B and C)
PINS = {
    "C": ("lift_cylinder_base", "pillar", (14.0, -5.0)),
    "B": ("lift_pivot", "pillar", (-13.0, 8.0)),
    "D": ("lift_cylinder_head", "lift", (16.0, -10.0)),
    "E": ("jib_cylinder_base", "lift", (-3.0, 15.0)),
    "F": ("rocker_pivot", "lift", (-12.0, -14.0)),
    "G": ("jib_pivot", "lift", (8.0, -16.0)),
    "I": ("coupler_pin", "jib", (17.0, 6.0)),
    "H": ("rocker_head", "", (-3.0, 16.0)),
}
# Texts, how far between which two places they point, and where they stand (points)
LABELS = (
    ("pillar", ("foot", "head", 0.5), (-40.0, 0.0), "right"),
    ("ground spring", ("foot", "foot", 0.0), (50.0, 0.0), "left"),
    ("lift arm", ("B", "G", 0.6), (12.0, -30.0), "left"),
    ("lift cylinder\nstroke {0:.0f} mm", ("C", "D", 0.5), (28.0, -8.0), "left"),
    ("jib cylinder\nstroke {1:.0f} mm", ("E", "H", 0.4), (-24.0, 44.0), "right"),
    ("rocker", ("F", "H", 0.5), (-40.0, 45.0), "right"),
    ("coupler", ("H", "I", 0.5), (34.0, 34.0), "left"),
    ("jib", ("rear pad", "front pad", 0.5), (-28.0, -34.0), "right"),
    ("rear pad", ("rear pad", "rear pad", 0.0), (4.0, 46.0), "center"),
    ("front pad", ("front pad", "front pad", 0.0), (20.0, 34.0), "left"),
    ("extension\nstroke {2:.0f} mm", ("front pad", "tip", 0.5), (-20.0, -44.0), "right"),
)
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

    shape : values, strokes (3,) in m; payload in kg; exaggeration of the deflection; beams and
        reference: for each of BEAMS the nodes (k, 2) in m, in equilibrium and rigid; tip and
        rigid_tip (2,) in m.
    """
    rigid = {name: np.asarray(shape["reference"][name], dtype=float) for name in BEAMS}
    bent = {
        name: nodes + float(shape["exaggeration"]) * (np.asarray(shape["beams"][name]) - nodes)
        for name, nodes in rigid.items()
    }
    strokes = np.asarray(shape["values"], dtype=float)
    posed = pose(geometry, strokes[None])
    rigid_pins = {letter: getattr(posed, field)[0] for letter, (field, _, _) in PINS.items()}
    pins, angle = _carry_pins(rigid_pins, rigid, bent), float(posed.lift_angle[0])
    # with room for the weight
    ends = [list(rigid_pins.values()), bent["extension"][-1:] - [0.0, 0.35]]
    every = np.concatenate([*rigid.values(), *bent.values(), *ends])
    low, high = every.min(axis=0) + ROOM[0], every.max(axis=0) + ROOM[1]
    height = float(np.clip((style.WIDTH - 0.7) * (high - low)[1] / (high - low)[0] + 1.1, 3.5, 9.0))
    tips = [rigid["extension"][-1], bent["extension"][-1]]
    return draw(
        chart,
        *_rigid(rigid, rigid_pins),
        *_loaded(geometry, bent, pins),
        *_points(tips, bent, pins),
        _texts([("rigid tip", tips[0], (9.0, 7.0), "left")]),
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


def _carry_pins(rigid: Points, reference: Points, bent: Points) -> dict[str, Array]:
    """Pins moved with their beams; H keeps the lengths of its rods to first order."""
    pins = {
        letter: _carry(reference[beam], bent[beam], rigid[letter])
        for letter, (_, beam, _) in PINS.items()
        if beam
    }
    rods = np.array([rigid["H"] - rigid["F"], rigid["H"] - rigid["I"]])
    ends = np.array([pins["F"] - rigid["F"], pins["I"] - rigid["I"]])
    return pins | {"H": rigid["H"] + np.linalg.solve(rods, np.sum(rods * ends, axis=1))}


def _carry(reference: Array, bent: Array, point: Array) -> Array:
    """Move `point` (2,) with the nearest segment of a polyline (k, 2), as if fixed to it."""
    k, share, foot = _foot(reference, point)
    moved = bent[k] + share * (bent[k + 1] - bent[k])
    before, after = (np.arctan2(*(axis[k + 1] - axis[k])[::-1]) for axis in (reference, bent))
    return moved + _turned(after - before, point - foot)


def _foot(axis: Array, point: Array) -> tuple[int, float, Array]:
    """Segment of the polyline `axis` (k, 2) that is nearest to `point`, share of it, and foot."""
    start, along = axis[:-1], np.diff(axis, axis=0)
    share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    feet = start + share[:, None] * along
    k = int(np.argmin(np.hypot(*(point - feet).T)))
    return k, float(share[k]), feet[k]


def _turned(angle: float, vector: Any) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ np.asarray(vector)


def _outline(axis: Array, half: float) -> Array:
    """Outline (2k, 2) of a beam of depth 2 `half` along the polyline `axis` (k, 2)."""
    tangent = np.gradient(axis, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None]
    normal = half * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.concatenate([axis + normal, (axis - normal)[::-1]])


def _layer(points: Any, mark: str, **look: Any) -> Layer:
    frame = pd.DataFrame(np.asarray(points, dtype=float), columns=["x", "y"])
    return Layer(frame, "x", "y", mark, label="", look=look)


def _rigid(axes: Points, pins: Points) -> Iterator[Layer]:
    pale = {"color": "#F0F0F0", "edgecolor": style.GREY, "linewidth": 0.8, "zorder": 1}
    for name, (_, half) in BEAMS.items():
        yield _layer(_outline(axes[name], half), "area", **pale)
    for rod in ("CD", "EH", "FHI"):
        corners = [pins[letter] for letter in rod]
        yield _layer(corners, "-", color=style.GREY, linewidth=0.8, zorder=1)


def _loaded(geometry: CraneGeometry, bent: Points, pins: Points) -> Iterator[Layer]:
    # the torsion spring that holds the pillar, and the ground at the flange
    turns, foot = np.linspace(0.0, 5 * np.pi, 200)[:, None], bent["pillar"][0]
    spiral = foot + (0.012 + 0.013 * turns) * np.hstack([np.cos(turns), np.sin(turns)])
    yield _layer(spiral, "-", color=style.PURPLE, linewidth=2, zorder=6)
    left, low = foot - [0.55, 0.24]
    hatch = [[[x, low], [x - 0.1, low - 0.12]] for x in np.linspace(left + 0.1, left + 1.1, 10)]
    for line in [[[left, low], [left + 1.1, low]], *hatch]:
        yield _layer(line, "-", linewidth=1.0, color=style.INK, zorder=2)
    for name, (colour, half) in BEAMS.items():
        level = 2.8 if name == "extension" else 3.0
        for letter, (_, beam, _) in PINS.items():  # rigid arms from the axis to pins beside it
            if beam == name or (name == "jib" and letter == "G"):
                arm = [_foot(bent[name], pins[letter])[2], pins[letter]]
                yield _layer(arm, "-", linewidth=9, zorder=level - 0.1, color=colour)
        yield _layer(_outline(bent[name], half), "area", zorder=level, color=colour)
    hidden = [bent["extension"][0], bent["jib"][-1]]
    dashed = {"color": "white", "linewidth": 1.0, "linestyle": (0, (5, 4)), "zorder": 3.1}
    yield _layer(hidden, "-", **dashed)
    lengths = geometry.lift_cylinder_length, geometry.jib_cylinder_length
    for ends, length in zip(("CD", "EH"), lengths, strict=True):
        start, end = (pins[letter] for letter in ends)
        barrel = start + 0.9 * length * (end - start) / np.hypot(*(end - start))
        dark = {"color": "#3D3D3D", "solid_capstyle": "butt"}
        yield _layer([start, end], "-", color="#A6A6A6", linewidth=4, zorder=4)
        yield _layer([start, barrel], "-", linewidth=8, zorder=4.1, **dark)
    rocker = [pins[letter] for letter in "FHI"]
    yield _layer(rocker, "-", color=style.GREEN, linewidth=6, zorder=4.2)


def _points(tips: list[Array], bent: Points, pins: Points) -> list[Layer]:
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
    places = {**pins, "foot": bent["pillar"][0], "head": bent["pillar"][-1]}
    places |= {"rear pad": bent["extension"][0], "front pad": bent["jib"][-1]}
    places["tip"] = tip = bent["extension"][-1]
    named = []
    for text, (start, end, share), offset, side in LABELS:
        at = (1 - share) * places[start] + share * places[end]
        along = _turned(angle, offset) if start == "E" else offset
        named.append((text.format(*MM * strokes), at, along, side))
    letters = [
        (letter, pins[letter], offset if letter in "BC" else _turned(angle, offset), "center")
        for letter, (_, _, offset) in PINS.items()
    ]
    box = {"boxstyle": "square,pad=0.4", "facecolor": style.PALE, "edgecolor": style.INK}
    weight = [(f"{payload:g} kg", tip, (0.0, -32.0), "center")]
    return [
        _texts(named, leader=True),
        _texts([*letters, ("loaded tip", tip, (11.0, 2.0), "left")]),
        _texts(weight, leader=True, bbox=box, path_effects=[]),
    ]


def _texts(rows: list[tuple[str, Array, Any, str]], **look: Any) -> Layer:
    columns = [(text, *point, *offset, side) for text, point, offset, side in rows]
    frame = pd.DataFrame(columns, columns=["text", "x", "y", "dx", "dy", "side"])
    return Layer(frame, "x", "y", "text", text="text", look={"fontsize": 9.5, **look})
