"""Levenberg-Marquardt training of a perceptron, the published schedule.

Source: Rouvinen 1999, equations 55 and 56; Hagan and Menhaj 1994; the schedule of mu is that of
MATLAB's trainlm.
"""

import math
from dataclasses import dataclass

import numpy as np

from flexik.learning.normal_equations import normal_equations
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, Stopping, StopReason
from flexik.learning.weights import Weights, moved

# mu must not underflow to zero, from where no factor brings it back
MU_MINIMUM = 1e-20


@dataclass(frozen=True)
class LevenbergMarquardt(Stopping):
    """Settings of the trainer; the defaults of mu are those of MATLAB's trainlm.

    Attributes
    ----------
    mu : first damping of equation 56
    mu_decrease, mu_increase : factors of mu after a step that lowers the error, and one that fails
    mu_maximum : the run ends when mu would exceed it
    """

    mu: float = 1e-3
    mu_decrease: float = 0.1
    mu_increase: float = 10.0
    mu_maximum: float = 1e10

    def ranges(self) -> dict[str, bool]:
        """Whether each setting is in its range."""
        return super().ranges() | {
            "mu": self.mu > 0.0,
            "mu_decrease": 0.0 < self.mu_decrease <= 1.0,
            "mu_increase": 1.0 < self.mu_increase < math.inf,
            "mu_maximum": self.mu <= self.mu_maximum < math.inf,
        }


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
