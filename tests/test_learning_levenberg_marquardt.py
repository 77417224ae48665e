"""Levenberg-Marquardt: derivatives, the step of equation 56, schedule and stop reasons."""

import functools
import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from flexik.errors import TrainingError
from flexik.learning import levenberg_marquardt as lm
from flexik.learning.levenberg_marquardt import LevenbergMarquardt, StopReason, Weights
from flexik.learning.perceptron import ACTIVATIONS

FUNCTIONS = {"tanh": torch.tanh, "logistic": torch.sigmoid}


def problem(
    n: int = 40, p: int = 3, q: int = 2, h: int = 4, activation: str = "tanh", seed: int = 0
):
    """Smooth data with a little noise, and Nguyen-Widrow weights."""
    generator = np.random.default_rng(seed)
    inputs = generator.uniform(-1.0, 1.0, (n, p))
    mixed = inputs @ generator.normal(size=(p, q))
    targets = np.sin(2.0 * mixed) + 0.02 * generator.normal(size=(n, q))
    weights = lm.initial_weights(p, h, q, activation, np.random.default_rng(seed))
    return weights, activation, inputs, targets


def flat(weights: Weights) -> np.ndarray:
    return np.concatenate([weights.hidden.ravel(), weights.output.ravel()])


def residuals(vector: torch.Tensor, weights: Weights, activation: str, inputs, targets):
    """Plain network errors (n * q,), written independently for autograd."""
    h, p = weights.hidden.shape[0], weights.hidden.shape[1] - 1
    first = vector[: h * (p + 1)].reshape(h, p + 1)
    second = vector[h * (p + 1) :].reshape(-1, h + 1)
    ones = torch.ones(len(inputs), 1, dtype=torch.float64)
    hidden = FUNCTIONS[activation](torch.cat([torch.from_numpy(inputs), ones], 1) @ first.T)
    outputs = torch.cat([hidden, ones], 1) @ second.T
    return (outputs - torch.from_numpy(targets)).reshape(-1)


