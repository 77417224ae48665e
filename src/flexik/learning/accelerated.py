"""Levenberg-Marquardt training of a perceptron, improved: a few steps do the work of many.

After every step the output layer is solved again exactly (Golub and Pereyra 1973); the step
follows the valley by its second derivative (geodesic acceleration: Transtrum and Sethna 2012); mu
follows the ratio of the actual to the predicted fall of the error (Nielsen 1999) and multiplies
the diagonal of J^T J (Marquardt 1963).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrs

from flexik.learning.levenberg_marquardt import MU_MINIMUM
from flexik.learning.normal_equations import NormalEquations, cholesky, normal_equations
from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, moved, unflatten
from flexik.parameters.trainers import LevenbergMarquardtAccelerated

# share of the largest diagonal element by which every weight is damped at least
_SCALE_FLOOR = 1e-3
# keeps the system of the output layer regular when hidden units agree; relative to its diagonal
_RIDGE = 1e-10
# mu falls by this factor at most in one step
_MU_DECREASE = 0.2


@dataclass(frozen=True, eq=False)
class _Point:
    weights: Weights
    equations: NormalEquations


class _Damping:
    """mu of Nielsen 1999."""

    def __init__(self, mu: float) -> None:
        self.mu, self._growth = mu, 2.0

    def decrease(self, gain: float) -> None:
        # inf and nan come from a predicted fall of 0
        bounded = min(gain, 2.0) if gain > 0.0 else 0.0
        factor = max(_MU_DECREASE, 1.0 - (2.0 * bounded - 1.0) ** 3)
        self.mu, self._growth = max(self.mu * factor, MU_MINIMUM), 2.0

    def increase(self) -> None:
        self.mu, self._growth = self.mu * self._growth, 2.0 * self._growth


def minimise(
    start: Weights,
    problem: Problem,
    settings: LevenbergMarquardtAccelerated,
    _: np.random.Generator,
) -> Minimum:
    """Lower the mean squared error from `start`; a step is kept only when the error falls.

    Solving the output layer of `start` is the first iteration.
    """
    monitor = Monitor(problem, settings)
    error = problem.mean_squared_error(start)
    if (reason := monitor.add(start, error)) is not None:
        return monitor.result(reason)
    solved, _error = with_solved_outputs(start, problem)
    if (better := _point_below(error, solved, problem)) is not None:
        reason = monitor.add(solved, better.equations.mean_squared_error)
    point = better or _Point(start, normal_equations(start, problem))
    damping = _Damping(settings.mu)
    while reason is None:
        found = _descend(point, problem, settings, damping)
        if isinstance(found, StopReason):
            reason = found
        else:
            point = found
            reason = monitor.add(point.weights, point.equations.mean_squared_error)
    return monitor.result(reason)


def _descend(
    point: _Point, problem: Problem, settings: LevenbergMarquardtAccelerated, damping: _Damping
) -> _Point | StopReason:
    equations = point.equations
    if not equations.is_finite():
        return StopReason.NON_FINITE
    norm = 2.0 / problem.targets.size * np.linalg.norm(equations.gradient)
    if norm <= settings.minimum_gradient:
        return StopReason.GRADIENT
    singular = False
    # only mu changes between trials, the Gram product is reused
    while damping.mu <= settings.mu_maximum:
        found = _step(point, problem, damping.mu, settings.acceleration)
        singular = found is None
        if found is not None:
            step, predicted = found
            before = equations.mean_squared_error
            trial, error = with_solved_outputs(moved(point.weights, step), problem)
            # false for nan as well; a trial that fails here costs no Gram product
            if error < before and (better := _point_below(before, trial, problem)) is not None:
                damping.decrease((before - error) / predicted if predicted > 0.0 else 0.0)
                return better
        damping.increase()
    return StopReason.SINGULAR if singular else StopReason.MU


def _point_below(error: float, weights: Weights, problem: Problem) -> _Point | None:
    equations = normal_equations(weights, problem)
    return _Point(weights, equations) if equations.mean_squared_error < error else None


def _step(
    point: _Point, problem: Problem, mu: float, acceleration: float
) -> tuple[Array, float] | None:
    """Step (w,) and the fall of the mean squared error the linear model predicts for it."""
    equations = point.equations
    hidden, output = scale = equations.scale(_SCALE_FLOOR)
    factor = equations.factor(mu, scale)
    if factor is None:
        return None
    diagonal = np.concatenate([hidden, *[output] * len(point.weights[-1])])
    velocity = -factor.solve(equations.gradient)
    predicted = velocity @ (mu * diagonal * velocity - equations.gradient) / problem.targets.size
    if acceleration == 0.0:
        return velocity, float(predicted)
    bending = problem.bending(point.weights, unflatten(velocity, point.weights))
    second = -factor.solve(bending)
    lengths = [math.sqrt(vector @ (diagonal * vector)) for vector in (second, velocity)]
    # false for nan
    if 2.0 * lengths[0] <= acceleration * lengths[1]:
        velocity = velocity + 0.5 * second
    return velocity, float(predicted)


def with_solved_outputs(weights: Weights, problem: Problem) -> tuple[Weights, float]:
    """Weights whose output layer fits the targets best, and their mean squared error.

    The error follows from the sums, to about 1e-16 of that before. What is solved for is the
    change of the output layer, so the ridge that guards the system leaves no bias.
    """
    q, k = weights[-1].shape
    system, right, error = np.zeros((k, k)), np.zeros((k, q)), 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for chunk in problem.chunks(weights):
            last, errors = chunk.layers[-1], chunk.errors(weights)
            system += last @ last.T
            right += last @ errors.T
            error += float(np.vdot(errors, errors))
        factor = cholesky(system, _RIDGE * np.trace(system) / k)
        if factor is None:
            return weights, error / problem.targets.size
        change = -dpotrs(factor, right, lower=1)[0]
        error += float(np.vdot(change, 2.0 * right + system @ change))
    return (*weights[:-1], weights[-1] + change.T), error / problem.targets.size
