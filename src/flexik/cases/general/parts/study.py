"""The picture of the machine, rigid and loaded, and what is measured on machines as built."""

from flexik.cases.general.section import Picture, Section
from flexik.datasets.parts import Part
from flexik.planar import shape
from flexik.planar.measured.parts import measured_parts


def parts(section: Section) -> list[Part]:
    """`shape`, and those of planar.measured."""
    middle = [sum(drive.limits) / 2 for drive in section.machine.drives.values()]
    loaded = Picture(values=middle, payload=section.largest_payload)
    shown = section.studies.picture or loaded
    drawn, measured = shape.part(section, shown.values, shown.payload), section.studies.measured
    return [drawn, *(measured_parts(section, measured) if measured else [])]
