"""The picture of the machine, errors by number of samples, and what is measured as built."""

from flexik.cases.general.section import Picture, Section
from flexik.datasets.parts import Part
from flexik.planar import learning_curves, physics, shape
from flexik.planar.measured.parts import measured_parts


def parts(section: Section) -> list[Part]:
    """`shape`, `learning_curves/NETWORK`, `physics`, and those of planar.measured."""
    middle = [sum(drive.limits) / 2 for drive in section.machine.drives.values()]
    loaded = Picture(values=middle, payload=section.largest_payload)
    shown, measured = section.studies.picture or loaded, section.studies.measured
    curves = learning_curves.parts(section, section.studies.learning_curves)
    drawn = shape.part(section, shown.values, shown.payload)
    open_ = physics.parts(section, section.studies.physics)
    return [drawn, *curves, *open_, *(measured_parts(section, measured) if measured else [])]
