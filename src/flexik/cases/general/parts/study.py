"""The picture of the machine, rigid and loaded."""

from flexik.cases.general.section import Picture, Section
from flexik.datasets.parts import Part
from flexik.planar import shape


def parts(section: Section) -> list[Part]:
    """`shape`."""
    middle = [sum(drive.limits) / 2 for drive in section.machine.drives.values()]
    loaded = Picture(values=middle, payload=section.largest_payload)
    shown = section.studies.picture or loaded
    return [shape.part(section, shown.values, shown.payload)]
