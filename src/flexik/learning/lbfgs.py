"""L-BFGS training of a perceptron, by SciPy."""

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, flatten, unflatten
from flexik.parameters.trainers import Lbfgs


def minimise(start: Weights, problem: Problem, settings: Lbfgs, _: np.random.Generator) -> Minimum:
    """Lower the mean squared error from `start`; a step is kept only when the error falls."""
    monitor = Monitor(problem, settings)
    reason = monitor.add(start, problem.mean_squared_error(start))
    last_gradient = np.empty(0)

    def error_and_gradient(vector: Array) -> tuple[float, Array]:
        nonlocal last_gradient
        error, last_gradient = problem.gradient(unflatten(vector, start))
        return error, last_gradient

    def after_step(intermediate_result: OptimizeResult) -> None:
        nonlocal reason
        # SciPy goes on to write into its vector
        weights = unflatten(np.array(intermediate_result.x), start)
        reason = monitor.add(weights, float(intermediate_result.fun))
        if reason is None and np.linalg.norm(last_gradient) <= settings.minimum_gradient:
            reason = StopReason.GRADIENT
        if reason is not None:
            raise StopIteration

    if reason is None:
        if np.linalg.norm(problem.gradient(start)[1]) <= settings.minimum_gradient:
            return monitor.result(StopReason.GRADIENT)
        # the rules of the other trainers decide, SciPy's own are off
        minimize(
            error_and_gradient,
            flatten(start),
            jac=True,
            method="L-BFGS-B",
            callback=after_step,
            options={
                "maxiter": settings.n_iterations + 1,
                "maxfun": 1000 * (settings.n_iterations + 1),
                "maxcor": settings.memory,
                "maxls": 50,
                "ftol": 0.0,
                "gtol": 0.0,
            },
        )
    return monitor.result(StopReason.LINE_SEARCH if reason is None else reason)
