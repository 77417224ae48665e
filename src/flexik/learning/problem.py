"""What a trainer minimises: the mean squared error of a perceptron on normalised data."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexik.learning.perceptron import Array
from flexik.learning.weights import Weights, backward, forward, second_derivative, slopes_of

# samples in work at once: bounds memory, and longer chunks are no faster
CHUNK_LENGTH = 1024


@dataclass(frozen=True, eq=False)
class Problem:
    """Data and activation a run works with; made by `problem`.

    Attributes
    ----------
    activation : one of perceptron.ACTIVATIONS
    inputs : (p + 1, n), normalised, the last row 1
    targets : (q, n), normalised
    selection : inputs and targets of the same form the training does not see, if any
    chunk_length : samples in work at once; changes rounding alone
    """

    activation: str
    inputs: Array
    targets: Array
    selection: tuple[Array, Array] | None = None
    chunk_length: int = CHUNK_LENGTH

    def chunks(self) -> Iterator[tuple[Array, Array]]:
        """Inputs (p + 1, c) and targets (q, c), chunk by chunk."""
        return _chunks(self.inputs, self.targets, self.chunk_length)

    def mean_squared_error(self, weights: Weights) -> float:
        """Mean of the squared errors over samples and outputs; inf or nan when it overflows."""
        return _mean_squared_error(weights, self.activation, self.chunks()) / self.targets.size

    def selection_error(self, weights: Weights) -> float:
        """The same on the selection data; nan when there are none."""
        if self.selection is None:
            return np.nan
        chunks = _chunks(*self.selection, self.chunk_length)
        return _mean_squared_error(weights, self.activation, chunks) / self.selection[1].size

    def gradient(self, weights: Weights) -> tuple[float, Array]:
        """Mean squared error and its gradient (w,)."""
        total, gradient = 0.0, np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for inputs, targets in self.chunks():
                layers, errors = forward(weights, self.activation, inputs)
                errors -= targets
                total += float(np.vdot(errors, errors))
                slopes = slopes_of(layers, self.activation)
                gradient += backward(weights, layers, slopes, errors)
            return total / self.targets.size, gradient * (2.0 / self.targets.size)

    def bending(self, weights: Weights, direction: Weights) -> Array:
        """J^T r (w,), r the second derivative of the outputs along `direction`."""
        product = np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for inputs, _ in self.chunks():
                layers, _ = forward(weights, self.activation, inputs)
                slopes = slopes_of(layers, self.activation)
                second = second_derivative(weights, self.activation, layers, slopes, direction)
                product += backward(weights, layers, slopes, second)
        return product


def problem(
    activation: str,
    inputs: Array,
    targets: Array,
    selection: tuple[Array, Array] | None = None,
    chunk_length: int = CHUNK_LENGTH,
) -> Problem:
    """Problem of normalised samples: inputs (n, p), targets (n, q), selection of the same form."""
    if selection is not None:
        selection = _with_bias(selection[0]), np.ascontiguousarray(selection[1].T)
    targets = np.ascontiguousarray(targets.T)
    return Problem(activation, _with_bias(inputs), targets, selection, chunk_length)


def _with_bias(inputs: Array) -> Array:
    return np.vstack([inputs.T, np.ones(len(inputs))])


def _chunks(inputs: Array, targets: Array, chunk_length: int) -> Iterator[tuple[Array, Array]]:
    for first in range(0, targets.shape[1], chunk_length):
        chunk = slice(first, first + chunk_length)
        yield inputs[:, chunk], targets[:, chunk]


def _mean_squared_error(
    weights: Weights, activation: str, chunks: Iterator[tuple[Array, Array]]
) -> float:
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for inputs, targets in chunks:
            _, errors = forward(weights, activation, inputs)
            errors -= targets
            total += float(np.vdot(errors, errors))
    return total
