"""What every method takes and gives: queries and current actuator coordinates in, answers out.

A query is a row of numbers: target and payload of a planar machine (x, y in m, kg), the actuated
joints of a parallel one, a pose. A case names the columns of both, their units and limits.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from flexik.datasets.tables import Field
from flexik.errors import FlexikError
from flexik.kinematics.manipulator import Manipulator, RigidSolution
from flexik.machines.planar import PlanarMachine
from flexik.parameters.model import Count, Model, Name

Array = NDArray[np.float64]


class PositioningError(FlexikError):
    """Arrays handed to a method, or coming from one, do not fit together."""


@dataclass(frozen=True)
class Answer:
    """What a method answers; a row that failed holds what the machine can take, or NaN.

    values : (n, k) actuator coordinates (strokes in m, angles in rad), or what else is asked for.
    status : (n,), codes of kinematics.status.
    diagnostics : arrays (n,) by name.
    """

    values: Array
    status: NDArray[np.int64]
    diagnostics: Mapping[str, NDArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        shapes = {"status": self.status.shape}
        shapes |= {name: values.shape for name, values in self.diagnostics.items()}
        for name, shape in shapes.items():
            if shape != self.values.shape[:1]:
                raise PositioningError(f"{name} of {shape=} beside {self.values.shape=}")


class Method(Protocol):
    """A method."""

    def __call__(self, query: Array, current: Array) -> Answer:
        """Answer for every row of `query` (n, p).

        `current` (n, k) are the present actuator coordinates; they choose among many solutions, and
        stay where a method of positioning finds none.
        """
        ...


@dataclass(frozen=True)
class Columns:
    """Columns of a case's queries and answers, and of the errors its judge finds.

    errors : `error` is among them: what a method is judged by.
    lower, upper : limits (k,) of the answers.
    diagnostic_unit : of diagnostics that are no whole numbers.
    """

    query: tuple[Field, ...]
    answer: tuple[Field, ...]
    errors: tuple[Field, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    diagnostic_unit: str = "m"


class Network(Protocol):
    """A trained network, or anything that predicts like one."""

    def predict(self, values: Array, /) -> Array:
        """Return outputs (n, n_outputs) at inputs `values` (n, n_inputs), both in SI units."""
        ...


class Settings(Model):
    """Base of the settings of a method of planar machines; its file adds its own, with defaults.

    A file of this room that has a class `Settings` with its name as `method` and a function
    `build(settings, ingredients)` is a method, see positioning.registry.

    needs : word that the network must have learnt (deflection, tip, coordinates, correction,
        remainder); None: it needs none.
    asks_machine : whether it asks the machine itself, beyond its rigid kinematics.
    reads : tables of samples that it is built from.
    network : name of the network it is built from.
    n_targets : the most random targets it is judged on; None: all.
    """

    needs: ClassVar[str | None] = None
    asks_machine: ClassVar[bool] = False
    reads: ClassVar[tuple[str, ...]] = ()
    method: str

    network: Name | None = None
    n_targets: Count | None = None


@dataclass(frozen=True)
class Ingredients:
    """What methods are built from; each takes what it needs.

    network : the trained one that the settings name.
    samples : tables of samples by name, those of `reads` of the settings.
    machine : all constants known; None: there is no flexible model.
    """

    manipulator: Manipulator
    network: Network | None = None
    samples: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    machine: PlanarMachine | None = None


def take_network(ingredients: Ingredients) -> Network:
    """The network of `ingredients`; raises PositioningError if there is none."""
    if ingredients.network is None:
        raise PositioningError("the method needs a network, got none")
    return ingredients.network


def take_machine(ingredients: Ingredients) -> PlanarMachine:
    """The machine of `ingredients`; raises PositioningError if there is none."""
    if ingredients.machine is None:
        raise PositioningError("the method needs a flexible machine, got none")
    return ingredients.machine


def planar(query: Array) -> tuple[Array, Array]:
    """Targets (n, 2) in m and payload (n,) in kg of the `query` (n, 3) of a planar machine."""
    query = checked("query", query, None, 3)
    return query[:, :2], query[:, 2]


def rigid_inverse(manipulator: Manipulator, targets: Array, current: Array) -> RigidSolution:
    """Rigid inverse of `manipulator`; raises PositioningError if `current` is no (n, k)."""
    current = checked("current coordinates", current, len(targets), len(manipulator.lower))
    return manipulator.inverse(targets, current)


def predicted(
    network: Network, what: str, values: Array, payload: Array, n_outputs: int | None
) -> Array:
    """Outputs (n, n_outputs) of `network` at coordinates (n, k) and payload (n,) in kg.

    Raises PositioningError, which names `what`, if they are not finite or of another shape.
    """
    found = network.predict(np.column_stack([values, payload]))
    return checked(f"predicted {what}", found, len(values), n_outputs)


def checked(name: str, values: ArrayLike, *shape: int | None) -> Array:
    """`values` as finite float64 of `shape` (None fits any length), or a PositioningError."""
    array = np.asarray(values, dtype=float)
    fits = array.ndim == len(shape) and all(
        expected in (None, found) for expected, found in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise PositioningError(f"{name}: expected shape {shape}, got {array.shape}")
    if not (finite := np.isfinite(array)).all():
        raise PositioningError(f"{name}: sample {np.argwhere(~finite)[0][0]} is not finite")
    return array
