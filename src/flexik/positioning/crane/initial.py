"""Initial positions, which make all methods use the same stroke combination for a target."""

import numpy as np

from flexik.errors import UnreachableError
from flexik.kinematics.crane import CraneGeometry, inverse_with_smallest_extension
from flexik.positioning.method import Array, checked

STEP = 0.01  # m


def initial_positions(geometry: CraneGeometry, targets: Array) -> Array:
    """Strokes (n, 3) near `targets` (n, 2), in m, in full centimetres within the stroke limits.

    The smallest extension that reaches the target, the rigid inverse for lift and jib, all rounded
    "to create some noise" (Rouvinen 1999, chapter 4 and appendix B).

    Raises
    ------
    UnreachableError
        Naming the targets that the rigid crane does not reach.
    """
    targets = checked("targets", targets, None, 2)
    solution = inverse_with_smallest_extension(geometry, targets)
    if not solution.reached.all():
        missed = ", ".join(
            f"({x:g}, {y:g})" for x, y in np.unique(targets[~solution.reached], axis=0)
        )
        raise UnreachableError(f"the rigid crane does not reach {missed} (x, y in m)")
    # whole steps inside the limits; the slack is for limits that are whole steps themselves
    most = np.floor(np.array(geometry.stroke_maximum) / STEP + 1e-6)
    return np.round(np.minimum(np.round(solution.strokes / STEP), most) * STEP, 2)
