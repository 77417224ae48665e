"""Command the crane by one method and record the errors: test conditions, random targets.

Usage: crane_evaluate.py METHOD, a name under crane.methods, or none.
Reads params.yaml: parallel, crane.geometry, crane.structure, crane.evaluation, crane.workspace,
crane.methods.METHOD (and crane.grid, crane.selection, networks and trainers to know which network
belongs to them); data/crane/calibration.json; data/crane/targets.parquet; the method's network.
Writes data/crane/evaluations/METHOD.parquet and data/crane/workspace/METHOD.parquet.
"""

import functools
from pathlib import Path

from flexik import parameters, stage
from flexik.datasets.crane.evaluations import TARGET_FIELDS, write_evaluation
from flexik.datasets.crane.grid import parallel_tips
from flexik.datasets.crane.provenance import (
    evaluation_checksum,
    targets_checksum,
    workspace_checksum,
)
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.tables import read_table
from flexik.evaluation.conditions import Conditions, all_conditions, random_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method

FOLDER = Path("data/crane")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane, label = given.crane, stage.argument("METHOD")
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    model = flexible_crane(crane, stiffness)
    method = trained_method(crane, label, model.geometry, stiffness, FOLDER / "networks")
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    tips = functools.partial(parallel_tips, model, settings=settings, description=label)
    for folder, conditions, made_with in (
        (
            "evaluations",
            all_conditions(crane.evaluation.points, crane.evaluation.payloads),
            evaluation_checksum(crane, stiffness, label),
        ),
        (
            "workspace",
            workspace(crane, stiffness, label),
            workspace_checksum(crane, stiffness, label),
        ),
    ):
        initial = initial_positions(model.geometry, conditions.targets)
        frame = evaluate(method, conditions, initial, tips)
        write_evaluation(FOLDER / folder / f"{label}.parquet", frame, made_with)
        if len(frame):
            found = statistics(frame)
            print(
                f"{label}, {folder}: mean error {1e3 * found['mean_error']:.2f} mm, "
                f"max {1e3 * found['max_error']:.2f} mm, "
                f"{found['n_failed']} of {found['n_conditions']} failed"
            )


def workspace(crane: parameters.Crane, stiffness: float, label: str) -> Conditions:
    """As many of the random targets as method `label` gets."""
    made_with = targets_checksum(crane, stiffness)
    table = read_table(FOLDER / "targets.parquet", TARGET_FIELDS, made_with)
    if label != "none":
        table = table.head(crane.methods[label].n_workspace_targets)
    return random_conditions(table[["target_x", "target_y"]], table["payload"])


if __name__ == "__main__":
    stage.run(main)
