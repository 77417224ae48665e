"""What the networks of the crane learn from: inputs and outputs of training and selection set."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.crane import FIELDS, INPUTS, deflection, kept
from flexik.datasets.provenance import grid_checksum, selection_checksum
from flexik.datasets.tables import Field, read_table

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kind:
    """What a kind of network gives: its output columns, and their values (n, q) from a table."""

    outputs: tuple[Field, ...]
    learn: Callable[[pd.DataFrame], Array]


KINDS = {
    "deflection": Kind(
        (
            Field("deflection_x", "m", "flexible minus rigid tip"),
            Field("deflection_y", "m", "flexible minus rigid tip"),
        ),
        deflection,
    ),
}
INPUT_FIELDS = tuple(field for field in FIELDS if field.name in INPUTS)


@dataclass(frozen=True, eq=False)
class LearningData:
    """Inputs (n, 4) and outputs (n, q) to train with, and (m, 4), (m, q) to select by; SI units."""

    inputs: Array
    outputs: Array
    selection_inputs: Array
    selection_outputs: Array


def read_learning_data(
    folder: Path, crane: parameters.Crane, spring_stiffness: float, kind: str
) -> LearningData:
    """Data of a network of `kind` (one of KINDS) from the tables in `folder`.

    Raises DataError if a table is missing, damaged or made with other parameters.
    """
    learn = KINDS[kind].learn
    made_with = grid_checksum(crane, spring_stiffness)
    grid = kept(read_table(folder / "grid.parquet", FIELDS, made_with))
    made_with = selection_checksum(crane, spring_stiffness)
    selection = kept(read_table(folder / "selection.parquet", FIELDS, made_with))
    inputs = list(INPUTS)
    return LearningData(
        grid[inputs].to_numpy(), learn(grid), selection[inputs].to_numpy(), learn(selection)
    )
