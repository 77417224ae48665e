"""Statics of machines of a file: joints at any angle, and independent checks of equilibria."""

import numpy as np
import pytest
from planar_machines import machine, pin, rigid
from test_planar_statics import G, beam, sag, turning

from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import tips

STIFF = {"kind": "box", "width": 0.3, "height": 0.6, "wall": 0.05}


@pytest.mark.parametrize("springs", [{"x": 1e5}, {"y": 1e5}, {"x": 1e5, "y": 3e5}])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("bends", [False, True])
def test_springs_are_the_inner_bodys_whatever_the_angle_of_the_joint(springs, angle, bends):
    turned, ends = 0.5, {"a": [0, 0], "b": [1, 0]}
    given = machine(
        {"a": [0, 0]},
        {
            "arm": beam([[0, 0], [1, 0]], STIFF, **ends) if bends else rigid(**ends),
            "end": rigid(b=[0, 0], tip=[0, 0]),
        },
        {
            "a": pin("ground.a", "arm.a"),
            "b": {
                "kind": "fixed",
                "of": ["arm.b", "end.b"],
                "angle": angle,
                "springs": springs,
            },
        },
        {"turn": turning("a")},
        "end.tip",
    )
    x, y = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    flexibility = np.outer(x, x) / springs.get("x", np.inf)
    flexibility += np.outer(y, y) / springs.get("y", np.inf)
    expected = flexibility @ [0.0, -10 * G]
    assert sag(given, values=np.array([turned])) == pytest.approx(expected, rel=2e-3, abs=2e-6)


def lifted(element, drive, direction=0.0, turned=0.0):
    """A boom on a cylinder and a slider, each with its axis at an angle in its own frame."""
    front, tip = (
        (length * np.array([np.cos(along), np.sin(along)])).tolist()
        for length, along in ((2.0, direction), (1.5, direction - turned))
    )
    out = {
        "telescope": {"joint": "pads", "of": ["boom.front", "slider.tip"]},
        "cylinder": {"of": ["boom.a", "slider.tip"], "retracted": 2.0},
    }[drive]
    lift = {"kind": "cylinder", "of": ["ground.c", "boom.front"], "retracted": 1.0}
    pads = {"kind": "slide", "of": ["boom.front", "slider.rear"]}
    return machine(
        {"a": [0, 0], "c": [1.0, -1.0]},
        {
            "boom": beam([[0, 0], front], a=[0, 0], front=front) | {"angle": -direction},
            "slider": beam([[0, 0], tip], rear=[0, 0], tip=tip) | {"angle": turned - direction},
        },
        {
            "a": pin("ground.a", "boom.a"),
            "pads": pads | {"direction": direction, "angle": turned},
        },
        {
            "lift": lift | {"limits": [0.3, 0.8]},
            "out": {"kind": drive, "limits": [0.2, 1.0], **out},
        },
        "slider.tip",
        element=element,
    )


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
@pytest.mark.parametrize("drive", ["telescope", "cylinder"])
def test_pads_do_not_depend_on_the_frames_of_the_bodies(element, drive):
    values, payload = np.array([[0.4, 0.2], [0.5, 0.7], [0.6, 1.0]]), np.full(3, 50.0)
    expected = tips(FlexibleMachine(lifted(element, drive)), values, payload)
    for direction, turned in ((0.5, 0.3), (-0.4, -0.8)):
        found = tips(FlexibleMachine(lifted(element, drive, direction, turned)), values, payload)
        assert found == pytest.approx(expected, abs=1e-7)
