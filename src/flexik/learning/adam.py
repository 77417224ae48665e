"""Adam training of a perceptron, in batches of samples, by torch.

Source: Kingma and Ba 2015; the learning rate falls along half a cosine (Loshchilov and Hutter
2017, without restarts). torch makes the steps; the gradients are ours, because at the sizes here
torch takes twice as long for them.
"""

import math

import numpy as np

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, backward, flatten, forward, slopes_of, unflatten
from flexik.parameters.trainers import Adam


def minimise(
    start: Weights, problem: Problem, settings: Adam, generator: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept.

    Of several batches, the error of a pass is the mean of what each had before its step: to look at
    all data once more would cost half as much as the steps.
    """
    # it takes a second or two, which other trainers save
    import torch

    monitor = Monitor(problem, settings)
    n_samples = problem.targets.shape[1]
    length = min(settings.batch_size or n_samples, n_samples)
    n_batches = math.ceil(n_samples / length)
    weights, error = start, problem.mean_squared_error(start)
    flat = torch.from_numpy(flatten(start))
    # views: they follow the steps
    current = unflatten(flat.numpy(), start)
    optimiser = torch.optim.Adam([flat], betas=(settings.beta_1, settings.beta_2), fused=True)
    while (reason := monitor.add(weights, error)) is None:
        if _is_flat(weights, problem, settings):
            reason = StopReason.GRADIENT
            break
        order = generator.permutation(n_samples)
        inputs, targets = problem.inputs[:, order], problem.targets[:, order]
        squares = 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            for batch in range(n_batches):
                part = slice(batch * length, (batch + 1) * length)
                given = inputs[:, part], targets[:, part]
                gradient, of_batch = _gradient(current, problem.activation, *given)
                squares += of_batch
                done = (len(monitor.errors) - 1 + batch / n_batches) / settings.n_iterations
                flat.grad = torch.from_numpy(gradient)
                optimiser.param_groups[0]["lr"] = rate(settings, done)
                optimiser.step()
            weights = unflatten(flat.numpy().copy(), start)
            one = n_batches == 1
            error = problem.mean_squared_error(weights) if one else squares / targets.size
    return monitor.result(reason)


def rate(settings: Adam, done: float) -> float:
    """Learning rate when the share `done` of n_iterations is over."""
    falling = 0.5 * (1.0 + math.cos(math.pi * done))
    return settings.learning_rate * (settings.final_rate + (1.0 - settings.final_rate) * falling)


def _gradient(
    weights: Weights, activation: str, inputs: Array, targets: Array
) -> tuple[Array, float]:
    """Gradient (w,) of the mean squared error of some samples, and the sum of their squares."""
    layers = forward(weights, activation, inputs)
    errors = weights[-1] @ layers[-1]
    errors -= targets
    gradient = backward(weights, layers, slopes_of(layers, activation), errors)
    return gradient * (2.0 / errors.size), float(np.vdot(errors, errors))


def _is_flat(weights: Weights, problem: Problem, settings: Adam) -> bool:
    # a pass over all data, for nothing where no gradient ends the run
    if settings.minimum_gradient == 0.0:
        return False
    gradient = problem.gradient(weights)[1]
    return bool(np.linalg.norm(gradient) <= settings.minimum_gradient)
