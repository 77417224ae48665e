"""What the networks of the elastic arm learn from, and the fields of what comes of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.provenance import readings_checksum
from flexik.datasets.elastic_arm.readings import ANGLES, FIELDS, HELD_OUT, SELECTION, TRAINING
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.elastic_arm import DEFORMATION, elbow

Array = NDArray[np.float64]

_DERIVED = (
    Field("deflection_x", "m", "flexible minus rigid tip"),
    Field("deflection_y", "m", "flexible minus rigid tip"),
    Field("elbow", "1", "1 where theta_2 >= 0, else -1"),
)
_COLUMNS = {field.name: field for field in (*FIELDS, *gauges.FIELDS, *_DERIVED)}


def _fields(*names: str) -> tuple[Field, ...]:
    return tuple(_COLUMNS[name] for name in names)


@dataclass(frozen=True)
class Kind:
    """Input and output columns of a kind of network."""

    inputs: tuple[Field, ...]
    outputs: tuple[Field, ...]


KINDS = {
    "gauges": Kind(_fields(*DEFORMATION, "p_x", "p_y"), _fields(*ANGLES)),
    "gauges_without_dx": Kind(
        _fields(*(name for name in DEFORMATION if not name.startswith("dx")), "p_x", "p_y"),
        _fields(*ANGLES),
    ),
    "gauges_elbow": Kind(_fields(*DEFORMATION, "p_x", "p_y", "elbow"), _fields(*ANGLES)),
    "deflection": Kind(_fields(*ANGLES, "payload"), _fields("deflection_x", "deflection_y")),
    "inverse": Kind(_fields("tip_x", "tip_y", "payload", "elbow"), _fields(*ANGLES)),
}

FIT_FIELDS = (
    Field("network", "1", "name of the network", "string"),
    Field("reading", "1", "row of the readings, from 0", "int64"),
    Field("network_theta_1", "rad", "angle of joint 1, by the network"),
    Field("network_theta_2", "rad", "angle of joint 2, by the network"),
    Field("network_p_x", "m", "equation 44 at these angles and the deformation by the gauges"),
    Field("network_p_y", "m", "equation 45 there"),
    Field("achieved_x", "m", "tip of the flexible model at these angles, forward"),
    Field("achieved_y", "m", "tip of the flexible model at these angles, upward"),
)
EVALUATION_FIELDS = (
    Field("point", "1", "number of the target, from 0", "int64"),
    Field("target_x", "m", "target, forward"),
    Field("target_y", "m", "target, upward"),
    Field("payload", "kg", "point mass at the tip"),
    Field("theta_1", "rad", "commanded angle of joint 1"),
    Field("theta_2", "rad", "commanded angle of joint 2"),
    Field("achieved_x", "m", "tip of the flexible model at the commanded angles"),
    Field("achieved_y", "m", "tip of the flexible model at the commanded angles"),
    Field("error_x", "m", "desired minus achieved"),
    Field("error_y", "m", "desired minus achieved"),
    Field("error", "m", "length of the error"),
    Field("status", "1", "0 reached, else see flexik.positioning.method", "int64"),
    Field("n_clipped", "1", "angles by a network that were clipped to the limits", "int64"),
)
SENSITIVITY_FIELDS = (
    Field("network", "1", "name of the network", "string"),
    Field("input", "1", "input that is off, or nothing", "string"),
    Field("change", "1", "by how much it is off, m or rad"),
    Field("reading", "1", "row of the readings, from 0", "int64"),
    Field("error", "m", "of the flexible model's tip from its tip in the reading"),
)
PAYLOAD_ERROR_FIELDS = (
    Field("method", "1", "name of the method", "string"),
    Field("point", "1", "number of the target, from 0", "int64"),
    Field("error", "m", "length of the error where the payload is told too large"),
)
SPLIT_FIELDS = (
    Field("seed", "1", "of the division of the readings", "int64"),
    *(Field(f"r_{name}", "1", f"R of {name} on its held-out readings") for name in ANGLES),
)
TARGET_FIELDS = (
    *EVALUATION_FIELDS[1:4],
    *(Field(name, "rad", "puts the loaded tip on the target") for name in ANGLES),
)


@dataclass(frozen=True, eq=False)
class LearningData:
    """Inputs (n, p) and outputs (n, q) to train with, and (m, p), (m, q) to select by; SI units."""

    inputs: Array
    outputs: Array
    selection_inputs: Array
    selection_outputs: Array


def read_readings(
    folder: Path, arm: parameters.ElasticArm, shown: str = gauges.FREE_OF_NOISE
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Readings of the model, and what gauges show of them (`shown`: noise_free or noisy).

    Raises DataError if a table is missing, damaged or made with other parameters.
    """
    made_with = readings_checksum(arm)
    return (
        read_table(folder / "readings.parquet", FIELDS, made_with),
        read_table(folder / f"gauges_{shown}.parquet", gauges.FIELDS, made_with),
    )


def read_learning_data(folder: Path, arm: parameters.ElasticArm, name: str) -> LearningData:
    """Data of network `name` from the tables in `folder`; the held-out readings are not among them.

    Raises DataError as `read_readings` does.
    """
    inputs, outputs, part = read_all(folder, arm, name)
    return divided(inputs, outputs, part)[0]


def read_all(
    folder: Path, arm: parameters.ElasticArm, name: str
) -> tuple[Array, Array, NDArray[np.str_]]:
    """Inputs (n, p) and outputs (n, q) of network `name` for every reading, and their part (n,)."""
    network = arm.all_networks[name]
    readings, shown = read_readings(folder, arm, network.readings or gauges.FREE_OF_NOISE)
    table, kind = learning_table(readings, shown, network.kind), KINDS[network.kind]
    inputs, outputs = (
        table[[field.name for field in fields]].to_numpy() for fields in (kind.inputs, kind.outputs)
    )
    return inputs, outputs, readings["part"].to_numpy(dtype=str)


def divided(
    inputs: Array, outputs: Array, part: NDArray[np.str_]
) -> tuple[LearningData, tuple[Array, Array]]:
    """What trains and selects, and the inputs and outputs that are held out of both."""
    training, selection, held_out = (
        (inputs[part == name], outputs[part == name]) for name in (TRAINING, SELECTION, HELD_OUT)
    )
    return LearningData(*training, *selection), held_out


def learning_table(readings: pd.DataFrame, shown: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Inputs and outputs of a network of `kind` for every reading."""
    angles = readings[list(ANGLES)].to_numpy()
    columns = {
        **readings,
        "deflection_x": readings["tip_x"] - readings["rigid_x"],
        "deflection_y": readings["tip_y"] - readings["rigid_y"],
        "elbow": elbow(angles),
        **shown,
    }
    fields = (*KINDS[kind].inputs, *KINDS[kind].outputs)
    return pd.DataFrame({field.name: columns[field.name] for field in fields})
