"""What every positioning method takes and gives: targets and payloads in, commanded strokes out.

Strokes stand for the actuator coordinates of any mechanism: (n, k), strokes in m or joint angles in
rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexik.errors import FlexikError
from flexik.kinematics import status

Array = NDArray[np.float64]
Diagnostics = dict[str, NDArray]

REACHED = status.REACHED
NOT_CONVERGED = 3
STATUS_MEANING = {**status.STATUS_MEANING, NOT_CONVERGED: "search ended above its tolerance"}


class PositioningError(FlexikError):
    """Arrays handed to a method, or coming from one, do not fit together."""


@dataclass(frozen=True)
class Command:
    """Commanded strokes; a row that failed still holds strokes the manipulator can take.

    strokes : (n, k) in m, or joint angles in rad.
    status : (n,), codes of STATUS_MEANING.
    diagnostics : arrays (n,) by name.
    """

    strokes: Array
    status: NDArray[np.int64]
    diagnostics: Diagnostics = field(default_factory=dict)

    def __post_init__(self) -> None:
        shapes = {"status": self.status.shape}
        shapes |= {name: values.shape for name, values in self.diagnostics.items()}
        for name, shape in shapes.items():
            if shape != self.strokes.shape[:1]:
                raise PositioningError(f"{name} of {shape=} beside {self.strokes.shape=}")


class Method(Protocol):
    """A positioning method."""

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """Strokes for `targets` (n, 2) in m under `payload` (n,) in kg.

        `initial_strokes` (n, k) are the current ones; they choose among the many stroke
        combinations that reach a target, and stay where a method finds none.
        """
        ...


class Network(Protocol):
    """A trained network, or anything that predicts like one."""

    def predict(self, values: Array, /) -> Array:
        """Return outputs (n, n_outputs) at inputs `values` (n, n_inputs), both in SI units."""
        ...


def take_network(networks: Mapping[str, Network], name: str) -> Network:
    """Network `name` of `networks`; raises PositioningError naming what there is."""
    if name not in networks:
        raise PositioningError(f"expected a network {name!r}, got {sorted(networks)}")
    return networks[name]


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
