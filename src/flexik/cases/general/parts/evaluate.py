"""Errors of every method under every set of conditions, or of networks on samples held out."""

from flexik.cases.general.section import Section
from flexik.datasets.parts import Part
from flexik.planar import evaluate, held_out
from flexik.planar.section import OwnSamples


def parts(section: Section) -> list[Part]:
    """Those of planar.evaluate, or of planar.held_out."""
    if isinstance(section.samples, OwnSamples):
        return held_out.parts(section)
    return evaluate.parts(section)
