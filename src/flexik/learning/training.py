"""The one door to training: data and settings in, a network and its training record out.

A new trainer is its settings in parameters.trainers, a file with its `minimise`, and one entry of
TRAINERS.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

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
from flexik.learning.perceptron import (
    ACTIVATIONS,
    Array,
    Column,
    Network,
    Normalisation,
    quantities,
)
from flexik.learning.problem import Problem, problem
from flexik.learning.stopping import Minimum
from flexik.learning.storage import TrainingRecord
from flexik.learning.weights import Weights, initial_weights, uniform_weights
from flexik.parameters.trainers import Stopping

# Function of start, problem, settings and generator, by kind of settings
TRAINERS: dict[str, Callable[..., Minimum]] = {
    "levenberg_marquardt": levenberg_marquardt.minimise,
    "levenberg_marquardt_accelerated": accelerated.minimise,
    "back_propagation": back_propagation.minimise,
    "adam": adam.minimise,
    "lbfgs": lbfgs.minimise,
    "regularised_cg": regularised_cg.minimise,
}

# Selection error of a network where the error of its outputs is not what counts
Judge = Callable[[Network], float]
# Sees the network of every iteration, the initial one first
Observer = Callable[[Network], None]


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

    def __str__(self) -> str:
        return f"{'-'.join(map(str, self.hidden_sizes))} {self.activation} units"


@dataclass(frozen=True, eq=False)
class Lesson:
    """What all restarts of a network share.

    Attributes
    ----------
    inputs, outputs : (n, p) and (n, q) in physical units; their extremes give the normalisation
    input_quantities, output_quantities : names and units of the p and q columns
    architecture, settings : of the network, and of one of TRAINERS
    seed : not negative
    selection : inputs (m, p) and outputs (m, q) the training does not see, if any
    judge : gives the selection error, else that of the normalised outputs on `selection`
    spread : when given, the initial weights are uniform in [-spread, spread]; else they are those
        of Nguyen and Widrow

    Raises
    ------
    DataError
        When the data are empty, not finite, or of shapes that do not belong together.
    TrainingError
        When there are more weights than numbers to fit, or patience without selection data.
    """

    inputs: Array
    outputs: Array
    input_quantities: Sequence[Column]
    output_quantities: Sequence[Column]
    architecture: Architecture
    settings: Stopping
    seed: int = 1
    selection: tuple[Array, Array] | None = None
    judge: Judge | None = None
    spread: float | None = None

    def __post_init__(self) -> None:
        self._check_pair("training", self.inputs, self.outputs)
        if self.selection is not None:
            self._check_pair("selection", *self.selection)
        elif self.settings.selection_patience is not None:
            raise TrainingError("trainer setting selection_patience needs selection data")
        if self.seed < 0:
            raise TrainingError(f"seed={self.seed}, expected 0 or more")
        n_weights = sum(
            n_units * (n_before + 1) for n_before, n_units in itertools.pairwise(self.sizes)
        )
        if self.outputs.size < n_weights:
            raise TrainingError(
                f"{self.architecture} have {n_weights} weights, more than "
                f"the {self.outputs.size} numbers ({len(self.outputs)} samples of "
                f"{self.outputs.shape[1]} outputs) there are to fit"
            )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of all layers, inputs and outputs among them."""
        hidden = self.architecture.hidden_sizes
        return (self.inputs.shape[1], *hidden, self.outputs.shape[1])

    @property
    def kind(self) -> str:
        """Kind of the trainer."""
        if (kind := getattr(self.settings, "kind", "")) not in TRAINERS:
            raise TrainingError(f"{type(self.settings).__name__} is not the settings of a trainer")
        return str(kind)

    @cached_property
    def scales(self) -> tuple[Normalisation, Normalisation]:
        """Of inputs and outputs."""
        return Normalisation.from_data(self.inputs), Normalisation.from_data(self.outputs)

    def network(self, weights: Weights) -> Network:
        """The network of a copy of `weights`."""
        copies = tuple(matrix.copy() for matrix in weights)
        names = quantities(self.input_quantities), quantities(self.output_quantities)
        activation = self.architecture.activation
        return Network(copies, activation, *self.scales, tuple(names[0]), tuple(names[1]))

    def _check_pair(self, role: str, inputs: Array, outputs: Array) -> None:
        _check(f"{role} inputs", inputs, self.input_quantities)
        _check(f"{role} outputs", outputs, self.output_quantities)
        if len(inputs) != len(outputs):
            raise DataError(f"{role} inputs have {len(inputs)} samples, outputs {len(outputs)}")


def train(
    lesson: Lesson, restart: int = 0, observer: Observer | None = None
) -> tuple[Network, TrainingRecord]:
    """The network of one restart; `observer` sees as many as the record has errors.

    Raises TrainingError when there is no usable network.
    """
    network, record = attempt(lesson, restart, observer)
    if network is None:
        raise no_network(lesson, [record])
    return network, record


