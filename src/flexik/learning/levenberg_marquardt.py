"""Levenberg-Marquardt training of a perceptron with one hidden layer, in normalised values.

Source: Rouvinen 1999, equations 55 and 56; Hagan and Menhaj 1994; the schedule of mu is that of
MATLAB's trainlm.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from flexik.errors import TrainingError
from flexik.learning.perceptron import Array, activate, slope

# samples whose rows are in memory at once; bounds memory, and 2,000 rows still fill the cache
CHUNK_LENGTH = 2048

# mu must not underflow to zero, from where no factor brings it back
_MU_MINIMUM = 1e-20


class StopReason(StrEnum):
    """Why a training run ended."""

    GOAL = "goal"  # the error reached the goal
    GRADIENT = "gradient"  # the gradient is as good as zero
    PROGRESS = "progress"  # the error hardly falls any more
    ITERATIONS = "iterations"  # all iterations are used
    MU = "mu"  # no step lowers the error, however short
    SINGULAR = "singular"  # the damped system has no Cholesky factor up to the largest mu
    NON_FINITE = "non_finite"  # the error or its derivatives overflowed


@dataclass(frozen=True)
class LevenbergMarquardt:
    """Settings of the trainer; the defaults of mu are those of MATLAB's trainlm.

    Attributes
    ----------
    n_iterations : largest number of accepted steps
    mu : first damping of equation 56
    mu_decrease, mu_increase : factors of mu after a step that lowers the error, and one that fails
    mu_maximum : the run ends when mu would exceed it
    goal : mean squared error (normalised outputs) at which the run ends
    minimum_gradient : Euclidean norm of the gradient of the mean squared error at which it ends
    minimum_progress : relative fall of that error over `progress_window` steps under which it ends

    Raises
    ------
    TrainingError
        When a setting is out of range.
    """

    n_iterations: int = 1000
    mu: float = 1e-3
    mu_decrease: float = 0.1
    mu_increase: float = 10.0
    mu_maximum: float = 1e10
    goal: float = 0.0
    minimum_gradient: float = 1e-7
    minimum_progress: float = 1e-4
    progress_window: int = 20

    def __post_init__(self) -> None:
        ranges = {
            "n_iterations": self.n_iterations >= 1,
            "mu": self.mu > 0.0,
            "mu_decrease": 0.0 < self.mu_decrease <= 1.0,
            "mu_increase": self.mu_increase > 1.0,
            "mu_maximum": self.mu <= self.mu_maximum < math.inf,
            "goal": self.goal >= 0.0,
            "minimum_gradient": self.minimum_gradient >= 0.0,
            "minimum_progress": 0.0 <= self.minimum_progress < 1.0,
            "progress_window": self.progress_window >= 1,
        }
        for name, valid in ranges.items():
            if not valid:
                raise TrainingError(f"trainer setting {name}={getattr(self, name)} is out of range")


@dataclass(frozen=True, eq=False)
class Weights:
    """All weights of a perceptron; the last column of each matrix is the bias.

    Attributes
    ----------
    hidden : (h, p + 1)
    output : (q, h + 1)
    """

    hidden: Array
    output: Array

    def moved(self, step: Array) -> "Weights":
        """Weights after `step` (hidden row by row, then output row by row)."""
        first, second = np.split(step, [self.hidden.size])
        return Weights(
            self.hidden + first.reshape(self.hidden.shape),
            self.output + second.reshape(self.output.shape),
        )


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a run ended: the weights of the last, lowest of `errors`."""

    weights: Weights
    errors: tuple[float, ...]
    stop_reason: StopReason


def initial_weights(
    n_inputs: int, n_hidden: int, n_outputs: int, activation: str, generator: np.random.Generator
) -> Weights:
    """Nguyen-Widrow weights for inputs in [-1, 1], as MATLAB's initnw draws them.

    Source: Nguyen and Widrow 1990. The hidden units share out the input range; their net inputs
    span [-2, 2] for tanh and [-4, 4] for logistic. Output weights are uniform in [-1, 1].
    """
    direction = generator.uniform(-1.0, 1.0, (n_hidden, n_inputs))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    active_half_range = 2.0 if activation == "tanh" else 4.0
    magnitude = active_half_range * 0.7 * n_hidden ** (1.0 / n_inputs)
    shift = np.linspace(-1.0, 1.0, n_hidden) if n_hidden > 1 else np.zeros(1)
    bias = shift * np.sign(direction[:, 0])
    hidden = magnitude * np.column_stack([direction, bias])
    return Weights(hidden, generator.uniform(-1.0, 1.0, (n_outputs, n_hidden + 1)))


def mean_squared_error(
    weights: Weights,
    activation: str,
    inputs: Array,
    targets: Array,
    chunk_length: int = CHUNK_LENGTH,
) -> float:
    """Mean of the squared errors over samples and outputs; inf or nan when it overflows."""
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(inputs), chunk_length):
            chunk = slice(first, first + chunk_length)
            _, residuals = _forward(weights, activation, inputs[chunk], targets[chunk])
            total += float(np.vdot(residuals, residuals))
    return total / targets.size


