"""When a training run ends, and which network it keeps."""

import math
import time
from dataclasses import dataclass
from enum import StrEnum

from flexik.learning.problem import Problem
from flexik.learning.weights import Weights
from flexik.parameters.trainers import Stopping


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
