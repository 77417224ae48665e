"""What a planar manipulator gives to methods: rigid kinematics both ways, limits and branches."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class RigidSolution(NamedTuple):
    """Actuator coordinates (n, k), status (n,) of kinematics.status, diagnostics (n,) by name.

    Rows that are not reached hold the current coordinates.
    """

    values: Array
    status: NDArray[np.int64]
    diagnostics: dict[str, NDArray]


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

        `original_targets` (n, 2) are what corrected targets were before their correction; a rule
        that chooses among many solutions applies to them. None: the targets.
        """
        ...

    def branch(self, values: Array) -> Array:
        """What makes the inverse unique, (n, b), at `values` (n, k).

        Coordinates that a rule chooses (the last b of k), or the side of an elbow, 1 or -1.
        """
        ...
