"""The picture of the machine, rigid and loaded; errors by number of samples."""

from flexik.cases.general.section import Picture, Section
from flexik.datasets.parts import Part
from flexik.planar import learning_curves, shape


def parts(section: Section) -> list[Part]:
    """`shape` and `learning_curves/NETWORK`."""
    middle = [sum(drive.limits) / 2 for drive in section.machine.drives.values()]
    loaded = Picture(values=middle, payload=section.largest_payload)
    shown = section.studies.picture or loaded
    curves = learning_curves.parts(section, section.studies.learning_curves)
    return [shape.part(section, shown.values, shown.payload), *curves]
