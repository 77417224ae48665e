"""A picture of the SmartEE in a pose, after figure 2 of the paper."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flexik.kinematics.smartee import (
    N_LEGS,
    SmartEEGeometry,
    base_points,
    elbow_circles,
    leg_tips,
)
from flexik.reporting import style

Array = NDArray[np.float64]

ARC = 0.6  # rad of the tip circle drawn to each side


def mechanism(path: Path | str, geometry: SmartEEGeometry, joints: Array) -> None:
    """Legs, plate and arcs of the tip circles at `joints` (3, 3), [leg, joint]; PNG `path`."""
    style.write_png(path, _figure, geometry, joints)


def _figure(geometry: SmartEEGeometry, joints: Array) -> Figure:
    figure = Figure(figsize=(style.WIDTH, 5.6))
    axes: Any = figure.add_subplot(projection="3d")
    circles = elbow_circles(geometry, joints[None, :, :2])
    tips = style.MM * leg_tips(circles, joints[None, :, 2])[0]
    elbows, bases = style.MM * circles.centre[0], style.MM * base_points(geometry)
    for leg in range(N_LEGS):
        turn = (joints[leg, 2] + np.linspace(-ARC, ARC, 61))[:, None]
        along, across = circles.along[0, leg], circles.across[0, leg]
        circle = np.cos(turn) * along + np.sin(turn) * across
        circle = elbows[leg] + style.MM * circles.radius * circle
        axes.plot(*circle.T, color=style.GREY, linewidth=1.0, linestyle="--")
        for ends, colour, name in (
            ((bases[leg], elbows[leg]), style.BLUE, "first link"),
            ((elbows[leg], tips[leg]), style.ORANGE, "second link"),
        ):
            axes.plot(*np.array(ends).T, color=colour, linewidth=4, label=name if leg == 0 else "")
    for ring, colour, name in ((bases, style.GREY, "base"), (tips, style.GREEN, "plate")):
        axes.plot(*np.vstack([ring, ring[:1]]).T, color=colour, linewidth=2, label=name)
    axes.scatter(*bases.T, color=style.BLUE, s=36, label="pitch and roll, actuated")
    axes.scatter(*elbows.T, color=style.INK, s=36, label="elbow, passive")
    axes.scatter(*tips.T, color=style.GREEN, s=36, label="ball joint")
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")
    axes.set_zlabel("z (mm)")
    axes.set_aspect("equal")
    axes.view_init(elev=18.0, azim=-50.0)
    figure.legend(loc="outside right upper")
    return figure
