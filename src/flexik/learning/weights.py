"""Weights of a perceptron: one matrix a layer, first draws, and the passes through the layers.

Everything here is in normalised values. Samples lie along the last axis, contiguous in memory,
because the passes multiply whole rows of samples.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from flexik.learning.perceptron import Array, activate, bend, slope

# One matrix (units, inputs of the layer + 1) a layer, the output layer last; last column: bias
Weights = tuple[Array, ...]


def flatten(weights: Sequence[Array]) -> Array:
    """One vector (w,): layer by layer, each row by row."""
    return np.concatenate([matrix.ravel() for matrix in weights])


def unflatten(vector: Array, like: Weights) -> Weights:
    """Matrices of the shapes of `like`, the inverse of `flatten`; views of `vector`."""
    parts, end = [], 0
    for matrix in like:
        start, end = end, end + matrix.size
        parts.append(vector[start:end].reshape(matrix.shape))
    return tuple(parts)


def moved(weights: Weights, step: Array) -> Weights:
    """Weights after the flat `step` (w,)."""
    return tuple(w + s for w, s in zip(weights, unflatten(step, weights), strict=True))


def initial_weights(
    n_inputs: int,
    hidden_sizes: Sequence[int],
    n_outputs: int,
    activation: str,
    generator: np.random.Generator,
) -> Weights:
    """Nguyen-Widrow weights for inputs in [-1, 1], as MATLAB's initnw draws them.

    Source: Nguyen and Widrow 1990. The units of a hidden layer share out the range of its inputs;
    their net inputs span [-2, 2] for tanh and [-4, 4] for logistic. Output weights are uniform in
    [-1, 1].
    """
    matrices = []
    for k, n_units in enumerate(hidden_sizes):
        matrix = _nguyen_widrow(n_inputs, n_units, activation, generator)
        if k > 0 and activation == "logistic":
            # inputs of this layer lie in [0, 1], not in [-1, 1]
            matrix[:, -1] -= matrix[:, :-1].sum(axis=1)
            matrix[:, :-1] *= 2.0
        matrices.append(matrix)
        n_inputs = n_units
    matrices.append(generator.uniform(-1.0, 1.0, (n_outputs, n_inputs + 1)))
    return tuple(matrices)


def uniform_weights(
    n_inputs: int,
    hidden_sizes: Sequence[int],
    n_outputs: int,
    spread: float,
    generator: np.random.Generator,
) -> Weights:
    """All weights uniform in [-spread, spread]: near the origin, or far from it."""
    sizes = (n_inputs, *hidden_sizes, n_outputs)
    return tuple(
        generator.uniform(-spread, spread, (n_units, n_before + 1))
        for n_before, n_units in itertools.pairwise(sizes)
    )


def _nguyen_widrow(
    n_inputs: int, n_units: int, activation: str, generator: np.random.Generator
) -> Array:
    direction = generator.uniform(-1.0, 1.0, (n_units, n_inputs))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    active_half_range = 2.0 if activation == "tanh" else 4.0
    magnitude = active_half_range * 0.7 * n_units ** (1.0 / n_inputs)
    shift = np.linspace(-1.0, 1.0, n_units) if n_units > 1 else np.zeros(1)
    bias = shift * np.sign(direction[:, 0])
    return magnitude * np.column_stack([direction, bias])


def forward(weights: Weights, activation: str, inputs: Array) -> list[Array]:
    """`inputs` (p + 1, c), whose last row is 1, and the output of every hidden layer.

    The outputs are (units + 1, c), their last row 1 as well; ``weights[-1] @ layers[-1]`` are
    those of the network (q, c).
    """
    layers = [inputs]
    for matrix in weights[:-1]:
        layer = np.empty((len(matrix) + 1, inputs.shape[1]))
        np.matmul(matrix, layers[-1], out=layer[:-1])
        activate(layer[:-1], activation, out=layer[:-1])
        layer[-1] = 1.0
        layers.append(layer)
    return layers


def slopes_of(layers: list[Array], activation: str) -> list[Array]:
    """Derivative (units, c) of the activation in every hidden layer of `forward`."""
    return [slope(layer[:-1], activation) for layer in layers[1:]]


def backward(weights: Weights, layers: list[Array], slopes: list[Array], errors: Array) -> Array:
    """J^T errors (w,) for output errors (q, c): equations 51 to 53 with linear outputs.

    Parameters
    ----------
    layers, slopes : of `forward` and `slopes_of`
    """
    parts = [errors @ layers[-1].T]
    for k in range(len(weights) - 1, 0, -1):
        errors = weights[k][:, :-1].T @ errors
        errors *= slopes[k - 1]
        parts.append(errors @ layers[k - 1].T)
    return flatten(parts[::-1])


def backward_squares(
    weights: Weights, layers: list[Array], slopes: list[Array], squares: Array
) -> Array:
    """As `backward`, with every factor squared: the diagonal (w,) of J^T J for `squares` of 1.

    Exact for one hidden layer; with more, products of different paths are left out (Becker and
    LeCun 1989).
    """
    parts = [squares @ (layers[-1] ** 2).T]
    for k in range(len(weights) - 1, 0, -1):
        squares = (weights[k][:, :-1] ** 2).T @ squares
        squares *= slopes[k - 1] ** 2
        parts.append(squares @ (layers[k - 1] ** 2).T)
    return flatten(parts[::-1])


def derivative(
    weights: Weights, layers: list[Array], slopes: list[Array], direction: Weights
) -> Array:
    """J `direction`: derivative (q, c) of the outputs along `direction` of the weights.

    Parameters
    ----------
    layers, slopes : of `forward` and `slopes_of`
    """
    change = direction[0] @ layers[0]
    for k, slopes_k in enumerate(slopes, start=1):
        change *= slopes_k
        change = weights[k][:, :-1] @ change
        change += direction[k] @ layers[k]
    return change


def second_derivative(
    weights: Weights, activation: str, layers: list[Array], slopes: list[Array], direction: Weights
) -> Array:
    """Second derivative (q, c) of the outputs along `direction` in the space of the weights.

    Parameters
    ----------
    layers, slopes : of `forward` and `slopes_of`
    """
    # first and second derivative of the net inputs of a layer, then of its outputs; the inputs of
    # the first layer do not change
    net_first = direction[0] @ layers[0]
    net_second = np.zeros(0)
    for k, slopes_k in enumerate(slopes, start=1):
        first = slopes_k * net_first
        second = bend(layers[k][:-1], activation)
        second *= first
        second *= net_first
        if k > 1:
            second += slopes_k * net_second
        net_second = weights[k][:, :-1] @ second
        net_second += 2.0 * direction[k][:, :-1] @ first
        if k < len(slopes):
            net_first = direction[k] @ layers[k] + weights[k][:, :-1] @ first
    return net_second
