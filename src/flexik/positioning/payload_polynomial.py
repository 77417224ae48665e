"""What methods have in common whose network knows no payload: the deflection is a polynomial of it.

The deflection is nearly linear in the payload, so that few payloads do for training.
"""

from typing import ClassVar

from flexik.learning.payload_polynomial import DEGREES, Interpolated, nodes_of
from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.combined import MOST_CORRECTIONS, Combined


class PolynomialSettings(method.Settings):
    """See Combined."""

    reads: ClassVar[tuple[str, ...]] = ("grid",)
    n_corrections: Count = MOST_CORRECTIONS


def build(settings: PolynomialSettings, ingredients: method.Ingredients) -> Combined:
    """Method of `settings` with network and grid of `ingredients`."""
    nodes = nodes_of(ingredients.samples["grid"], DEGREES[settings.needs or ""])
    deflection = Interpolated(method.take_network(ingredients), nodes)
    return Combined(ingredients.manipulator, deflection, settings.n_corrections)
