"""Operation counts against a network written with numbers that count."""

import itertools
import math

import numpy as np
import pytest

from flexik.errors import ParameterError
from flexik.evaluation.operations import (
    forward_operations,
    gauss_newton_step_operations,
    inversion_step_operations,
    normalisation_operations,
)
from flexik.learning.perceptron import Network, Normalisation, Quantity

SIZES = [(3, 5, 2), (4, 6, 3), (2, 3, 1), (1, 2, 1), (3, 4, 3, 2), (3, 4, 5, 3, 3)]
CASES = [(s, a, n) for s in SIZES for a in ("tanh", "logistic") for n in range(1, s[0] + 1)]


class Number:
    """A float whose every operation is counted in `Number.count`."""

    count = 0

    def __init__(self, value):
        self.value = float(value)

    def _result(self, value):
        Number.count += 1
        return Number(value)

    def __add__(self, other):
        return self._result(self.value + plain(other))

    def __sub__(self, other):
        return self._result(self.value - plain(other))

    def __rsub__(self, other):
        return self._result(plain(other) - self.value)

    def __mul__(self, other):
        return self._result(self.value * plain(other))

    __rmul__ = __mul__

    def __truediv__(self, other):
        return self._result(self.value / plain(other))

    def root(self):
        """Square root."""
        return self._result(math.sqrt(self.value))

    def activated(self, activation):
        """Output of a unit."""
        value = self.value
        return self._result(
            math.tanh(value) if activation == "tanh" else 1 / (1 + math.exp(-value))
        )


def plain(number):
    return number.value if isinstance(number, Number) else float(number)


def counted(function, *arguments):
    Number.count = 0
    result = function(*arguments)
    return Number.count, result


def dot(a, b):
    products = [x * y for x, y in zip(a, b, strict=True)]
    total = products[0]
    for product in products[1:]:
        total = total + product
    return total


def some_network(sizes, activation):
    generator = np.random.default_rng(5)
    p, q = sizes[0], sizes[-1]

    def normalisation(n):
        minimum = generator.uniform(-2.0, 1.0, n)
        return Normalisation(minimum, minimum + generator.uniform(0.5, 3.0, n))

    return Network(
        tuple(generator.normal(size=(k, i + 1)) for i, k in itertools.pairwise(sizes)),
        activation,
        normalisation(p),
        normalisation(q),
        tuple(Quantity(f"x{i}", "m") for i in range(p)),
        tuple(Quantity(f"y{i}", "m") for i in range(q)),
    )


def layers_of(network, values):
    """Values of every layer from normalised inputs to normalised outputs."""
    layers = [values]
    for k, matrix in enumerate(network.weights):
        sums = [dot(row[:-1], layers[-1]) + row[-1] for row in matrix]
        if k < len(network.weights) - 1:
            sums = [number.activated(network.activation) for number in sums]
        layers.append(sums)
    return layers


def predict(network, values):
    half, minimum = network.input_normalisation.half_range, network.input_normalisation.minimum
    factor, constant = 1 / half, -minimum / half - 1
    unit = [v * f + c for v, f, c in zip(values, factor, constant, strict=True)]
    half, minimum = network.output_normalisation.half_range, network.output_normalisation.minimum
    outputs = layers_of(network, unit)[-1]
    return [y * h + c for y, h, c in zip(outputs, half, minimum + half, strict=True)]


def slopes_of(network, layers):
    def slope(h):
        return 1.0 - h * h if network.activation == "tanh" else h * (1.0 - h)

    return [[slope(h) for h in layer] for layer in layers[1:-1]]


def gradient_descent(network, values, desired, n_free, rate):
    layers = layers_of(network, values)
    deltas = [d - y for d, y in zip(desired, layers[-1], strict=True)]
    for matrix, slopes in zip(
        network.weights[:0:-1], slopes_of(network, layers)[::-1], strict=True
    ):
        deltas = [s * dot(matrix[:, j], deltas) for j, s in enumerate(slopes)]
    first = network.weights[0]
    return [values[k] + rate * dot(first[:, k], deltas) for k in range(n_free)]


def jacobian_of(network, layers, n_free):
    slopes, rows = slopes_of(network, layers), []
    for i in range(len(network.outputs)):
        last = network.weights[-1][i, :-1]
        deltas = [s * w for s, w in zip(slopes[-1], last, strict=True)]
        for matrix, layer in zip(network.weights[-2:0:-1], slopes[-2::-1], strict=True):
            deltas = [s * dot(matrix[:, j], deltas) for j, s in enumerate(layer)]
        rows.append([dot(network.weights[0][:, k], deltas) for k in range(n_free)])
    return rows


