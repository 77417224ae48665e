"""What `direct` and `modular` share: the inverse of a network that predicts the tip."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexik.learning import perceptron
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.inversion import GaussNewton, GradientDescent, invert
from flexik.positioning.method import (
    NOT_CONVERGED,
    REACHED,
    Array,
    Command,
    PositioningError,
    checked,
    take_network,
)


class HasStrokes(Protocol):
    """A geometry whose strokes begin at zero."""

    @property
    def stroke_maximum(self) -> tuple[float, ...]:
        """Longest strokes, m."""
        ...


@dataclass(frozen=True)
class InvertedNetwork:
    """Strokes at which a network predicts the target as its tip, searched from the current ones.

    network : predicts the tip (m) from strokes (m) and payload (kg).
    stroke_maximum : longest strokes, m; the shortest are zero.
    inversion : settings of the search.

    A row whose search does not end below the tolerance is NOT_CONVERGED.
    Diagnostics: `n_iterations`, `n_clipped` (strokes stopped by a limit), and `network_residual`,
    the distance from the target to the network's tip at the commanded strokes, m.
    """

    network: perceptron.Network
    stroke_maximum: tuple[float, ...]
    inversion: GradientDescent | GaussNewton

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        targets = checked("targets", targets, None, 2)
        payload = checked("payload", payload, len(targets))
        maximum = np.array(self.stroke_maximum)
        initial = checked("initial strokes", initial_strokes, len(targets), len(maximum))
        found = invert(self.network, targets, payload[:, None], initial, maximum, self.inversion)
        status = np.where(found.converged, REACHED, NOT_CONVERGED)
        diagnostics = {
            "n_iterations": found.n_iterations,
            "n_clipped": found.n_clipped,
            "network_residual": found.residual,
        }
        return Command(found.strokes, status, diagnostics)


def inverted(
    ingredients: Ingredients[HasStrokes], name: str, inversion: GradientDescent | GaussNewton
) -> InvertedNetwork:
    """Inverse of the network `name` of `ingredients`, which must be a perceptron."""
    network = take_network(ingredients.networks, name)
    if not isinstance(network, perceptron.Network):
        raise PositioningError(
            f"network {name!r} is a {type(network).__name__}, expected a perceptron to invert"
        )
    return InvertedNetwork(network, ingredients.geometry.stroke_maximum, inversion)
