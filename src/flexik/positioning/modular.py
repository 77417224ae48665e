"""Method `modular`: inverse of two networks that add up, rigid tip and what it lacks.

Source: Rouvinen 1999, section 4.3 and figure 4.11. The two are one network by
`flexik.learning.modular.combine`.
"""

from flexik.positioning.ingredients import Ingredients
from flexik.positioning.inversion import GaussNewton, GradientDescent
from flexik.positioning.inverted_network import HasStrokes, InvertedNetwork, inverted


def build(
    ingredients: Ingredients[HasStrokes], inversion: GradientDescent | GaussNewton
) -> InvertedNetwork:
    """Build method `modular` with the combined network `modular` of `ingredients`."""
    return inverted(ingredients, "modular", inversion)
