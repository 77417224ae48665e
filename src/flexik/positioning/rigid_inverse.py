"""The rigid inverse that methods build on, and its closed form.

A genetic algorithm with the same signature stands in genetic.py.
"""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexik.mechanisms.crane import CraneGeometry, inverse, smallest_extension
from flexik.positioning.method import Array, Diagnostics, checked


class RigidSolution(NamedTuple):
    """Strokes (n, 3) in m, status (n,) of STATUS_MEANING, diagnostics (n,) by name.

    Rows that are not reached hold the current strokes.
    """

    strokes: Array
    status: NDArray[np.int64]
    diagnostics: Diagnostics


class RigidInverse(Protocol):
    """Strokes that put the rigid tip on targets."""

    def __call__(
        self, targets: Array, current_strokes: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """Solve for `targets` (n, 2) from `current_strokes` (n, 3), in m.

        `original_targets` (n, 2) are what corrected targets were before their correction; an
        inverse with a rule for the redundant stroke applies it to them. None: the targets.
        """
        ...


def closed_form(geometry: CraneGeometry) -> RigidInverse:
    """Exact inverse with the extension rule of Rouvinen's appendix B.

    The extension is the smallest that the original target needs, so that a correction of a few
    centimetres does not change the combination. Where the target is not reached with it, the
    smallest larger one is taken; where no larger one reaches, the smallest that reaches at all.
    The rule leaves nothing to choose, so the current strokes serve unreached rows only.
    """

    def solve(
        targets: Array, current_strokes: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        targets = checked("targets", targets, None, 2)
        current = checked("current strokes", current_strokes, len(targets), 3)
        original = targets
        if original_targets is not None:
            original = checked("original targets", original_targets, len(targets), 2)
        needed = np.nan_to_num(smallest_extension(geometry, original), nan=0.0)
        extension = smallest_extension(geometry, targets, at_least=needed)
        extension = np.where(np.isnan(extension), smallest_extension(geometry, targets), extension)
        # where nothing reaches, any extension tells why
        extension = np.where(np.isnan(extension), needed, extension)
        solution = inverse(geometry, targets, extension)
        strokes = np.where(solution.reached[:, None], solution.strokes, current)
        return RigidSolution(strokes, solution.status, {})

    return solve
