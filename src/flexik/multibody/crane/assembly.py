"""The flexible crane as data/machines/crane.yaml describes it."""

import math
from pathlib import Path

from flexik.errors import DataError
from flexik.files import read_json
from flexik.machines.crane import Machine, Structure
from flexik.machines.sections import read_section
from flexik.multibody.beams import Beam
from flexik.multibody.crane.structure import CraneStructure, FlexibleCrane


def flexible_crane(machine: Machine, spring_stiffness: float) -> FlexibleCrane:
    """Build the crane `machine` on a ground spring of `spring_stiffness` N m/rad.

    Raises DataError if a section table cannot be read.
    """
    given = machine.structure
    structure = CraneStructure(
        **{name: _beam(given, name) for name in given.beams.sections},
        rocker=given.rocker,
        coupler=given.coupler,
        lift_axis_height=given.lift_axis_height,
        jib_axis_height=given.jib_axis_height,
        gravity=given.gravity,
    )
    return FlexibleCrane(machine.geometry, structure, spring_stiffness, given.element)


def read_spring_stiffness(path: Path | str) -> float:
    """Fitted ground spring in N m/rad; raises DataError if the file is missing or damaged."""
    calibration = read_json(path)
    stiffness = calibration.get("spring_stiffness") if isinstance(calibration, dict) else None
    if not isinstance(stiffness, float | int) or not 0.0 < stiffness < math.inf:
        raise DataError(f"{path}: expected a positive number spring_stiffness, got {stiffness!r}")
    return float(stiffness)


def _beam(structure: Structure, name: str) -> Beam:
    given = getattr(structure.beams, name)
    try:
        section = read_section(given.section)
    except DataError as error:
        raise DataError(f"structure.beams.{name}.section: {error}") from None
    others = given.model_dump(exclude={"section"})
    return Beam(section=section, youngs_modulus=structure.youngs_modulus, **others)
