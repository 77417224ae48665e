"""Method `stroke_correction`: a network of how far to shift the coordinates of the rigid inverse.

Beside `target_correction` it tells why networks of strokes err: the mechanism amplifies what they
leave, most of all where a linkage is stretched or folded.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from flexik.kinematics.manipulator import Manipulator
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

    needs: ClassVar[str | None] = "stroke_shift"
    method: Literal["stroke_correction"] = "stroke_correction"


@dataclass(frozen=True)
class StrokeCorrection:
    """Rigid inverse of the target, its coordinates shifted by a network.

    network : predicts shifts (m or rad) of the first coordinates from all of them and the payload
        (kg); the others stay.

    A target that the rigid machine does not reach keeps the current coordinates and the rigid
    inverse's status. Diagnostic: `n_clipped`, coordinates that were put on their limits.
    """

    manipulator: Manipulator
    network: Network

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, payload = planar(query)
        rigid = rigid_inverse(self.manipulator, targets, current)
        shift = predicted(self.network, "shift", rigid.values, payload, None)
        shift[~rigid.reached] = 0.0
        wanted = rigid.values + np.pad(shift, ((0, 0), (0, current.shape[1] - shift.shape[1])))
        values = np.clip(wanted, self.manipulator.lower, self.manipulator.upper)
        n_clipped = np.sum((values != wanted) & rigid.reached[:, None], axis=1)
        return Answer(values, rigid.status, {"n_clipped": n_clipped})


def build(settings: Settings, ingredients: method.Ingredients) -> StrokeCorrection:
    """Method `stroke_correction` with the network of `ingredients`."""
    return StrokeCorrection(ingredients.manipulator, take_network(ingredients))
