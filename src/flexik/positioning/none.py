"""Method `none`: the rigid inverse alone; the deflection stays as the error."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from flexik.kinematics.manipulator import Manipulator
from flexik.positioning import method
from flexik.positioning.method import Answer, Array, planar, rigid_inverse


class Settings(method.Settings):
    """None."""

    method: Literal["none"] = "none"
    needs: ClassVar[str | None] = None


@dataclass(frozen=True)
class Uncompensated:
    """Coordinates of the rigid inverse at the target, whatever the payload."""

    manipulator: Manipulator

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, _ = planar(query)
        return Answer(*rigid_inverse(self.manipulator, targets, current))


def build(settings: Settings, ingredients: method.Ingredients) -> Uncompensated:
    """Method `none`."""
    return Uncompensated(ingredients.manipulator)
