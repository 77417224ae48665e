"""What varies one thing: mesh, shape, size of a network, tolerance, and the crane as built."""

from flexik.cases.crane.parts import fitting, mesh, shape, tolerance
from flexik.cases.crane.parts.measured.parts import measured_parts
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part


def parts(section: Section) -> list[Part]:
    """The studies of the nominal crane, then those of the measured one."""
    nominal = [study.part(section) for study in (mesh, shape, fitting, tolerance)]
    return nominal + measured_parts(section)
