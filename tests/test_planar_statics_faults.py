"""Statics of machines of a file: joints at any angle, and independent checks of equilibria."""

import numpy as np
import pytest
from planar_machines import machine, pin, rigid
from test_planar_statics import G, beam, sag, turning

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
