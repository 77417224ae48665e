"""Perceptron: normalisation, predictions, derivatives."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from flexik.errors import DataError, FlexikError
from flexik.learning.perceptron import ACTIVATIONS, Network, Normalisation, Quantity

columns = arrays(
    np.float64,
    array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.floats(-1e6, 1e6, allow_subnormal=False),
)


def some_network(activation: str, n_hidden: int | tuple[int, ...] = 5) -> Network:
    generator = np.random.default_rng(3)
    sizes = (3, *(n_hidden if isinstance(n_hidden, tuple) else (n_hidden,)), 2)
    return Network(
        weights=tuple(generator.normal(size=(k, i + 1)) for i, k in itertools.pairwise(sizes)),
        activation=activation,
        input_normalisation=Normalisation(np.array([-1.0, 10.0, 0.2]), np.array([3.0, 12.0, 0.5])),
        output_normalisation=Normalisation(np.array([5.0, -2e-3]), np.array([9.0, 1e-3])),
        inputs=(Quantity("x", "m"), Quantity("y", "m"), Quantity("angle", "rad")),
        outputs=(Quantity("force", "N"), Quantity("stroke", "m")),
    )


def some_inputs(n: int = 7) -> np.ndarray:
    return np.random.default_rng(4).uniform([-1.0, 10.0, 0.2], [3.0, 12.0, 0.5], (n, 3))


@given(columns)
def test_normalisation_round_trip(values):
    normalisation = Normalisation.from_data(values)
    unit = normalisation.to_unit(values)
    assert np.all(np.abs(unit) <= 1.0)
    scale = np.abs(values).max(axis=0)
    assert np.all(np.abs(normalisation.from_unit(unit) - values) <= 1e-15 * scale)


@given(columns)
def test_normalised_extremes_are_minus_one_and_one_unless_constant(values):
    normalisation = Normalisation.from_data(values)
    unit = normalisation.to_unit(values)
    varies = normalisation.half_range > 0.0
    np.testing.assert_array_equal(unit.min(axis=0), np.where(varies, -1.0, 0.0))
    np.testing.assert_array_equal(unit.max(axis=0), np.where(varies, 1.0, 0.0))


def test_a_column_that_differs_by_rounding_is_constant():
    values = np.array([[0.1 + 0.2, 1.0], [0.3, 2.0]])
    normalisation = Normalisation.from_data(values)
    assert values[0, 0] != values[1, 0]
    np.testing.assert_array_equal(normalisation.to_unit(values), [[0.0, -1.0], [0.0, 1.0]])
    # later values of a constant column carry no information either
    np.testing.assert_array_equal(normalisation.to_unit(np.array([[7.0, 1.5]])), [[0.0, 0.0]])


@pytest.mark.parametrize(
    "values",
    [np.empty((0, 2)), np.array([1.0, 2.0]), np.array([[1.0], [np.nan]]), [[-1e308, 1e308]]],
)
def test_normalisation_refuses_unusable_data(values):
    with pytest.raises(DataError):
        Normalisation.from_data(np.asarray(values).T if isinstance(values, list) else values)


def test_normalisation_refuses_mixed_extremes():
    with pytest.raises(FlexikError, match="minimum <= maximum"):
        Normalisation(np.array([1.0]), np.array([0.0]))
    with pytest.raises(FlexikError, match=r"\(1,\) and \(2,\)"):
        Normalisation(np.zeros(1), np.zeros(2))


every_activation = pytest.mark.parametrize("activation", ACTIVATIONS)
every_depth = pytest.mark.parametrize("n_hidden", [5, (4, 3), (2, 1, 3)])


@every_activation
@every_depth
def test_prediction_follows_the_formula_unit_by_unit(activation, n_hidden):
    network, values = some_network(activation, n_hidden), some_inputs(2)
    functions = {"tanh": math.tanh, "logistic": lambda z: 1.0 / (1.0 + math.exp(-z))}
    low, high = network.input_normalisation.minimum, network.input_normalisation.maximum
    for sample, predicted in zip(values, network.predict(values), strict=True):
        layer = 2.0 * (sample - low) / (high - low) - 1.0
        for k, matrix in enumerate(network.weights):
            net = [sum(w * a for w, a in zip(row, layer, strict=False)) + row[-1] for row in matrix]
            last = k == len(network.weights) - 1
            layer = net if last else [functions[activation](z) for z in net]
        low_y, high_y = network.output_normalisation.minimum, network.output_normalisation.maximum
        expected = low_y + (np.array(layer) + 1.0) / 2.0 * (high_y - low_y)
        np.testing.assert_allclose(predicted, expected, rtol=1e-13)


def test_extreme_net_inputs_saturate():
    network = some_network("logistic", 2)
    far = replace(network, weights=(network.weights[0] * 1e6, network.weights[1]))
    assert np.isfinite(far.predict(some_inputs())).all()
    assert np.all(far.jacobian(some_inputs()) == 0.0)


@every_activation
@every_depth
def test_jacobian_against_central_differences(activation, n_hidden):
    network, values = some_network(activation, n_hidden), some_inputs()
    numeric = np.empty((len(values), 2, 3))
    for i, length in enumerate([1e-5, 1e-5, 1e-6]):
        shift = length * np.eye(3)[i]
        difference = network.predict(values + shift) - network.predict(values - shift)
        numeric[:, :, i] = difference / (2.0 * length)
    scale = np.abs(numeric).max(axis=(0, 2), keepdims=True)
    assert np.all(np.abs(network.jacobian(values) - numeric) <= 1e-7 * scale)


@every_activation
@every_depth
def test_jacobian_against_autograd(activation, n_hidden):
    network, values = some_network(activation, n_hidden), some_inputs()
    function = {"tanh": torch.tanh, "logistic": torch.sigmoid}[activation]

    def extremes(normalisation: Normalisation) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.from_numpy(normalisation.minimum), torch.from_numpy(normalisation.maximum)

    def predict(x: torch.Tensor) -> torch.Tensor:
        low, high = extremes(network.input_normalisation)
        layer = 2.0 * (x - low) / (high - low) - 1.0
        for k, matrix in enumerate(torch.from_numpy(matrix) for matrix in network.weights):
            layer = matrix[:, :-1] @ layer + matrix[:, -1]
            layer = layer if k == len(network.weights) - 1 else function(layer)
        low, high = extremes(network.output_normalisation)
        return low + (layer + 1.0) / 2.0 * (high - low)

    expected = torch.stack(
        [torch.autograd.functional.jacobian(predict, x) for x in torch.from_numpy(values)]
    )
    np.testing.assert_allclose(network.jacobian(values), expected.numpy(), rtol=1e-10, atol=1e-14)


def test_jacobian_by_a_constant_input_is_zero():
    network = some_network("tanh")
    constant = Normalisation(np.array([-1.0, 10.0, 0.2]), np.array([3.0, 10.0, 0.5]))
    jacobian = replace(network, input_normalisation=constant).jacobian(some_inputs())
    assert np.all(jacobian[:, :, 1] == 0.0)
    assert np.all(jacobian[:, :, [0, 2]] != 0.0)


def test_counts():
    network = some_network("tanh", n_hidden=14)
    assert network.n_hidden == 14
    assert network.n_weights == 14 * 4 + 2 * 15
    network = some_network("tanh", n_hidden=(7, 4))
    assert network.n_hidden == (7, 4)
    assert network.n_weights == 7 * 4 + 4 * 8 + 2 * 5


@pytest.mark.parametrize("method", ["predict", "jacobian"])
@pytest.mark.parametrize("shape", [(3,), (4, 2), (1, 4, 3)])
def test_inputs_of_another_shape_are_named(method, shape):
    with pytest.raises(FlexikError) as caught:
        getattr(some_network("tanh"), method)(np.zeros(shape))
    assert str(shape) in str(caught.value)
    assert "(n, 3): x, y, angle" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weights": (np.zeros((5, 3)), np.zeros((2, 6)))}, r"weights\[0\].*\(5, 4\)"),
        ({"weights": (np.zeros((5, 4)), np.zeros((2, 5)))}, r"weights\[1\].*\(2, 6\)"),
        ({"weights": (np.zeros((5, 4)), np.zeros((3, 6)))}, r"weights\[1\].*\(2, 6\)"),
        ({"weights": (np.zeros((5, 4)), np.zeros(6), np.zeros((2, 7)))}, r"weights\[1\]"),
        ({"weights": (np.zeros((2, 4)),)}, "weights are of 1 layers"),
        ({"input_normalisation": Normalisation(np.zeros(2), np.ones(2))}, "input_normalisation"),
        ({"output_normalisation": Normalisation(np.zeros(1), np.ones(1))}, "output_normalisation"),
        ({"activation": "relu"}, "activation"),
    ],
)
def test_parts_that_do_not_fit_are_named(change, message):
    with pytest.raises(FlexikError, match=message):
        replace(some_network("tanh"), **change)
