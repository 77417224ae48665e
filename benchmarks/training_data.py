"""What the training benchmark trains: the crane's tables, large samples of a teacher, a clock."""

import functools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexik.cases.case import load
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.learning.problem import Problem, problem
from flexik.learning.training import Architecture, Lesson, train
from flexik.learning.weights import Weights, initial_weights
from flexik.parameters.trainers import LevenbergMarquardt, LevenbergMarquardtAccelerated, Stopping
from flexik.planar.learning import lesson
from flexik.planar.train import data_inputs

Array = NDArray[np.float64]

ACTIVATION = "tanh"
SEED = 1
OURS, PUBLISHED = LevenbergMarquardtAccelerated, LevenbergMarquardt
# what each network learns
NETWORKS = {"deflection": "deflection", "direct": "tip"}

# The teacher of large samples, and the noise that keeps any student from fitting it exactly
TEACHER_HIDDEN, TEACHER_ITERATIONS, TEACHER_NOISE = 60, 40, 1e-4


@functools.cache
def crane_lesson(network: str) -> Lesson:
    """Grid and selection data of one of NETWORKS, in SI units.

    Raises DataError when the pipeline has not made them.
    """
    section = load("crane")
    architecture = Architecture(1, ACTIVATION)
    return lesson(
        NETWORKS[network],
        architecture,
        OURS(),
        SEED,
        section.machine,
        **data_inputs(section, network),
    )


def columns(n: int) -> list[Quantity]:
    """Names for `n` columns; the trainers do not look at them."""
    return [Quantity(f"column {k}", "1") for k in range(n)]


def run_ours(
    inputs: Array, outputs: Array, n_hidden: int, settings: Stopping, restart: int = 0
) -> tuple[Network, tuple[float, ...], float]:
    """Train through the package's door: network, mean squared errors, seconds."""
    started = time.perf_counter()
    names = columns(inputs.shape[1]), columns(outputs.shape[1])
    architecture = Architecture(n_hidden, ACTIVATION)
    network, record = train(Lesson(inputs, outputs, *names, architecture, settings, SEED), restart)
    return network, record.errors, time.perf_counter() - started


def endless(trainer: type[Stopping], **options: float) -> Stopping:
    """Settings that end by `options` alone."""
    return trainer(minimum_progress=0.0, minimum_gradient=0.0).but(**options)


def teacher_sample(n_samples: int) -> tuple[Array, Array]:
    """Uniform random inputs (n, 4) in [-1, 1] and what a trained network, with noise, makes of it.

    No equilibrium is solved: cost does not depend on what is fitted.
    """
    data = crane_lesson("deflection")
    settings = endless(OURS, n_iterations=TEACHER_ITERATIONS)
    network, _, _ = run_ours(data.inputs, data.outputs, TEACHER_HIDDEN, settings)
    rng = np.random.default_rng(SEED)
    inputs = rng.uniform(-1.0, 1.0, (n_samples, data.inputs.shape[1]))
    outputs = np.empty((n_samples, data.outputs.shape[1]))
    for first in range(0, n_samples, 10_000):  # the hidden layer of all would not be small
        rows = slice(first, first + 10_000)
        values = network.input_normalisation.from_unit(inputs[rows])
        outputs[rows] = network.output_normalisation.to_unit(network.predict(values))
    outputs += rng.normal(0.0, TEACHER_NOISE, outputs.shape)
    return inputs, outputs


@dataclass(frozen=True, eq=False)
class Case:
    """One start on normalised data: inputs (n, p), targets (n, q), Nguyen-Widrow weights."""

    inputs: Array
    targets: Array
    start: Weights

    @property
    def start_error(self) -> float:
        """Root mean square of the errors of `start`."""
        return self.error(self.start)

    def error(self, weights: Weights) -> float:
        """Root mean square over all samples and outputs: the one measure of all trainers."""
        error = self.problem.mean_squared_error(weights)
        return math.sqrt(error) if error >= 0.0 else math.inf

    @functools.cached_property
    def problem(self) -> Problem:
        """The same for the functions of the package."""
        return problem(ACTIVATION, self.inputs, self.targets)


def case(network: str, n_hidden: int, restart: int) -> Case:
    """The start that `run_ours` draws for `restart`, and the data as it normalises them."""
    data = crane_lesson(network)
    pair = (data.inputs, data.outputs)
    inputs, targets = (Normalisation.from_data(values).to_unit(values) for values in pair)
    generator = np.random.default_rng((SEED, restart))
    sizes = inputs.shape[1], [n_hidden], targets.shape[1]
    return Case(inputs, targets, initial_weights(*sizes, ACTIVATION, generator))


class Finished(Exception):  # noqa: N818
    """All targets are reached, or the time is up."""


class Watch:
    """Seconds until each of `targets` (root mean square error); runs from `start` on.

    Attributes
    ----------
    first, best : error noted first, and least error
    reached : seconds by target
    """

    def __init__(self, targets: Sequence[float], limit: float) -> None:
        self.targets, self.limit = targets, limit
        self.first, self.best = math.nan, math.inf
        self.reached: dict[float, float] = {}
        self._started = self._noted = 0.0

    def start(self) -> None:
        """Begin; what came before (imports, compiling) is not counted."""
        self._started = self._noted = time.perf_counter()

    def note(self, error: float) -> None:
        """Note an error the trainer has at hand; raises Finished when there is no more to do."""
        self._note(error, time.perf_counter())

    def note_of(self, case: Case, weights: Weights) -> None:
        """Note the error of `weights`; the time this takes is not counted."""
        now = time.perf_counter()
        error = case.error(weights)
        self._note(error, now)
        self._started += time.perf_counter() - now

    def _note(self, error: float, now: float) -> None:
        seconds = now - self._started
        if math.isnan(self.first):
            self.first = error
        if error < self.best:
            self.best = error
        if seconds <= self.limit:
            for target in self.targets:
                if error <= target:
                    self.reached.setdefault(target, seconds)
        if len(self.reached) == len(self.targets) or seconds > self.limit:
            raise Finished
