"""Method `target_correction`: a network of how far to shift the target, and no iteration.

It learnt from the loaded tip what `combined` searches by corrections: where the rigid tip has to go
so that the loaded one is on the target.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from flexik.kinematics.manipulator import Manipulator
from flexik.kinematics.status import REACHED
from flexik.positioning import method
from flexik.positioning.method import (
    Answer,
    Array,
    Network,
    planar,
    predicted,
    rigid_inverse,
    take_network,
)


class Settings(method.Settings):
    """None of its own."""

    needs: ClassVar[str | None] = "target_shift"
    method: Literal["target_correction"] = "target_correction"


@dataclass(frozen=True)
class TargetCorrection:
    """Rigid inverse of the target, and of the target that a network shifts.

    network : predicts the shift (m) from the coordinates of the rigid inverse of the target and the
        payload (kg).

    A row that the inverse fails keeps the coordinates it had and the failing status. Diagnostics:
    the shift, `shift_x` and `shift_y`, m.
    """

    manipulator: Manipulator
    network: Network

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, payload = planar(query)
        first = rigid_inverse(self.manipulator, targets, current)
        shift = predicted(self.network, "shift", first.values, payload, 2)
        last = self.manipulator.inverse(targets + shift, first.values, targets)
        status = np.where(first.reached, last.status, first.status)
        values = np.where((status == REACHED)[:, None], last.values, first.values)
        return Answer(values, status, {"shift_x": shift[:, 0], "shift_y": shift[:, 1]})


def build(settings: Settings, ingredients: method.Ingredients) -> TargetCorrection:
    """Method `target_correction` with the network of `ingredients`."""
    return TargetCorrection(ingredients.manipulator, take_network(ingredients))