def cholesky_solution(matrix, right):
    """Solve with the lower triangle `matrix`, a list of rows."""
    n = len(right)
    lower = [list(row) for row in matrix]
    for j in range(n):
        for i in range(j, n):
            for k in range(j):
                lower[i][j] = lower[i][j] - lower[i][k] * lower[j][k]
            lower[i][j] = lower[j][j].root() if i == j else lower[i][j] / lower[j][j]
    solution = list(right)
    for order, entry in ((range(n), lambda i, k: lower[i][k]), (reversed(range(n)), None)):
        done = []
        for i in order:
            for k in done:
                factor = entry(i, k) if entry else lower[k][i]
                solution[i] = solution[i] - factor * solution[k]
            solution[i] = solution[i] / lower[i][i]
            done.append(i)
    return solution


def gauss_newton(network, values, desired, n_free, damping):
    layers = layers_of(network, values)
    errors = [d - y for d, y in zip(desired, layers[-1], strict=True)]
    rows = jacobian_of(network, layers, n_free)
    columns = [list(column) for column in zip(*rows, strict=True)]
    shorter = columns if n_free <= len(rows) else rows
    triangle = [[dot(a, b) for b in shorter[: i + 1]] for i, a in enumerate(shorter)]
    for i, row in enumerate(triangle):
        row[i] = row[i] + damping
    if n_free <= len(rows):
        step = cholesky_solution(triangle, [dot(column, errors) for column in columns])
    else:
        solution = cholesky_solution(triangle, errors)
        step = [dot(column, solution) for column in columns]
    return [v + s for v, s in zip(values[:n_free], step, strict=True)]


def some_state(network):
    generator = np.random.default_rng(6)
    values = generator.uniform(-1, 1, len(network.inputs))
    desired = generator.uniform(-1, 1, len(network.outputs))
    return values, desired


def unit_jacobian(network, unit):
    """Outputs (q,) and Jacobian (q, p) at `unit` (p,), all normalised, by the package."""
    values = network.input_normalisation.from_unit(unit[None])
    derivative = network.jacobian(values)[0] * network.input_normalisation.half_range
    outputs = network.output_normalisation.to_unit(network.predict(values))[0]
    return outputs, derivative / network.output_normalisation.half_range[:, None]


@pytest.mark.parametrize("activation", ["tanh", "logistic"])
@pytest.mark.parametrize("sizes", SIZES)
def test_forward_operations(sizes, activation):
    network = some_network(sizes, activation)
    values = some_state(network)[0]
    count, found = counted(predict, network, [Number(v) for v in values])
    assert [y.value for y in found] == pytest.approx(network.predict(values[None])[0], abs=1e-12)
    assert forward_operations(network) == count
    count, _ = counted(layers_of, network, [Number(v) for v in values])
    assert normalisation_operations(network) == forward_operations(network) - count


@pytest.mark.parametrize(("sizes", "activation", "n_free"), CASES)
def test_inversion_step_operations(sizes, activation, n_free):
    network = some_network(sizes, activation)
    values, desired = some_state(network)
    count, found = counted(
        gradient_descent, network, [Number(v) for v in values], desired, n_free, 0.05
    )
    outputs, jacobian = unit_jacobian(network, values)
    expected = values + 0.05 * jacobian.T @ (desired - outputs)
    assert [x.value for x in found] == pytest.approx(expected[:n_free], abs=1e-12)
    assert inversion_step_operations(network, n_free) == count


@pytest.mark.parametrize(("sizes", "activation", "n_free"), CASES)
def test_gauss_newton_step_operations(sizes, activation, n_free):
    network = some_network(sizes, activation)
    values, desired = some_state(network)
    count, found = counted(
        gauss_newton, network, [Number(v) for v in values], desired, n_free, 1e-3
    )
    outputs, jacobian = unit_jacobian(network, values)
    free = jacobian[:, :n_free]
    step = np.linalg.solve(free.T @ free + 1e-3 * np.eye(n_free), free.T @ (desired - outputs))
    assert [x.value for x in found] == pytest.approx(values[:n_free] + step, rel=1e-8, abs=1e-8)
    assert gauss_newton_step_operations(network, n_free) == count


def test_a_prediction_by_hand():
    # 19 units of 4 products, 4 sums and an activation; 2 units of 19 and 19; 6 normalisations
    network = some_network((4, 19, 2), "logistic")
    assert forward_operations(network) == 19 * 9 + 2 * 38 + 2 * 6


@pytest.mark.parametrize("n_free", [0, 4])
def test_a_wrong_number_of_free_inputs_is_told(n_free):
    network = some_network((3, 5, 2), "tanh")
    for operations in (inversion_step_operations, gauss_newton_step_operations):
        with pytest.raises(ParameterError, match=f"n_free={n_free}, expected 1 to 3"):
            operations(network, n_free)
