"""Command the flexible arm to the random targets by every method, and to the readings.

One stage for all methods: they share the targets, and each takes a fraction of a second.
Reads params.yaml: elastic_arm; the tables of elastic_arm_generate; the networks;
data/elastic_arm/targets.parquet.
Writes data/elastic_arm/evaluations/METHOD.parquet, errors at the targets, METHOD a name under
elastic_arm.methods or none; and fit.parquet, what the networks given gauges say for every reading,
and where the arm is then.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import (
    EVALUATION_FIELDS,
    FIT_FIELDS,
    KINDS,
    TARGET_FIELDS,
    learning_table,
    read_readings,
)
from flexik.datasets.elastic_arm.provenance import (
    evaluation_checksum,
    fit_checksum,
    network_checksum,
    targets_checksum,
)
from flexik.datasets.elastic_arm.readings import (
    ANGLES,
    STREAM_OF_TARGETS,
    columns_of,
    gauges_of,
    noise_generator,
)
from flexik.datasets.tables import read_table, write_table
from flexik.evaluation.conditions import random_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.learning.perceptron import Network
from flexik.learning.storage import load_network
from flexik.mechanisms.elastic_arm import DEFORMATION, flexible_forward
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import Equilibria, FlexibleArm, equilibria
from flexik.parameters import load_parameters
from flexik.positioning.elastic_arm.assembly import arm_method, uncompensated
from flexik.positioning.method import Method

FOLDER = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    model = flexible_arm(arm)
    table = read_table(FOLDER / "targets.parquet", TARGET_FIELDS, targets_checksum(arm))
    conditions = random_conditions(table[["target_x", "target_y"]], table["payload"])
    found = equilibria(model, table[list(ANGLES)].to_numpy(), conditions.payload)
    # from the stretched arm; only a row without a solution would stay there
    initial = np.zeros((len(conditions), 2))
    for label in ("none", *arm.methods):
        frame = evaluate(
            chosen_method(arm, label, model, found),
            conditions,
            initial,
            lambda angles, payload: equilibria(model, angles, payload).tip,
            ANGLES,
        )
        write_table(
            FOLDER / "evaluations" / f"{label}.parquet",
            {field.name: frame[field.name].to_numpy() for field in EVALUATION_FIELDS},
            EVALUATION_FIELDS,
            evaluation_checksum(arm, label),
        )
        values = statistics(frame)
        print(
            f"{label}: mean error {1e3 * values['mean_error']:.3f} mm, "
            f"max {1e3 * values['max_error']:.3f} mm, "
            f"{values['n_failed']} of {values['n_conditions']} failed"
        )
    names = [name for name, network in arm.all_networks.items() if network.kind == "gauges"]
    fits = pd.concat([fit(arm, model, name) for name in names])
    columns = {field.name: fits[field.name].to_numpy() for field in FIT_FIELDS}
    write_table(FOLDER / "fit.parquet", columns, FIT_FIELDS, fit_checksum(arm))


def chosen_method(
    arm: parameters.ElasticArm, label: str, model: FlexibleArm, found: Equilibria
) -> Method:
    """Method `label` for targets that the arm is on in the equilibria `found`.

    Only a method that is given gauges is told anything of them: what the gauges show there.
    """
    if label == "none":
        return uncompensated(model.geometry)
    method = arm.methods[label]
    deformation = None
    if isinstance(method, parameters.GaugeMethod):
        readings = arm.all_networks[method.network].readings
        generator = noise_generator(arm, readings, STREAM_OF_TARGETS)
        deformation = gauges.read(gauges_of(arm), *found[1:], generator).deformation
    return arm_method(method, model.geometry, trained(arm, method.network), deformation)


def trained(arm: parameters.ElasticArm, name: str) -> Network:
    """Network `name`."""
    return load_network(FOLDER / "networks" / f"{name}.json", network_checksum(arm, name))[0]


def fit(arm: parameters.ElasticArm, model: FlexibleArm, name: str) -> pd.DataFrame:
    """Columns FIT_FIELDS of network `name`."""
    readings, shown = read_readings(FOLDER, arm, arm.all_networks[name].readings or "")
    table = learning_table(readings, shown, "gauges")
    inputs = table[[field.name for field in KINDS["gauges"].inputs]].to_numpy()
    angles = trained(arm, name).predict(inputs)
    tip = flexible_forward(model.geometry, angles, table[list(DEFORMATION)].to_numpy())
    achieved = equilibria(model, angles, readings["payload"].to_numpy()).tip
    columns = [np.full(len(table), name), np.arange(len(table)), angles, tip, achieved]
    return pd.DataFrame(columns_of(columns, FIT_FIELDS))


if __name__ == "__main__":
    stage.run(main)
