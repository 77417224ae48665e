"""The one door to training: data and settings in, a network and its training record out.

A new trainer is one settings dataclass and one entry of TRAINERS.
"""

import functools
import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flexik.errors import DataError, TrainingError
from flexik.learning import levenberg_marquardt
from flexik.learning.levenberg_marquardt import LevenbergMarquardt, Minimum, StopReason, Weights
from flexik.learning.perceptron import (
    ACTIVATIONS,
    Array,
    Network,
    Normalisation,
    Quantity,
)

__all__ = [
    "TRAINERS",
    "Architecture",
    "LevenbergMarquardt",
    "StopReason",
    "TrainingRecord",
    "train",
    "train_best",
]

Minimiser = Callable[[Weights, str, Array, Array, Any], Minimum]

TRAINERS: dict[type, tuple[str, Minimiser]] = {
    LevenbergMarquardt: ("levenberg_marquardt", levenberg_marquardt.minimise),
}


@dataclass(frozen=True)
class Architecture:
    """Size and activation of the hidden layer; TrainingError when out of range."""

    n_hidden: int
    activation: str = "tanh"

    def __post_init__(self) -> None:
        if self.n_hidden < 1:
            raise TrainingError(f"n_hidden={self.n_hidden}, expected at least 1")
        if self.activation not in ACTIVATIONS:
            raise TrainingError(f"activation={self.activation!r}, expected one of {ACTIVATIONS}")


@dataclass(frozen=True)
class TrainingRecord:
    """How a network came to be.

    Attributes
    ----------
    trainer : name of the trainer
    seed, restart : the initial weights are drawn from the NumPy generator of (seed, restart)
    stop_reason : why the run ended
    errors : mean squared error of the normalised outputs per iteration, the first the initial
        one; empty when the run gave no usable network
    selection_error : root mean square of the normalised output errors on the selection data
    n_restarts : number of runs this one competed with, itself among them
    seconds : wall time of the run; nan when read from a file, and no part of equality
    """

    trainer: str
    seed: int
    stop_reason: StopReason
    errors: tuple[float, ...]
    selection_error: float | None
    restart: int
    n_restarts: int
    seconds: float = field(compare=False)


@dataclass(frozen=True, eq=False)
class _Task:
    """What all restarts share."""

    inputs: Array
    outputs: Array
    architecture: Architecture
    settings: LevenbergMarquardt
    seed: int
    n_restarts: int
    quantities: tuple[tuple[Quantity, ...], tuple[Quantity, ...]]
    selection: tuple[Array, Array] | None


def train(
    inputs: Array,
    outputs: Array,
    architecture: Architecture,
    settings: LevenbergMarquardt,
    seed: int,
    input_quantities: Sequence[Quantity],
    output_quantities: Sequence[Quantity],
) -> tuple[Network, TrainingRecord]:
    """Train one network; the same as restart 0 of `train_best`.

    Parameters
    ----------
    inputs, outputs : (n, p) and (n, q) in physical units; their extremes give the normalisation
    seed : not negative
    input_quantities, output_quantities : names and units of the p and q columns

    Raises
    ------
    DataError
        When the data are empty, not finite, or of shapes that do not belong together.
    TrainingError
        When there are more weights than numbers to fit, or no usable network results.
    """
    quantities = tuple(input_quantities), tuple(output_quantities)
    data = _checked_pair("training", inputs, outputs, quantities)
    task = _Task(*data, architecture, settings, _checked_seed(seed), 1, quantities, None)
    _check_size(task)
    network, record = _run(task, 0)
    if network is None:
        raise _no_network(task, [record])
    return network, record


def train_best(
    inputs: Array,
    outputs: Array,
    selection_inputs: Array,
    selection_outputs: Array,
    architecture: Architecture,
    settings: LevenbergMarquardt,
    seed: int,
    n_restarts: int,
    input_quantities: Sequence[Quantity],
    output_quantities: Sequence[Quantity],
    map_function: Callable[[Callable, Iterable], Iterable] = map,
) -> tuple[Network, TrainingRecord, list[TrainingRecord]]:
    """Train from `n_restarts` starts and keep the network with the least selection error.

    Rare restarts generalise badly, so the training error does not choose.

    Parameters
    ----------
    inputs, outputs : (n, p) and (n, q) in physical units; their extremes give the normalisation
    selection_inputs, selection_outputs : (m, p) and (m, q), data the training does not see
    seed : restart k starts from the NumPy generator of (seed, k)
    map_function : ``map_function(function, items)`` gives the results in any order; `function`
        can be pickled, so it may run in other processes without changing the result

    Returns
    -------
    network, record : the chosen network and its record
    records : of all restarts in their order; one that failed has no errors and no selection error

    Raises
    ------
    DataError, TrainingError
        As `train`, the latter when every restart fails.
    """
    if n_restarts < 1:
        raise TrainingError(f"n_restarts={n_restarts}, expected at least 1")
    quantities = tuple(input_quantities), tuple(output_quantities)
    data = _checked_pair("training", inputs, outputs, quantities)
    selection = _checked_pair("selection", selection_inputs, selection_outputs, quantities)
    seed = _checked_seed(seed)
    task = _Task(*data, architecture, settings, seed, n_restarts, quantities, selection)
    _check_size(task)
    runs = sorted(
        map_function(functools.partial(_run, task), range(n_restarts)),
        key=lambda run: run[1].restart,
    )
    records = [record for _, record in runs]
    # min keeps the first of equals, that is the lowest restart
    network, record = min(runs, key=_selection_error)
    if network is None or math.isinf(_selection_error((network, record))):
        raise _no_network(task, records)
    return network, record, records


