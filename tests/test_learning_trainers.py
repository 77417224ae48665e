"""Back-propagation, L-BFGS, Adam, the fading penalty: steps by hand, limits, what they keep."""

import itertools
import math

import numpy as np
import pytest
import torch
from learning_problems import dense, errors_function, some_problem, taught
from pydantic import ValidationError

from flexik.errors import ParameterError
from flexik.learning.adam import Adam, rate
from flexik.learning.back_propagation import BackPropagation
from flexik.learning.lbfgs import Lbfgs
from flexik.learning.problem import Problem
from flexik.learning.regularised_cg import RegularisedCg
from flexik.learning.stopping import Minimum, Monitor, Stopping, StopReason
from flexik.learning.training import TRAINERS
from flexik.learning.weights import Weights, flatten, moved
from flexik.parameters.reading import validated
from flexik.parameters.trainers import Trainer

SETTINGS = (BackPropagation, Adam, Lbfgs, RegularisedCg)
every_trainer = pytest.mark.parametrize("trainer", SETTINGS)


def minimise(start: Weights, problem: Problem, limits: Stopping, seed: int = 0) -> Minimum:
    return TRAINERS[limits.kind](start, problem, limits, np.random.default_rng(seed))


def test_batch_steps_follow_equation_54():
    start, problem = some_problem()
    fixed = {"rate_increase": 1.0, "error_increase": 1e9, "learning_rate": 0.05, "momentum": 0.8}
    minimum = minimise(start, problem, BackPropagation(n_iterations=3, **fixed))
    weights, step = start, np.zeros(flatten(start).size)
    errors = [problem.mean_squared_error(start)]
    for _ in range(3):
        jacobian, residuals = dense(weights, problem)
        # the mean over samples of the gradient of equation 49
        step = 0.8 * step - 0.05 * jacobian.T @ residuals / 40
        weights = moved(weights, step)
        errors.append(problem.mean_squared_error(weights))
    np.testing.assert_allclose(minimum.errors, errors, rtol=1e-10)


