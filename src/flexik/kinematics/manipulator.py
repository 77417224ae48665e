"""What a planar manipulator gives to methods: rigid kinematics both ways, limits and branches."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED

Array = NDArray[np.float64]


class RigidSolution(NamedTuple):
    """Actuator coordinates (n, k), status (n,) of kinematics.status, diagnostics (n,) by name."""

    values: Array
    status: NDArray[np.int64]
    diagnostics: Mapping[str, NDArray] = MappingProxyType({})

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Rows whose coordinates lie within their limits, (n,)."""
        return self.status == REACHED

    def but(self, rows: NDArray[np.bool_], other: Self) -> "RigidSolution":
        """The same, but for `rows` (n,), which are those of `other`."""
        values = np.where(rows[:, None], other.values, self.values)
        return RigidSolution(values, np.where(rows, other.status, self.status))

    def or_current(self, current: Array) -> "RigidSolution":
        """The same with the coordinates `current` (n, k) in rows that are not reached."""
        return self._replace(values=np.where(self.reached[:, None], self.values, current))


def limited(values: Array, lower: Array, upper: Array, tolerance: float) -> RigidSolution:
    """Solution of coordinates `values` (n, k) that limits (k,) allow or do not, NaN: there is none.

    What is outside by no more than `tolerance` is put on its limit; rows with ACTUATOR_LIMIT hold
    the coordinates that would be needed, rows with OUT_OF_REACH hold NaN.
    """
    unsolved = np.isnan(values).any(axis=1)
    with np.errstate(invalid="ignore"):
        allowed = (values >= lower - tolerance) & (values <= upper + tolerance)
    inside = np.all(allowed, axis=1)
    values = np.where(inside[:, None], np.clip(values, lower, upper), values)
    values[unsolved] = np.nan
    status = np.where(unsolved, OUT_OF_REACH, np.where(inside, REACHED, ACTUATOR_LIMIT))
    return RigidSolution(values, status)


def arc_cosine(cosine: Array) -> Array:
    """Arc cosine, NaN outside [-1, 1] but for round-off of a stretched or folded linkage."""
    within = np.abs(cosine) <= 1.0 + 1e-12
    return np.arccos(np.where(within, np.clip(cosine, -1.0, 1.0), np.nan))


class Manipulator(Protocol):
    """A rigid planar manipulator of k actuator coordinates: strokes in m, joint angles in rad."""

    @property
    def lower(self) -> Array:
        """Least actuator coordinates (k,)."""
        ...

    @property
    def upper(self) -> Array:
        """Largest actuator coordinates (k,)."""
        ...

    def forward(self, values: Array) -> Array:
        """Tip (n, 2) in m at actuator coordinates (n, k)."""
        ...

    def inverse(
        self, targets: Array, current: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """Coordinates that put the tip on `targets` (n, 2) in m, from `current` (n, k).

        Rows that are not reached keep `current`. `original_targets` (n, 2) are what corrected
        targets were before their correction; a rule that chooses among many solutions applies to
        them. None: the targets.
        """
        ...

    def branch(self, values: Array) -> Array:
        """What makes the inverse unique, (n, b), at `values` (n, k).

        Coordinates that a rule chooses (the last b of k), or the side of an elbow, 1 or -1.
        """
        ...
