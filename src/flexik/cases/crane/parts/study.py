"""What varies one thing: mesh, shape, size of a network, tolerance, and the crane as built."""

from flexik.cases.crane.parts import fitting, mesh, shape, tolerance
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part


def parts(section: Section) -> list[Part]:
    """The studies of the nominal crane."""
    return [study.part(section) for study in (mesh, shape, fitting, tolerance)]
