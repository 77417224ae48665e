"""Adam training of a perceptron, in batches of samples, by torch.

Source: Kingma and Ba 2015; the learning rate falls along half a cosine (Loshchilov and Hutter
2017, without restarts). torch makes the steps; the gradients are ours, because at the sizes here
torch takes twice as long for them.
"""

import math
from dataclasses import dataclass

import numpy as np

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, Stopping, StopReason
from flexik.learning.weights import Weights, backward, flatten, forward, slopes_of, unflatten


@dataclass(frozen=True)
class Adam(Stopping):
    """Settings of the trainer; an iteration is one pass over the data (an epoch).

    Attributes
    ----------
    learning_rate, beta_1, beta_2 : of the paper
    final_rate : learning rate after n_iterations over the first one; 1: constant
    batch_size : samples a step, drawn in random order; null: all of them
    """

    minimum_progress: float = 0.0
    learning_rate: float = 1e-3
    final_rate: float = 1.0
    beta_1: float = 0.9
    beta_2: float = 0.999
    batch_size: int | None = None

    def ranges(self) -> dict[str, bool]:
        """Whether each setting is in its range."""
        return super().ranges() | {
            "learning_rate": 0.0 < self.learning_rate < math.inf,
            "final_rate": 0.0 <= self.final_rate <= 1.0,
            "beta_1": 0.0 <= self.beta_1 < 1.0,
            "beta_2": 0.0 <= self.beta_2 < 1.0,
            "batch_size": self.batch_size is None or self.batch_size >= 1,
        }

    def rate(self, done: float) -> float:
        """Learning rate when the share `done` of n_iterations is over."""
        falling = 0.5 * (1.0 + math.cos(math.pi * done))
        return self.learning_rate * (self.final_rate + (1.0 - self.final_rate) * falling)


def minimise(
    start: Weights, problem: Problem, settings: Adam, generator: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept."""
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
        with np.errstate(over="ignore", invalid="ignore"):
            for batch in range(n_batches):
                part = slice(batch * length, (batch + 1) * length)
                gradient = _gradient(current, problem.activation, inputs[:, part], targets[:, part])
                done = (len(monitor.errors) - 1 + batch / n_batches) / settings.n_iterations
                flat.grad = torch.from_numpy(gradient)
                optimiser.param_groups[0]["lr"] = settings.rate(done)
                optimiser.step()
            weights = unflatten(flat.numpy().copy(), start)
            error = problem.mean_squared_error(weights)
    return monitor.result(reason)


def _gradient(weights: Weights, activation: str, inputs: Array, targets: Array) -> Array:
    """Gradient (w,) of the mean squared error of some samples."""
    layers = forward(weights, activation, inputs)
    errors = weights[-1] @ layers[-1]
    errors -= targets
    return backward(weights, layers, slopes_of(layers, activation), errors) * (2.0 / errors.size)


def _is_flat(weights: Weights, problem: Problem, settings: Adam) -> bool:
    # a pass over all data, for nothing where no gradient ends the run
    if settings.minimum_gradient == 0.0:
        return False
    gradient = problem.gradient(weights)[1]
    return bool(np.linalg.norm(gradient) <= settings.minimum_gradient)
