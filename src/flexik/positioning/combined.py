"""Method `combined`: rigid inverse, deflection network, corrected target, rigid inverse again.

Source: Rouvinen 1999, section 4.1 and figure 4.7.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexik.errors import ParameterError
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import REACHED, Array, Command, Network, checked, take_network
from flexik.positioning.rigid_inverse import RigidInverse


@dataclass(frozen=True)
class Combined:
    """Rigid inverse corrected by the deflection that a network predicts.

    inverse : rigid inverse used before and after the correction.
    network : predicts the deflection (flexible minus rigid tip, m) from strokes (m) and payload
        (kg).
    n_corrections : one as published; more iterate towards strokes whose own deflection is the
        one corrected.

    A row that the inverse fails in any pass keeps the strokes it had and the first failing status.
    Diagnostics: those of the inverse with the prefixes `first_` and `corrected_` (the last pass),
    and the predicted deflection of the last pass, `deflection_x` and `deflection_y`, m.
    """

    inverse: RigidInverse
    network: Network
    n_corrections: int = 1

    def __post_init__(self) -> None:
        if self.n_corrections < 1:
            raise ParameterError(f"combined: {self.n_corrections=}, expected 1 or more")

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        targets = checked("targets", targets, None, 2)
        payload = checked("payload", payload, len(targets))
        first = self.inverse(targets, initial_strokes)
        last, strokes, status = first, first.strokes, first.status
        for _ in range(self.n_corrections):
            inputs = np.column_stack([strokes, payload])
            deflection = checked(
                "predicted deflection", self.network.predict(inputs), *targets.shape
            )
            last = self.inverse(targets - deflection, strokes, targets)
            status = np.where(status == REACHED, last.status, status)
            strokes = np.where((status == REACHED)[:, None], last.strokes, strokes)
        diagnostics = {f"first_{name}": values for name, values in first.diagnostics.items()}
        diagnostics |= {f"corrected_{name}": values for name, values in last.diagnostics.items()}
        diagnostics |= {"deflection_x": deflection[:, 0], "deflection_y": deflection[:, 1]}
        return Command(strokes, status, diagnostics)


def build(ingredients: Ingredients[Any], n_corrections: int = 1) -> Combined:
    """Build method `combined` with the inverse and the network `deflection` of `ingredients`."""
    network = take_network(ingredients.networks, "deflection")
    return Combined(ingredients.inverse, network, n_corrections)
