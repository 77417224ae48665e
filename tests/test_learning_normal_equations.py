"""J^T J and J^T e in blocks, and the step of equation 56."""

import math

import numpy as np
import pytest
from learning_problems import ARCHITECTURES, dense, some_problem
from test_learning_weights import every_activation, every_architecture

from flexik.learning import normal_equations as ne
from flexik.learning.normal_equations import NormalEquations, normal_equations


def assembled(equations: NormalEquations) -> np.ndarray:
    """J^T J (w, w) of the blocks."""
    q, k, m = equations.mixed.shape
    whole = np.zeros((m + q * k, m + q * k))
    whole[:m, :m] = equations.hidden
    for unit in range(q):
        block = slice(m + unit * k, m + (unit + 1) * k)
        whole[block, :m], whole[:m, block] = equations.mixed[unit], equations.mixed[unit].T
        whole[block, block] = equations.output
    return whole


@every_activation
@every_architecture
def test_blocks_against_autograd(activation, p, hidden, q):
    weights, problem = some_problem(p=p, hidden=hidden, q=q, activation=activation)
    jacobian, errors = dense(weights, problem)
    equations = normal_equations(weights, problem)
    np.testing.assert_allclose(assembled(equations), jacobian.T @ jacobian, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(equations.gradient, jacobian.T @ errors, rtol=1e-11, atol=1e-12)
    assert equations.mean_squared_error == pytest.approx(np.mean(errors**2), rel=1e-13)


@every_activation
@pytest.mark.parametrize("p", [1, 4])
@pytest.mark.parametrize("q", [1, 3])
def test_the_form_for_one_hidden_layer_agrees_with_that_for_any(activation, p, q):
    weights, problem = some_problem(n=50, p=p, hidden=(6,), q=q, activation=activation)
    fast, general = ne._one_hidden_layer(weights, problem), ne._any_layers(weights, problem)
    for name in ("hidden", "mixed", "output", "gradient", "mean_squared_error"):
        np.testing.assert_allclose(
            getattr(fast, name), getattr(general, name), rtol=1e-11, atol=1e-12, err_msg=name
        )


@pytest.mark.parametrize("hidden", [(4,), (4, 3)])
@pytest.mark.parametrize("chunk_length", [1, 7, 39, 40, 1000])
def test_chunks_change_rounding_alone(hidden, chunk_length, monkeypatch):
    # by default one chunk holds all 40 samples
    weights, problem = some_problem(hidden=hidden)
    expected = normal_equations(weights, problem)
    monkeypatch.setattr("flexik.learning.problem.CHUNK_LENGTH", chunk_length)
    found = normal_equations(*some_problem(hidden=hidden))
    for name in ("hidden", "mixed", "output", "gradient"):
        block = getattr(expected, name)
        np.testing.assert_allclose(
            getattr(found, name), block, rtol=0, atol=1e-13 * np.abs(block).max()
        )


@every_activation
@pytest.mark.parametrize(("p", "hidden", "q"), [ARCHITECTURES[0], ARCHITECTURES[3]])
@pytest.mark.parametrize("mu", [1e-4, 1e-1, 1e3])
@pytest.mark.parametrize("scaled", [False, True])
def test_step_against_the_augmented_dense_system(activation, p, hidden, q, mu, scaled):
    weights, problem = some_problem(p=p, hidden=hidden, q=q, activation=activation)
    jacobian, errors = dense(weights, problem)
    n_weights = jacobian.shape[1]
    equations = normal_equations(weights, problem)
    scale = equations.scale(1e-3) if scaled else None
    diagonal = np.ones(n_weights)
    if scaled:
        n_hidden, k = len(equations.hidden), len(equations.output)
        squares = np.sum(jacobian**2, axis=0)
        diagonal[:n_hidden] = np.maximum(squares[:n_hidden], 1e-3 * squares[:n_hidden].max())
        output = np.maximum(squares[-k:], 1e-3 * squares[-k:].max())
        diagonal[n_hidden:] = np.tile(output, q)
    # (J^T J + mu D) step = -J^T e is the least-squares solution of
    # [J; sqrt(mu D)] step = [-e; 0]
    augmented = np.vstack([jacobian, np.diag(np.sqrt(mu * diagonal))])
    expected = np.linalg.lstsq(augmented, np.append(-errors, np.zeros(n_weights)), rcond=None)[0]
    step = -equations.factor(mu, scale).solve(equations.gradient)
    np.testing.assert_allclose(step, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


def test_singular_system_has_no_factor():
    def equations(hidden: float, output: float) -> NormalEquations:
        one = np.ones((1, 1))
        return NormalEquations(hidden * one, 0.0 * one[None], output * one, np.ones(2), 1.0)

    assert equations(1.0, 1.0).factor(0.0) is not None
    assert equations(0.0, 1.0).factor(0.0) is None
    assert equations(1.0, 0.0).factor(0.0) is None
    assert equations(1.0, -1.0).factor(0.5) is None


@pytest.mark.parametrize("hidden", [(4,), (4, 3)])
def test_overflow_is_told_not_warned_of(hidden):
    weights, problem = some_problem(hidden=hidden)
    assert normal_equations(weights, problem).is_finite()
    huge = (*weights[:-1], weights[-1] * 1e200)
    equations = normal_equations(huge, problem)
    assert not equations.is_finite()
    assert math.isinf(equations.mean_squared_error)
