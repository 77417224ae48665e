"""The flexible machine with the constants that the pipeline has calibrated, for parts."""

from pathlib import Path

from flexik.evaluation.errors import TIP_ERRORS
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.planar import fields
from flexik.planar.constants import known
from flexik.positioning.method import Columns


def flexible(machine: PlanarMachine, constants: Path | None = None) -> FlexibleMachine:
    """The flexible `machine` with the fitted `constants` of a file."""
    return FlexibleMachine(known(machine, constants))


def columns_of(machine: PlanarMachine) -> Columns:
    """Columns of queries, answers and errors."""
    lower, upper = zip(*(drive.limits for drive in machine.drives.values()), strict=True)
    return Columns(fields.QUERY, fields.coordinates(machine), TIP_ERRORS, lower, upper)
