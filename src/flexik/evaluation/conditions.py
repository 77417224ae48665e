"""Conditions: what a method is asked, and from where."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexik.errors import ParameterError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Conditions:
    """Rows of a set of conditions.

    query : (m, p), see positioning.method.
    current : (m, k) actuator coordinates before the method is asked.
    group : (m,) number of the point, path or pose that a row belongs to.
    """

    query: Array
    current: Array
    group: NDArray[np.int64]

    def __post_init__(self) -> None:
        lengths = {len(self.query), len(self.current), len(self.group)}
        if len(lengths) != 1 or self.query.ndim != 2 or self.current.ndim != 2:
            raise ParameterError(
                f"{self.query.shape=}, {self.current.shape=}, {self.group.shape=}, "
                "expected (m, p), (m, k) and (m,)"
            )

    def __len__(self) -> int:
        return len(self.query)

    def __getitem__(self, rows: slice | NDArray) -> "Conditions":
        return Conditions(self.query[rows], self.current[rows], self.group[rows])

    def chunks(self, n_rows: int) -> list["Conditions"]:
        """In order, in pieces of `n_rows` rows."""
        return [self[k : k + n_rows] for k in range(0, len(self), n_rows)]


def every(points: ArrayLike, payloads: ArrayLike) -> tuple[Array, NDArray[np.int64]]:
    """Queries (m, 3) of all `points` (k, 2) in m with all `payloads` (p,) in kg, m = k p.

    Point-major: all payloads of the first point come first. The second array (m,) numbers the
    points. Raises ParameterError if either is empty, of another shape, or not finite.
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
    group = np.repeat(np.arange(len(points)), len(payloads))
    return np.column_stack([points[group], np.tile(payloads, len(points))]), group
