"""Rigid inverse of the crane in closed form.

A genetic algorithm with the same signature stands in genetic.py.
"""

import numpy as np

from flexik.kinematics.crane import CraneGeometry, inverse, smallest_extension
from flexik.positioning.method import Array, checked
from flexik.positioning.rigid_inverse import RigidInverse, RigidSolution


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
