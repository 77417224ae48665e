"""What `direct` and `modular` share: the inverse of a network that predicts the tip."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from flexik.kinematics.manipulator import Manipulator
from flexik.kinematics.status import NOT_CONVERGED, REACHED
from flexik.learning import perceptron
from flexik.positioning import method
from flexik.positioning.inversion import GaussNewton, GradientDescent, invert
from flexik.positioning.method import (
    Answer,
    Array,
    PositioningError,
    checked,
    planar,
    take_network,
)

Inversion = Annotated[GradientDescent | GaussNewton, Field(discriminator="kind")]


class InvertedSettings(method.Settings):
    """Settings of both."""

    inversion: Inversion = GradientDescent()


@dataclass(frozen=True)
class InvertedNetwork:
    """Coordinates at which a network predicts the target as its tip, searched from the current.

    network : predicts the tip (m) from actuator coordinates and payload (kg).
    inversion : settings of the search.

    A row whose search does not end below the tolerance is NOT_CONVERGED.
    Diagnostics: `n_iterations`, `n_clipped` (coordinates stopped by a limit), and
    `network_residual`, the distance from the target to the network's tip at the answer, m.
    """

    manipulator: Manipulator
    network: perceptron.Network
    inversion: GradientDescent | GaussNewton

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, payload = planar(query)
        limits = np.stack([self.manipulator.lower, self.manipulator.upper])
        current = checked("current coordinates", current, len(targets), limits.shape[1])
        found = invert(self.network, targets, payload[:, None], current, limits, self.inversion)
        status = np.where(found.converged, REACHED, NOT_CONVERGED)
        diagnostics = {
            "n_iterations": found.n_iterations,
            "n_clipped": found.n_clipped,
            "network_residual": found.residual,
        }
        return Answer(found.values, status, diagnostics)


def build(settings: InvertedSettings, ingredients: method.Ingredients) -> InvertedNetwork:
    """Inverse of the network of `ingredients`, which must be a perceptron."""
    network = take_network(ingredients)
    if not isinstance(network, perceptron.Network):
        raise PositioningError(f"{type(network).__name__}: expected a perceptron to invert")
    return InvertedNetwork(ingredients.manipulator, network, settings.inversion)
