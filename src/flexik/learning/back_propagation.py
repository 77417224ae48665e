"""Back-propagation training of a perceptron, by pattern or by batch.

Source: Rouvinen 1999, equations 49 to 54, with linear outputs, so that equation 52 loses its
factor y (1 - y); the learning rate varies as in MATLAB's traingdx.
"""

import math
from dataclasses import dataclass

import numpy as np

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, Stopping, StopReason
from flexik.learning.weights import Weights, backward, flatten, forward, slopes_of, unflatten

MODES = ("pattern", "batch")


@dataclass(frozen=True)
class BackPropagation(Stopping):
    """Settings of the trainer; an iteration is one pass over the data (an epoch).

    Attributes
    ----------
    mode : "pattern": a step after each sample, in random order; "batch": one step a pass, along
        the mean of the samples' gradients, so that the learning rate does not depend on their
        number
    learning_rate : eta of equation 51, the first one
    momentum : alpha of equation 54
    rate_increase : factor of the learning rate after a pass that lowers the error
    rate_decrease : factor after a pass that raises it by more than `error_increase`; that pass is
        taken back and the momentum cleared
    error_increase : largest factor by which a pass may raise the error
    minimum_rate : the run ends when the learning rate falls below it
    """

    minimum_progress: float = 0.0
    mode: str = "batch"
    learning_rate: float = 0.01
    momentum: float = 0.9
    rate_increase: float = 1.05
    rate_decrease: float = 0.7
    error_increase: float = 1.04
    minimum_rate: float = 1e-12

    def ranges(self) -> dict[str, bool]:
        """Whether each setting is in its range."""
        return super().ranges() | {
            "mode": self.mode in MODES,
            "learning_rate": 0.0 < self.learning_rate < math.inf,
            "momentum": 0.0 <= self.momentum < 1.0,
            "rate_increase": 1.0 <= self.rate_increase < math.inf,
            "rate_decrease": 0.0 < self.rate_decrease < 1.0,
            "error_increase": 1.0 <= self.error_increase < math.inf,
            "minimum_rate": 0.0 < self.minimum_rate <= self.learning_rate,
        }


def minimise(
    start: Weights, problem: Problem, settings: BackPropagation, generator: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept."""
    monitor = Monitor(problem, settings)
    weights, step, rate = start, np.zeros(flatten(start).size), settings.learning_rate
    error, gradient = problem.gradient(weights)
    while (reason := monitor.add(weights, error)) is None:
        if np.linalg.norm(gradient) <= settings.minimum_gradient:
            reason = StopReason.GRADIENT
            break
        while rate >= settings.minimum_rate:
            if settings.mode == "batch":
                # of the mean over samples of equation 49, which halves squares and adds outputs
                mean_gradient = 0.5 * len(problem.targets) * gradient
                trial_step = settings.momentum * step - rate * mean_gradient
                trial = unflatten(flatten(weights) + trial_step, start)
            else:
                trial, trial_step = _pattern_pass(weights, problem, rate, step, settings, generator)
            trial_error, trial_gradient = problem.gradient(trial)
            # false for nan as well
            if trial_error <= settings.error_increase * error:
                break
            rate *= settings.rate_decrease
            step = np.zeros_like(step)
        else:
            reason = StopReason.LINE_SEARCH
            break
        if trial_error < error:
            rate *= settings.rate_increase
        weights, step, error, gradient = trial, trial_step, trial_error, trial_gradient
    return monitor.result(reason)


def _pattern_pass(
    weights: Weights,
    problem: Problem,
    rate: float,
    step: Array,
    settings: BackPropagation,
    generator: np.random.Generator,
) -> tuple[Weights, Array]:
    vector = flatten(weights)
    # views: they follow the vector
    current = unflatten(vector, weights)
    with np.errstate(over="ignore", invalid="ignore"):
        for sample in generator.permutation(problem.targets.shape[1]):
            one = slice(sample, sample + 1)
            layers = forward(current, problem.activation, problem.inputs[:, one])
            errors = current[-1] @ layers[-1] - problem.targets[:, one]
            gradient = backward(current, layers, slopes_of(layers, problem.activation), errors)
            step = settings.momentum * step - rate * gradient
            vector += step
    return current, step
