"""Back-propagation training of a perceptron, by pattern or by batch.

Source: Rouvinen 1999, equations 49 to 54, with linear outputs, so that equation 52 loses its
factor y (1 - y); the learning rate varies as in MATLAB's traingdx.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexik.learning.perceptron import Array, activate, slope
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, flatten, unflatten
from flexik.parameters.trainers import BackPropagation


def minimise(
    start: Weights, problem: Problem, settings: BackPropagation, generator: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept."""
    return minimise_together([start], [problem], [settings], [generator])[0]


def minimise_together(
    starts: Sequence[Weights],
    problems: Sequence[Problem],
    settings: Sequence[BackPropagation],
    generators: Sequence[np.random.Generator],
) -> list[Minimum]:
    """`minimise` of several networks of one shape, activation and number of samples.

    Each has its own data, settings and order of samples, and becomes what it would alone; a step of
    all takes hardly longer than that of one.
    """
    runs = dict(enumerate(map(_run, starts, problems, settings, generators)))
    results: dict[int, Minimum] = {}
    answers: dict[int, Array | None] = dict.fromkeys(runs)
    while runs:
        asked: dict[int, _Pass] = {}
        for k, run in list(runs.items()):
            try:
                asked[k] = run.send(answers[k])
            except StopIteration as end:
                results[k] = end.value
                del runs[k]
        answers = dict(zip(asked, _patterns(list(asked.values())), strict=True))
    return [results[k] for k in range(len(starts))]


@dataclass(frozen=True, eq=False)
class _Pass:
    """A pass by pattern from `weights`; its answer holds weights and last step (2, w)."""

    weights: Weights
    step: Array
    rate: float
    momentum: float
    order: NDArray[np.int64]
    problem: Problem


def _run(
    start: Weights, problem: Problem, settings: BackPropagation, generator: np.random.Generator
) -> Generator[_Pass, Any, Minimum]:
    """The rule itself; it asks for passes by pattern, and is sent weights and step after each."""
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
                order = generator.permutation(problem.targets.shape[1])
                vector, trial_step = yield _Pass(
                    weights, step, rate, settings.momentum, order, problem
                )
                trial = unflatten(vector, start)
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


def _patterns(passes: Sequence[_Pass]) -> Sequence[Array]:
    """Weights and last step (2, w) after each of the passes, which go side by side."""
    if not passes:
        return []
    activation, shapes = passes[0].problem.activation, [m.shape for m in passes[0].weights]
    vectors, steps = (
        np.array([flatten(each.weights) for each in passes]),
        np.array([each.step for each in passes]),
    )
    gradient = np.empty_like(vectors)
    rate, momentum = (np.array([[getattr(p, n)] for p in passes]) for n in ("rate", "momentum"))
    weights, slots = _matrices(vectors, shapes), _matrices(gradient, shapes)
    returning = [matrix[:, :, :-1].swapaxes(1, 2) for matrix in weights]
    # last row of each layer: 1, the input of the biases
    hidden = [np.ones((len(passes), units + 1, 1)) for units, _ in shapes[:-1]]
    inputs, targets = (
        np.stack([getattr(p.problem, name)[:, p.order].T for p in passes], axis=1)[..., None]
        for name in ("inputs", "targets")
    )
    with np.errstate(over="ignore", invalid="ignore"):
        for sample, target in zip(inputs, targets, strict=True):
            layers = [sample, *hidden]
            for k, layer in enumerate(hidden):
                units = layer[:, :-1]
                activate(np.matmul(weights[k], layers[k], out=units), activation, out=units)
            errors = weights[-1] @ layers[-1]
            errors -= target
            for k in range(len(shapes) - 1, -1, -1):
                np.multiply(errors, layers[k].swapaxes(1, 2), out=slots[k])
                if k:
                    errors = returning[k] @ errors
                    errors *= slope(layers[k][:, :-1], activation)
            gradient *= rate
            steps *= momentum
            steps -= gradient
            vectors += steps
    return list(np.stack([vectors, steps], axis=1))


def _matrices(vectors: Array, shapes: Sequence[tuple[int, ...]]) -> list[Array]:
    """Views (b, units, inputs + 1) of flat weights (b, w)."""
    ends = np.cumsum([units * inputs for units, inputs in shapes])[:-1]
    parts = np.split(vectors, ends, axis=1)
    return [part.reshape(len(vectors), *shape) for part, shape in zip(parts, shapes, strict=True)]
