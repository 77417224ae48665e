"""Modules of torch in place of a network: several layers, other activations, or one's own class.

A module is a class PACKAGE.MODULE:CLASS of torch.nn.Module, called with the numbers of inputs and
outputs and the options that params.yaml gives; it maps normalised inputs (n, p) to normalised
outputs (n, q), in float64. torch takes a second or two to import, so it is only where a module is
trained or asked.
"""

import importlib
import importlib.util
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from threadpoolctl import threadpool_limits

from flexik.errors import FlexikError, TrainingError
from flexik.learning.adam import rate
from flexik.learning.examples import Examples
from flexik.learning.perceptron import Array, Normalisation
from flexik.learning.problem import Problem
from flexik.learning.stopping import Minimum, Monitor, StopReason
from flexik.learning.storage import TrainingRecord
from flexik.parameters.trainers import Adam, Lbfgs

if TYPE_CHECKING:
    from torch import nn

LAYERS = "flexik.learning.torch_layers:Layers"
# Two generators of different use never meet
_BATCHES = 1
# Of L-BFGS: scaled error at the start, and trials of a line search
_LARGE, _MOST_TRIALS = 1e6, 25


@dataclass(frozen=True, eq=False)
class Module:
    """A trained module, as arrays.

    given : name of its class and options, as in params.yaml
    arrays : its parameters and buffers by name
    """

    given: Mapping[str, Any]
    arrays: Mapping[str, Array]
    input_normalisation: Normalisation
    output_normalisation: Normalisation

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of inputs and outputs."""
        return len(self.input_normalisation.minimum), len(self.output_normalisation.minimum)

    @cached_property
    def _built(self) -> "nn.Module":
        import torch

        module = made(self.given, *self.sizes)
        own = module.state_dict()
        if own.keys() != self.arrays.keys():
            raise FlexikError(f"{self.given}: arrays {[*self.arrays]}, expected {[*own]}")
        arrays = {k: torch.as_tensor(v).to(own[k].dtype) for k, v in self.arrays.items()}
        module.load_state_dict(arrays)
        return module.eval()

    def predict(self, values: Array) -> Array:
        """Return the outputs (n, q) at inputs `values` (n, p), both in SI units.

        Raises FlexikError when `values` has another shape.
        """
        import torch

        if values.ndim != 2 or values.shape[1] != self.sizes[0]:
            raise FlexikError(f"values have shape {values.shape}, expected (n, {self.sizes[0]})")
        with threadpool_limits(1), torch.no_grad():
            unit = self._built(torch.from_numpy(self.input_normalisation.to_unit(values)))
        return self.output_normalisation.from_unit(unit.numpy())


Trained = tuple[Module, TrainingRecord]


def made(given: Mapping[str, Any], n_inputs: int, n_outputs: int) -> "nn.Module":
    """The module `given` with its first weights; raises TrainingError if there is none like it."""
    from torch import nn

    name = given.get("name", LAYERS)
    options = {key: value for key, value in given.items() if key != "name"}
    package, _, of = name.partition(":")
    try:
        found = getattr(importlib.import_module(package), of)
        if not (isinstance(found, type) and issubclass(found, nn.Module)):
            raise TypeError("expected a class of torch.nn.Module")
        return found(n_inputs, n_outputs, **options).double()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise TrainingError(f"module {name}: {error}") from None


def train(
    given: Mapping[str, Any],
    examples: Examples,
    trainers: Sequence[Adam | Lbfgs],
    seed: int,
    restart: int = 0,
    device: str = "cpu",
) -> tuple[Module | None, TrainingRecord]:
    """Train the module `given` by `trainers`, one after the other; None if that fails.

    The first weights are torch's own, drawn by (seed, restart). An iteration of Adam is a pass over
    the samples in batches, its error the mean of what each had before its step; one of L-BFGS a
    step with all samples. The arrays come back to the processor.

    device : cpu, where bytes are the same everywhere, or auto: a GPU if there is one
    """
    import torch

    sizes = examples.inputs.shape[1], examples.outputs.shape[1]
    generator = np.random.default_rng((seed, restart, _BATCHES))
    with threadpool_limits(1), torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(np.random.SeedSequence((seed, restart)).generate_state(1)[0]))
        module = made(given, *sizes)
        run = _Run(given, module, examples, device)
        minima = []
        for settings in trainers:
            minima.append(run.minimise(settings, generator))
            if not minima[-1].errors:
                break
            run.take(minima[-1].weights[0])
        found = run.module() if minima[-1].errors else None
    return found, _record(trainers, minima, seed, restart, examples, found)


def train_best(
    given: Mapping[str, Any],
    examples: Examples,
    trainers: Sequence[Adam | Lbfgs],
    seed: int,
    n_restarts: int,
    device: str = "cpu",
) -> Module:
    """The best of `n_restarts` starts by selection error; raises TrainingError if all fail."""
    runs = [train(given, examples, trainers, seed, k, device) for k in range(n_restarts)]
    return best(runs)[0]


def best(runs: Sequence[tuple[Module | None, TrainingRecord]]) -> Trained:
    """The one of the least selection error; raises TrainingError if there is none."""
    usable = [(found, record) for found, record in runs if found is not None]
    if not usable:
        reasons = ", ".join(str(record.stop_reason) for _, record in runs)
        raise TrainingError(f"module: no usable one, restarts ended with {reasons}")
    return min(usable, key=lambda run: run[1].rank)


def _record(
    trainers: Sequence[Adam | Lbfgs],
    minima: Sequence[Minimum],
    seed: int,
    restart: int,
    examples: Examples,
    found: Module | None,
) -> TrainingRecord:
    errors = minima[0].errors
    kept = minima[0].kept
    for minimum in minima[1:]:
        kept = len(errors) - 1 + minimum.kept
        errors += minimum.errors[1:]
    selection = math.nan if found is None else examples.errors(found.predict)[1]
    return TrainingRecord(
        " + ".join(each.kind for each in trainers),
        seed,
        restart,
        minima[-1].stop_reason,
        errors if found is not None else (),
        kept if found is not None else 0,
        selection if math.isfinite(selection) else None,
    )


class _Run:
    """A module in training on normalised samples."""

    # what a Monitor asks of a problem
    observer = None

    def __init__(
        self, given: Mapping[str, Any], module: "nn.Module", examples: Examples, device: str
    ) -> None:
        import torch

        gpu = device == "auto" and torch.cuda.is_available()
        self.given, self.examples, self.device = given, examples, "cuda" if gpu else "cpu"
        self.network = module.to(self.device)
        unit = examples.unit()
        self.inputs, self.targets = (torch.from_numpy(a).to(self.device) for a in unit)

    def minimise(self, settings: Adam | Lbfgs, generator: np.random.Generator) -> Minimum:
        """Train by `settings` from the present weights."""
        monitor = Monitor(cast(Problem, self), settings)
        if isinstance(settings, Adam):
            steps = self._adam(settings, generator)
        else:
            steps = self._lbfgs(settings)
        reason = monitor.add((self.vector(),), self.error())
        for error in steps if reason is None else ():
            reason = monitor.add((self.vector(),), error)
            if reason is not None:
                break
        return monitor.result(StopReason.GRADIENT if reason is None else reason)

    def _adam(self, settings: Adam, generator: np.random.Generator) -> Iterator[float]:
        import torch

        betas, n = (settings.beta_1, settings.beta_2), len(self.inputs)
        optimiser = torch.optim.Adam(self.network.parameters(), settings.learning_rate, betas)
        length = min(settings.batch_size or n, n)
        n_batches = math.ceil(n / length)
        for done in range(settings.n_iterations):
            order, squares = torch.from_numpy(generator.permutation(n)).to(self.device), 0.0
            self.network.train()
            for batch in range(n_batches):
                rows = order[batch * length : (batch + 1) * length]
                share = (done + batch / n_batches) / settings.n_iterations
                optimiser.param_groups[0]["lr"] = rate(settings, share)
                optimiser.zero_grad()
                loss = self._loss(rows)
                loss.backward()
                optimiser.step()
                squares += len(rows) * float(loss.detach())
            yield squares / n

    def _lbfgs(self, settings: Lbfgs) -> Iterator[float]:
        import torch
        from torch.nn.utils import parameters_to_vector

        parameters = list(self.network.parameters())
        self.network.train()
        # torch takes no step into its memory whose change of gradient is below 1e-10
        scale = _LARGE / float(self._loss(slice(None)).detach())
        # one step a call: the rules of the other trainers decide where it ends
        optimiser = torch.optim.LBFGS(
            parameters,
            max_iter=1,
            max_eval=_MOST_TRIALS,
            tolerance_grad=settings.minimum_gradient * scale,
            tolerance_change=0.0,
            history_size=settings.memory,
            line_search_fn="strong_wolfe",
        )
        asked: list[Any] = []

        def closure() -> Any:
            # a step begins where the last trial of the one before mostly ended
            at = parameters_to_vector(parameters).detach()
            if not (asked and torch.equal(asked[0], at)):
                optimiser.zero_grad()
                loss = scale * self._loss(slice(None))
                loss.backward()
                asked[:] = at, loss.detach()
            return asked[1]

        while True:
            before = parameters_to_vector(parameters).detach()
            optimiser.step(closure)
            if torch.equal(before, parameters_to_vector(parameters)):
                return  # the gradient is as good as zero, or no step along it lowers the error
            yield float(closure()) / scale

    def _loss(self, rows: Any) -> Any:
        from torch.nn.functional import mse_loss

        return mse_loss(self.network(self.inputs[rows]), self.targets[rows])

    def error(self) -> float:
        """Mean squared error on the samples."""
        import torch

        self.network.eval()
        with torch.no_grad():
            return float(self._loss(slice(None)))

    def vector(self) -> Array:
        """All parameters and buffers in one vector."""
        return np.concatenate([array.ravel() for array in self._arrays().values()])

    def take(self, vector: Array) -> None:
        """Take back what `vector` was."""
        import torch

        state, first = self.network.state_dict(), 0
        for name, tensor in state.items():
            part = torch.from_numpy(vector[first : first + tensor.numel()].copy())
            state[name] = part.reshape(tensor.shape).to(tensor.dtype)
            first += tensor.numel()
        self.network.load_state_dict(state)

    def _arrays(self) -> dict[str, Array]:
        state = self.network.state_dict()
        return {k: v.detach().cpu().double().numpy().copy() for k, v in state.items()}

    def module(self) -> Module:
        """The module as it is now."""
        scales = self.examples.scales
        return Module(self.given, self._arrays(), scales.inputs, scales.outputs)

    def selection_error(self, _: object) -> float:
        """Mean squared error on the selection, of the present weights."""
        return self.examples.errors(self.module().predict)[1] ** 2


def code_of(given: Mapping[str, Any]) -> Path:
    """File of the class of module `given`; raises TrainingError if there is none."""
    package = given.get("name", LAYERS).partition(":")[0]
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None:
        raise TrainingError(f"module {package}: there is none that Python can import")
    return Path(spec.origin)
