"""Method `direct`: inverse of a network that learnt the tip of the flexible manipulator.

Source: Rouvinen 1999, section 4.2 and figure 4.9.
"""

from flexik.positioning.ingredients import Ingredients
from flexik.positioning.inversion import GaussNewton, GradientDescent
from flexik.positioning.inverted_network import HasStrokes, InvertedNetwork, inverted


def build(
    ingredients: Ingredients[HasStrokes], inversion: GradientDescent | GaussNewton
) -> InvertedNetwork:
    """Build method `direct` with the network `direct` of `ingredients`."""
    return inverted(ingredients, "direct", inversion)
