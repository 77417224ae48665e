"""Method `exact`: `combined` with the flexible model itself in place of a network.

The ceiling in accuracy, and what it costs: a static equilibrium a correction. Corrections are
Newton's method on the coordinates with the derivatives of the rigid machine.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from flexik.kinematics.manipulator import Manipulator
from flexik.multibody.flexible import FlexibleMachine
from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.combined import MOST_CORRECTIONS, Combined
from flexik.positioning.method import Array, take_machine


class Settings(method.Settings):
    """See Combined."""

    asks_machine: ClassVar[bool] = True
    method: Literal["exact"] = "exact"
    n_corrections: Count = MOST_CORRECTIONS


@dataclass(frozen=True)
class FlexibleModel:
    """The deflection of the flexible model; a Network."""

    manipulator: Manipulator
    flexible: FlexibleMachine

    def predict(self, values: Array) -> Array:
        """Deflection (n, 2) in m at `values` (n, k + 1): coordinates, and payload in kg.

        Raises SolverError of the first row without equilibrium.
        """
        # Exudyn takes a second to load, and few ask for this method
        from flexik.multibody.planar import tips

        coordinates, payload = np.ascontiguousarray(values[:, :-1]), values[:, -1]
        return tips(self.flexible, coordinates, payload) - self.manipulator.forward(coordinates)


def build(settings: Settings, ingredients: method.Ingredients) -> Combined:
    """Method `exact` for the machine of `ingredients`."""
    model = FlexibleModel(ingredients.manipulator, FlexibleMachine(take_machine(ingredients)))
    return Combined(ingredients.manipulator, model, settings.n_corrections)
