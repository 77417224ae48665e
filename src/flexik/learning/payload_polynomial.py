"""Polynomials of the payload whose coefficients a network gives, by their values at nodes."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Degree of the polynomial by what the network learnt
DEGREES = {"payload_linear": 1, "payload_quadratic": 2}


class Predictor(Protocol):
    """A trained network."""

    def predict(self, values: Array, /) -> Array:
        """Return outputs (n, q) at inputs (n, p), in SI units."""
        ...


def nodes_of(grid: pd.DataFrame, degree: int) -> Array:
    """Payloads (degree + 1,) in kg, from the least to the largest of `grid`."""
    return np.linspace(grid["payload"].min(), grid["payload"].max(), degree + 1)


def lagrange(nodes: Array, payload: Array) -> Array:
    """Weights (n, m) of what is known at `nodes` (m,), at `payload` (n,)."""
    found = np.ones((len(payload), len(nodes)))
    for k, node in enumerate(nodes):
        for other in np.delete(nodes, k):
            found[:, k] *= (payload - other) / (node - other)
    return found


@dataclass(frozen=True)
class Interpolated:
    """A Network of the deflection.

    at_nodes : gives the deflection (n, 2 m) in m at every node, x and y, at coordinates (n, k).
    nodes : payloads (m,) in kg.
    """

    at_nodes: Predictor
    nodes: Array

    def predict(self, values: Array) -> Array:
        """Deflection (n, 2) in m at `values` (n, k + 1): coordinates, and payload in kg."""
        at = self.at_nodes.predict(np.ascontiguousarray(values[:, :-1]))
        at = at.reshape(len(values), len(self.nodes), 2)
        return np.einsum("nm,nmi->ni", lagrange(self.nodes, values[:, -1]), at)
