"""A planar machine drawn: its bodies in a rigid pose, and how they are bent by a load."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from flexik.machines.bodies import Beam
from flexik.machines.planar import GROUND, Cylinder, Pin, PlanarMachine, Slide
from flexik.machines.sections import Array
from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer, chart
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM

# Of the size of the machine, how far the drawn tip sags about
DRAWN_SAG = 0.06
ROOM = 0.06  # about all points, share of their extent
GREY = {"color": style.GREY, "linewidth": 1.0, "zorder": 1}
BENT = {"color": style.BLUE, "linewidth": 3.0, "zorder": 3, "solid_capstyle": "round"}
CYLINDER = {"color": style.VERMILION, "linewidth": 2.0, "zorder": 2}
INK = {"color": style.INK, "zorder": 4}
HOLLOW = {**INK, "markerfacecolor": "white"}
TIP = {"zorder": 5, "markersize": 7.0, "markeredgecolor": style.INK}
# Names this near, over the size of the machine, are one text
NEAR = 0.12
DOTS = {"color": style.PALE, "markersize": 2.0, "zorder": 0}


def picture(
    machine: PlanarMachine, shape: Mapping[str, Any], reach: Array | None = None
) -> Drawing:
    """The loaded machine, deflection enlarged, over its rigid pose.

    shape : see planar.shape.drawn.
    reach : tips (n, 2) in m that are drawn below, within the limits of the drives.
    """
    below = np.empty((0, 2)) if reach is None else reach
    rigid = {name: np.asarray(nodes) for name, nodes in shape["reference"].items()}
    tips = np.array([shape["rigid_tip"], shape["tip"]])
    sag = float(np.hypot(*(tips[1] - tips[0])))
    every = np.concatenate([*rigid.values(), tips, *_bodies(machine, shape["poses"]).values()])
    size = float(np.ptp(every, axis=0).max())
    times = _round(DRAWN_SAG * size / sag) if sag > 0 else 1.0
    bent = {n: rigid[n] + times * (np.asarray(shape["beams"][n]) - rigid[n]) for n in rigid}
    loaded = tips[0] + times * (tips[1] - tips[0])
    every = np.concatenate([every, *bent.values(), loaded[None], below])
    low, high = every.min(axis=0) - ROOM * size, every.max(axis=0) + ROOM * size
    height = float(np.clip((style.WIDTH - 0.7) * (high - low)[1] / (high - low)[0] + 1.4, 3.0, 9.0))
    enlarged = f"both drawn {times:g} times larger" if times > 1.0 else ""
    title = f"{moved(shape)}\n{enlarged}".strip()
    return draw(
        chart,
        *([_layer(below, ".", "within all limits", **DOTS)] if len(below) else []),
        *_unloaded(machine, shape["poses"], rigid),
        *(
            _layer(nodes, "-", "loaded" if not k else "", **BENT)
            for k, nodes in enumerate(bent.values())
        ),
        _layer(tips[:1], "D", "tip, rigid", color="white", **TIP),
        _layer(loaded[None], "D", "tip, loaded", color=style.BLUE, **TIP),
        *_names(machine, shape["poses"], rigid),
        x=Axis("x (m)", limits=(low[0], high[0])),
        y=Axis("y (m)", limits=(low[1], high[1])),
        equal=True,
        height=height,
        titles=title,
    )


def moved(shape: Mapping[str, Any]) -> str:
    """How far the own weight and the payload of `shape`, see planar.shape.drawn, move the tip."""
    rigid, own, tip = (np.array(shape[n]) for n in ("rigid_tip", "own_weight_tip", "tip"))
    weight, payload = (MM * float(np.hypot(*way)) for way in (own - rigid, tip - own))
    return (
        f"own weight moves the tip by {weight:.4g} mm, {shape['payload']:g} kg by {payload:.4g} mm"
        " more"
    )


def _unloaded(
    machine: PlanarMachine, poses: Mapping[str, Array], rigid: Mapping[str, Array]
) -> Iterator[Layer]:
    """Bodies, cylinders, pins and pads in the rigid pose."""
    points = _bodies(machine, poses)
    label = "bodies, rigid"
    for name, body in machine.bodies.items():
        if isinstance(body, Beam):
            yield _layer(rigid[name], "-", label, **GREY)
            for point in points[name]:  # arms from the axis to the points beside it
                foot = rigid[name][np.hypot(*(rigid[name] - point).T).argmin()]
                yield _layer([foot, point], "-", "", **GREY)
        else:
            yield _layer(points[name], "-", label, **GREY)
        label = ""
    label = "cylinder, rigid"
    for drive in machine.drives.values():
        if isinstance(drive, Cylinder):
            yield _layer([_placed(machine, poses, end) for end in drive.of], "-", label, **CYLINDER)
            label = ""
    joints = machine.joints.values()
    pins = [_placed(machine, poses, j.of[0]) for j in joints if isinstance(j, Pin)]
    pads = [_placed(machine, poses, end) for j in joints if isinstance(j, Slide) for end in j.of]
    ground = points[GROUND]
    marks = ((ground, "^", "ground"), (pins, "o", "pin, rigid"), (pads, "s", "pad, rigid"))
    for places, mark, text in marks:
        if len(places):
            size = {"^": 8.0}.get(mark, 4.5)
            yield _layer(places, mark, text, markersize=size, **HOLLOW)


def _names(
    machine: PlanarMachine, poses: Mapping[str, Array], rigid: Mapping[str, Array]
) -> Iterator[Layer]:
    """Names of bodies, cylinders and joints; those of one kind that are near are one text."""
    points = _bodies(machine, poses)
    along = {name: rigid.get(name, points[name]) for name in machine.bodies}
    cylinders = {n: drive.of for n, drive in machine.drives.items() if isinstance(drive, Cylinder)}
    ends = {n: [_placed(machine, poses, end) for end in of] for n, of in cylinders.items()}
    kinds = (
        ({n: p.mean(axis=0) for n, p in along.items()}, style.BLUE, (-6.0, -6.0, "right")),
        ({n: np.mean(p, axis=0) for n, p in ends.items()}, style.VERMILION, (0.0, 9.0, "center")),
        (
            {n: _placed(machine, poses, joint.of[0]) for n, joint in machine.joints.items()},
            style.INK,
            (7.0, -3.0, "left"),
        ),
    )
    near = NEAR * float(np.ptp(np.concatenate([*points.values()]), axis=0).max())
    for places, colour, beside in kinds:
        texts: list[tuple[str, float, float]] = []
        for name, (x, y) in places.items():
            k = next((k for k, t in enumerate(texts) if np.hypot(t[1] - x, t[2] - y) < near), None)
            if k is None:
                texts.append((name, x, y))
            else:
                texts[k] = (f"{texts[k][0]}\n{name}", *texts[k][1:])
        rows = [(*text, *beside) for text in texts]
        frame = pd.DataFrame(rows, columns=["text", "x", "y", "dx", "dy", "side"])
        if rows:
            look = {"fontsize": 8.5, "color": colour}
            yield Layer(frame, "x", "y", "text", text="text", look=look)


def _bodies(machine: PlanarMachine, poses: Mapping[str, Array]) -> dict[str, Array]:
    """Points (k, 2) in m by body, the ground's too."""
    given = {GROUND: machine.ground, **{n: body.points for n, body in machine.bodies.items()}}
    return {
        name: np.array([_placed(machine, poses, f"{name}.{point}") for point in points])
        for name, points in given.items()
    }


def _placed(machine: PlanarMachine, poses: Mapping[str, Array], reference: str) -> Array:
    body, (x, y) = machine.located(reference)
    px, py, angle = poses[body]
    c, s = np.cos(angle), np.sin(angle)
    return np.array([px + c * x - s * y, py + s * x + c * y])


def _layer(points: Any, mark: str, label: str, **look: Any) -> Layer:
    frame = pd.DataFrame(np.asarray(points, dtype=float).reshape(-1, 2), columns=["x", "y"])
    return Layer(frame, "x", "y", mark, label=label, look=look)


def _round(value: float) -> float:
    """The largest of 1, 2, 5, 10 ... up to `value`, at least 1."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(step * power for step in (1, 2, 5) if step * power <= max(value, 1.0)))
