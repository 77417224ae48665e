"""Method `inverse`: a network that learnt actuator coordinates for a tip, payload and branch.

Source: Rouvinen 1999, section 4.4 and figure 4.16; the extension by appendix B.
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
    checked,
    planar,
    rigid_inverse,
    take_network,
)


class Settings(method.Settings):
    """None of its own."""

    method: Literal["inverse"] = "inverse"
    needs: ClassVar[str | None] = "coordinates"


@dataclass(frozen=True)
class InverseNetwork:
    """Coordinates as a network predicts them, on the branch of the rigid inverse.

    network : predicts actuator coordinates from tip x and y (m), payload (kg) and branch. Where it
        gives fewer than there are, the others are the branch (the extension stroke of a crane).

    A target that the rigid machine does not reach keeps the current coordinates and the rigid
    inverse's status. Diagnostic: `n_clipped`, predicted coordinates that were clipped to their
    limits; the network's own error is not known, so such rows count as reached.
    """

    manipulator: Manipulator
    network: Network

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, _ = planar(query)
        rigid = rigid_inverse(self.manipulator, targets, current)
        rows = rigid.status == REACHED
        branch = self.manipulator.branch(rigid.values[rows])
        predicted = self.network.predict(np.column_stack([query[rows], branch]))
        predicted = checked("predicted coordinates", predicted, len(branch), None)
        k, q = current.shape[1], predicted.shape[1]
        clipped = np.clip(predicted, self.manipulator.lower[:q], self.manipulator.upper[:q])
        values = rigid.values.copy()
        values[rows] = np.column_stack([clipped, branch[:, branch.shape[1] - (k - q) :]])
        n_clipped = np.zeros(len(targets), dtype=np.int64)
        n_clipped[rows] = np.sum(clipped != predicted, axis=1)
        return Answer(values, rigid.status, {"n_clipped": n_clipped})


def build(settings: Settings, ingredients: method.Ingredients) -> InverseNetwork:
    """Method `inverse` with the network of `ingredients`."""
    return InverseNetwork(ingredients.manipulator, take_network(ingredients))
