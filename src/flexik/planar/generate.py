"""Tables that networks learn from and are selected by, and random targets to judge by."""

from flexik.datasets.parts import Part
from flexik.planar import samples, targets
from flexik.planar.section import PlanarSection


def parts(section: PlanarSection) -> list[Part]:
    """`grid`, `selection`, and every set of random conditions by its name."""
    return [*samples.parts(section), *targets.parts(section)]
