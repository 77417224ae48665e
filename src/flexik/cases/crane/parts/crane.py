"""The flexible crane that the pipeline has calibrated, for parts that put it into equilibrium."""

import math
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from flexik.cases.crane.parts.fields import QUERY_FIELDS, SAMPLE_FIELDS
from flexik.cases.crane.section import SPRING, Section
from flexik.errors import DataError
from flexik.evaluation.errors import TIP_ERRORS
from flexik.files import read_json
from flexik.kinematics.crane import CraneGeometry
from flexik.kinematics.machine_file import crane_geometry, with_geometry
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.positioning.method import Columns


class FlexibleCrane(FlexibleMachine):
    """The crane; its rigid kinematics are in closed form."""

    @cached_property
    def geometry(self) -> CraneGeometry:
        """Its dimensions."""
        return crane_geometry(self.machine)

    def like(self, geometry: CraneGeometry) -> "FlexibleCrane":
        """The same with the dimensions `geometry`, a little off its own."""
        machine = with_geometry(self.machine, geometry)
        return replace(self, machine=machine, near=self.linkage)


def model_inputs(section: Section) -> dict[str, Any]:
    """Inputs `spring` and `sections` of a part that solves the flexible crane."""
    spring = section.data / "constants/spring.json"
    return {"spring": spring, "sections": section.machine.section_files}


def flexible(machine: PlanarMachine, spring: Path) -> FlexibleCrane:
    """The crane `machine` on the ground spring of the file `spring`.

    Raises DataError if the file is missing or damaged.
    """
    calibration = read_json(spring)
    stiffness = calibration.get("spring_stiffness") if isinstance(calibration, dict) else None
    if not isinstance(stiffness, float | int) or not 0.0 < stiffness < math.inf:
        raise DataError(f"{spring}: expected a positive number spring_stiffness, got {stiffness!r}")
    return on_spring(machine, float(stiffness))


def on_spring(machine: PlanarMachine, stiffness: float) -> FlexibleCrane:
    """The crane `machine` on a ground spring of `stiffness` N m/rad."""
    return FlexibleCrane(machine.with_constants({SPRING: stiffness}))


def columns_of(machine: PlanarMachine) -> Columns:
    """Columns of queries, answers and errors."""
    lower, upper = zip(*(drive.limits for drive in machine.drives.values()), strict=True)
    return Columns(QUERY_FIELDS, SAMPLE_FIELDS[:3], TIP_ERRORS, lower, upper)