def dense(weights: Weights, activation: str, inputs, targets) -> tuple[np.ndarray, np.ndarray]:
    """J (n * q, w) and e (n * q,) by automatic differentiation."""
    vector = torch.from_numpy(flat(weights))
    function = functools.partial(
        residuals, weights=weights, activation=activation, inputs=inputs, targets=targets
    )
    return torch.autograd.functional.jacobian(function, vector).numpy(), function(vector).numpy()


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize(("p", "q", "h"), [(3, 2, 4), (1, 1, 1), (2, 3, 5)])
def test_normal_equations_against_autograd(activation, p, q, h):
    case = problem(p=p, q=q, h=h, activation=activation)
    jacobian, errors = dense(*case)
    hessian, gradient = lm.normal_equations(*case)
    np.testing.assert_allclose(hessian, jacobian.T @ jacobian, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(gradient, jacobian.T @ errors, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_gradient_against_central_differences(activation):
    weights, *rest = problem(activation=activation)
    _, gradient = lm.normal_equations(weights, *rest)
    count = rest[2].size
    length = 1e-6
    for i in range(gradient.size):
        shift = length * np.eye(gradient.size)[i]
        above, below = (lm.mean_squared_error(weights.moved(s), *rest) for s in (shift, -shift))
        # the gradient of the mean of the squares is 2 / count J^T e
        numeric = (above - below) / (2.0 * length)
        assert numeric == pytest.approx(2.0 / count * gradient[i], rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("mu", [1e-4, 1e-1, 1e3])
def test_step_against_the_augmented_dense_system(activation, mu):
    case = problem(activation=activation)
    jacobian, errors = dense(*case)
    n_weights = jacobian.shape[1]
    # (J^T J + mu I) step = -J^T e is the least-squares solution of [J; sqrt(mu) I] step = [-e; 0]
    augmented = np.vstack([jacobian, math.sqrt(mu) * np.eye(n_weights)])
    expected = np.linalg.lstsq(augmented, np.append(-errors, np.zeros(n_weights)), rcond=None)[0]
    step = lm.damped_step(*lm.normal_equations(*case), mu)
    np.testing.assert_allclose(step, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


def test_singular_system_has_no_step():
    assert lm.damped_step(np.zeros((2, 2)), np.ones(2), 0.0) is None
    assert lm.damped_step(np.diag([1.0, -1.0]), np.ones(2), 0.5) is None


@pytest.mark.parametrize("chunk_length", [1, 7, 39, 40, 1000])
def test_chunks_change_rounding_alone(chunk_length):
    case = problem()
    # the reference chunk holds all 40 samples
    hessian, gradient = lm.normal_equations(*case, chunk_length=40)
    chunked = lm.normal_equations(*case, chunk_length=chunk_length)
    np.testing.assert_allclose(chunked[0], hessian, rtol=0, atol=1e-13 * np.abs(hessian).max())
    np.testing.assert_allclose(chunked[1], gradient, rtol=0, atol=1e-13 * np.abs(gradient).max())
    error = lm.mean_squared_error(*case, chunk_length=chunk_length)
    assert error == pytest.approx(lm.mean_squared_error(*case, chunk_length=40), rel=1e-14)


def test_training_does_not_depend_on_the_chunk_length(monkeypatch):
    limits = LevenbergMarquardt(n_iterations=10)
    whole = lm.minimise(*problem(), limits)
    for name in ("normal_equations", "mean_squared_error"):
        monkeypatch.setattr(lm, name, functools.partial(getattr(lm, name), chunk_length=7))
    chunked = lm.minimise(*problem(), limits)
    np.testing.assert_allclose(chunked.errors, whole.errors, rtol=1e-9)


@given(st.integers(0, 2**31), st.sampled_from(ACTIVATIONS))
@settings(max_examples=40, deadline=None)
def test_the_error_falls_at_every_step(seed, activation):
    case = problem(activation=activation, seed=seed)
    minimum = lm.minimise(*case, LevenbergMarquardt(n_iterations=30))
    assert np.all(np.diff(minimum.errors) < 0.0)
    assert minimum.errors[0] == lm.mean_squared_error(*case)
    assert minimum.errors[-1] == lm.mean_squared_error(minimum.weights, *case[1:])


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_recovers_data_made_by_a_network(activation):
    generator = np.random.default_rng(1)
    teacher = lm.initial_weights(2, 3, 2, activation, generator)
    inputs = generator.uniform(-1.0, 1.0, (200, 2))
    targets = residuals(
        torch.from_numpy(flat(teacher)), teacher, activation, inputs, np.zeros((200, 2))
    )
    targets = targets.numpy().reshape(200, 2)
    errors = []
    for seed in range(5):
        start = lm.initial_weights(2, 3, 2, activation, np.random.default_rng(seed))
        errors.append(lm.minimise(start, activation, inputs, targets, LevenbergMarquardt()).errors)
    assert min(run[-1] for run in errors) < 1e-10


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_linear_data_is_fitted_closely(activation):
    weights, _, inputs, _ = problem(activation=activation)
    targets = inputs @ np.array([[0.3, -0.2], [0.1, 0.4], [-0.5, 0.2]]) + 0.1
    limits = LevenbergMarquardt(minimum_gradient=0.0)
    # a straight line is the limit of ever smaller hidden weights, so 0 is approached, not met
    assert lm.minimise(weights, activation, inputs, targets, limits).errors[-1] < 1e-9


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("seed", range(3))
def test_same_minimum_as_scipy_from_the_same_start(activation, seed):
    # noise gives an error floor above 0; a start near the teacher puts both in one valley
    generator = np.random.default_rng(seed)
    teacher = lm.initial_weights(2, 3, 2, activation, generator)
    inputs = generator.uniform(-1.0, 1.0, (80, 2))
    vector = torch.from_numpy(flat(teacher))
    clean = residuals(vector, teacher, activation, inputs, np.zeros((80, 2))).numpy()
    targets = clean.reshape(80, 2) + 0.01 * generator.normal(size=(80, 2))
    start = teacher.moved(0.05 * generator.normal(size=vector.numel()))

    def errors(vector: np.ndarray) -> np.ndarray:
        return residuals(torch.from_numpy(vector), start, activation, inputs, targets).numpy()

    reference = least_squares(errors, flat(start), method="lm", xtol=1e-12, ftol=1e-12)
    assert reference.success
    limits = LevenbergMarquardt(minimum_progress=0.0, minimum_gradient=1e-10)
    minimum = lm.minimise(start, activation, inputs, targets, limits)
    assert minimum.errors[-1] == pytest.approx(2.0 * reference.cost / targets.size, rel=1e-6)


@pytest.mark.parametrize(("activation", "half_range"), [("tanh", 2.0), ("logistic", 4.0)])
def test_initial_weights_are_nguyen_widrow(activation, half_range):
    weights = lm.initial_weights(4, 14, 2, activation, np.random.default_rng(5))
    assert weights.hidden.shape == (14, 5)
    assert weights.output.shape == (2, 15)
    magnitude = half_range * 0.7 * 14**0.25
    np.testing.assert_allclose(np.linalg.norm(weights.hidden[:, :4], axis=1), magnitude)
    spread = np.linspace(-magnitude, magnitude, 14) * np.sign(weights.hidden[:, 0])
    np.testing.assert_allclose(weights.hidden[:, 4], spread)
    assert np.all(np.abs(weights.output) <= 1.0)


def test_every_limit_ends_the_run_with_its_reason():
    def reason(**limits) -> StopReason:
        return lm.minimise(*problem(), LevenbergMarquardt(**limits)).stop_reason

    assert reason(n_iterations=3) is StopReason.ITERATIONS
    assert reason(goal=0.1) is StopReason.GOAL
    assert reason(minimum_gradient=1e3) is StopReason.GRADIENT
    assert reason(minimum_progress=0.9, progress_window=5) is StopReason.PROGRESS
    assert len(lm.minimise(*problem(), LevenbergMarquardt(n_iterations=3)).errors) == 4


def test_the_gradient_limit_is_that_of_the_mean_squared_error():
    case = problem()
    jacobian, errors = dense(*case)
    norm = 2.0 / case[3].size * np.linalg.norm(jacobian.T @ errors)
    for factor, n_errors in [(1.001, 1), (0.999, 2)]:
        limits = LevenbergMarquardt(n_iterations=1, minimum_gradient=factor * norm)
        assert len(lm.minimise(*case, limits).errors) == n_errors


def test_mu_never_underflows(monkeypatch):
    tried = []

    def always_better(hessian, gradient, mu):
        tried.append(mu)
        return -1e-3 * gradient

    monkeypatch.setattr(lm, "damped_step", always_better)
    lm.minimise(*problem(), LevenbergMarquardt(n_iterations=6, mu_decrease=1e-100))
    assert len(tried) == 6
    assert min(tried) > 0.0


def test_a_run_at_its_minimum_ends_by_mu_and_keeps_its_weights():
    # with every other limit off, rounding alone stops the fall of the error
    weights, activation, inputs, targets = problem(n=12, p=1, q=1, h=1)
    limits = LevenbergMarquardt(minimum_gradient=0.0, minimum_progress=0.0, n_iterations=10_000)
    minimum = lm.minimise(weights, activation, inputs, targets, limits)
    assert minimum.stop_reason is StopReason.MU
    again = lm.minimise(minimum.weights, activation, inputs, targets, limits)
    assert again.errors[-1] <= minimum.errors[-1] == again.errors[0]


def test_a_singular_system_ends_the_run_and_keeps_the_weights(monkeypatch):
    case = problem()
    monkeypatch.setattr(lm, "damped_step", lambda *_: None)
    minimum = lm.minimise(*case, LevenbergMarquardt())
    assert minimum.stop_reason is StopReason.SINGULAR
    assert minimum.weights is case[0]


def test_a_singular_factor_raises_mu(monkeypatch):
    tried, original = [], lm.damped_step

    def fussy(hessian, gradient, mu):
        tried.append(mu)
        return original(hessian, gradient, mu) if mu >= 1.0 else None

    monkeypatch.setattr(lm, "damped_step", fussy)
    minimum = lm.minimise(*problem(), LevenbergMarquardt(n_iterations=1))
    np.testing.assert_allclose(tried[:4], [1e-3, 1e-2, 1e-1, 1.0])
    assert minimum.errors[1] < minimum.errors[0]


def test_a_trial_that_overflows_is_not_taken(monkeypatch):
    original = lm.damped_step

    def wild(hessian, gradient, mu):
        step = original(hessian, gradient, mu)
        return step * 1e200 if mu < 1.0 else step

    monkeypatch.setattr(lm, "damped_step", wild)
    minimum = lm.minimise(*problem(), LevenbergMarquardt(n_iterations=5))
    assert np.all(np.diff(minimum.errors) < 0.0)


def test_overflow_ends_the_run_without_a_bad_network():
    weights, *rest = problem()
    huge = Weights(weights.hidden, weights.output * 1e200)
    minimum = lm.minimise(huge, *rest, LevenbergMarquardt())
    assert (minimum.stop_reason, minimum.errors) == (StopReason.NON_FINITE, ())


def test_overflowing_derivatives_keep_the_weights(monkeypatch):
    case = problem()
    monkeypatch.setattr(lm, "normal_equations", lambda *_: (np.full((2, 2), np.inf), np.ones(2)))
    minimum = lm.minimise(*case, LevenbergMarquardt())
    assert minimum.stop_reason is StopReason.NON_FINITE
    assert minimum.weights is case[0]
    assert len(minimum.errors) == 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("n_iterations", 0),
        ("mu", 0.0),
        ("mu", math.nan),
        ("mu_decrease", 1.5),
        ("mu_increase", 1.0),
        ("mu_maximum", 1e-4),
        ("mu_maximum", math.inf),
        ("goal", -1.0),
        ("minimum_gradient", math.nan),
        ("minimum_progress", 1.0),
        ("progress_window", 0),
    ],
)
def test_settings_out_of_range_are_named(name, value):
    with pytest.raises(TrainingError, match=f"{name}={value}"):
        LevenbergMarquardt(**{name: value})
