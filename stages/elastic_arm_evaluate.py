"""Command the flexible arm to the random targets by every method, and to the readings.

One stage for all methods: they share the targets, and each takes a fraction of a second.
Reads params.yaml: elastic_arm; the tables of elastic_arm_generate; the networks;
data/elastic_arm/targets.parquet.
Writes data/elastic_arm/evaluations/METHOD.parquet, errors at the targets, METHOD a name under
elastic_arm.methods or none; fit.parquet, what the networks given gauges say for every reading,
and where the arm is then; sensitivity.parquet, how far off it is in the held-out readings when one
input is off; and payload_error.parquet, errors at the targets when the payload is told too large.
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
    PAYLOAD_ERROR_FIELDS,
    SENSITIVITY_FIELDS,
    TARGET_FIELDS,
    learning_table,
    read_readings,
)
from flexik.datasets.elastic_arm.provenance import (
    evaluation_checksum,
    fit_checksum,
    network_checksum,
    payload_error_checksum,
    targets_checksum,
)
from flexik.datasets.elastic_arm.readings import (
    ANGLES,
    HELD_OUT,
    STREAM_OF_TARGETS,
    columns_of,
    gauges_of,
    noise_generator,
)
from flexik.datasets.tables import Field, read_table, write_table
from flexik.evaluation.conditions import Conditions, random_conditions
from flexik.evaluation.errors import evaluate, statistics
from flexik.learning.perceptron import Network
from flexik.learning.storage import load_network
from flexik.kinematics.elastic_arm import DEFORMATION, flexible_forward
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import Equilibria, FlexibleArm, equilibria
from flexik.parameters import load_parameters
from flexik.positioning.elastic_arm.assembly import arm_method, uncompensated
from flexik.positioning.method import Array, Command, Method

FOLDER = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    model = flexible_arm(arm)
    table = read_table(FOLDER / "targets.parquet", TARGET_FIELDS, targets_checksum(arm))
    conditions = random_conditions(table[["target_x", "target_y"]], table["payload"])
    found = equilibria(model, table[list(ANGLES)].to_numpy(), conditions.payload)
    for label in ("none", *arm.methods):
        frame = evaluated(chosen_method(arm, label, model, found), conditions, model)
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
    names, made_with = arm.gauge_networks, fit_checksum(arm)
    write("fit", [fit(arm, model, name) for name in names], FIT_FIELDS, made_with)
    by_input = [sensitivity(arm, model, name) for name in names]
    write("sensitivity", by_input, SENSITIVITY_FIELDS, made_with)
    write(
        "payload_error",
        [
            payload_error(arm, label, model, found, conditions)
            for label, method in arm.methods.items()
            if not isinstance(method, parameters.GaugeMethod)
        ],
        PAYLOAD_ERROR_FIELDS,
        payload_error_checksum(arm),
    )


def write(name: str, frames: list[pd.DataFrame], fields: tuple[Field, ...], made_with: str) -> None:
    """Write `frames`, one below the other, into the table `name`."""
    table = pd.concat(frames) if frames else pd.DataFrame(columns=[f.name for f in fields])
    columns = {field.name: table[field.name].to_numpy() for field in fields}
    write_table(FOLDER / f"{name}.parquet", columns, fields, made_with)


def evaluated(method: Method, conditions: Conditions, model: FlexibleArm) -> pd.DataFrame:
    """Columns EVALUATION_FIELDS of `method`."""
    frame = evaluate(
        method,
        conditions,
        # from the stretched arm; only a row without a solution would stay there
        np.zeros((len(conditions), 2)),
        lambda angles, payload: equilibria(model, angles, payload).tip,
        ANGLES,
    )
    return frame if "n_clipped" in frame else frame.assign(n_clipped=0)


def chosen_method(
    arm: parameters.ElasticArm, label: str, model: FlexibleArm, found: Equilibria
) -> Method:
    """Method `label` for targets that the arm is on in the equilibria `found`.

    Only a method that is given gauges is told anything of them: what the gauges show there.
    """
    if label == "none":
        return uncompensated(model.geometry)
    method = arm.methods[label]
    network, deformation = arm.all_networks[method.network], None
    if isinstance(method, parameters.GaugeMethod):
        generator = noise_generator(arm, network.readings, STREAM_OF_TARGETS)
        of_network = gauges_of(arm, network.readings)
        deformation = gauges.read(of_network, *found[1:], generator).deformation
    by = trained(arm, method.network)
    return arm_method(method, model.geometry, by, deformation, network.kind)


def trained(arm: parameters.ElasticArm, name: str) -> Network:
    """Network `name`."""
    return load_network(FOLDER / "networks" / f"{name}.json", network_checksum(arm, name))[0]


def payload_error(
    arm: parameters.ElasticArm,
    label: str,
    model: FlexibleArm,
    found: Equilibria,
    conditions: Conditions,
) -> pd.DataFrame:
    """Columns PAYLOAD_ERROR_FIELDS of method `label`, told more payload than there is."""
    method = chosen_method(arm, label, model, found)

    def told(targets: Array, payload: Array, initial_strokes: Array) -> Command:
        return method(targets, payload + arm.workspace.payload_error, initial_strokes)

    return evaluated(told, conditions, model).assign(method=label)


def fit(arm: parameters.ElasticArm, model: FlexibleArm, name: str) -> pd.DataFrame:
    """Columns FIT_FIELDS of network `name`; the arm is moved within its joint limits."""
    readings, shown = read_readings(FOLDER, arm, arm.all_networks[name].readings or "")
    angles = trained(arm, name).predict(inputs_of(arm, name, readings, shown))
    deformation = shown[list(DEFORMATION)].to_numpy()
    tip = flexible_forward(model.geometry, angles, deformation)
    achieved = moved(model, angles, readings)
    columns = [np.full(len(readings), name), np.arange(len(readings)), angles, tip, achieved]
    return pd.DataFrame(columns_of(columns, FIT_FIELDS))


def sensitivity(arm: parameters.ElasticArm, model: FlexibleArm, name: str) -> pd.DataFrame:
    """Columns SENSITIVITY_FIELDS of network `name`: no input off, then each by its uncertainty.

    The uncertainty is that of the gauges with noise, whether the network learnt with it or not.
    """
    readings, shown = read_readings(FOLDER, arm, arm.all_networks[name].readings or "")
    held_out = readings["part"] == HELD_OUT
    readings, shown = readings[held_out], shown[held_out]
    network, inputs = trained(arm, name), inputs_of(arm, name, readings, shown)
    changes = {"nothing": 0.0} | dict(
        zip(DEFORMATION, gauges.uncertainty(gauges_of(arm)).tolist(), strict=True)
    )
    names = [field.name for field in KINDS[arm.all_networks[name].kind].inputs]
    frames = []
    for changed, change in changes.items():
        if changed not in ("nothing", *names):
            continue
        off = inputs + change * (np.array(names) == changed)
        apart = moved(model, network.predict(off), readings)
        apart = apart - readings[["tip_x", "tip_y"]].to_numpy()
        columns = [np.full(len(readings), value) for value in (name, changed, change)]
        columns += [readings.index.to_numpy(), np.hypot(*apart.T)]
        frames.append(pd.DataFrame(columns_of(columns, SENSITIVITY_FIELDS)))
    return pd.concat(frames)


def inputs_of(
    arm: parameters.ElasticArm, name: str, readings: pd.DataFrame, shown: pd.DataFrame
) -> np.ndarray:
    """Inputs (n, p) of network `name` in `readings`."""
    kind = arm.all_networks[name].kind
    table = learning_table(readings, shown, kind)
    return table[[field.name for field in KINDS[kind].inputs]].to_numpy()


def moved(model: FlexibleArm, angles: np.ndarray, readings: pd.DataFrame) -> np.ndarray:
    """Tip (n, 2) in m of the arm at `angles` within its limits, with the payloads of `readings`."""
    limits = model.geometry.lower, model.geometry.upper
    return equilibria(model, np.clip(angles, *limits), readings["payload"].to_numpy()).tip


if __name__ == "__main__":
    stage.run(main)
