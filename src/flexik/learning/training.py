"""The one door to training: data and settings in, a network and its training record out.

A new trainer is one file, with its settings and its `minimise`, and one entry of TRAINERS.
"""

import functools
import itertools
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from flexik.errors import DataError, TrainingError
from flexik.learning import (
    accelerated,
    adam,
    back_propagation,
    lbfgs,
    levenberg_marquardt,
    regularised_cg,
)
from flexik.learning.accelerated import LevenbergMarquardtAccelerated
from flexik.learning.adam import Adam
from flexik.learning.back_propagation import BackPropagation
from flexik.learning.lbfgs import Lbfgs
from flexik.learning.levenberg_marquardt import LevenbergMarquardt
from flexik.learning.perceptron import (
    ACTIVATIONS,
    Array,
    Network,
    Normalisation,
    Quantity,
)
from flexik.learning.problem import Problem, problem
from flexik.learning.regularised_cg import RegularisedCg
from flexik.learning.stopping import Minimum, Stopping, StopReason
from flexik.learning.weights import Weights, initial_weights, uniform_weights

__all__ = [
    "TRAINERS",
    "Adam",
    "Architecture",
    "BackPropagation",
    "Lbfgs",
    "LevenbergMarquardt",
    "LevenbergMarquardtAccelerated",
    "RegularisedCg",
    "StopReason",
    "Stopping",
    "TrainingRecord",
    "train",
    "train_best",
    "trainer_settings",
]


# Selection error of a network where the error of its outputs is not what counts
Judge = Callable[[Network], float]
# Sees the network of every iteration, the initial one first
Observer = Callable[[Network], None]


@dataclass(frozen=True)
class Trainer:
    """Settings of a trainer, and its function of start, problem, settings and generator."""

    settings: type[Stopping]
    minimise: Callable[[Weights, Problem, Any, np.random.Generator], Minimum]


TRAINERS = {
    "levenberg_marquardt": Trainer(LevenbergMarquardt, levenberg_marquardt.minimise),
    "levenberg_marquardt_accelerated": Trainer(LevenbergMarquardtAccelerated, accelerated.minimise),
    "back_propagation": Trainer(BackPropagation, back_propagation.minimise),
    "adam": Trainer(Adam, adam.minimise),
    "lbfgs": Trainer(Lbfgs, lbfgs.minimise),
    "regularised_cg": Trainer(RegularisedCg, regularised_cg.minimise),
}


def trainer_settings(name: str, options: Mapping[str, Any] | None = None) -> Stopping:
    """Settings of the trainer `name`; what `options` leave out keeps its default.

    Raises
    ------
    TrainingError
        When the trainer or an option is unknown, or a value of another type or out of range.
    """
    if name not in TRAINERS:
        raise TrainingError(f"trainer {name!r} is unknown, expected one of {', '.join(TRAINERS)}")
    settings = TRAINERS[name].settings
    known = [setting.name for setting in fields(settings)]
    for option in options or {}:
        if option not in known:
            raise TrainingError(
                f"trainer {name}: option {option!r} is unknown, expected one of {', '.join(known)}"
            )
    try:
        return settings(**(options or {}))
    except TrainingError as error:
        raise TrainingError(f"trainer {name}: {error}") from error


