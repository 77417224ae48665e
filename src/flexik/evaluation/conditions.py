"""Test conditions: every point with every payload."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexik.errors import ParameterError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Conditions:
    """Targets (m, 2) in m, payload (m,) in kg, and the index (m,) of each condition's point."""

    targets: Array
    payload: Array
    point_index: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, rows: slice) -> "Conditions":
        return Conditions(self.targets[rows], self.payload[rows], self.point_index[rows])


def all_conditions(points: ArrayLike, payloads: ArrayLike) -> Conditions:
    """All of `points` (k, 2) in m with all of `payloads` (p,) in kg, m = k p.

    Point-major: all payloads of the first point come first.

    Raises
    ------
    ParameterError
        If points or payloads are empty, of another shape, or not finite.
    """
    points, payloads = np.asarray(points, dtype=float), np.asarray(payloads, dtype=float)
    if points.ndim != 2 or points.shape[1:] != (2,) or payloads.ndim != 1:
        raise ParameterError(
            f"{points.shape=}, {payloads.shape=}, expected (k, 2) points and (p,) payloads"
        )
    if points.size == 0 or payloads.size == 0:
        raise ParameterError(f"{points.shape=}, {payloads.shape=}, expected one or more of each")
    if not (np.isfinite(points).all() and np.isfinite(payloads).all()):
        raise ParameterError("points and payloads must be finite")
    return Conditions(
        np.repeat(points, len(payloads), axis=0),
        np.tile(payloads, len(points)),
        np.repeat(np.arange(len(points)), len(payloads)),
    )


def random_conditions(targets: ArrayLike, payload: ArrayLike) -> Conditions:
    """Conditions of `targets` (m, 2) in m with `payload` (m,) in kg, each a point of its own."""
    targets, payload = np.asarray(targets, dtype=float), np.asarray(payload, dtype=float)
    if targets.shape != (len(payload), 2):
        raise ParameterError(f"{targets.shape=}, {payload.shape=}, expected (m, 2) and (m,)")
    return Conditions(targets, payload, np.arange(len(payload)))
