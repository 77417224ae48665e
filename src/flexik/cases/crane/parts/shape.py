"""Study `shape`: node positions with and without load of the sample that the picture shows."""

from pathlib import Path

import numpy as np

from flexik.cases.crane.parts.crane import flexible, model_inputs
from flexik.cases.crane.section import Section, Shape
from flexik.datasets.parts import Part, Work, Writer, json_file, whole
from flexik.kinematics.crane import forward
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import shapes


def part(section: Section) -> Part:
    """`shape`, a JSON file."""
    settings = {"machine": section.machine, "shape": section.studies.shape}
    return Part("shape", prepare, settings, model_inputs(section))


def prepare(
    *, machine: PlanarMachine, shape: Shape, spring: Path, sections: dict[str, Path]
) -> Work:
    """Solve the sample."""
    return whole(_shape, machine=machine, shape=shape, spring=spring)


def _shape(machine: PlanarMachine, shape: Shape, spring: Path) -> dict[str, Writer]:
    crane = flexible(machine, spring)
    unloaded, bent = shapes(crane, np.array(shape.strokes), shape.payload)
    drawn = {
        "strokes": shape.strokes,
        "payload": shape.payload,
        "exaggeration": shape.exaggeration,
        "beams": {name: _rounded(nodes) for name, nodes in bent.items()},
        "reference": {name: _rounded(nodes) for name, nodes in unloaded.items()},
        "tip": _rounded(bent["extension"][-1]),
        "rigid_tip": _rounded(forward(crane.geometry, np.array([shape.strokes]))[0]),
    }
    return {".json": json_file(drawn)}


def _rounded(values: np.ndarray) -> list[float]:
    """Values to 1 um, below which machines differ."""
    return np.round(values, 6).tolist()
