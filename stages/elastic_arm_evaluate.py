"""Command the flexible arm to the random targets by one method and record the errors.

Usage: elastic_arm_evaluate.py METHOD, a name under elastic_arm.methods, or none.
Reads params.yaml: elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges,
elastic_arm.workspace, elastic_arm.methods.METHOD (and elastic_arm.readings, networks and trainers
to know which network belongs to it); data/elastic_arm/targets.parquet; the method's network.
Writes data/elastic_arm/evaluations/METHOD.parquet.
"""

from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import EVALUATION_FIELDS, TARGET_FIELDS
from flexik.datasets.elastic_arm.provenance import (
    evaluation_checksum,
    network_checksum,
    targets_checksum,
)
from flexik.datasets.elastic_arm.readings import (
    ANGLES,
    STREAM_OF_TARGETS,
    gauges_of,
    noise_generator,
)
from flexik.datasets.tables import read_table, write_table
from flexik.errors import ParameterError
from flexik.evaluation.conditions import random_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.learning.storage import load_network
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import FlexibleArm, equilibria
from flexik.parameters import load_parameters
from flexik.positioning.elastic_arm.assembly import arm_method, uncompensated
from flexik.positioning.method import Array, Method

FOLDER = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm, label = load_parameters().elastic_arm, stage.argument("METHOD")
    model = flexible_arm(arm)
    table = read_table(FOLDER / "targets.parquet", TARGET_FIELDS, targets_checksum(arm))
    conditions = random_conditions(table[["target_x", "target_y"]], table["payload"])
    method = chosen_method(arm, label, model, table[list(ANGLES)].to_numpy(), conditions.payload)
    # from the stretched arm; only a row without a solution would stay there
    initial = np.zeros((len(conditions), 2))
    frame = evaluate(
        method,
        conditions,
        initial,
        lambda angles, mass: equilibria(model, angles, mass).tip,
        ANGLES,
    )
    write_table(
        FOLDER / "evaluations" / f"{label}.parquet",
        {field.name: frame[field.name].to_numpy() for field in EVALUATION_FIELDS},
        EVALUATION_FIELDS,
        evaluation_checksum(arm, label),
    )
    found = statistics(frame)
    print(
        f"{label}: mean error {1e3 * found['mean_error']:.3f} mm, "
        f"max {1e3 * found['max_error']:.3f} mm, "
        f"{found['n_failed']} of {found['n_conditions']} failed"
    )


def chosen_method(
    arm: parameters.ElasticArm, label: str, model: FlexibleArm, angles: Array, payload: Array
) -> Method:
    """Method `label` for poses of `angles` (n, 2) in rad and `payload` (n,) in kg.

    Only a method that is given gauges is told anything of the angles: what the gauges show there.
    """
    if label == "none":
        return uncompensated(model.geometry)
    if label not in arm.methods:
        raise ParameterError(
            f"elastic_arm.methods: there is no {label!r} ({', '.join(arm.methods)})"
        )
    method = arm.methods[label]
    network, _ = load_network(
        FOLDER / "networks" / f"{method.network}.json", network_checksum(arm, method.network)
    )
    deformation = None
    if isinstance(method, parameters.GaugeMethod):
        generator = noise_generator(
            arm, arm.all_networks[method.network].readings, STREAM_OF_TARGETS
        )
        found = equilibria(model, angles, payload)
        deformation = gauges.read(gauges_of(arm), *found[1:], generator).deformation
    return arm_method(method, model.geometry, network, deformation)


if __name__ == "__main__":
    stage.run(main)
