"""The rigid inverse that methods build on; every mechanism has its own."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexik.positioning.method import Array, Diagnostics


class RigidSolution(NamedTuple):
    """Strokes (n, k), status (n,) of STATUS_MEANING, diagnostics (n,) by name.

    Strokes stand for the actuator coordinates, see `flexik.positioning.method`. Rows that are not
    reached hold the current ones.
    """

    strokes: Array
    status: NDArray[np.int64]
    diagnostics: Diagnostics


class RigidInverse(Protocol):
    """Actuator coordinates that put the rigid tip on targets."""

    def __call__(
        self, targets: Array, current_strokes: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """Solve for `targets` (n, 2) in m from `current_strokes` (n, k).

        `original_targets` (n, 2) are what corrected targets were before their correction; an
        inverse with a rule for a redundant stroke applies it to them. None: the targets.
        """
        ...
