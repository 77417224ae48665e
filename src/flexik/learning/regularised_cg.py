"""Training with a weight penalty that fades round by round, by preconditioned conjugate gradients.

Source: De Luca, Mattone and Sciandrone, "Direct kinematics of articulated parallel manipulators
using neural networks", section 3.1, steps 1 to 5. Far from the origin of the weights the hidden
units are saturated and the error E(w) has stationary points of no worth; the penalised error
E(w) + p |w|^2 has not, and as p fades the weights grow where the data ask for it.

The paper leaves open how its conjugate gradients are made. Here they solve the equations of each
Newton step with Gauss-Newton curvature, which needs products with J alone (Martens 2010). Their
preconditioner is the diagonal, with squares passed back through the layers (Becker and LeCun
1989), which is exact for one hidden layer.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.weights import Weights, flatten, unflatten
from flexik.parameters.trainers import RegularisedCg

# share of the fall along the gradient that a step must keep, and the shortest step tried
_DECREASE, _SHORTEST = 1e-4, 1e-6
# share of its largest element that every element of the preconditioner has at least
_FLOOR = 1e-4


class _Point(NamedTuple):
    """Weights as a vector, E there, its gradient, and the penalised error."""

    vector: Array
    error: float
    gradient: Array
    penalised: float


def minimise(
    start: Weights, problem: Problem, settings: RegularisedCg, _: np.random.Generator
) -> Minimum:
    """Lower the mean squared error from `start`; the weights of the least error are kept.

    The errors of the record are E at every step; they may rise within a round.
    """
    # the goal counts where a round ends, not on the way
    monitor = Monitor(problem, settings.but(goal=0.0))
    penalty, origin = settings.penalty, _point(flatten(start), start, problem, settings.penalty)
    reason = monitor.add(start, origin.error)
    if reason is None and np.linalg.norm(origin.gradient) <= settings.minimum_gradient:
        reason = StopReason.GRADIENT
    while reason is None:
        found, reason = _round(origin, start, problem, settings, penalty, monitor)
        if found.error <= settings.goal:
            return monitor.result(StopReason.GOAL)
        if reason is None and _unchanged(origin, found, settings):
            reason = StopReason.STATIONARY
        if found.error < origin.error:
            origin = found
        penalty *= settings.penalty_decrease
    return monitor.result(reason)


def _unchanged(before: _Point, after: _Point, settings: RegularisedCg) -> bool:
    """The test of step 3."""
    moved = np.linalg.norm(before.vector - after.vector)
    changed = abs(before.error - after.error)
    return bool(
        moved <= settings.weight_tolerance and changed <= settings.error_tolerance * after.error
    )


def _round(
    point: _Point,
    like: Weights,
    problem: Problem,
    settings: RegularisedCg,
    penalty: float,
    monitor: Monitor,
) -> tuple[_Point, StopReason | None]:
    """Step 1: where the minimisation of the penalised error ends, and why the run ends, if so."""
    point = _penalised(point, penalty)
    for _ in range(settings.round_steps):
        step = _newton_step(point, like, problem, settings, penalty)
        found = _along(point, step, like, problem, penalty)
        if found is None:
            break
        reason = monitor.add(unflatten(found.vector, like), found.error)
        if reason is None and np.linalg.norm(found.gradient) <= settings.minimum_gradient:
            reason = StopReason.GRADIENT
        fall, point = point.penalised - found.penalised, found
        if reason is not None:
            return point, reason
        if fall < settings.round_progress * (point.penalised + fall):
            break
    return point, None


def _newton_step(
    point: _Point, like: Weights, problem: Problem, settings: RegularisedCg, penalty: float
) -> Array:
    """Step (w,) to where the penalised Gauss-Newton model is least, as far as asked for."""
    weights, size = unflatten(point.vector, like), point.vector.size
    share = 2.0 / problem.targets.size
    gradient = point.gradient + 2.0 * penalty * point.vector
    diagonal = share * problem.curvature_diagonal(weights)
    diagonal = np.maximum(diagonal, _FLOOR * diagonal.max()) + 2.0 * penalty

    def curvature(vector: Array) -> Array:
        return share * problem.curvature(weights, unflatten(vector, like)) + 2.0 * penalty * vector

    norm = float(np.linalg.norm(gradient))
    with np.errstate(all="ignore"):
        step, _ = cg(
            LinearOperator((size, size), matvec=curvature, dtype=np.float64),
            -gradient,
            rtol=min(settings.cg_tolerance, math.sqrt(norm)),
            maxiter=settings.cg_iterations,
            M=LinearOperator((size, size), matvec=lambda v: v / diagonal, dtype=np.float64),
        )
    return step


def _along(
    point: _Point, step: Array, like: Weights, problem: Problem, penalty: float
) -> _Point | None:
    """The point after `step`, halved until the penalised error falls enough; None if never."""
    slope = float((point.gradient + 2.0 * penalty * point.vector) @ step)
    length = 1.0
    while length >= _SHORTEST:
        found = _point(point.vector + length * step, like, problem, penalty)
        # false for nan as well
        if found.penalised < point.penalised + _DECREASE * length * slope:
            return found
        length *= 0.5
    return None


def _point(vector: Array, like: Weights, problem: Problem, penalty: float) -> _Point:
    error, gradient = problem.gradient(unflatten(vector, like))
    return _penalised(_Point(vector, error, gradient, error), penalty)


def _penalised(point: _Point, penalty: float) -> _Point:
    with np.errstate(over="ignore", invalid="ignore"):
        square = float(point.vector @ point.vector)
    return point._replace(penalised=point.error + penalty * square)
