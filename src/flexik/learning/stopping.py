"""When a training run ends, which network it keeps, and the settings all trainers share."""

import math
import numbers
import time
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, get_args

from flexik.errors import TrainingError
from flexik.learning.problem import Problem
from flexik.learning.weights import Weights


class StopReason(StrEnum):
    """Why a training run ended."""

    GOAL = "goal"  # the error reached the goal
    GRADIENT = "gradient"  # the gradient is as good as zero
    PROGRESS = "progress"  # the error hardly falls any more
    ITERATIONS = "iterations"  # all iterations are used
    TIME = "time"  # the time is used
    SELECTION = "selection"  # the selection error no longer falls
    MU = "mu"  # no step lowers the error, however short
    LINE_SEARCH = "line_search"  # no step along the search direction lowers the error
    STATIONARY = "stationary"  # a round of weaker penalty changes neither weights nor error
    SINGULAR = "singular"  # the damped system has no Cholesky factor up to the largest mu
    NON_FINITE = "non_finite"  # the error or its derivatives overflowed


@dataclass(frozen=True)
class Stopping:
    """When to stop; the settings every trainer has.

    Attributes
    ----------
    n_iterations : largest number of iterations (accepted steps, or passes over the data)
    goal : mean squared error (normalised outputs) at which the run ends
    minimum_gradient : Euclidean norm of the gradient of the mean squared error at which it ends
    minimum_progress : relative fall of that error over `progress_window` iterations under which
        it ends; 0: never
    maximum_seconds : wall time after which it ends; results then depend on the machine
    selection_patience : iterations without a new least selection error after which it ends; the
        network of the least selection error is kept, however the run ends

    Raises
    ------
    TrainingError
        When a setting is of another type or out of range.
    """

    n_iterations: int = 1000
    goal: float = 0.0
    minimum_gradient: float = 1e-7
    minimum_progress: float = 1e-4
    progress_window: int = 20
    maximum_seconds: float | None = None
    selection_patience: int | None = None

    def __post_init__(self) -> None:
        for setting in fields(self):
            value = getattr(self, setting.name)
            if not _is_of(value, setting.type):
                kinds = " or ".join(_KINDS[kind] for kind in _kinds(setting.type))
                raise TrainingError(f"trainer setting {setting.name}={value!r}, expected {kinds}")
        for name, valid in self.ranges().items():
            if not valid:
                raise TrainingError(f"trainer setting {name}={getattr(self, name)} is out of range")

    def ranges(self) -> dict[str, bool]:
        """Whether each setting is in its range."""
        return {
            "n_iterations": self.n_iterations >= 1,
            "goal": 0.0 <= self.goal < math.inf,
            "minimum_gradient": 0.0 <= self.minimum_gradient < math.inf,
            "minimum_progress": 0.0 <= self.minimum_progress < 1.0,
            "progress_window": self.progress_window >= 1,
            "maximum_seconds": self.maximum_seconds is None or self.maximum_seconds > 0.0,
            "selection_patience": self.selection_patience is None or self.selection_patience >= 1,
        }


_KINDS = {int: "an integer", float: "a number", str: "a name", type(None): "null"}
_NUMERIC = {int: numbers.Integral, float: numbers.Real}


def _kinds(annotation: Any) -> tuple[type, ...]:
    return get_args(annotation) or (annotation,)


def _is_of(value: Any, annotation: Any) -> bool:
    # bool is an int to Python
    return not isinstance(value, bool) and any(
        isinstance(value, _NUMERIC.get(kind, kind)) for kind in _kinds(annotation)
    )


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a run ended.

    Attributes
    ----------
    weights : of the network to keep
    errors : mean squared error per iteration, the first the initial one; empty when that is not
        finite, the weights are then of no use
    kept : the iteration whose weights are kept
    """

    weights: Weights
    errors: tuple[float, ...]
    stop_reason: StopReason
    kept: int


class Monitor:
    """Errors of a run so far, and the weights to keep: those of the least error.

    The error that counts is that of the selection data when the settings ask for patience.
    """

    def __init__(self, problem: Problem, settings: Stopping) -> None:
        self.problem, self.settings = problem, settings
        self.errors: list[float] = []
        self._started = time.perf_counter()
        self._least = math.inf
        self._kept = 0
        self._weights: Weights | None = None

    def add(self, weights: Weights, error: float) -> StopReason | None:
        """Note the weights an iteration ended with, and tell whether to stop."""
        if not math.isfinite(error):
            if self._weights is None:
                self._weights = weights
            return StopReason.NON_FINITE
        self.errors.append(error)
        if self.problem.observer is not None:
            self.problem.observer(weights)
        patience = self.settings.selection_patience
        judged = error if patience is None else self.problem.selection_error(weights)
        # false for nan; the first weights are kept until others are better
        if judged < self._least or self._weights is None:
            self._least = judged if math.isfinite(judged) else math.inf
            self._kept, self._weights = len(self.errors) - 1, weights
        return self._reason()

    def result(self, reason: StopReason) -> Minimum:
        """End of the run."""
        assert self._weights is not None
        return Minimum(self._weights, tuple(self.errors), reason, self._kept)

    def _reason(self) -> StopReason | None:
        settings, errors = self.settings, self.errors
        n_done, patience = len(errors) - 1, settings.selection_patience
        if errors[-1] <= settings.goal:
            return StopReason.GOAL
        if patience is not None and n_done - self._kept >= patience:
            return StopReason.SELECTION
        if n_done >= settings.n_iterations:
            return StopReason.ITERATIONS
        if settings.minimum_progress > 0.0 and n_done >= settings.progress_window:
            before = errors[-1 - settings.progress_window]
            if before - errors[-1] < settings.minimum_progress * before:
                return StopReason.PROGRESS
        limit = settings.maximum_seconds
        if limit is not None and time.perf_counter() - self._started >= limit:
            return StopReason.TIME
        return None
