"""What a trainer minimises: the mean squared error of a perceptron on normalised data."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexik.learning.perceptron import Array
from flexik.learning.weights import (
    Weights,
    backward,
    backward_squares,
    derivative,
    forward,
    second_derivative,
    slopes_of,
)

# Samples in work at once, at most: bounds memory, and longer chunks leave the cache. No setting,
# because sums are rounded chunk by chunk, and a long run makes much of the last digit.
CHUNK_LENGTH = 1280
# values of hidden layers that are remembered from one pass to the next, 32 MB
_REMEMBERED = 4_000_000


@dataclass(eq=False)
class Chunk:
    """Some of the samples, and the hidden layers' outputs for them.

    Attributes
    ----------
    inputs, targets : (p + 1, c) and (q, c)
    layers : of `weights.forward`
    """

    inputs: Array
    targets: Array
    layers: list[Array]
    activation: str

    @cached_property
    def slopes(self) -> list[Array]:
        """Derivative (units, c) of the activation in every hidden layer."""
        return slopes_of(self.layers, self.activation)

    def errors(self, weights: Weights) -> Array:
        """Outputs minus targets (q, c)."""
        errors = weights[-1] @ self.layers[-1]
        errors -= self.targets
        return errors


@dataclass(frozen=True, eq=False)
class Problem:
    """Data and activation a run works with; made by `problem`.

    Attributes
    ----------
    activation : one of perceptron.ACTIVATIONS
    inputs : (p + 1, n), normalised, the last row 1
    targets : (q, n), normalised
    selection : inputs and targets of the same form the training does not see, if any
    observer : sees the weights each iteration ends with, the initial ones first
    """

    activation: str
    inputs: Array
    targets: Array
    selection: tuple[Array, Array] | None = None
    observer: Callable[[Weights], None] | None = None
    # the last hidden weights and their chunks, or nothing
    _memory: list[tuple[Weights, list[Chunk]]] = field(default_factory=list, init=False, repr=False)

    def chunks(self, weights: Weights) -> Iterator[Chunk]:
        """All samples, chunk by chunk; trainers ask for the same hidden weights several times."""
        hidden = weights[:-1]
        for known, chunks in self._memory:
            if all(one is other for one, other in zip(known, hidden, strict=True)):
                yield from chunks
                return
        size = self.targets.shape[1] * sum(len(matrix) for matrix in hidden)
        passed = []
        for chunk in self._new_chunks(weights, self.inputs, self.targets):
            yield chunk
            if size <= _REMEMBERED:
                passed.append(chunk)
        if passed:
            self._memory[:] = [(hidden, passed)]

    def mean_squared_error(self, weights: Weights) -> float:
        """Mean of the squared errors over samples and outputs; inf or nan when it overflows."""
        return _sum_of_squares(weights, self.chunks(weights)) / self.targets.size

    def selection_error(self, weights: Weights) -> float:
        """The same on the selection data; nan when there are none."""
        if self.selection is None:
            return np.nan
        chunks = self._new_chunks(weights, *self.selection)
        return _sum_of_squares(weights, chunks) / self.selection[1].size

    def gradient(self, weights: Weights) -> tuple[float, Array]:
        """Mean squared error and its gradient (w,)."""
        total, gradient = 0.0, np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for chunk in self.chunks(weights):
                errors = chunk.errors(weights)
                total += float(np.vdot(errors, errors))
                gradient += backward(weights, chunk.layers, chunk.slopes, errors)
            return total / self.targets.size, gradient * (2.0 / self.targets.size)

    def bending(self, weights: Weights, direction: Weights) -> Array:
        """J^T r (w,), r the second derivative of the outputs along `direction`."""
        product = np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for chunk in self.chunks(weights):
                layers, slopes = chunk.layers, chunk.slopes
                second = second_derivative(weights, self.activation, layers, slopes, direction)
                product += backward(weights, layers, slopes, second)
        return product

    def curvature(self, weights: Weights, direction: Weights) -> Array:
        """J^T J `direction` (w,)."""
        product = np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for chunk in self.chunks(weights):
                layers, slopes = chunk.layers, chunk.slopes
                change = derivative(weights, layers, slopes, direction)
                product += backward(weights, layers, slopes, change)
        return product

    def curvature_diagonal(self, weights: Weights) -> Array:
        """Diagonal (w,) of J^T J, see `weights.backward_squares`."""
        diagonal = np.zeros(sum(matrix.size for matrix in weights))
        with np.errstate(over="ignore", invalid="ignore"):
            for chunk in self.chunks(weights):
                squares = np.ones_like(chunk.targets)
                diagonal += backward_squares(weights, chunk.layers, chunk.slopes, squares)
        return diagonal

    def _new_chunks(self, weights: Weights, inputs: Array, targets: Array) -> Iterator[Chunk]:
        n, length = targets.shape[1], chunk_length(targets.shape[1])
        for first in range(0, n, length):
            part = slice(first, first + length)
            layers = forward(weights, self.activation, inputs[:, part])
            yield Chunk(inputs[:, part], targets[:, part], layers, self.activation)


def chunk_length(n: int) -> int:
    """Samples in each of the equal chunks of `n` samples; the last may be a little shorter."""
    return math.ceil(n / math.ceil(n / CHUNK_LENGTH))


def problem(
    activation: str,
    inputs: Array,
    targets: Array,
    selection: tuple[Array, Array] | None = None,
    observer: Callable[[Weights], None] | None = None,
) -> Problem:
    """Problem of normalised samples: inputs (n, p), targets (n, q), selection of the same form."""
    if selection is not None:
        selection = _with_bias(selection[0]), np.ascontiguousarray(selection[1].T)
    targets = np.ascontiguousarray(targets.T)
    return Problem(activation, _with_bias(inputs), targets, selection, observer)


def _with_bias(inputs: Array) -> Array:
    return np.vstack([inputs.T, np.ones(len(inputs))])


def _sum_of_squares(weights: Weights, chunks: Iterator[Chunk]) -> float:
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for chunk in chunks:
            errors = chunk.errors(weights)
            total += float(np.vdot(errors, errors))
    return total
