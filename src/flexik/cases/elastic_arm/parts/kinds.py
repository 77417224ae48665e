"""What the networks of the arm learn from the readings, by kind."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.readings import ANGLES, FIELDS, HELD_OUT, SELECTION, TRAINING
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.elastic_arm import DEFORMATION, elbow

Array = NDArray[np.float64]

_DERIVED = (
    Field("deflection_x", "m", "flexible minus rigid tip"),
    Field("deflection_y", "m", "flexible minus rigid tip"),
    Field("elbow", "1", "1 where theta_2 >= 0, else -1"),
)
_COLUMNS = {field.name: field for field in (*FIELDS, *gauges.FIELDS, *_DERIVED)}
_WITHOUT_DX = tuple(name for name in DEFORMATION if not name.startswith("dx"))


@dataclass(frozen=True)
class Kind:
    """Input and output columns of a kind of network."""

    inputs: tuple[Field, ...]
    outputs: tuple[Field, ...]

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(field.name for field in self.inputs)


def _kind(inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Kind:
    return Kind(*(tuple(_COLUMNS[name] for name in names) for names in (inputs, outputs)))


KINDS = {
    "gauges": _kind((*DEFORMATION, "p_x", "p_y"), ANGLES),
    "gauges_without_dx": _kind((*_WITHOUT_DX, "p_x", "p_y"), ANGLES),
    "gauges_elbow": _kind((*DEFORMATION, "p_x", "p_y", "elbow"), ANGLES),
    "deflection": _kind((*ANGLES, "payload"), ("deflection_x", "deflection_y")),
    "tip": _kind((*ANGLES, "payload"), ("tip_x", "tip_y")),
    "coordinates": _kind(("tip_x", "tip_y", "payload", "elbow"), ANGLES),
}


@dataclass(frozen=True, eq=False)
class LearningData:
    """Inputs (n, p) and outputs (n, q) of every reading in SI units, and its part (n,)."""

    inputs: Array
    outputs: Array
    part: NDArray[np.str_]

    def of(self, part: str) -> tuple[Array, Array]:
        """Inputs and outputs of the readings of `part`."""
        rows = self.part == part
        return self.inputs[rows], self.outputs[rows]

    @property
    def training(self) -> tuple[Array, Array]:
        """What trains."""
        return self.of(TRAINING)

    @property
    def selection(self) -> tuple[Array, Array]:
        """What selects."""
        return self.of(SELECTION)

    @property
    def held_out(self) -> tuple[Array, Array]:
        """What neither sees."""
        return self.of(HELD_OUT)


def learning_data(kind: str, readings: Path, shown: Path) -> LearningData:
    """Data of a network of `kind` from the tables of the readings and of what gauges show there."""
    table = read_table(readings)
    columns = learning_table(table, read_table(shown), kind)
    names = KINDS[kind].input_names
    return LearningData(
        columns[list(names)].to_numpy(),
        columns.drop(columns=list(names)).to_numpy(),
        table["part"].to_numpy(dtype=str),
    )


def learning_table(readings: pd.DataFrame, shown: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Inputs and outputs of a network of `kind` for every reading."""
    columns = {
        **readings,
        "deflection_x": readings["tip_x"] - readings["rigid_x"],
        "deflection_y": readings["tip_y"] - readings["rigid_y"],
        "elbow": elbow(readings[list(ANGLES)].to_numpy()),
        **shown,
    }
    fields = (*KINDS[kind].inputs, *KINDS[kind].outputs)
    return pd.DataFrame({field.name: columns[field.name] for field in fields})
