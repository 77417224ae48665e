"""Tables that networks learn from and are selected by, and random targets to judge by."""

from flexik.cases.crane.parts import samples, targets
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part


def parts(section: Section) -> list[Part]:
    """`grid`, `selection`, and every set of random conditions by its name."""
    return [*samples.parts(section), *targets.parts(section)]
