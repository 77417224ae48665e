"""Levenberg-Marquardt training of a perceptron, the published schedule.

Source: Rouvinen 1999, equations 55 and 56; Hagan and Menhaj 1994; the schedule of mu is that of
MATLAB's trainlm.
"""

import numpy as np

from flexik.learning.normal_equations import normal_equations
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, moved
from flexik.parameters.trainers import LevenbergMarquardt

# mu must not underflow to zero, from where no factor brings it back
MU_MINIMUM = 1e-20


def minimise(
    start: Weights, problem: Problem, settings: LevenbergMarquardt, _: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; a step is kept only when the error falls."""
    monitor = Monitor(problem, settings)
    weights, mu, error = start, settings.mu, problem.mean_squared_error(start)
    while (reason := monitor.add(weights, error)) is None:
        equations = normal_equations(weights, problem)
        if not equations.is_finite():
            reason = StopReason.NON_FINITE
            break
        if 2.0 / problem.targets.size * np.linalg.norm(equations.gradient) <= (
            settings.minimum_gradient
        ):
            reason = StopReason.GRADIENT
            break
        # only mu changes between trials, the Gram product is reused
        while mu <= settings.mu_maximum:
            factor = equations.factor(mu)
            if factor is not None:
                trial = moved(weights, -factor.solve(equations.gradient))
                trial_error = problem.mean_squared_error(trial)
                # false for nan as well
                if trial_error < error:
                    break
            mu *= settings.mu_increase
        else:
            reason = StopReason.SINGULAR if factor is None else StopReason.MU
            break
        weights, error, mu = trial, trial_error, max(mu * settings.mu_decrease, MU_MINIMUM)
    return monitor.result(reason)
