"""The fading weight penalty: steps 1 to 5 of De Luca, Mattone and Sciandrone, section 3.1."""

import numpy as np
import pytest
from learning_problems import ARCHITECTURES, dense, some_problem, taught
from scipy.optimize import minimize
from scipy.sparse.linalg import cg

from flexik.learning import regularised_cg
from flexik.learning.problem import Problem
from flexik.learning.regularised_cg import RegularisedCg, minimise
from flexik.learning.stopping import Minimum, StopReason
from flexik.learning.weights import Weights, flatten, moved, unflatten, uniform_weights

# rounds that end where nothing is left to gain
EXACT = {"round_steps": 400, "round_progress": 0.0, "cg_tolerance": 1e-6, "cg_iterations": 400}


def run(start: Weights, problem: Problem, **settings) -> Minimum:
    return minimise(start, problem, RegularisedCg(**settings), np.random.default_rng(0))


@pytest.mark.parametrize(("p", "hidden", "q"), ARCHITECTURES)
@pytest.mark.parametrize("activation", ["tanh", "logistic"])
def test_curvature_against_autograd(activation, p, hidden, q):
    weights, problem = some_problem(p=p, hidden=hidden, q=q, activation=activation)
    jacobian, _ = dense(weights, problem)
    direction = np.random.default_rng(1).normal(size=jacobian.shape[1])
    found = problem.curvature(weights, unflatten(direction, weights))
    np.testing.assert_allclose(found, jacobian.T @ (jacobian @ direction), rtol=1e-9, atol=1e-11)
    if len(hidden) == 1:
        diagonal = np.einsum("ij,ij->j", jacobian, jacobian)
        np.testing.assert_allclose(problem.curvature_diagonal(weights), diagonal, rtol=1e-10)


def test_a_step_solves_the_penalised_gauss_newton_equations():
    """A first full step, where the model is good enough for it, is that of dense equations."""
    teacher, problem = taught("tanh", seed=2)
    start = moved(teacher, np.full(flatten(teacher).size, 0.05))
    penalty = 1e-5
    jacobian, errors = dense(start, problem)
    share, vector = 2.0 / errors.size, flatten(start)
    system = share * jacobian.T @ jacobian + 2.0 * penalty * np.eye(vector.size)
    gradient = share * jacobian.T @ errors + 2.0 * penalty * vector
    expected = vector - np.linalg.solve(system, gradient)
    precise = EXACT | {"cg_tolerance": 1e-10}
    minimum = run(start, problem, penalty=penalty, n_iterations=1, **precise)
    np.testing.assert_allclose(flatten(minimum.weights), expected, rtol=1e-6)


def test_the_first_round_ends_where_scipy_finds_the_penalised_error_least():
    start, problem = some_problem(hidden=(2,))
    penalty = 0.05
    # the goal is met where the first round ends, so the run ends there
    minimum = run(start, problem, penalty=penalty, goal=10.0, n_iterations=2000, **EXACT)
    assert minimum.stop_reason is StopReason.GOAL

    def penalised(vector):
        error, gradient = problem.gradient(unflatten(vector, start))
        return error + penalty * vector @ vector, gradient + 2.0 * penalty * vector

    known = minimize(penalised, flatten(start), jac=True, method="BFGS", options={"gtol": 1e-9})
    expected = problem.mean_squared_error(unflatten(known.x, start))
    assert minimum.errors[-1] == pytest.approx(expected, rel=1e-4)


def test_success_is_looked_at_where_a_round_ends():
    """Step 2: an error at or below the goal on the way does not end the run."""
    start, problem = some_problem()
    free = run(start, problem, n_iterations=10, round_steps=5, round_progress=0.0)
    goal = 1.0001 * free.errors[2]
    stopped = run(start, problem, n_iterations=10, round_steps=5, round_progress=0.0, goal=goal)
    assert (stopped.stop_reason, len(stopped.errors)) == (StopReason.GOAL, 6)