@dataclass(frozen=True)
class Architecture:
    """Units of the hidden layer (of several, from the inputs on, one number each) and activation.

    Raises TrainingError when they are out of range.
    """

    n_hidden: int | tuple[int, ...]
    activation: str = "tanh"

    def __post_init__(self) -> None:
        if isinstance(self.n_hidden, list):
            object.__setattr__(self, "n_hidden", tuple(self.n_hidden))
        if not self.hidden_sizes or min(self.hidden_sizes) < 1:
            raise TrainingError(f"n_hidden={self.n_hidden}, expected at least 1 in every layer")
        if self.activation not in ACTIVATIONS:
            raise TrainingError(f"activation={self.activation!r}, expected one of {ACTIVATIONS}")

    @property
    def hidden_sizes(self) -> tuple[int, ...]:
        """Units of every hidden layer."""
        return self.n_hidden if isinstance(self.n_hidden, tuple) else (self.n_hidden,)


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
    kept : the iteration the network is of; the last one unless the errors rose or the settings
        asked for selection patience
    selection_error : root mean square of the normalised output errors on the selection data, or
        what the judge of the run says
    n_restarts : number of runs this one competed with, itself among them
    seconds : wall time of the run; nan when read from a file, and no part of equality
    """

    trainer: str
    seed: int
    stop_reason: StopReason
    errors: tuple[float, ...]
    kept: int
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
    settings: Stopping
    seed: int
    n_restarts: int
    quantities: tuple[tuple[Quantity, ...], tuple[Quantity, ...]]
    selection: tuple[Array, Array] | None
    judge: Judge | None
    observer: Observer | None = None
    spread: float | None = None


def train(
    inputs: Array,
    outputs: Array,
    architecture: Architecture,
    settings: Stopping,
    seed: int,
    input_quantities: Sequence[Quantity],
    output_quantities: Sequence[Quantity],
    selection: tuple[Array, Array] | None = None,
    restart: int = 0,
    judge: Judge | None = None,
    observer: Observer | None = None,
    spread: float | None = None,
) -> tuple[Network, TrainingRecord]:
    """Train one network; the same as restart `restart` of `train_best`.

    Parameters
    ----------
    inputs, outputs : (n, p) and (n, q) in physical units; their extremes give the normalisation
    settings : of one of TRAINERS
    seed : not negative
    input_quantities, output_quantities : names and units of the p and q columns
    selection : inputs (m, p) and outputs (m, q) the training does not see, if any
    judge : gives the selection error, else that of the normalised outputs on `selection`
    observer : called with the network of every iteration, as many as the record has errors
    spread : when given, the initial weights are uniform in [-spread, spread]; else they are those
        of Nguyen and Widrow

    Raises
    ------
    DataError
        When the data are empty, not finite, or of shapes that do not belong together.
    TrainingError
        When there are more weights than numbers to fit, selection patience without selection
        data, or no usable network.
    """
    quantities = tuple(input_quantities), tuple(output_quantities)
    data = _checked_pair("training", inputs, outputs, quantities)
    if selection is not None:
        selection = _checked_pair("selection", *selection, quantities)
    elif settings.selection_patience is not None:
        raise TrainingError("trainer setting selection_patience needs selection data")
    task = _Task(
        *data, architecture, settings, seed, 1, quantities, selection, judge, observer, spread
    )
    _check(task)
    network, record = _run(task, restart)
    if network is None:
        raise _no_network(task, [record])
    return network, record


def train_best(
    inputs: Array,
    outputs: Array,
    selection_inputs: Array,
    selection_outputs: Array,
    architecture: Architecture,
    settings: Stopping,
    seed: int,
    n_restarts: int,
    input_quantities: Sequence[Quantity],
    output_quantities: Sequence[Quantity],
    map_function: Callable[[Callable, Iterable], Iterable] = map,
    judge: Judge | None = None,
) -> tuple[Network, TrainingRecord, list[TrainingRecord]]:
    """Train from `n_restarts` starts and keep the network with the least selection error.

    Rare restarts generalise badly, so the training error does not choose.

    Parameters
    ----------
    inputs, outputs : (n, p) and (n, q) in physical units; their extremes give the normalisation
    selection_inputs, selection_outputs : (m, p) and (m, q), data the training does not see
    seed : restart k starts from the NumPy generator of (seed, k)
    settings : of one of TRAINERS
    map_function : ``map_function(function, items)`` gives the results in any order; `function`
        can be pickled, so it may run in other processes without changing the result
    judge : as for `train`

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
    task = _Task(*data, architecture, settings, seed, n_restarts, quantities, selection, judge)
    _check(task)
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
    name, trainer = _trainer(task.settings)
    normalisations = Normalisation.from_data(task.inputs), Normalisation.from_data(task.outputs)
    generator = np.random.default_rng((task.seed, restart))
    sizes = task.inputs.shape[1], task.architecture.hidden_sizes, task.outputs.shape[1]
    if task.spread is None:
        start = initial_weights(*sizes, task.architecture.activation, generator)
    else:
        start = uniform_weights(*sizes, task.spread, generator)
    # the order of sums in a product depends on the number of threads, so it is one everywhere
    with threadpool_limits(1):
        minimum = trainer.minimise(start, _problem(task, normalisations), task.settings, generator)
    record = TrainingRecord(
        trainer=name,
        seed=task.seed,
        stop_reason=minimum.stop_reason,
        errors=minimum.errors,
        kept=minimum.kept,
        selection_error=None,
        restart=restart,
        n_restarts=task.n_restarts,
        seconds=time.perf_counter() - started,
    )
    if not minimum.errors:
        return None, record
    network = _network(task, minimum.weights, normalisations)
    if task.judge is not None:
        record = replace(record, selection_error=task.judge(network))
    elif task.selection is not None:
        values, expected = (task.selection[0], normalisations[1].to_unit(task.selection[1]))
        residuals = normalisations[1].to_unit(network.predict(values)) - expected
        record = replace(record, selection_error=float(np.sqrt(np.mean(residuals**2))))
    return network, record


