"""Perceptron: normalisation, predictions, derivatives."""

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


def some_network(activation: str, n_hidden: int = 5) -> Network:
    generator = np.random.default_rng(3)
    return Network(
        hidden_weights=generator.normal(size=(n_hidden, 3)),
        hidden_bias=generator.normal(size=n_hidden),
        output_weights=generator.normal(size=(2, n_hidden)),
        output_bias=generator.normal(size=2),
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


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_prediction_follows_the_formula_unit_by_unit(activation):
    network, values = some_network(activation), some_inputs(2)
    functions = {"tanh": np.tanh, "logistic": lambda z: 1.0 / (1.0 + np.exp(-z))}
    low, high = network.input_normalisation.minimum, network.input_normalisation.maximum
    for sample, predicted in zip(values, network.predict(values), strict=True):
        x = 2.0 * (sample - low) / (high - low) - 1.0
        y = network.output_bias.copy()
        for weights, bias, out in zip(
            network.hidden_weights, network.hidden_bias, network.output_weights.T, strict=True
        ):
            y += out * functions[activation](weights @ x + bias)
        low_y, high_y = network.output_normalisation.minimum, network.output_normalisation.maximum
        np.testing.assert_allclose(
            predicted, low_y + (y + 1.0) / 2.0 * (high_y - low_y), rtol=1e-13
        )


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_jacobian_against_central_differences(activation):
    network, values = some_network(activation), some_inputs()
    numeric = np.empty((len(values), 2, 3))
    for i, length in enumerate([1e-5, 1e-5, 1e-6]):
        shift = length * np.eye(3)[i]
        difference = network.predict(values + shift) - network.predict(values - shift)
        numeric[:, :, i] = difference / (2.0 * length)
    scale = np.abs(numeric).max(axis=(0, 2), keepdims=True)
    assert np.all(np.abs(network.jacobian(values) - numeric) <= 1e-8 * scale)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_jacobian_against_autograd(activation):
    network, values = some_network(activation), some_inputs()
    function = {"tanh": torch.tanh, "logistic": torch.sigmoid}[activation]

    def predict(x: torch.Tensor) -> torch.Tensor:
        normalisations = network.input_normalisation, network.output_normalisation
        low, high = (
            torch.from_numpy(a) for a in (normalisations[0].minimum, normalisations[0].maximum)
        )
        unit = 2.0 * (x - low) / (high - low) - 1.0
        hidden = function(
            torch.from_numpy(network.hidden_weights) @ unit + torch.from_numpy(network.hidden_bias)
        )
        y = torch.from_numpy(network.output_weights) @ hidden + torch.from_numpy(
            network.output_bias
        )
        low, high = (
            torch.from_numpy(a) for a in (normalisations[1].minimum, normalisations[1].maximum)
        )
        return low + (y + 1.0) / 2.0 * (high - low)

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


@pytest.mark.parametrize("method", ["predict", "jacobian"])
@pytest.mark.parametrize("shape", [(3,), (4, 2), (1, 4, 3)])
def test_inputs_of_another_shape_are_named(method, shape):
    with pytest.raises(FlexikError) as caught:
        getattr(some_network("tanh"), method)(np.zeros(shape))
    assert str(shape) in str(caught.value)
    assert "(n, 3): x, y, angle" in str(caught.value)


@pytest.mark.parametrize(
    "change",
    [
        {"hidden_weights": np.zeros((5, 2))},
        {"hidden_bias": np.zeros((5, 1))},
        {"output_weights": np.zeros((5, 2))},
        {"output_bias": np.zeros(3)},
        {"input_normalisation": Normalisation(np.zeros(2), np.ones(2))},
        {"output_normalisation": Normalisation(np.zeros(1), np.ones(1))},
        {"activation": "relu"},
    ],
)
def test_parts_that_do_not_fit_are_named(change):
    with pytest.raises(FlexikError, match=next(iter(change))):
        replace(some_network("tanh"), **change)
