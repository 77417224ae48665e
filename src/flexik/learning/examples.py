"""What regressors and torch modules learn from."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexik.learning.perceptron import Array, Normalisation


@dataclass(frozen=True, eq=False)
class Scaled:
    """Normalisations of inputs and outputs, as those of networks: to [-1, 1]."""

    inputs: Normalisation
    outputs: Normalisation


@dataclass(frozen=True, eq=False)
class Examples:
    """Samples to learn from, and those that the fit does not see.

    inputs, outputs : (n, p) and (n, q), SI units
    selection : inputs (m, p) and outputs (m, q) by which starts and models are compared
    """

    inputs: Array
    outputs: Array
    selection: tuple[Array, Array]

    @cached_property
    def scales(self) -> Scaled:
        """Of the samples to learn from; raises DataError when they are empty or not finite."""
        return Scaled(Normalisation.from_data(self.inputs), Normalisation.from_data(self.outputs))

    def unit(self) -> tuple[Array, Array]:
        """Normalised inputs and outputs."""
        return self.scales.inputs.to_unit(self.inputs), self.scales.outputs.to_unit(self.outputs)

    def errors(self, predict: Callable[[Array], Array]) -> tuple[float, float]:
        """Root mean square of the normalised errors of `predict`: here, and on the selection."""
        half = np.where(self.scales.outputs.half_range > 0.0, self.scales.outputs.half_range, 1.0)
        pairs = (self.inputs, self.outputs), self.selection
        found = [np.sqrt(np.mean(((predict(x) - y) / half) ** 2)) for x, y in pairs]
        return float(found[0]), float(found[1])
