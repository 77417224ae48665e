"""Compare meshes and elements on random samples.

Reads params.yaml: crane.geometry, crane.structure, crane.mesh_study, crane.grid.minimum_tip_x,
crane.selection.payload; data/crane/calibration.json. Writes data/crane/mesh_study.csv.
"""

from pathlib import Path

from flexik import stage
from flexik.datasets.crane.grid import random_samples
from flexik.files import write_text
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.mesh_study import mesh_study
from flexik.parameters import load_parameters

OUTPUT = Path("data/crane/mesh_study.csv")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    model = flexible_crane(crane, read_spring_stiffness("data/crane/calibration.json"))
    settings = crane.mesh_study
    samples = random_samples(
        model.geometry,
        settings.n_samples,
        crane.selection.payload,
        crane.grid.minimum_tip_x,
        settings.seed,
    )
    table = mesh_study(model, samples.strokes, samples.payload, settings.refinements)
    table.insert(0, "n_samples", settings.n_samples)
    write_text(OUTPUT, table.to_csv(index=False))


if __name__ == "__main__":
    stage.run(main)