def test_pattern_steps_follow_equation_54_sample_by_sample():
    start, problem = some_problem(n=6)
    fixed = {"rate_increase": 1.0, "error_increase": 1e9, "learning_rate": 0.05, "momentum": 0.8}
    limits = BackPropagation(n_iterations=1, mode="pattern", **fixed)
    minimum = minimise(start, problem, limits, seed=4)
    weights, step = start, np.zeros(flatten(start).size)
    for sample in np.random.default_rng(4).permutation(6):
        jacobian, residuals = dense(weights, problem)
        rows = slice(2 * sample, 2 * sample + 2)
        step = 0.8 * step - 0.05 * jacobian[rows].T @ residuals[rows]
        weights = moved(weights, step)
    assert minimum.errors[1] == pytest.approx(problem.mean_squared_error(weights), rel=1e-10)
    np.testing.assert_allclose(flatten(minimum.weights), flatten(weights), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("mode", ["pattern", "batch"])
def test_a_rate_that_is_too_large_is_lowered(mode):
    start, problem = some_problem()
    limits = BackPropagation(n_iterations=30, mode=mode, learning_rate=1e3)
    minimum = minimise(start, problem, limits)
    ratios = np.divide(minimum.errors[1:], minimum.errors[:-1])
    assert np.all(ratios <= limits.error_increase)
    assert minimum.errors[minimum.kept] < 0.5 * minimum.errors[0]


def test_a_rate_that_falls_too_low_ends_the_run():
    start, problem = some_problem()
    limits = BackPropagation(learning_rate=1e6, minimum_rate=1e5)
    minimum = minimise(start, problem, limits)
    assert minimum.stop_reason is StopReason.LINE_SEARCH
    assert minimum.weights is start


@pytest.mark.parametrize("batch_size", [None, 16, 1000])
def test_adam_follows_the_paper(batch_size):
    start, problem = some_problem()
    limits = Adam(n_iterations=2, learning_rate=0.01, batch_size=batch_size)
    minimum = minimise(start, problem, limits, seed=4)
    generator, weights = np.random.default_rng(4), start
    first = second = np.zeros(flatten(start).size)
    size, count = min(batch_size or 40, 40), itertools.count(1)
    for _ in range(2):
        order = generator.permutation(40)
        for begin in range(0, 40, size):
            batch = order[begin : begin + size] if size < 40 else np.arange(40)
            rows = np.sort(np.concatenate([2 * batch, 2 * batch + 1]))
            jacobian, residuals = (array[rows] for array in dense(weights, problem))
            gradient = 2.0 / rows.size * jacobian.T @ residuals
            first = 0.9 * first + 0.1 * gradient
            second = 0.999 * second + 0.001 * gradient**2
            t = next(count)
            ratio = first / (1 - 0.9**t) / (np.sqrt(second / (1 - 0.999**t)) + 1e-8)
            weights = moved(weights, -0.01 * ratio)
    np.testing.assert_allclose(flatten(minimum.weights), flatten(weights), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("activation", ["tanh", "logistic"])
@pytest.mark.parametrize("hidden", [(3,), (3, 2)])
def test_lbfgs_finds_the_data_of_a_network_near_it(activation, hidden):
    teacher, problem = taught(activation, seed=2, hidden=hidden)
    shift = np.random.default_rng(0).normal(size=flatten(teacher).size)
    limits = Lbfgs(n_iterations=2000, minimum_progress=0.0)
    minimum = minimise(moved(teacher, 0.02 * shift), problem, limits)
    assert minimum.errors[-1] < 1e-9
    assert np.all(np.diff(minimum.errors) < 0.0)


def test_lbfgs_stops_where_the_gradient_of_autograd_is_small():
    start, problem = some_problem(hidden=(2,))
    limits = Lbfgs(n_iterations=5000, minimum_progress=0.0, minimum_gradient=1e-4)
    minimum = minimise(start, problem, limits)
    assert minimum.stop_reason is StopReason.GRADIENT
    vector = torch.tensor(flatten(minimum.weights), requires_grad=True)
    torch.mean(errors_function(start, problem)(vector) ** 2).backward()
    assert 1e-6 < torch.linalg.norm(vector.grad).item() <= 1e-4


@every_trainer
def test_every_limit_ends_the_run_with_its_reason(trainer):
    def run(**limits) -> Minimum:
        return minimise(*some_problem(), trainer(**limits))

    assert run(n_iterations=3).stop_reason is StopReason.ITERATIONS
    assert len(run(n_iterations=3).errors) == 4
    assert run(goal=1.0).stop_reason is StopReason.GOAL
    assert run(minimum_gradient=1e3).stop_reason is StopReason.GRADIENT
    assert run(minimum_progress=0.99, progress_window=3).stop_reason is StopReason.PROGRESS
    assert run(maximum_seconds=1e-9).stop_reason is StopReason.TIME


@every_trainer
def test_overflow_ends_the_run_without_a_bad_network(trainer):
    start, problem = some_problem()
    huge = (start[0], start[1] * 1e200)
    minimum = minimise(huge, problem, trainer())
    assert (minimum.stop_reason, minimum.errors) == (StopReason.NON_FINITE, ())


def test_overflow_on_the_way_keeps_the_best_weights():
    start, problem = some_problem()
    minimum = minimise(start, problem, Adam(n_iterations=50, learning_rate=1e200))
    assert minimum.stop_reason is StopReason.NON_FINITE
    assert minimum.errors[minimum.kept] == min(minimum.errors) <= minimum.errors[0]
    assert problem.mean_squared_error(minimum.weights) == minimum.errors[minimum.kept]


@every_trainer
def test_the_weights_of_the_least_error_are_kept(trainer):
    start, problem = some_problem(hidden=(4, 3))
    minimum = minimise(start, problem, trainer(n_iterations=40))
    assert minimum.errors[minimum.kept] == min(minimum.errors) < minimum.errors[0]
    assert problem.mean_squared_error(minimum.weights) == pytest.approx(
        min(minimum.errors), rel=1e-13
    )


def test_patience_counts_from_the_least_selection_error():
    start, problem = some_problem(selection=True)
    monitor = Monitor(problem, Stopping(selection_patience=2))
    judged = [5.0, 3.0, 4.0, math.nan, 2.0]
    errors = iter(judged)
    object.__setattr__(problem, "selection_error", lambda _: next(errors))
    weights = [moved(start, np.full(flatten(start).size, k)) for k in range(5)]
    reasons = [monitor.add(weights[k], 9.0 - k) for k in range(4)]
    assert reasons == [None, None, None, StopReason.SELECTION]
    minimum = monitor.result(reasons[-1])
    assert (minimum.kept, minimum.weights) == (1, weights[1])


def test_the_rate_of_adam_falls_along_half_a_cosine():
    limits = Adam(n_iterations=2, learning_rate=0.01, final_rate=0.2)
    assert [rate(limits, done) for done in (0.0, 0.5, 1.0)] == pytest.approx([0.01, 0.006, 0.002])
    start, problem = some_problem()
    # the first steps of Adam are as long as its rate
    first = minimise(start, problem, Adam(n_iterations=1, learning_rate=0.01, final_rate=0.0))
    assert np.abs(flatten(first.weights) - flatten(start)).max() == pytest.approx(0.01, rel=1e-4)
    constant = Adam(n_iterations=2, learning_rate=0.01)
    assert rate(constant, 0.7) == rate(constant, 0.0)
    one, other = (minimise(start, problem, settings) for settings in (limits, constant))
    moves = [np.abs(flatten(run.weights) - flatten(first.weights)).max() for run in (one, other)]
    assert moves[0] == pytest.approx(0.6 * moves[1], rel=1e-6)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("levenberg_marquardt", {"mu": math.nan}),
        ("levenberg_marquardt", {"mu_decrease": 1.5}),
        ("levenberg_marquardt", {"mu_increase": 1.0}),
        ("levenberg_marquardt", {"mu_maximum": math.inf}),
        ("levenberg_marquardt_accelerated", {"mu": 0.0}),
        ("levenberg_marquardt_accelerated", {"mu": 1e11}),
        ("levenberg_marquardt_accelerated", {"acceleration": -0.1}),
        ("back_propagation", {"mode": "online"}),
        ("back_propagation", {"minimum_rate": 1.0}),
        ("adam", {"mu": 1.0}),
        ("adam", {"beta_1": 1.0}),
        ("lbfgs", {"n_iterations": 1.5}),
        ("lbfgs", {"memory": True}),
        ("lbfgs", {"goal": "1e-3"}),
        ("regularised_cg", {"penalty_decrease": 1.0}),
    ],
)
def test_bad_settings_are_told_in_one_line_that_names_the_key(kind, options):
    (key,) = options
    with pytest.raises(ParameterError, match=rf"^params.yaml: {key}: [^\n]*$"):
        validated(Trainer, {"kind": kind, **options}, lambda keys: ("params.yaml", ".".join(keys)))


def test_changed_settings_are_checked_too():
    assert Adam().but(beta_1=0.5) == Adam(beta_1=0.5)
    with pytest.raises(ValidationError, match="beta_1"):
        Adam().but(beta_1=1.0)
