"""Floating-point operations a query of a network, counted from the sizes of its layers.

An addition, subtraction, multiplication, division, square root or activation is one operation;
comparisons and moves are none. Biases are added; nothing that happens to be zero is left out, so
the count does not depend on the values of the weights.
"""

import itertools

from flexik.errors import ParameterError
from flexik.learning.perceptron import Network


def forward_operations(network: Network) -> int:
    """Operations of one prediction in physical units.

    A unit with k inputs takes k multiplications and k additions (the bias is one of them), and a
    hidden unit one activation; each input and each output takes a multiplication and an addition
    for its normalisation.
    """
    return normalisation_operations(network) + _unit_forward(network)


def normalisation_operations(network: Network) -> int:
    """Operations that normalise the inputs and bring the outputs back: 2 for each.

    An inversion works in normalised values throughout and pays this once a query.
    """
    return 2 * (len(network.inputs) + len(network.outputs))


def inversion_step_operations(network: Network, n_free: int) -> int:
    """Operations of one step of gradient descent on `n_free` inputs (Rouvinen 1999, eqs 60 to 63).

    In normalised values: the whole forward pass, held inputs too; the output deltas, one
    subtraction each (62); the slope of each hidden unit, 2 operations, times the sum over the layer
    above (61); the sum over the first hidden layer for each free input (60); the learning rate and
    the update, 2 for each free input (63), where the minus signs of (60) and (63) cancel. The
    error that ends the iteration is not counted.

    Raises ParameterError unless 1 <= `n_free` <= number of inputs.
    """
    _check_free(network, n_free)
    *hidden, n_outputs = _sizes(network)[1:]
    layers = [n_free, *hidden, n_outputs]
    deltas = n_outputs + sum(3 * n for n in hidden)
    sums = sum(n * _dot(above) for n, above in itertools.pairwise(layers))
    return _unit_forward(network) + deltas + sums + 2 * n_free


def gauss_newton_step_operations(network: Network, n_free: int) -> int:
    """Operations of one damped Gauss-Newton step on `n_free` inputs, for q outputs.

    In normalised values: the whole forward pass, held inputs too; the errors, q subtractions; the
    slopes, 2 operations a hidden unit; the Jacobian J (q, n_free), for each output by the sums of
    equations 60 and 61 from a delta of 1 at that output alone, which makes its first sum a single
    weight; the step by the smaller of two systems,

    - (J^T J + mu I)^-1 J^T e, where n_free <= q,
    - J^T (J J^T + mu I)^-1 e, the same step, where n_free > q,

    of which one triangle is formed, one addition damps each diagonal element, and a Cholesky
    factorisation and two triangular solutions, which divide by the diagonal, solve it; and one
    addition for each free input. Neither the choice of mu nor the error that ends the iteration is
    counted.

    Raises ParameterError unless 1 <= `n_free` <= number of inputs.
    """
    _check_free(network, n_free)
    *hidden, q = _sizes(network)[1:]
    slopes = 2 * sum(hidden)
    backward = sum(hidden) + sum(n * _dot(above) for n, above in itertools.pairwise(hidden))
    jacobian = q * (backward + n_free * _dot(hidden[0]))
    smaller, larger = sorted((n_free, q))
    triangle = smaller * (smaller + 1) // 2 * _dot(larger)
    product = n_free * _dot(q)  # J^T e, or J^T times the solution
    solution = triangle + smaller + product + _cholesky_solution(smaller)
    return _unit_forward(network) + q + slopes + jacobian + solution + n_free


def _sizes(network: Network) -> list[int]:
    """Number of inputs, then of the units of each layer."""
    return [len(network.inputs), *(len(matrix) for matrix in network.weights)]


def _unit_forward(network: Network) -> int:
    sizes = _sizes(network)
    return sum(2 * n * units for n, units in itertools.pairwise(sizes)) + sum(sizes[1:-1])


def _dot(n: int) -> int:
    """Operations of a sum of `n` products."""
    return 2 * n - 1


def _cholesky_solution(n: int) -> int:
    """Operations that factorise a symmetric (n, n) matrix and solve with both factors."""
    factorisation = n + n * (n - 1) // 2 + (n**3 - n) // 3
    return factorisation + 2 * n**2


def _check_free(network: Network, n_free: int) -> None:
    if not 1 <= n_free <= len(network.inputs):
        raise ParameterError(f"{n_free=}, expected 1 to {len(network.inputs)} free inputs")