def _network(
    task: _Task, weights: Weights, normalisations: tuple[Normalisation, Normalisation]
) -> Network:
    copies = tuple(matrix.copy() for matrix in weights)
    return Network(copies, task.architecture.activation, *normalisations, *task.quantities)


def _trainer(settings: Stopping) -> tuple[str, Trainer]:
    for name, trainer in TRAINERS.items():
        if type(settings) is trainer.settings:
            return name, trainer
    raise TrainingError(f"{type(settings).__name__} is not the settings of a trainer")


def _problem(task: _Task, normalisations: tuple[Normalisation, Normalisation]) -> Problem:
    def unit(inputs: Array, outputs: Array) -> tuple[Array, Array]:
        return normalisations[0].to_unit(inputs), normalisations[1].to_unit(outputs)

    # the trainer sees the selection data only to stop by them
    asked = task.settings.selection_patience is not None
    selection = unit(*task.selection) if asked and task.selection is not None else None
    watch, data = task.observer, unit(task.inputs, task.outputs)

    def observe(weights: Weights) -> None:
        if watch is not None:
            watch(_network(task, weights, normalisations))

    return problem(task.architecture.activation, *data, selection, observe if watch else None)


def _selection_error(run: tuple[Network | None, TrainingRecord]) -> float:
    error = run[1].selection_error
    return math.inf if error is None or math.isnan(error) else error


def _no_network(task: _Task, records: list[TrainingRecord]) -> TrainingError:
    outputs = ", ".join(quantity.name for quantity in task.quantities[1])
    reasons = ", ".join(f"{record.restart}: {record.stop_reason}" for record in records)
    return TrainingError(
        f"network for {outputs} with {task.architecture.n_hidden} {task.architecture.activation} "
        f"units, seed {task.seed}: no usable network, restarts ended with {reasons}"
    )


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


def _check(task: _Task) -> None:
    if task.seed < 0:
        raise TrainingError(f"seed={task.seed}, expected 0 or more")
    n_outputs, n_hidden = task.outputs.shape[1], task.architecture.n_hidden
    sizes = (task.inputs.shape[1], *task.architecture.hidden_sizes, n_outputs)
    n_weights = sum(n_units * (n_before + 1) for n_before, n_units in itertools.pairwise(sizes))
    if task.outputs.size < n_weights:
        raise TrainingError(
            f"{n_hidden} hidden units have {n_weights} weights, more than the {task.outputs.size} "
            f"numbers ({len(task.outputs)} samples of {n_outputs} outputs) there are to fit"
        )
