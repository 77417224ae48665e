"""What the networks of the arm learn from the readings, by kind."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.readings import ANGLES, FIELDS
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


class Kind(NamedTuple):
    """Columns that a kind of network is given, and that it gives."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


KINDS = {
    "gauges": Kind((*DEFORMATION, "p_x", "p_y"), ANGLES),
    "gauges_without_dx": Kind((*_WITHOUT_DX, "p_x", "p_y"), ANGLES),
    "gauges_elbow": Kind((*DEFORMATION, "p_x", "p_y", "elbow"), ANGLES),
    "deflection": Kind((*ANGLES, "payload"), ("deflection_x", "deflection_y")),
    "tip": Kind((*ANGLES, "payload"), ("tip_x", "tip_y")),
    "coordinates": Kind(("tip_x", "tip_y", "payload", "elbow"), ANGLES),
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


def fields(names: Iterable[str]) -> list[Field]:
    """Fields of columns of `learning_table`."""
    return [_COLUMNS[name] for name in names]


def learning_data(kind: str, readings: Path, shown: Path) -> LearningData:
    """Data of a network of `kind` from the tables of the readings and of what gauges show there."""
    table = read_table(readings)
    columns = learning_table(table, read_table(shown))
    inputs, outputs = (columns[list(names)].to_numpy() for names in KINDS[kind])
    return LearningData(inputs, outputs, table["part"].to_numpy(dtype=str))


def learning_table(readings: pd.DataFrame, shown: pd.DataFrame) -> pd.DataFrame:
    """All that networks learn from, for every reading; deformation as the gauges show it."""
    columns = {
        **readings,
        "deflection_x": readings["tip_x"] - readings["rigid_x"],
        "deflection_y": readings["tip_y"] - readings["rigid_y"],
        "elbow": elbow(readings[list(ANGLES)].to_numpy()),
        **shown,
    }
    return pd.DataFrame(columns)
