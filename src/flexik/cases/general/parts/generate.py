"""Tables that networks learn from and are selected by: a model's or one's own; random targets."""

from flexik.cases.general.section import Section
from flexik.datasets.parts import Part
from flexik.planar import generate, own_samples
from flexik.planar.section import OwnSamples


def parts(section: Section) -> list[Part]:
    """Those of planar.generate, or of planar.own_samples."""
    if isinstance(section.samples, OwnSamples):
        return own_samples.parts(section, section.samples)
    return generate.parts(section)
