"""Method `none`: the rigid inverse alone; the deflection stays as the error."""

from dataclasses import dataclass
from typing import Any

from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import Array, Command
from flexik.positioning.rigid_inverse import RigidInverse


@dataclass(frozen=True)
class Uncompensated:
    """Strokes of the rigid inverse at the target, whatever the payload."""

    inverse: RigidInverse

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        return Command(*self.inverse(targets, initial_strokes))


def build(ingredients: Ingredients[Any]) -> Uncompensated:
    """Build method `none` with the rigid inverse of `ingredients`."""
    return Uncompensated(ingredients.inverse)
