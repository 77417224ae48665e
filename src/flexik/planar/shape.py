"""Study `shape`: node positions with and without load of the sample that the picture shows."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexik.datasets.parts import Part, Work, Writer, json_file, whole
from flexik.machines.planar import PlanarMachine
from flexik.machines.sections import Array
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import shapes, tips
from flexik.planar.constants import model_inputs
from flexik.planar.machine import flexible
from flexik.planar.section import PlanarSection


def part(section: PlanarSection, values: Sequence[float], payload: float) -> Part:
    """`shape`, a JSON file, at coordinates `values` (k,) with `payload` in kg."""
    settings = {"machine": section.machine, "values": list(values), "payload": payload}
    return Part("shape", prepare, settings, model_inputs(section))


def prepare(
    *,
    machine: PlanarMachine,
    values: list[float],
    payload: float,
    sections: dict[str, Path],
    constants: Path | None = None,
) -> Work:
    """Solve the sample."""
    return whole(_shape, machine=machine, values=values, payload=payload, constants=constants)


def _shape(
    machine: PlanarMachine, values: list[float], payload: float, constants: Path | None
) -> dict[str, Writer]:
    return {".json": json_file(drawn(flexible(machine, constants), np.array(values), payload))}


def drawn(machine: FlexibleMachine, values: Array, payload: float) -> dict[str, Any]:
    """What planar.picture draws of coordinates `values` (k,) with `payload` in kg.

    values, payload; reference and beams, node positions (m, 2) in m by beam, rigid and loaded;
    poses (3,) in m and rad by body; rigid_tip, own_weight_tip (without payload) and tip (2,) in m.
    """
    rigid, bent = shapes(machine, values, payload)
    poses = machine.linkage.poses(values[None])[0]
    body, (x, y) = machine.machine.located(machine.machine.payload)
    px, py, angle = poses[machine.linkage.names.index(body)]
    c, s = np.cos(angle), np.sin(angle)
    under_own_weight, loaded = tips(machine, np.tile(values, (2, 1)), np.array([0.0, payload]))
    return {
        "values": values.tolist(),
        "payload": payload,
        "beams": {name: _rounded(nodes) for name, nodes in bent.items()},
        "reference": {name: _rounded(nodes) for name, nodes in rigid.items()},
        "poses": dict(zip(machine.linkage.names, map(_rounded, poses), strict=True)),
        "tip": _rounded(loaded),
        "own_weight_tip": _rounded(under_own_weight),
        "rigid_tip": _rounded(np.array([px + c * x - s * y, py + s * x + c * y])),
    }


def _rounded(values: Array) -> list[float]:
    """Values to 1 um, below which machines differ."""
    return np.round(values, 6).tolist()