def _run(task: _Task, restart: int) -> tuple[Network | None, TrainingRecord]:
    started = time.perf_counter()
    name, minimise = TRAINERS[type(task.settings)]
    activation = task.architecture.activation
    normalisations = Normalisation.from_data(task.inputs), Normalisation.from_data(task.outputs)
    unit_inputs = normalisations[0].to_unit(task.inputs)
    unit_outputs = normalisations[1].to_unit(task.outputs)
    start = levenberg_marquardt.initial_weights(
        unit_inputs.shape[1],
        task.architecture.n_hidden,
        unit_outputs.shape[1],
        activation,
        np.random.default_rng((task.seed, restart)),
    )
    minimum = minimise(start, activation, unit_inputs, unit_outputs, task.settings)
    record = TrainingRecord(
        trainer=name,
        seed=task.seed,
        stop_reason=minimum.stop_reason,
        errors=minimum.errors,
        selection_error=None,
        restart=restart,
        n_restarts=task.n_restarts,
        seconds=time.perf_counter() - started,
    )
    if not minimum.errors:
        return None, record
    network = _network(minimum.weights, activation, normalisations, task.quantities)
    if task.selection is not None:
        values, expected = (task.selection[0], normalisations[1].to_unit(task.selection[1]))
        residuals = normalisations[1].to_unit(network.predict(values)) - expected
        record = replace(record, selection_error=float(np.sqrt(np.mean(residuals**2))))
    return network, record


def _network(
    weights: Weights,
    activation: str,
    normalisations: tuple[Normalisation, Normalisation],
    quantities: tuple[tuple[Quantity, ...], tuple[Quantity, ...]],
) -> Network:
    return Network(
        hidden_weights=weights.hidden[:, :-1].copy(),
        hidden_bias=weights.hidden[:, -1].copy(),
        output_weights=weights.output[:, :-1].copy(),
        output_bias=weights.output[:, -1].copy(),
        activation=activation,
        input_normalisation=normalisations[0],
        output_normalisation=normalisations[1],
        inputs=quantities[0],
        outputs=quantities[1],
    )


def _selection_error(run: tuple[Network | None, TrainingRecord]) -> float:
    error = run[1].selection_error
    return math.inf if error is None or math.isnan(error) else error


def _no_network(task: _Task, records: list[TrainingRecord]) -> TrainingError:
    outputs = ", ".join(quantity.name for quantity in task.quantities[1])
    reasons = ", ".join(f"{record.restart}: {record.stop_reason}" for record in records)
    return TrainingError(
        f"network for {outputs} with {task.architecture.n_hidden} "
        f"{task.architecture.activation} units, seed {task.seed}: "
        f"no usable network, restarts ended with {reasons}"
    )


def _checked_seed(seed: int) -> int:
    if seed < 0:
        raise TrainingError(f"seed={seed}, expected 0 or more")
    return int(seed)


def _checked_pair(
    role: str,
    inputs: Array,
    outputs: Array,
    quantities: tuple[tuple[Quantity, ...], tuple[Quantity, ...]],
) -> tuple[Array, Array]:
    pair = (
        _checked(f"{role} inputs", inputs, quantities[0]),
        _checked(f"{role} outputs", outputs, quantities[1]),
    )
    if len(pair[0]) != len(pair[1]):
        raise DataError(f"{role} inputs have {len(pair[0])} samples, outputs {len(pair[1])}")
    return pair


def _checked(role: str, values: Array, quantities: tuple[Quantity, ...]) -> Array:
    values = np.asarray(values, dtype=np.float64)
    names = ", ".join(quantity.name for quantity in quantities)
    if values.ndim != 2 or 0 in values.shape or values.shape[1] != len(quantities):
        raise DataError(
            f"{role} have shape {values.shape}, expected (n, {len(quantities)}), n > 0: {names}"
        )
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        sample, column = bad[0]
        raise DataError(
            f"{role}, sample {sample}: {quantities[column].name} is "
            f"{values[sample, column]}, expected a finite number"
        )
    return values


def _check_size(task: _Task) -> None:
    n_outputs = task.outputs.shape[1]
    n_hidden = task.architecture.n_hidden
    n_weights = n_hidden * (task.inputs.shape[1] + 1) + n_outputs * (n_hidden + 1)
    if task.outputs.size < n_weights:
        raise TrainingError(
            f"{n_hidden} hidden units have {n_weights} weights, more than the {task.outputs.size} "
            f"numbers ({len(task.outputs)} samples of {n_outputs} outputs) there are to fit"
        )
