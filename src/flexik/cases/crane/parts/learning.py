"""What the networks of the crane learn from: inputs and outputs of training and selection set."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.crane.parts.fields import SAMPLE_FIELDS, STROKES, deflection, kept
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.crane import CraneGeometry, forward, inverse
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, Lesson
from flexik.parameters.trainers import Stopping

Array = NDArray[np.float64]

# Strokes closer than this are the same, m
_SAME_STROKES = 1e-6

_COLUMNS = {field.name: field for field in SAMPLE_FIELDS} | {
    field.name: field
    for field in (
        Field("deflection_x", "m", "flexible minus rigid tip"),
        Field("deflection_y", "m", "flexible minus rigid tip"),
        Field("correction_x", "m", "flexible tip minus the rigid network's"),
        Field("correction_y", "m", "flexible tip minus the rigid network's"),
    )
}


@dataclass(frozen=True)
class Kind:
    """Input and output columns of a kind of network.

    once_a_pose : payload is no input, so each pose is learnt from once.
    one_branch : only poses that the rigid inverse takes for their tip and extension; beyond the
        fold of the jib stroke a second pose has the same tip, and strokes are no function of it.
    """

    inputs: tuple[Field, ...]
    outputs: tuple[Field, ...]
    once_a_pose: bool = False
    one_branch: bool = False


def _fields(*names: str) -> tuple[Field, ...]:
    return tuple(_COLUMNS[name] for name in names)


_STROKES_AND_PAYLOAD = _fields(*STROKES, "payload")
KINDS = {
    "deflection": Kind(_STROKES_AND_PAYLOAD, _fields("deflection_x", "deflection_y")),
    "tip": Kind(_STROKES_AND_PAYLOAD, _fields("tip_x", "tip_y")),
    "rigid_tip": Kind(_fields(*STROKES), _fields("rigid_x", "rigid_y"), once_a_pose=True),
    "correction": Kind(_STROKES_AND_PAYLOAD, _fields("correction_x", "correction_y")),
    "coordinates": Kind(
        _fields("tip_x", "tip_y", "payload", "extension_stroke"),
        _fields("lift_stroke", "jib_stroke"),
        one_branch=True,
    ),
}


class Predictor(Protocol):
    """A trained network."""

    def predict(self, values: Array, /) -> Array:
        """Return outputs (n, q) at inputs (n, p), in SI units."""
        ...


def lesson(
    kind: str,
    architecture: Architecture,
    trainer: Stopping,
    seed: int,
    geometry: CraneGeometry,
    grid: Path,
    selection: Path,
    rigid: Predictor | None = None,
) -> Lesson:
    """What a network of `kind` (one of KINDS) learns from the table `grid`, chosen by `selection`.

    `rigid` is the trained rigid network that a correction corrects, its errors included
    (Rouvinen 1999, chapter 4.3); only kind `correction` needs it.
    """
    tables = [kept(read_table(path, SAMPLE_FIELDS)) for path in (grid, selection)]
    (inputs, outputs), chosen_by = (_pair(table, kind, geometry, rigid) for table in tables)
    judge = None
    if kind == "coordinates":
        reach = np.ptp(tables[0][["tip_x", "tip_y"]].to_numpy(), axis=0) / 2.0
        judge = functools.partial(stroke_error_at_tip, geometry, *chosen_by, reach)
    return Lesson(
        inputs,
        outputs,
        quantities(KINDS[kind].inputs),
        quantities(KINDS[kind].outputs),
        architecture,
        trainer,
        seed,
        chosen_by,
        judge,
    )


def stroke_error_at_tip(
    geometry: CraneGeometry, inputs: Array, strokes: Array, reach: Array, network: Predictor
) -> float:
    """Root mean square of what errors of lift and jib stroke move the rigid tip, over `reach`.

    One millimetre of a stroke moves the tip by a few millimetres in one pose and by centimetres in
    another (Rouvinen 1999, chapter 4.4), so errors of strokes do not tell inverse networks apart.

    Parameters
    ----------
    inputs : (n, 4) of kind `coordinates`, the last one the extension, m
    strokes : (n, 2) lift and jib, m
    reach : (2,) half the extent of the tips in x and y, m
    network : gives strokes (n, 2) at `inputs`
    """
    found = np.clip(network.predict(inputs), 0.0, geometry.stroke_maximum[:2])
    commanded, exact = (
        forward(geometry, np.column_stack([pair, inputs[:, -1]])) for pair in (found, strokes)
    )
    return float(np.sqrt(np.mean(((commanded - exact) / reach) ** 2)))


def correction(table: pd.DataFrame, rigid: Predictor) -> Array:
    """Flexible tip minus the tip that network `rigid` gives (n, 2) in m."""
    return table[["tip_x", "tip_y"]].to_numpy() - rigid.predict(table[list(STROKES)].to_numpy())


def on_branch(table: pd.DataFrame, geometry: CraneGeometry) -> NDArray[np.bool_]:
    """Whether the rigid inverse takes the pose of each row (n,) for its rigid tip and extension."""
    strokes = table[list(STROKES)].to_numpy()
    taken = inverse(geometry, table[["rigid_x", "rigid_y"]].to_numpy(), strokes[:, 2])
    return taken.reached & (np.abs(taken.values - strokes).max(axis=1) < _SAME_STROKES)


def learnt_rows(table: pd.DataFrame, kind: str, geometry: CraneGeometry) -> pd.DataFrame:
    """Rows of `table` that a network of `kind` learns from or is selected by."""
    if KINDS[kind].once_a_pose:
        table = table.drop_duplicates(list(STROKES))
    return table[on_branch(table, geometry)] if KINDS[kind].one_branch else table


def _pair(
    table: pd.DataFrame, kind: str, geometry: CraneGeometry, rigid: Predictor | None
) -> tuple[Array, Array]:
    table = learnt_rows(table, kind, geometry)
    bent = deflection(table)
    table = table.assign(deflection_x=bent[:, 0], deflection_y=bent[:, 1])
    if rigid is not None:
        left = correction(table, rigid)
        table = table.assign(correction_x=left[:, 0], correction_y=left[:, 1])
    columns = (
        [field.name for field in fields] for fields in (KINDS[kind].inputs, KINDS[kind].outputs)
    )
    inputs, outputs = (table[names].to_numpy() for names in columns)
    return inputs, outputs
