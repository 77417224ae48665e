"""Adam training of a perceptron, by torch; torch is imported when a run starts.

Source: Kingma and Ba 2015.
"""

import math
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexik.errors import TrainingError
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, Stopping, StopReason
from flexik.learning.weights import Weights

if TYPE_CHECKING:
    import torch


@dataclass(frozen=True)
class Adam(Stopping):
    """Settings of the trainer; an iteration is one pass over the data (an epoch).

    Attributes
    ----------
    learning_rate, beta_1, beta_2 : of the paper
    batch_size : samples a step, drawn in random order; null: all of them
    """

    minimum_progress: float = 0.0
    learning_rate: float = 1e-3
    beta_1: float = 0.9
    beta_2: float = 0.999
    batch_size: int | None = None

    def ranges(self) -> dict[str, bool]:
        """Whether each setting is in its range."""
        return super().ranges() | {
            "learning_rate": 0.0 < self.learning_rate < math.inf,
            "beta_1": 0.0 <= self.beta_1 < 1.0,
            "beta_2": 0.0 <= self.beta_2 < 1.0,
            "batch_size": self.batch_size is None or self.batch_size >= 1,
        }


def minimise(
    start: Weights, problem: Problem, settings: Adam, generator: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept.

    Raises
    ------
    TrainingError
        When torch is not installed.
    """
    try:
        import torch
    except ImportError as missing:
        raise TrainingError("the trainer adam needs the package torch") from missing
    monitor = Monitor(problem, settings)
    n_samples = problem.targets.shape[1]
    batch_size = min(settings.batch_size or n_samples, n_samples)
    with _one_thread():
        parameters = [torch.tensor(w, requires_grad=True) for w in start]
        inputs, targets = torch.from_numpy(problem.inputs), torch.from_numpy(problem.targets)
        betas = (settings.beta_1, settings.beta_2)
        optimiser = torch.optim.Adam(parameters, lr=settings.learning_rate, betas=betas)
        weights = start
        error, gradient = problem.gradient(weights)
        while (reason := monitor.add(weights, error)) is None:
            if np.linalg.norm(gradient) <= settings.minimum_gradient:
                reason = StopReason.GRADIENT
                break
            order = torch.from_numpy(generator.permutation(n_samples))
            for batch in order.split(batch_size) if batch_size < n_samples else [slice(None)]:
                optimiser.zero_grad()
                outputs = _outputs(parameters, problem.activation, inputs[:, batch])
                torch.mean((outputs - targets[:, batch]) ** 2).backward()
                optimiser.step()
            weights = tuple(parameter.detach().numpy().copy() for parameter in parameters)
            error, gradient = problem.gradient(weights)
    return monitor.result(reason)


def _outputs(
    parameters: "list[torch.Tensor]", activation: str, values: "torch.Tensor"
) -> "torch.Tensor":
    import torch

    function = torch.tanh if activation == "tanh" else torch.sigmoid
    for matrix in parameters[:-1]:
        values = function(matrix @ values)
        values = torch.cat([values, torch.ones_like(values[:1])])
    return parameters[-1] @ values


@contextmanager
def _one_thread() -> Generator[None]:
    # more threads are slower at this size, and the order of sums must not depend on their number
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