def train_best(
    lesson: Lesson, n_restarts: int
) -> tuple[Network, TrainingRecord, list[TrainingRecord]]:
    """Train from `n_restarts` starts, one after the other, and keep the best by selection error.

    Rare restarts generalise badly, so the training error does not choose.

    Returns
    -------
    network, record : of the chosen restart
    records : of all restarts in their order; one that failed has no errors and no selection error

    Raises
    ------
    TrainingError
        When every restart fails.
    """
    return best(lesson, [attempt(lesson, restart) for restart in range(n_restarts)])


def best(
    lesson: Lesson, runs: Sequence[tuple[Network | None, TrainingRecord]]
) -> tuple[Network, TrainingRecord, list[TrainingRecord]]:
    """As `train_best`, of restarts that were made before, in their order."""
    records = [record for _, record in runs]
    # min keeps the first of equals, that is the lowest restart
    network, record = min(runs, key=lambda run: run[1].rank, default=(None, None))
    if network is None or record is None or math.isinf(record.rank):
        raise no_network(lesson, records)
    return network, record, records


@dataclass(frozen=True, eq=False)
class Attempt:
    """A restart of a lesson; `observer` sees the network of every iteration."""

    lesson: Lesson
    restart: int
    observer: Observer | None = None

    def begin(self) -> tuple[Weights, Problem, Stopping, np.random.Generator]:
        """What a trainer takes."""
        lesson, (first, *hidden, last) = self.lesson, self.lesson.sizes
        generator = np.random.default_rng((lesson.seed, self.restart))
        if lesson.spread is None:
            activation = lesson.architecture.activation
            start = initial_weights(first, hidden, last, activation, generator)
        else:
            start = uniform_weights(first, hidden, last, lesson.spread, generator)
        watch = self.observer
        observe = None if watch is None else lambda weights: watch(lesson.network(weights))
        return start, _problem(lesson, observe), lesson.settings, generator

    def end(self, minimum: Minimum) -> tuple[Network | None, TrainingRecord]:
        """The network, None where it is not usable, and its record."""
        lesson = self.lesson
        network = lesson.network(minimum.weights) if minimum.errors else None
        error = math.nan if network is None else _selection_error(lesson, network)
        made = lesson.kind, lesson.seed, self.restart, minimum.stop_reason, minimum.errors
        return network, TrainingRecord(*made, minimum.kept, error if math.isfinite(error) else None)


def attempt(
    lesson: Lesson, restart: int, observer: Observer | None = None
) -> tuple[Network | None, TrainingRecord]:
    """As `train`; None in place of a network that is not usable."""
    return attempt_together([Attempt(lesson, restart, observer)])[0]


def attempt_together(
    attempts: Sequence[Attempt],
) -> list[tuple[Network | None, TrainingRecord]]:
    """As `attempt`, of lessons of one architecture, kind of trainer and number of samples.

    Back-propagation takes the steps of all at once; others learn one after the other.
    """
    kinds = {each.lesson.kind for each in attempts}
    # the order of sums in a product depends on the number of threads, so it is one everywhere
    with threadpool_limits(1):
        begun = [each.begin() for each in attempts]
        if kinds == {"back_propagation"}:
            minima = back_propagation.minimise_together(*zip(*begun, strict=True))
        else:
            minima = [
                TRAINERS[each.lesson.kind](*given)
                for each, given in zip(attempts, begun, strict=True)
            ]
    return [each.end(minimum) for each, minimum in zip(attempts, minima, strict=True)]


def no_network(lesson: Lesson, records: Sequence[TrainingRecord]) -> TrainingError:
    """What to raise when no restart gave a usable network."""
    outputs = ", ".join(quantity.name for quantity in lesson.output_quantities)
    reasons = ", ".join(f"{record.restart}: {record.stop_reason}" for record in records)
    return TrainingError(
        f"network for {outputs} with {lesson.architecture}, seed {lesson.seed}: no usable network, "
        f"restarts ended with {reasons}"
    )


def _selection_error(lesson: Lesson, network: Network) -> float:
    if lesson.judge is not None:
        return lesson.judge(network)
    if lesson.selection is None:
        return math.nan
    inputs, outputs = lesson.selection
    to_unit = network.output_normalisation.to_unit
    residuals = to_unit(network.predict(inputs)) - to_unit(outputs)
    return float(np.sqrt(np.mean(residuals**2)))


def _problem(lesson: Lesson, observe: Callable[[Weights], None] | None) -> Problem:
    def unit(inputs: Array, outputs: Array) -> tuple[Array, Array]:
        return lesson.scales[0].to_unit(inputs), lesson.scales[1].to_unit(outputs)

    # the trainer sees the selection data only to stop by them
    asked = lesson.settings.selection_patience is not None
    selection = unit(*lesson.selection) if asked and lesson.selection is not None else None
    data = unit(lesson.inputs, lesson.outputs)
    return problem(lesson.architecture.activation, *data, selection, observe)


def _check(role: str, values: Array, columns: Sequence[Column]) -> None:
    names = ", ".join(column.name for column in columns)
    if values.ndim != 2 or 0 in values.shape or values.shape[1] != len(columns):
        raise DataError(
            f"{role} have shape {values.shape}, expected (n, {len(columns)}), n > 0: {names}"
        )
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        sample, column = bad[0]
        raise DataError(
            f"{role}, sample {sample}: {columns[column].name} is "
            f"{values[sample, column]}, expected a finite number"
        )
