"""Inverse of a network: coordinates at which it predicts the targets, its other inputs held.

Source: Rouvinen 1999, section 2.4.6. Searches run in the normalised units of the network.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from flexik.learning.perceptron import Network, Normalisation, activate, slope
from flexik.parameters.model import Count, Model, Positive
from flexik.positioning.method import Array, PositioningError, checked

# factors of the damping after a better and after a worse step, and its limits
FALL, RISE = 0.1, 10.0
DAMPING_MINIMUM, DAMPING_MAXIMUM = 1e-12, 1e10


class GradientDescent(Model):
    """Gradient descent with a constant rate, as published (equation 63).

    The thesis does not mention stroke limits; here a coordinate that a step takes beyond its limit
    is put on it, and the others go on.

    learning_rate : gamma of equation 63, in normalised units; not published, 0.2 diverges at some
        poses of the crane.
    tolerance : a row is done below this E_s (equation 59): half the sum of the squared errors of
        the normalised outputs.
    n_iterations : most steps of a row.
    """

    kind: Literal["gradient_descent"] = "gradient_descent"
    learning_rate: Positive = 0.15
    tolerance: Positive = 1e-7
    n_iterations: Count = 5000


class GaussNewton(Model):
    """Damped Gauss-Newton steps (Levenberg-Marquardt) within the limits.

    Each row has a damping of its own, which falls after a better step and rises after a worse one.

    damping : first damping, in normalised units.
    tolerance : as in GradientDescent.
    n_iterations : most steps of a row, rejected ones among them.
    """

    kind: Literal["gauss_newton"] = "gauss_newton"
    damping: Annotated[float, Field(gt=0, le=DAMPING_MAXIMUM)] = 1e-2
    tolerance: Positive = 1e-12
    n_iterations: Count = 100


class Inversion(NamedTuple):
    """Coordinates found, and how.

    values : (n, k) in m or rad, within their limits whatever happened.
    n_iterations : (n,) steps made.
    residual : (n,) in m, from the target to the network's output there.
    n_clipped : (n,) coordinates that a limit stopped in the last step.
    converged : (n,) whether the search ended below the tolerance.
    """

    values: Array
    n_iterations: NDArray[np.int64]
    residual: Array
    n_clipped: NDArray[np.int64]
    converged: NDArray[np.bool_]


def invert(
    network: Network,
    targets: Array,
    held: Array,
    initial: Array,
    limits: Array,
    settings: GradientDescent | GaussNewton,
) -> Inversion:
    """Coordinates (n, k) at which `network` predicts `targets` (n, q), from `initial` (n, k).

    The inputs of the network are the coordinates, then `held` (n, h), which stay as they are.
    Coordinates lie between `limits` (2, k). Rows do not influence each other; one that overflows
    ends with its last finite coordinates.

    Raises
    ------
    PositioningError
        If the arrays and the network do not fit together, or a value is not finite.
    """
    targets = checked("targets", targets, None, len(network.outputs))
    held = checked("held inputs", held, len(targets), None)
    initial = checked("current coordinates", initial, len(targets), None)
    limits = checked("limits", limits, 2, initial.shape[1])
    if initial.shape[1] + held.shape[1] != len(network.inputs):
        names = ", ".join(quantity.name for quantity in network.inputs)
        raise PositioningError(
            f"{initial.shape[1]} coordinates and {held.shape[1]} held inputs for a network of "
            f"{len(network.inputs)} inputs ({names})"
        )

    k = limits.shape[1]
    # the coordinates' part of the normalisation; a column that was constant moves nothing
    half = network.input_normalisation.half_range[:k]
    to_unit = Normalisation(
        network.input_normalisation.minimum[:k], network.input_normalisation.maximum[:k]
    ).to_unit
    rows = _Rows.of(network, targets, held)
    start, unit_limits = to_unit(initial), to_unit(limits)
    begin = np.clip(start, *unit_limits)
    with np.errstate(over="ignore", invalid="ignore"):  # overflow ends a row
        if isinstance(settings, GradientDescent):
            found = _gradient_descent(rows, begin, unit_limits, settings)
        else:
            found = _gauss_newton(rows, begin, unit_limits, settings)
        # clipped for rounding, and for columns that were constant
        values = np.clip(initial + half * (found.unit - start), *limits)
        residual = np.linalg.norm(network.predict(np.hstack([values, held])) - targets, axis=1)
    n_clipped = found.stopped.sum(axis=1)
    return Inversion(values, found.n_iterations, residual, n_clipped, found.converged)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows in work: the network as a function of their normalised strokes (n, k) alone.

    by_stroke : (units, k) weights of the strokes in the first layer.
    rest : (n, units) what held inputs and biases add there.
    targets : (n, q) normalised.
    """

    network: Network
    by_stroke: Array
    rest: Array
    targets: Array

    @classmethod
    def of(cls, network: Network, targets: Array, held: Array) -> Self:
        k = len(network.inputs) - held.shape[1]
        normalisation = network.input_normalisation
        unit = Normalisation(normalisation.minimum[k:], normalisation.maximum[k:]).to_unit(held)
        first = network.weights[0]
        return cls(
            network,
            np.where(normalisation.half_range[:k] > 0.0, first[:, :k], 0.0),
            unit @ first[:, k:-1].T + first[:, -1],
            network.output_normalisation.to_unit(targets),
        )

    def take(self, rows: NDArray[np.bool_]) -> Self:
        return replace(self, rest=self.rest[rows], targets=self.targets[rows])

    def forward(self, unit: Array) -> tuple[list[Array], Array]:
        """Outputs (n, units) of every hidden layer, and output errors d - y (n, q)."""
        weights, activation = self.network.weights, self.network.activation
        layers = [activate(unit @ self.by_stroke.T + self.rest, activation)]
        for matrix in weights[1:-1]:
            layers.append(activate(layers[-1] @ matrix[:, :-1].T + matrix[:, -1], activation))
        return layers, self.targets - layers[-1] @ weights[-1][:, :-1].T - weights[-1][:, -1]

    def backward(self, layers: list[Array], delta: Array) -> Array:
        """J^T `delta` (n, k) for deltas (n, q) or (q,) of the outputs, J = dy/dx."""
        for matrix, layer in zip(self.network.weights[:0:-1], layers[::-1], strict=True):
            delta = slope(layer, self.network.activation) * (delta @ matrix[:, :-1])
        return delta @ self.by_stroke

    def jacobian(self, layers: list[Array]) -> Array:
        """Derivatives (n, q, k) of normalised outputs by normalised strokes."""
        each = np.eye(self.targets.shape[1])
        return np.stack([self.backward(layers, delta) for delta in each], axis=1)


