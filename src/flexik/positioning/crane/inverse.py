"""Method `inverse`: a network that learnt lift and jib stroke for a tip, payload and extension.

Source: Rouvinen 1999, section 4.4 and figure 4.16; the extension by appendix B.
"""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.crane import CraneGeometry, inverse_with_smallest_extension
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import Array, Command, Network, checked, take_network


@dataclass(frozen=True)
class InverseNetwork:
    """Lift and jib stroke as a network predicts them, with the smallest extension that reaches.

    network : predicts lift and jib stroke (m) from tip x and y (m), payload (kg) and extension
        stroke (m).

    The rule for the extension is that of the rigid crane; a target that it does not reach keeps the
    initial strokes and the rigid inverse's status. Diagnostic: `n_clipped`, predicted strokes that
    were clipped to their limits; the network's own error is not known, so such rows count as
    reached.
    """

    geometry: CraneGeometry
    network: Network

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        targets = checked("targets", targets, None, 2)
        payload = checked("payload", payload, len(targets))
        strokes = checked("initial strokes", initial_strokes, len(targets), 3).copy()
        rigid = inverse_with_smallest_extension(self.geometry, targets)
        rows = rigid.reached
        extension = rigid.strokes[rows, 2]
        inputs = np.column_stack([targets[rows], payload[rows], extension])
        predicted = checked("predicted strokes", self.network.predict(inputs), len(inputs), 2)
        clipped = np.clip(predicted, 0.0, self.geometry.stroke_maximum[:2])
        strokes[rows] = np.column_stack([clipped, extension])
        n_clipped = np.zeros(len(targets), dtype=np.int64)
        n_clipped[rows] = np.sum(clipped != predicted, axis=1)
        return Command(strokes, rigid.status, {"n_clipped": n_clipped})


def build(ingredients: Ingredients[CraneGeometry]) -> InverseNetwork:
    """Build method `inverse` with the geometry and the network `inverse` of `ingredients`."""
    return InverseNetwork(ingredients.geometry, take_network(ingredients.networks, "inverse"))
