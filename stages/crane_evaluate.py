"""Command the crane by one method under all test conditions and record the errors.

Usage: crane_evaluate.py METHOD, a name under crane.methods, or none.
Reads params.yaml: crane.geometry, crane.structure, crane.evaluation, crane.methods.METHOD (and
crane.grid, crane.selection, crane.networks to know which network belongs to them);
data/crane/calibration.json; the method's network.
Writes data/crane/evaluations/METHOD.parquet.
"""

import functools
from pathlib import Path

from flexik import parameters, stage
from flexik.datasets.evaluations import write_evaluation
from flexik.datasets.provenance import evaluation_checksum, network_checksum
from flexik.errors import ParameterError
from flexik.evaluation.conditions import all_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.learning.storage import load_network
from flexik.mechanisms.crane import CraneGeometry
from flexik.multibody.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane import tips
from flexik.parameters import load_parameters
from flexik.positioning import build_method
from flexik.positioning.genetic import GeneticSettings, genetic
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.initial import initial_positions
from flexik.positioning.method import Method, Network
from flexik.positioning.rigid_inverse import RigidInverse, closed_form

FOLDER = Path("data/crane")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    label = stage.argument("METHOD")
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    model = flexible_crane(crane, stiffness)
    conditions = all_conditions(crane.evaluation.points, crane.evaluation.payloads)
    initial = initial_positions(model.geometry, conditions.targets)
    method = chosen_method(crane, label, model.geometry, stiffness)
    frame = evaluate(method, conditions, initial, functools.partial(tips, model))
    made_with = evaluation_checksum(crane, stiffness, label)
    write_evaluation(FOLDER / "evaluations" / f"{label}.parquet", frame, made_with)
    found = statistics(frame)
    print(
        f"{label}: mean error {1e3 * found['mean_error']:.2f} mm, "
        f"max {1e3 * found['max_error']:.2f} mm, "
        f"{found['n_failed']} of {found['n_conditions']} conditions failed"
    )


def chosen_method(
    crane: parameters.Crane, label: str, geometry: CraneGeometry, stiffness: float
) -> Method:
    """Method `label` of params.yaml, ready to be called."""
    if label == "none":
        return build_method("none", Ingredients(geometry, closed_form(geometry)))
    if label not in crane.methods:
        raise ParameterError(f"crane.methods: there is no {label!r} ({', '.join(crane.methods)})")
    chosen = crane.methods[label]
    network, _ = load_network(
        FOLDER / "networks" / f"{chosen.network}.json",
        network_checksum(crane, stiffness, chosen.network),
    )
    inverse: RigidInverse = closed_form(geometry)
    if chosen.genetic is not None:
        inverse = genetic(geometry, GeneticSettings(**chosen.genetic.model_dump()))
    learnt = crane.any_network(chosen.network)
    assert learnt is not None  # validated with the parameters
    networks: dict[str, Network] = {learnt.kind: network}
    ingredients = Ingredients(geometry, inverse, networks)
    return build_method(chosen.method, ingredients, n_corrections=chosen.n_corrections)


if __name__ == "__main__":
    stage.run(main)
