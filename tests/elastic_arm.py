"""The elastic arm of params.yaml, for tests."""

from pathlib import Path

import numpy as np

from flexik.cases.case import load
from flexik.cases.elastic_arm.parts.arm import equilibria, flexible_arm

ROOT = Path(__file__).resolve().parents[1]
SECTION = load("elastic_arm", ROOT / "params.yaml")
MODEL = flexible_arm(SECTION.machine)
GEOMETRY = MODEL.geometry

TARGETS = np.array([[1.1, 0.3], [0.9, 0.7], [1.15, -0.1], [0.6, 0.85]])
PAYLOAD = np.array([3.0, 0.5, 1.5, 2.2])
QUERY = np.column_stack([TARGETS, PAYLOAD])
HOME = np.zeros((4, 2))


def tips(angles, payload):
    """Tip (n, 2) of the flexible arm."""
    return equilibria(MODEL, angles, payload).tip
