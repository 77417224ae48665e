"""Solve the training grid and the random selection set in parallel.

Reads params.yaml: parallel (where to compute, not what), crane.geometry, crane.structure,
crane.grid, crane.selection; data/crane/calibration.json.
Writes data/crane/grid.parquet and data/crane/selection.parquet. Killed and run again it goes on
where it was.
"""

import sys
from pathlib import Path

from flexik import datasets, mechanisms, multibody, stage
from flexik.datasets.crane.grid import (
    FIELDS,
    GridParts,
    axis,
    counts,
    failed_samples,
    generate,
    random_samples,
    split,
)
from flexik.datasets.crane.provenance import grid_checksum, selection_checksum
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.tables import read_table
from flexik.errors import SolverError
from flexik.files import checksum, source_checksum
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.parameters import load_parameters

FOLDER = Path("data/crane")
SHOWN_FAILURES = 10


def main() -> None:
    """Run the stage."""
    parameters = load_parameters()
    crane = parameters.crane
    settings = from_environment(ParallelSettings(**parameters.parallel.model_dump()))
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    model = flexible_crane(crane, stiffness)
    axes = {name: axis(**getattr(crane.grid, name).model_dump()) for name in GridParts.AXES}
    selection = random_samples(
        model.geometry,
        crane.selection.n_samples,
        crane.selection.payload,
        crane.grid.minimum_tip_x,
        crane.selection.seed,
    )
    version = source_checksum(mechanisms, multibody, datasets)
    for name, parts, made_with in (
        ("grid", GridParts(**axes), grid_checksum(crane, stiffness)),
        ("selection", split(selection), selection_checksum(crane, stiffness)),
    ):
        path = FOLDER / f"{name}.parquet"
        path.with_suffix(".failed.parquet").unlink(missing_ok=True)
        reused = generate(
            path,
            model,
            parts,
            crane.grid.minimum_tip_x,
            made_with,
            checksum(made_with, version),
            settings,
            f"crane {name}",
        )
        if reused:
            print(f"{name}: {reused} of {len(parts)} parts were there from an interrupted run")
        report(name, path, made_with, crane.grid.maximum_failed_share)


def report(name: str, path: Path, made_with: str, maximum_failed_share: float) -> None:
    """Print the counts and the failed samples; too many of them end the stage."""
    table = read_table(path, FIELDS, made_with)
    n = counts(table)
    print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in n.items()))
    failed = failed_samples(table)
    for line in failed[:SHOWN_FAILURES]:
        print(f"{name}: no static equilibrium at {line}", file=sys.stderr)
    if n["n_failed"] > maximum_failed_share * n["n_samples"]:
        # kept under another name: the samples that failed can be looked at
        path.rename(path.with_suffix(".failed.parquet"))
        raise SolverError(
            f"{name}: {n['n_failed']} of {n['n_samples']} samples failed, more than "
            f"crane.grid.maximum_failed_share {maximum_failed_share:g}; first: {failed[0]}"
        )


if __name__ == "__main__":
    stage.run(main)