def normal_equations(
    weights: Weights,
    activation: str,
    inputs: Array,
    targets: Array,
    chunk_length: int = CHUNK_LENGTH,
) -> tuple[Array, Array]:
    """J^T J (w, w) and J^T e (w,) of e = prediction - target, equations 55 and 56.

    J itself is never formed. All outputs share the rows "slope times input"; one Gram product of
    [slope x input and bias | hidden outputs and 1 | residuals] holds every block, and the output
    weights only scale it.

    Parameters
    ----------
    inputs, targets : (n, p) and (n, q), normalised
    chunk_length : samples per Gram product; changes rounding alone
    """
    (n_hidden, n_columns), n_outputs = weights.hidden.shape, len(weights.output)
    n_slopes = n_hidden * n_columns
    n_rows = n_slopes + n_hidden + 1
    n_weights = n_slopes + n_outputs * (n_hidden + 1)
    gram = np.zeros((n_rows + n_outputs, n_rows + n_outputs))
    hessian, gradient = np.zeros((n_weights, n_weights)), np.empty(n_weights)
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(inputs), chunk_length):
            chunk = slice(first, first + chunk_length)
            rows = _shared_rows(weights, activation, inputs[chunk], targets[chunk])
            gram += rows.T @ rows
        slopes, hidden, residuals = np.split(np.arange(len(gram)), [n_slopes, n_rows])
        coupling = np.repeat(weights.output[:, :-1], n_columns, axis=1)
        hessian[:n_slopes, :n_slopes] = gram[:n_slopes, :n_slopes] * (coupling.T @ coupling)
        gradient[:n_slopes] = np.sum(gram[np.ix_(slopes, residuals)] * coupling.T, axis=1)
        for k in range(n_outputs):
            block = slice(n_slopes + k * hidden.size, n_slopes + (k + 1) * hidden.size)
            mixed = coupling[k][:, None] * gram[np.ix_(slopes, hidden)]
            hessian[:n_slopes, block], hessian[block, :n_slopes] = mixed, mixed.T
            hessian[block, block] = gram[np.ix_(hidden, hidden)]
            gradient[block] = gram[hidden, n_rows + k]
    return hessian, gradient


def damped_step(hessian: Array, gradient: Array, mu: float) -> Array | None:
    """Step -(J^T J + mu I)^-1 J^T e of equation 56, or None when it is singular in float64."""
    damped = hessian.copy()
    damped.flat[:: len(damped) + 1] += mu
    try:
        factor = cho_factor(damped, overwrite_a=True, check_finite=False)
    except LinAlgError:
        return None
    return -cho_solve(factor, gradient, check_finite=False)


def minimise(
    start: Weights, activation: str, inputs: Array, targets: Array, settings: LevenbergMarquardt
) -> Minimum:
    """Lower the mean squared error from `start`; a step is kept only when the error falls.

    Parameters
    ----------
    inputs, targets : (n, p) and (n, q), normalised
    """
    weights, mu = start, settings.mu
    errors = [mean_squared_error(weights, activation, inputs, targets)]
    if not math.isfinite(errors[0]):
        return Minimum(start, (), StopReason.NON_FINITE)
    while (reason := _finished(errors, settings)) is None:
        hessian, gradient = normal_equations(weights, activation, inputs, targets)
        if not (np.isfinite(hessian).all() and np.isfinite(gradient).all()):
            reason = StopReason.NON_FINITE
            break
        if 2.0 / targets.size * np.linalg.norm(gradient) <= settings.minimum_gradient:
            reason = StopReason.GRADIENT
            break
        # only mu changes between trials, the Gram product is reused
        while mu <= settings.mu_maximum:
            step = damped_step(hessian, gradient, mu)
            if step is not None:
                trial = weights.moved(step)
                error = mean_squared_error(trial, activation, inputs, targets)
                # false for nan as well
                if error < errors[-1]:
                    break
            mu *= settings.mu_increase
        else:
            reason = StopReason.SINGULAR if step is None else StopReason.MU
            break
        weights, mu = trial, max(mu * settings.mu_decrease, _MU_MINIMUM)
        errors.append(error)
    return Minimum(weights, tuple(errors), reason)


def _finished(errors: list[float], settings: LevenbergMarquardt) -> StopReason | None:
    if errors[-1] <= settings.goal:
        return StopReason.GOAL
    if len(errors) > settings.n_iterations:
        return StopReason.ITERATIONS
    if len(errors) > settings.progress_window:
        before = errors[-1 - settings.progress_window]
        if before - errors[-1] < settings.minimum_progress * before:
            return StopReason.PROGRESS
    return None


def _forward(
    weights: Weights, activation: str, inputs: Array, targets: Array
) -> tuple[Array, Array]:
    hidden = activate(inputs @ weights.hidden[:, :-1].T + weights.hidden[:, -1], activation)
    return hidden, hidden @ weights.output[:, :-1].T + weights.output[:, -1] - targets


def _shared_rows(weights: Weights, activation: str, inputs: Array, targets: Array) -> Array:
    (n, p), h = inputs.shape, len(weights.hidden)
    hidden, residuals = _forward(weights, activation, inputs, targets)
    slopes = slope(hidden, activation)
    rows = np.empty((n, h * (p + 1) + h + 1 + targets.shape[1]))
    products = rows[:, : h * (p + 1)].reshape(n, h, p + 1)
    np.multiply(slopes[:, :, None], inputs[:, None, :], out=products[:, :, :p])
    products[:, :, p] = slopes
    rows[:, h * (p + 1) : -1 - targets.shape[1]] = hidden
    rows[:, -1 - targets.shape[1]] = 1.0
    rows[:, -targets.shape[1] :] = residuals
    return rows
