"""What the networks of a planar machine learn from: inputs and outputs of both sets of samples."""

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field, read_table
from flexik.kinematics.crane import inverse
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.machine_file import manipulator_of
from flexik.kinematics.manipulator import Manipulator, RigidSolution
from flexik.learning.payload_polynomial import (
    DEGREES,
    Interpolated,
    Predictor,
    lagrange,
    nodes_of,
)
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

# Coordinates and tips closer than this are the same, m or rad
_SAME = 1e-6
# Coordinates that a payload moves less, in shares of their ranges, are of the same pose
_NEAR = 0.1

DEFLECTION = (
    Field("deflection_x", "m", "flexible minus rigid tip"),
    Field("deflection_y", "m", "flexible minus rigid tip"),
)
REMAINDER = (
    Field("remainder_x", "m", "flexible tip minus that of beam theory"),
    Field("remainder_y", "m", "flexible tip minus that of beam theory"),
)
SHIFT = (
    Field("shift_x", "m", "rigid minus flexible tip"),
    Field("shift_y", "m", "rigid minus flexible tip"),
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
    moved = tuple(
        Field(f"shift_{f.name}", f.unit, f"{f.name} minus that of the rigid inverse of the tip")
        for f, drive in zip(given, machine.drives, strict=True)
        if drive != machine.smallest_first
    )
    known = {
        "deflection": Kind(loaded, DEFLECTION),
        "remainder": Kind(loaded, REMAINDER),
        "tip": Kind(loaded, TIP),
        "rigid_tip": Kind(given, RIGID, once_a_pose=True),
        "correction": Kind(loaded, CORRECTION),
        "coordinates": Kind((*TIP, PAYLOAD, *given[2:]), given[:2], one_branch=True),
        "target_shift": Kind(loaded, SHIFT),
        "stroke_shift": Kind(loaded, moved),
    }
    known |= {
        kind: Kind(given, at_nodes(degree), once_a_pose=True) for kind, degree in DEGREES.items()
    }
    return known[name]


def at_nodes(degree: int) -> Fields:
    """Deflections at the payloads of payload_polynomial.nodes_of."""
    return tuple(
        Field(f"deflection_{axis}_{k}", "m", f"flexible minus rigid tip at payload {k} of {degree}")
        for k in range(degree + 1)
        for axis in "xy"
    )


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
    judge, chosen_by = None, None
    if kind in DEGREES:
        inputs, outputs = _polynomials(tables[0], machine, DEGREES[kind])
        nodes, chosen = nodes_of(tables[0], DEGREES[kind]), tables[1]
        asked, answers = chosen[inputs_of(machine)].to_numpy(), deflection(chosen)
        judge = functools.partial(error_of_deflection, nodes, asked, answers)
    else:
        (inputs, outputs), chosen_by = (_pair(table, kind, machine, base) for table in tables)
    if kind == "coordinates" and chosen_by is not None:
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


def error_of_deflection(nodes: Array, inputs: Array, values: Array, network: Predictor) -> float:
    """Root mean square error of deflections (n, 2) at `inputs` (n, k + 1), over half their extent.

    `network` gives them at the payloads `nodes` (m,), see payload_polynomial.
    """
    error = Interpolated(network, nodes).predict(inputs) - values
    return float(np.sqrt(np.mean((error / (np.ptp(values, axis=0) / 2.0)) ** 2)))


def rigid_inverse(machine: PlanarMachine, tips: Array, values: Array) -> RigidSolution:
    """Rigid inverse of `tips` (n, 2) on the branch of the coordinates `values` (n, k)."""
    manipulator = manipulator_of(machine)
    if isinstance(manipulator, CraneManipulator):
        return inverse(manipulator.geometry, tips, values[:, 2])
    return manipulator.inverse(tips, values)


def on_branch(table: pd.DataFrame, machine: PlanarMachine) -> NDArray[np.bool_]:
    """Whether the rigid inverse takes the pose of each row (n,) for its rigid tip and branch."""
    values, tips = (table[_names(f)].to_numpy() for f in (coordinates(machine), RIGID))
    taken = rigid_inverse(machine, tips, values)
    return taken.reached & (np.abs(taken.values - values).max(axis=1) < _SAME)


def learnt_rows(table: pd.DataFrame, kind: str, machine: PlanarMachine) -> pd.DataFrame:
    """Rows of `table` that a network of `kind` learns from or is selected by."""
    columns = kind_of(machine, kind)
    if columns.once_a_pose:
        table = table.drop_duplicates(_names(coordinates(machine)))
    return table[on_branch(table, machine)] if columns.one_branch else table


def _pair(
    table: pd.DataFrame, kind: str, machine: PlanarMachine, base: Predictor | None
) -> tuple[Array, Array]:
    table, columns = learnt_rows(table, kind, machine), kind_of(machine, kind)
    if kind in ("target_shift", "stroke_shift"):
        return _shifts(table, kind, machine)
    found = {DEFLECTION: deflection(table)}
    if base is not None and kind == "remainder":
        found[REMAINDER] = deflection(table) - base.predict(table[inputs_of(machine)].to_numpy())
    elif base is not None:
        found[CORRECTION] = correction(table, machine, base)
    for pair, values in found.items():
        table = table.assign(**dict(zip(_names(pair), values.T, strict=True)))
    inputs, outputs = (
        table[_names(fields)].to_numpy() for fields in (columns.inputs, columns.outputs)
    )
    return inputs, outputs


def _shifts(table: pd.DataFrame, kind: str, machine: PlanarMachine) -> tuple[Array, Array]:
    """Rigid inverse of the loaded tips, and what it lacks to put the loaded tip there.

    Only of tips that the rigid machine can be put on, though beyond its limits, from the same pose.
    """
    values, tips = (table[_names(f)].to_numpy() for f in (coordinates(machine), TIP))
    rigid, manipulator = rigid_inverse(machine, tips, values), manipulator_of(machine)
    with np.errstate(invalid="ignore"):
        moved = np.abs(rigid.values - values) / (manipulator.upper - manipulator.lower)
        off = np.abs(manipulator.forward(np.nan_to_num(rigid.values)) - tips)
    used = (moved.max(axis=1) < _NEAR) & (off.max(axis=1) < _SAME)
    outputs = -deflection(table)
    if kind == "stroke_shift":
        kept_drive = [drive != machine.smallest_first for drive in machine.drives]
        outputs = (values - rigid.values)[:, kept_drive]
    inputs = np.column_stack([rigid.values, table[PAYLOAD.name]])
    return inputs[used], outputs[used]


def _polynomials(table: pd.DataFrame, machine: PlanarMachine, degree: int) -> tuple[Array, Array]:
    """Poses, and deflections at the payloads of nodes_of of the polynomials nearest to them."""
    poses, number = np.unique(
        table[_names(coordinates(machine))].to_numpy(), axis=0, return_inverse=True
    )
    weights = lagrange(nodes_of(table, degree), table[PAYLOAD.name].to_numpy())
    normal, right = (
        np.zeros((len(poses), degree + 1, degree + 1)),
        np.zeros((len(poses), degree + 1, 2)),
    )
    np.add.at(normal, number, weights[:, :, None] * weights[:, None])
    np.add.at(right, number, weights[:, :, None] * deflection(table)[:, None])
    found = np.asarray(np.linalg.solve(normal, right), dtype=float)
    return poses, found.reshape(len(poses), -1)


def _names(fields: Fields) -> list[str]:
    return [field.name for field in fields]
