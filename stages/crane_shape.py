"""Solve the sample that the picture of the crane shows.

Reads params.yaml: crane.geometry, crane.structure, crane.illustration;
data/crane/calibration.json. Writes data/crane/shape.json: node positions with and without load.
"""

from pathlib import Path

import numpy as np

from flexik import stage
from flexik.files import write_json
from flexik.kinematics.crane import forward
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.model import equilibrium, reference_shapes
from flexik.parameters import load_parameters

OUTPUT = Path("data/crane/shape.json")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    model = flexible_crane(crane, read_spring_stiffness("data/crane/calibration.json"))
    strokes, payload = crane.illustration.strokes, crane.illustration.payload
    solved = equilibrium(model, strokes, payload)
    write_json(
        OUTPUT,
        {
            "strokes": strokes,
            "payload": payload,
            "exaggeration": crane.illustration.exaggeration,
            "beams": {name: rounded(nodes) for name, nodes in solved.shapes.items()},
            "reference": {n: rounded(x) for n, x in reference_shapes(model, strokes).items()},
            "tip": rounded(solved.tip),
            "rigid_tip": rounded(forward(model.geometry, np.array([strokes]))[0]),
        },
    )


def rounded(values: np.ndarray) -> list[float]:
    """Values to 1 um, below which machines differ."""
    return np.round(values, 6).tolist()


if __name__ == "__main__":
    stage.run(main)
