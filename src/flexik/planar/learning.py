"""What the networks of a planar machine learn from: inputs and outputs of both sets of samples."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field, read_table
from flexik.kinematics.crane import inverse
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.machine_file import manipulator_of
from flexik.kinematics.manipulator import Manipulator
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, Lesson
from flexik.machines.planar import PlanarMachine
from flexik.parameters.trainers import Stopping
from flexik.planar.fields import (
    PAYLOAD,
    RIGID,
    TIP,
    Fields,
    coordinates,
    deflection,
    kept,
    sample_fields,
)
from flexik.planar.fields import inputs as inputs_of

Array = NDArray[np.float64]

# Coordinates closer than this are the same, m or rad
_SAME = 1e-6

DEFLECTION = (
    Field("deflection_x", "m", "flexible minus rigid tip"),
    Field("deflection_y", "m", "flexible minus rigid tip"),
)
REMAINDER = (
    Field("remainder_x", "m", "flexible tip minus that of beam theory"),
    Field("remainder_y", "m", "flexible tip minus that of beam theory"),
)
CORRECTION = (
    Field("correction_x", "m", "flexible tip minus the rigid network's"),
    Field("correction_y", "m", "flexible tip minus the rigid network's"),
)


@dataclass(frozen=True)
class Kind:
    """Input and output columns of a kind of network.

    once_a_pose : payload is no input, so each pose is learnt from once.
    one_branch : only poses that the rigid inverse takes for their tip and branch: where a second
        pose has the same ones, coordinates are no function of them.
    """

    inputs: Fields
    outputs: Fields
    once_a_pose: bool = False
    one_branch: bool = False


def kind_of(machine: PlanarMachine, name: str) -> Kind:
    """The kind `name` of networks of `machine`; an inverse one is told coordinates beyond two."""
    given = coordinates(machine)
    loaded = (*given, PAYLOAD)
    return {
        "deflection": Kind(loaded, DEFLECTION),
        "remainder": Kind(loaded, REMAINDER),
        "tip": Kind(loaded, TIP),
        "rigid_tip": Kind(given, RIGID, once_a_pose=True),
        "correction": Kind(loaded, CORRECTION),
        "coordinates": Kind((*TIP, PAYLOAD, *given[2:]), given[:2], one_branch=True),
    }[name]


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
    machine: PlanarMachine,
    grid: Path,
    selection: Path,
    base: Predictor | None = None,
) -> Lesson:
    """What a network of `kind` learns from the table `grid`, chosen by `selection`.

    `base` is what others add to: of kind `correction` the trained rigid network, its errors
    included (Rouvinen 1999, chapter 4.3), of kind `remainder` beam theory.
    """
    tables = [kept(read_table(path, sample_fields(machine))) for path in (grid, selection)]
    (inputs, outputs), chosen_by = (pair(table, kind, machine, base) for table in tables)
    judge = None
    if kind == "coordinates":
        reach = np.ptp(tables[0][_names(TIP)].to_numpy(), axis=0) / 2.0
        judge = functools.partial(error_at_tip, manipulator_of(machine), *chosen_by, reach)
    columns = kind_of(machine, kind)
    return Lesson(
        inputs,
        outputs,
        quantities(columns.inputs),
        quantities(columns.outputs),
        architecture,
        trainer,
        seed,
        chosen_by,
        judge,
    )


def error_at_tip(
    manipulator: Manipulator, inputs: Array, values: Array, reach: Array, network: Predictor
) -> float:
    """Root mean square of what errors of two coordinates move the rigid tip, over `reach`.

    One millimetre of a crane's stroke moves the tip by a few millimetres in one pose and by
    centimetres in another (Rouvinen 1999, chapter 4.4), so errors of strokes do not tell inverse
    networks apart.

    Parameters
    ----------
    inputs : (n, 3 + k - 2) of kind `coordinates`, the last ones the coordinates beyond two
    values : (n, 2) the first two
    reach : (2,) half the extent of the tips in x and y, m
    network : gives the first two (n, 2) at `inputs`
    """
    found = np.clip(network.predict(inputs), manipulator.lower[:2], manipulator.upper[:2])
    commanded, exact = (
        manipulator.forward(np.column_stack([pair, inputs[:, 3:]])) for pair in (found, values)
    )
    return float(np.sqrt(np.mean(((commanded - exact) / reach) ** 2)))


def correction(table: pd.DataFrame, machine: PlanarMachine, rigid: Predictor) -> Array:
    """Flexible tip minus the tip that network `rigid` gives (n, 2) in m."""
    values = table[_names(coordinates(machine))].to_numpy()
    return table[_names(TIP)].to_numpy() - rigid.predict(values)


def on_branch(table: pd.DataFrame, machine: PlanarMachine) -> NDArray[np.bool_]:
    """Whether the rigid inverse takes the pose of each row (n,) for its rigid tip and branch."""
    values, tips = (table[_names(f)].to_numpy() for f in (coordinates(machine), RIGID))
    manipulator = manipulator_of(machine)
    if isinstance(manipulator, CraneManipulator):
        taken = inverse(manipulator.geometry, tips, values[:, 2])
    else:
        taken = manipulator.inverse(tips, values)
    return taken.reached & (np.abs(taken.values - values).max(axis=1) < _SAME)


def learnt_rows(table: pd.DataFrame, kind: str, machine: PlanarMachine) -> pd.DataFrame:
    """Rows of `table` that a network of `kind` learns from or is selected by."""
    columns = kind_of(machine, kind)
    if columns.once_a_pose:
        table = table.drop_duplicates(_names(coordinates(machine)))
    return table[on_branch(table, machine)] if columns.one_branch else table


def pair(
    table: pd.DataFrame, kind: str, machine: PlanarMachine, base: Predictor | None = None
) -> tuple[Array, Array]:
    """Inputs (n, p) and outputs (n, q) of a network of `kind`; `base` as for `lesson`."""
    table = learnt_rows(table, kind, machine)
    found = {DEFLECTION: deflection(table)}
    if base is not None and kind == "remainder":
        found[REMAINDER] = deflection(table) - base.predict(table[inputs_of(machine)].to_numpy())
    elif base is not None:
        found[CORRECTION] = correction(table, machine, base)
    for pair, values in found.items():
        table = table.assign(**dict(zip(_names(pair), values.T, strict=True)))
    columns = kind_of(machine, kind)
    inputs, outputs = (
        table[_names(fields)].to_numpy() for fields in (columns.inputs, columns.outputs)
    )
    return inputs, outputs


def _names(fields: Fields) -> list[str]:
    return [field.name for field in fields]
