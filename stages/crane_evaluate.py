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
    network_checksum,
    targets_checksum,
    workspace_checksum,
)
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.evaluation.conditions import Conditions, all_conditions, random_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.learning.storage import load_network
from flexik.mechanisms.crane import CraneGeometry
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.positioning.crane.assembly import crane_method, uncompensated
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.method import Method

FOLDER = Path("data/crane")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane, label = given.crane, stage.argument("METHOD")
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    model = flexible_crane(crane, stiffness)
    method = chosen_method(crane, label, model.geometry, stiffness)
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


def chosen_method(
    crane: parameters.Crane, label: str, geometry: CraneGeometry, stiffness: float
) -> Method:
    """Method `label` of params.yaml, ready to be called."""
    if label == "none":
        return uncompensated(geometry)
    if label not in crane.methods:
        raise ParameterError(f"crane.methods: there is no {label!r} ({', '.join(crane.methods)})")
    chosen = crane.methods[label]
    network, _ = load_network(
        FOLDER / "networks" / f"{chosen.network}.json",
        network_checksum(crane, stiffness, chosen.network),
    )
    return crane_method(chosen, geometry, network)


def workspace(crane: parameters.Crane, stiffness: float, label: str) -> Conditions:
    """As many of the random targets as method `label` gets."""
    made_with = targets_checksum(crane, stiffness)
    table = read_table(FOLDER / "targets.parquet", TARGET_FIELDS, made_with)
    if label != "none":
        table = table.head(crane.methods[label].n_workspace_targets)
    return random_conditions(table[["target_x", "target_y"]], table["payload"])


if __name__ == "__main__":
    stage.run(main)
