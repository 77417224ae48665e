"""Both Levenberg-Marquardt trainers: known minima, schedules of mu, stop reasons."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from learning_problems import dense, errors_function, some_problem, taught
from scipy.optimize import least_squares

from flexik.learning import accelerated, levenberg_marquardt
from flexik.learning.accelerated import LevenbergMarquardtAccelerated, with_solved_outputs
from flexik.learning.levenberg_marquardt import LevenbergMarquardt
from flexik.learning.normal_equations import NormalEquations, normal_equations
from flexik.learning.perceptron import ACTIVATIONS
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Stopping, StopReason
from flexik.learning.weights import (
    Weights,
    flatten,
    forward,
    initial_weights,
    moved,
    slopes_of,
    unflatten,
)

MODULES = {
    LevenbergMarquardt: levenberg_marquardt,
    LevenbergMarquardtAccelerated: accelerated,
}
TRAINERS = tuple(MODULES)
HIDDEN = [(4,), (4, 3)]
UNLIMITED = {"minimum_gradient": 0.0, "minimum_progress": 0.0, "n_iterations": 10_000}

every_activation = pytest.mark.parametrize("activation", ACTIVATIONS)
every_trainer = pytest.mark.parametrize("trainer", TRAINERS)


def minimise(start: Weights, problem: Problem, limits: Stopping) -> Minimum:
    generator = np.random.default_rng(0)
    return MODULES[type(limits)].minimise(start, problem, limits, generator)


@given(
    st.integers(0, 2**31),
    st.sampled_from(ACTIVATIONS),
    st.sampled_from(TRAINERS),
    st.sampled_from(HIDDEN),
)
@settings(max_examples=60, deadline=None)
def test_the_error_falls_at_every_step(seed, activation, trainer, hidden):
    start, problem = some_problem(hidden=hidden, activation=activation, seed=seed)
    minimum = minimise(start, problem, trainer(n_iterations=20))
    assert np.all(np.diff(minimum.errors) < 0.0)
    assert minimum.errors[0] == problem.mean_squared_error(start)
    assert minimum.errors[-1] == pytest.approx(
        problem.mean_squared_error(minimum.weights), rel=1e-13
    )
    assert minimum.kept == len(minimum.errors) - 1


@every_trainer
@pytest.mark.parametrize("hidden", HIDDEN)
def test_chunks_do_not_change_a_short_run(trainer, hidden, monkeypatch):
    limits = trainer(n_iterations=10)
    whole = minimise(*some_problem(hidden=hidden), limits)
    monkeypatch.setattr("flexik.learning.problem.CHUNK_LENGTH", 7)
    np.testing.assert_allclose(
        minimise(*some_problem(hidden=hidden), limits).errors, whole.errors, rtol=1e-9
    )


@every_trainer
@every_activation
@pytest.mark.parametrize("seed", [1, 2])
def test_chunks_do_not_change_the_minimum(trainer, activation, seed, monkeypatch):
    def run():
        teacher, problem = taught(activation, seed, n=80, noise=0.01)
        shift = np.random.default_rng(seed).normal(size=flatten(teacher).size)
        limits = trainer(n_iterations=2000, minimum_progress=0.0, minimum_gradient=1e-10)
        return minimise(moved(teacher, 0.05 * shift), problem, limits).errors

    whole = run()
    monkeypatch.setattr("flexik.learning.problem.CHUNK_LENGTH", 7)
    assert run()[-1] == pytest.approx(whole[-1], rel=1e-9)


@every_trainer
@pytest.mark.parametrize("hidden", HIDDEN)
def test_what_is_remembered_changes_no_bit(trainer, hidden, monkeypatch):
    limits = trainer(n_iterations=60, minimum_progress=0.0)
    monkeypatch.setattr("flexik.learning.problem.CHUNK_LENGTH", 7)
    remembered = minimise(*some_problem(hidden=hidden), limits)
    monkeypatch.setattr("flexik.learning.problem._REMEMBERED", 0)
    again = minimise(*some_problem(hidden=hidden), limits)
    assert again.errors == remembered.errors
    assert np.array_equal(flatten(again.weights), flatten(remembered.weights))


@every_activation
@every_trainer
@pytest.mark.parametrize("hidden", [(3,), (3, 2)])
def test_recovers_data_made_by_a_network(activation, trainer, hidden):
    _, problem = taught(activation, seed=1, hidden=hidden)
    starts = [
        initial_weights(2, hidden, 2, activation, np.random.default_rng(seed)) for seed in range(5)
    ]
    limits = trainer(n_iterations=300, minimum_progress=0.0, goal=1e-12)
    reached = [minimise(start, problem, limits).errors[-1] for start in starts]
    assert min(reached) < 1e-10


@every_activation
@every_trainer
def test_linear_data_is_fitted_closely(activation, trainer):
    start, problem = some_problem(activation=activation)
    mixing = np.array([[0.3, -0.2], [0.1, 0.4], [-0.5, 0.2]])
    targets = np.ascontiguousarray((problem.inputs[:-1].T @ mixing + 0.1).T)
    limits = trainer(minimum_gradient=0.0, n_iterations=500)
    # a straight line is the limit of ever smaller hidden weights, so 0 is approached, not met
    assert minimise(start, replace(problem, targets=targets), limits).errors[-1] < 1e-8


@every_activation
@every_trainer
@pytest.mark.parametrize("seed", range(3))
def test_same_minimum_as_scipy_from_the_same_start(activation, trainer, seed):
    # noise gives an error floor above 0; a start near the teacher puts both in one valley
    teacher, problem = taught(activation, seed, n=80, noise=0.01)
    shift = np.random.default_rng(seed).normal(size=flatten(teacher).size)
    start = moved(teacher, 0.05 * shift)
    function = errors_function(start, problem)
    reference = least_squares(
        lambda vector: function(torch.from_numpy(vector)).numpy(),
        flatten(start),
        method="lm",
        xtol=1e-12,
        ftol=1e-12,
    )
    assert reference.success
    minimum = minimise(start, problem, trainer(minimum_progress=0.0, minimum_gradient=1e-10))
    assert minimum.errors[-1] == pytest.approx(
        2.0 * reference.cost / problem.targets.size, rel=1e-6
    )


def plain_errors(vector: np.ndarray, start: Weights, problem: Problem) -> np.ndarray:
    weights = unflatten(vector, start)
    outputs = weights[-1] @ forward(weights, problem.activation, problem.inputs)[-1]
    return (outputs - problem.targets).T.ravel()


def plain_jacobian(vector: np.ndarray, start: Weights, problem: Problem) -> np.ndarray:
    weights, n_outputs = unflatten(vector, start), len(problem.targets)
    layers = forward(weights, problem.activation, problem.inputs)
    slopes = slopes_of(layers, problem.activation)
    # derivative (n, q, units) of the outputs by the net inputs of a layer
    derivative = np.tile(np.eye(n_outputs), (problem.inputs.shape[1], 1, 1))
    columns = []
    for k in range(len(weights) - 1, -1, -1):
        block = derivative[:, :, :, None] * layers[k].T[:, None, None, :]
        columns.append(block.reshape(len(derivative) * n_outputs, -1))
        if k > 0:
            derivative = derivative @ weights[k][:, :-1] * slopes[k - 1].T[:, None, :]
    return np.hstack(columns[::-1])


@every_activation
@pytest.mark.parametrize("hidden", HIDDEN)
def test_the_jacobian_given_to_scipy_is_right(activation, hidden):
    start, problem = some_problem(hidden=hidden, activation=activation)
    found = plain_jacobian(flatten(start), start, problem)
    np.testing.assert_allclose(found, dense(start, problem)[0], rtol=1e-11, atol=1e-13)


@every_activation
@pytest.mark.parametrize("hidden", HIDDEN)
def test_accelerated_training_ends_no_worse_than_scipy_from_the_same_starts(activation, hidden):
    ours, theirs = [], []
    for seed in range(12):
        start, problem = some_problem(n=60, p=2, hidden=hidden, activation=activation, seed=seed)

        reference = least_squares(
            functools.partial(plain_errors, start=start, problem=problem),
            flatten(start),
            functools.partial(plain_jacobian, start=start, problem=problem),
            method="lm",
            max_nfev=150,
        )
        theirs.append(2.0 * reference.cost / problem.targets.size)
        limits = LevenbergMarquardtAccelerated(n_iterations=150, minimum_progress=0.0)
        ours.append(minimise(start, problem, limits).errors[-1])
    # one start may lead the two into different valleys, many do not
    assert np.mean(np.log(ours)) <= np.mean(np.log(theirs))


@every_activation
@pytest.mark.parametrize("hidden", HIDDEN)
def test_outputs_are_solved_exactly(activation, hidden):
    start, problem = some_problem(hidden=hidden, activation=activation)
    solved, error = with_solved_outputs(start, problem)
    jacobian, errors = dense(start, problem)
    output = jacobian[:, -start[-1].size :]
    # the errors are linear in the output weights
    change = np.linalg.lstsq(output, -errors, rcond=None)[0]
    np.testing.assert_allclose(solved[-1].ravel(), start[-1].ravel() + change, rtol=1e-6, atol=1e-7)
    assert error == pytest.approx(np.mean((errors + output @ change) ** 2), rel=1e-9)
    assert error == pytest.approx(problem.mean_squared_error(solved), rel=1e-12)
    for before, after in zip(start[:-1], solved[:-1], strict=True):
        assert after is before


def test_equal_hidden_units_are_no_obstacle():
    start, problem = some_problem()
    twins = (np.repeat(start[0][:2], 2, axis=0), start[1])
    limits = LevenbergMarquardtAccelerated(n_iterations=20)
    minimum = minimise(twins, problem, limits)
    assert np.all(np.diff(minimum.errors) < 0.0)
    assert len(minimum.errors) > 5


@every_trainer
def test_every_limit_ends_the_run_with_its_reason(trainer):
    def run(**limits) -> Minimum:
        return minimise(*some_problem(selection=True), trainer(**limits))

    assert run(n_iterations=3).stop_reason is StopReason.ITERATIONS
    assert len(run(n_iterations=3).errors) == 4
    assert run(goal=0.1).stop_reason is StopReason.GOAL
    assert run(minimum_gradient=1e3).stop_reason is StopReason.GRADIENT
    assert run(minimum_progress=0.9, progress_window=5).stop_reason is StopReason.PROGRESS
    assert run(maximum_seconds=1e-9).stop_reason is StopReason.TIME


@every_trainer
def test_the_gradient_limit_is_that_of_the_mean_squared_error(trainer):
    start, problem = some_problem()
    if trainer is LevenbergMarquardtAccelerated:
        # so that solving the outputs moves nothing
        start, _ = with_solved_outputs(start, problem)
    norm = np.linalg.norm(problem.gradient(start)[1])
    for factor, stopped in [(1.001, True), (0.999, False)]:
        limits = trainer(n_iterations=2, minimum_gradient=factor * norm)
        errors = minimise(start, problem, limits).errors
        assert (errors[-1] > (1.0 - 1e-12) * errors[0]) == stopped


@every_trainer
def test_a_run_at_its_minimum_ends_by_mu_and_keeps_its_weights(trainer):
    # with every other limit off, rounding alone stops the fall of the error
    start, problem = some_problem(n=12, p=1, q=1, hidden=(1,))
    limits = trainer(**UNLIMITED)
    minimum = minimise(start, problem, limits)
    assert minimum.stop_reason is StopReason.MU
    again = minimise(minimum.weights, problem, limits)
    assert again.errors[-1] <= again.errors[0]
    assert again.errors[0] == pytest.approx(minimum.errors[-1], rel=1e-14)


@every_trainer
def test_a_singular_system_ends_the_run_and_keeps_the_weights(trainer, monkeypatch):
    start, problem = some_problem()
    monkeypatch.setattr(NormalEquations, "factor", lambda *_: None)
    minimum = minimise(start, problem, trainer())
    assert minimum.stop_reason is StopReason.SINGULAR
    assert minimum.weights[0] is start[0]


@every_trainer
def test_a_singular_factor_raises_mu(trainer, monkeypatch):
    tried, original = [], NormalEquations.factor

    def fussy(self, mu, *scale):
        tried.append(mu)
        return original(self, mu, *scale) if mu >= 1.0 else None

    monkeypatch.setattr(NormalEquations, "factor", fussy)
    minimum = minimise(*some_problem(), trainer(n_iterations=2))
    before = [mu for mu in tried if mu < 1.0]
    assert before
    assert before == sorted(before)
    assert np.all(np.diff(minimum.errors) < 0.0)


def test_mu_follows_the_rules_of_matlab(monkeypatch):
    tried, original = [], NormalEquations.factor

    def fussy(self, mu):
        tried.append(mu)
        return original(self, mu) if mu >= 1.0 else None

    monkeypatch.setattr(NormalEquations, "factor", fussy)
    minimise(*some_problem(), LevenbergMarquardt(n_iterations=1))
    np.testing.assert_allclose(tried[:4], [1e-3, 1e-2, 1e-1, 1.0])


@every_trainer
def test_mu_never_underflows(trainer, monkeypatch):
    tried, original = [], NormalEquations.factor

    def recording(self, mu, *scale):
        tried.append(mu)
        return original(self, mu, *scale)

    monkeypatch.setattr(NormalEquations, "factor", recording)
    monkeypatch.setattr(accelerated, "_MU_DECREASE", 1e-100)
    shrink = {"mu_decrease": 1e-100} if trainer is LevenbergMarquardt else {}
    minimise(*some_problem(), trainer(n_iterations=6, **shrink))
    assert len(tried) >= 5
    assert min(tried) == 1e-20


@every_trainer
@pytest.mark.parametrize("hidden", HIDDEN)
def test_overflow_ends_the_run_without_a_bad_network(trainer, hidden):
    start, problem = some_problem(hidden=hidden)
    huge = (*start[:-1], start[-1] * 1e200)
    minimum = minimise(huge, problem, trainer())
    assert (minimum.stop_reason, minimum.errors) == (StopReason.NON_FINITE, ())


@every_trainer
def test_overflowing_derivatives_keep_the_weights(trainer, monkeypatch):
    start, problem = some_problem()

    def overflowing(weights, problem):
        equations = normal_equations(weights, problem)
        return replace(equations, hidden=equations.hidden * np.inf)

    monkeypatch.setattr(MODULES[trainer], "normal_equations", overflowing)
    minimum = minimise(start, problem, trainer())
    assert minimum.stop_reason is StopReason.NON_FINITE
    assert minimum.weights[0] is start[0]
    assert math.isfinite(minimum.errors[-1])


@every_trainer
def test_a_trial_that_overflows_is_not_taken(trainer, monkeypatch):
    module, original, calls = MODULES[trainer], moved, []

    def wild(weights, step):
        calls.append(step)
        return original(weights, step * (1e300 if len(calls) % 3 == 1 else 1.0))

    monkeypatch.setattr(module, "moved", wild)
    minimum = minimise(*some_problem(), trainer(n_iterations=5))
    assert len(calls) > 5
    assert np.all(np.diff(minimum.errors) < 0.0)
