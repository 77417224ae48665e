"""What varies one thing: mesh, shape, size of a network, tolerance, and the crane as built."""

from flexik.cases.crane.parts import fitting, mesh, points, tolerance
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part
from flexik.planar import corrections, learning_curves, physics, shape
from flexik.planar.measured.parts import measured_parts


def parts(section: Section) -> list[Part]:
    """The studies of the nominal crane, then those of the measured one."""
    shown = section.studies.shape
    drawn = shape.part(section, shown.strokes, shown.payload)
    nominal = [study.part(section) for study in (mesh, fitting, tolerance, points)]
    nominal.append(corrections.part(section, section.studies.corrections))
    curves = learning_curves.parts(section, section.studies.learning_curves)
    curves += physics.parts(section, section.studies.physics)
    measured = measured_parts(section, section.studies.measured)
    return [drawn, *nominal, *curves, *measured]
