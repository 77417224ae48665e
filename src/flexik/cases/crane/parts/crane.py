"""The flexible crane that the pipeline has calibrated, for parts that put it into equilibrium."""

from pathlib import Path
from typing import Any

from flexik.cases.crane.parts.fields import QUERY_FIELDS, SAMPLE_FIELDS
from flexik.cases.crane.section import Section
from flexik.evaluation.errors import TIP_ERRORS
from flexik.machines.crane import Machine
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.method import Columns


def model_inputs(section: Section) -> dict[str, Any]:
    """Inputs `spring` and `sections` of a part that solves the flexible crane."""
    spring = section.data / "constants/spring.json"
    return {"spring": spring, "sections": section.machine.structure.beams.sections}


def flexible(machine: Machine, spring: Path) -> FlexibleCrane:
    """The crane `machine` on the ground spring of the file `spring`."""
    return flexible_crane(machine, read_spring_stiffness(spring))


def columns_of(machine: Machine) -> Columns:
    """Columns of queries, answers and errors."""
    return Columns(
        QUERY_FIELDS,
        SAMPLE_FIELDS[:3],
        TIP_ERRORS,
        (0.0, 0.0, 0.0),
        machine.geometry.stroke_maximum,
    )