class _Found(NamedTuple):
    """Normalised strokes (n, k) and how they were found; `stopped` (n, k) by a limit."""

    unit: Array
    n_iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]
    stopped: NDArray[np.bool_]


def _half_square(errors: Array) -> Array:
    """E_s of equation 59."""
    return 0.5 * np.sum(errors**2, axis=1)


def _gradient_descent(rows: _Rows, unit: Array, limits: Array, settings: GradientDescent) -> _Found:
    """Equations 60 to 63 within `limits` (2, k): minus the gradient of E_s is J^T (d - y)."""
    n, stopped = len(unit), np.zeros(unit.shape, dtype=bool)
    found = _Found(unit.copy(), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool), stopped)
    index, stopped = np.arange(n), stopped.copy()
    for step in range(settings.n_iterations + 1):
        layers, errors = rows.forward(unit)
        wanted = unit + settings.learning_rate * rows.backward(layers, errors)
        done = _half_square(errors) < settings.tolerance
        going = ~done & np.isfinite(wanted).all(axis=1) & (step < settings.n_iterations)
        if not going.all():
            ended = index[~going]
            found.unit[ended] = unit[~going]
            found.stopped[ended] = stopped[~going]
            found.n_iterations[ended] = step
            found.converged[ended] = done[~going]
            index, rows, wanted = index[going], rows.take(going), wanted[going]
        if index.size == 0:
            break
        unit = np.clip(wanted, *limits)
        stopped = unit != wanted
    return found