def test_failure_is_a_round_that_changes_neither_weights_nor_error():
    """Step 3, at a minimum of E far above a goal that noise puts out of reach."""
    start, problem = some_problem(hidden=(2,))
    limits = {"penalty": 1e-6, "penalty_decrease": 0.01, "n_iterations": 5000}
    limits |= {"minimum_gradient": 0.0, "weight_tolerance": 1e-2, "goal": 1e-9}
    minimum = run(start, problem, **limits, **EXACT)
    assert minimum.stop_reason is StopReason.STATIONARY
    _, gradient = problem.gradient(minimum.weights)
    assert np.linalg.norm(gradient) < 1e-4


@pytest.mark.parametrize(
    ("change", "error", "unchanged"),
    [(1e-3, 1.0005, True), (1e-3, 0.9995, True), (2e-3, 1.0, False), (0.0, 1.002, False)],
)
def test_failure_needs_both_tests(change, error, unchanged):
    vector = np.array([1.0, 2.0])
    before = regularised_cg._Point(vector, 1.0, vector, 1.0)
    after = regularised_cg._Point(vector - [0.9 * change, 0.0], error, vector, 1.0)
    settings = RegularisedCg(weight_tolerance=1e-3, error_tolerance=1e-3)
    assert regularised_cg._unchanged(before, after, settings) is unchanged


def test_a_round_that_ends_higher_is_taken_back():
    """Step 4: from the minimum of E a strong penalty leads uphill, and the start is kept."""
    teacher, problem = taught("tanh", seed=2)
    minimum = run(
        teacher,
        problem,
        penalty=1.0,
        penalty_decrease=0.5,
        n_iterations=6,
        round_steps=2,
        minimum_gradient=0.0,
    )
    assert minimum.kept == 0
    assert np.array_equal(flatten(minimum.weights), flatten(teacher))
    # every round begins at the teacher again, with half the penalty: it ends nearer to it
    ends = minimum.errors[2::2]
    assert len(ends) == 3 and np.all(np.diff(ends) < 0.0)
    # and its first step is that of a run of its own from there
    own = run(teacher, problem, penalty=0.5, n_iterations=1, minimum_gradient=0.0)
    assert minimum.errors[3] == own.errors[1]


def test_conjugate_gradients_are_preconditioned_by_the_diagonal(monkeypatch):
    start, problem = some_problem()
    penalty, found = 1e-3, []

    def watched(system, right, **options):
        found.append(options["M"] @ np.ones(right.size))
        return cg(system, right, **options)

    monkeypatch.setattr(regularised_cg, "cg", watched)
    run(start, problem, penalty=penalty, n_iterations=1)
    diagonal = 2.0 / problem.targets.size * problem.curvature_diagonal(start)
    expected = 1.0 / (np.maximum(diagonal, 1e-4 * diagonal.max()) + 2.0 * penalty)
    np.testing.assert_allclose(found[0], expected, rtol=1e-12)
    assert expected.max() > 10.0 * expected.min()


def test_a_strong_penalty_pulls_saturated_weights_back_and_lets_them_grow_again():
    _, problem = some_problem(n=200, p=2, hidden=(8,))
    start = uniform_weights(2, (8,), 2, 40.0, np.random.default_rng(3))
    limits = {"n_iterations": 200, "minimum_gradient": 0.0, "penalty": 1e-2}
    one = run(start, problem, goal=1e9, **limits, **EXACT)
    assert one.stop_reason is StopReason.GOAL
    many = run(start, problem, **limits)
    assert np.linalg.norm(flatten(one.weights)) < 0.1 * np.linalg.norm(flatten(start))
    assert np.linalg.norm(flatten(one.weights)) < np.linalg.norm(flatten(many.weights))
    assert min(many.errors) < 0.2 * one.errors[-1] < 1e-5 * one.errors[0]
