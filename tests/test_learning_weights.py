"""Passes through the layers, their derivatives, and the first draw of the weights."""

import numpy as np
import pytest
import torch
from learning_problems import ARCHITECTURES, dense, errors_function, some_problem

from flexik.learning.perceptron import ACTIVATIONS
from flexik.learning.weights import (
    flatten,
    forward,
    initial_weights,
    moved,
    second_derivative,
    slopes_of,
    unflatten,
)

every_architecture = pytest.mark.parametrize(("p", "hidden", "q"), ARCHITECTURES)
every_activation = pytest.mark.parametrize("activation", ACTIVATIONS)


def test_flat_and_back():
    weights, _ = some_problem(hidden=(4, 3))
    vector = flatten(weights)
    for back, matrix in zip(unflatten(vector, weights), weights, strict=True):
        np.testing.assert_array_equal(back, matrix)
    np.testing.assert_array_equal(flatten(moved(weights, 2.0 * vector)), 3.0 * vector)


@every_activation
@every_architecture
def test_gradient_against_autograd(activation, p, hidden, q):
    weights, problem = some_problem(p=p, hidden=hidden, q=q, activation=activation)
    jacobian, errors = dense(weights, problem)
    error, gradient = problem.gradient(weights)
    assert error == pytest.approx(np.mean(errors**2), rel=1e-13)
    assert problem.mean_squared_error(weights) == error
    # the gradient of the mean of the squares is 2 / count J^T e
    expected = 2.0 / errors.size * jacobian.T @ errors
    np.testing.assert_allclose(gradient, expected, rtol=1e-11, atol=1e-14)


@every_activation
@every_architecture
def test_gradient_against_central_differences(activation, p, hidden, q):
    weights, problem = some_problem(p=p, hidden=hidden, q=q, activation=activation)
    gradient = problem.gradient(weights)[1]
    length = 1e-6
    for shift, value in zip(length * np.eye(gradient.size), gradient, strict=True):
        above, below = (problem.mean_squared_error(moved(weights, s)) for s in (shift, -shift))
        assert (above - below) / (2.0 * length) == pytest.approx(value, rel=1e-6, abs=1e-8)


@every_activation
@every_architecture
def test_second_derivative_against_autograd(activation, p, hidden, q):
    weights, problem = some_problem(n=5, p=p, hidden=hidden, q=q, activation=activation)
    function, vector = errors_function(weights, problem), torch.from_numpy(flatten(weights))
    direction = torch.from_numpy(np.random.default_rng(1).normal(size=vector.numel()))

    jacobian_of = torch.autograd.functional.jacobian

    def first(t: torch.Tensor) -> torch.Tensor:
        return jacobian_of(lambda s: function(vector + s * direction), t, create_graph=True)

    expected = jacobian_of(first, torch.zeros((), dtype=torch.float64)).numpy()
    layers = forward(weights, activation, problem.inputs)
    arguments = layers, slopes_of(layers, activation), unflatten(direction.numpy(), weights)
    second = second_derivative(weights, activation, *arguments)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(second.T.ravel(), expected, rtol=1e-11, atol=1e-13 * scale)
    jacobian, _ = dense(weights, problem)
    bending = problem.bending(weights, unflatten(direction.numpy(), weights))
    expected = jacobian.T @ expected
    np.testing.assert_allclose(bending, expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("chunk_length", [1, 7, 39, 40, 1000])
def test_chunks_change_rounding_alone(chunk_length, monkeypatch):
    def results():
        weights, problem = some_problem(hidden=(4, 3))
        direction = moved(weights, flatten(weights))
        gradient, bending = problem.gradient(weights)[1], problem.bending(weights, direction)
        return problem.mean_squared_error(weights), gradient, bending

    # by default one chunk holds all 40 samples
    whole_error, *whole = results()
    monkeypatch.setattr("flexik.learning.problem.CHUNK_LENGTH", chunk_length)
    error, *chunked = results()
    assert error == pytest.approx(whole_error, rel=1e-14)
    for expected, found in zip(whole, chunked, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize(("activation", "half_range"), [("tanh", 2.0), ("logistic", 4.0)])
def test_initial_weights_are_nguyen_widrow(activation, half_range):
    hidden, output = initial_weights(4, (14,), 2, activation, np.random.default_rng(5))
    assert hidden.shape == (14, 5)
    assert output.shape == (2, 15)
    magnitude = half_range * 0.7 * 14**0.25
    np.testing.assert_allclose(np.linalg.norm(hidden[:, :4], axis=1), magnitude)
    spread = np.linspace(-magnitude, magnitude, 14) * np.sign(hidden[:, 0])
    np.testing.assert_allclose(hidden[:, 4], spread)
    assert np.all(np.abs(output) <= 1.0)


@pytest.mark.parametrize(("activation", "half_range"), [("tanh", 2.0), ("logistic", 4.0)])
def test_later_layers_share_out_the_range_of_the_layer_before(activation, half_range):
    weights = initial_weights(4, (14, 6), 2, activation, np.random.default_rng(5))
    assert [matrix.shape for matrix in weights] == [(14, 5), (6, 15), (2, 7)]
    # rewritten for inputs of the layer mapped to [-1, 1]
    slopes, bias = weights[1][:, :-1], weights[1][:, -1]
    if activation == "logistic":
        slopes, bias = slopes / 2.0, bias + slopes.sum(axis=1) / 2.0
    magnitude = half_range * 0.7 * 6 ** (1.0 / 14.0)
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=1), magnitude)
    np.testing.assert_allclose(np.abs(bias), np.abs(np.linspace(-magnitude, magnitude, 6)))