class _State(NamedTuple):
    """Rows of Gauss-Newton between two steps; `row` tells which they are."""

    row: NDArray[np.int64]
    unit: Array
    errors: Array
    jacobian: Array
    damping: Array
    stopped: NDArray[np.bool_]

    def take(self, rows: NDArray[np.bool_]) -> "_State":
        return _State(*(values[rows] for values in self))  # type: ignore[arg-type]


def _gauss_newton(rows: _Rows, unit: Array, limits: Array, settings: GaussNewton) -> _Found:
    """Steps that lower E_s, from `unit` (n, k) within `limits` (2, k)."""
    n = len(unit)
    n_iterations, converged = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    result, stopped = unit.copy(), np.zeros(unit.shape, dtype=bool)
    layers, errors = rows.forward(unit)
    damping = np.full(n, settings.damping)
    state = _State(np.arange(n), unit, errors, rows.jacobian(layers), damping, stopped.copy())
    for step in range(settings.n_iterations + 1):
        error = _half_square(state.errors)
        done = error < settings.tolerance
        usable = np.isfinite(error) & (state.damping <= DAMPING_MAXIMUM)
        going = ~done & usable & (step < settings.n_iterations)
        if not going.all():
            ended = state.row[~going]
            result[ended] = state.unit[~going]
            stopped[ended] = state.stopped[~going]
            n_iterations[ended] = step
            converged[ended] = done[~going]
            state = state.take(going)
            rows, error = rows.take(going), error[going]
        if state.row.size == 0:
            break
        trial, fixed = _limited_step(state, limits)
        layers, errors = rows.forward(trial)
        better = _half_square(errors) < error  # false for nan
        row = better[:, None]
        state = _State(
            state.row,
            np.where(row, trial, state.unit),
            np.where(row, errors, state.errors),
            np.where(row[:, :, None], rows.jacobian(layers), state.jacobian),
            np.maximum(np.where(better, FALL, RISE) * state.damping, DAMPING_MINIMUM),
            fixed,
        )
    # a rejected step may have been stopped where these strokes are not
    stopped &= (result == limits[0]) | (result == limits[1])
    return _Found(result, n_iterations, converged, stopped)


def _limited_step(state: _State, limits: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Next strokes (n, k) of a damped step within `limits`, and which of them a limit fixes.

    Strokes that the step takes beyond a limit are put on it, and the others are solved for again.
    """
    unit, jacobian = state.unit, state.jacobian
    trial, fixed = unit, np.zeros(unit.shape, dtype=bool)
    for _ in range(unit.shape[1] + 1):
        rest = state.errors - np.einsum("nqk,nk->nq", jacobian, np.where(fixed, trial - unit, 0.0))
        wanted = unit + _damped_step(jacobian * ~fixed[:, None], rest, state.damping)
        trial = np.where(fixed, trial, np.clip(wanted, *limits))
        beyond = ~fixed & (trial != wanted)
        if not beyond.any():
            break
        fixed |= beyond
    return trial, fixed


def _damped_step(jacobian: Array, errors: Array, damping: Array) -> Array:
    """Step s (n, k) with (J^T J + damping I) s = J^T e, by J J^T, which has fewer rows."""
    # eigenvalues, because they never fail however close J J^T is to singular
    values, vectors = np.linalg.eigh(jacobian @ jacobian.transpose(0, 2, 1))
    along = np.einsum("nij,ni->nj", vectors, errors)
    along /= np.maximum(values, 0.0) + damping[:, None]
    return np.einsum("nqk,nqj,nj->nk", jacobian, vectors, along)
