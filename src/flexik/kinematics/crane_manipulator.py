"""The crane as a planar manipulator: its inverse with the rule for the redundant extension."""

from dataclasses import dataclass

import numpy as np

from flexik.errors import UnreachableError
from flexik.kinematics.crane import (
    Array,
    CraneGeometry,
    forward,
    inverse,
    inverse_with_smallest_extension,
    smallest_extension,
)
from flexik.kinematics.manipulator import RigidSolution

STEP = 0.01  # m, of initial positions


@dataclass(frozen=True)
class CraneManipulator:
    """See kinematics.manipulator.Manipulator: strokes of lift, jib and extension, m."""

    geometry: CraneGeometry

    @property
    def lower(self) -> Array:
        """Zero strokes (3,)."""
        return np.zeros(3)

    @property
    def upper(self) -> Array:
        """Longest strokes (3,) in m."""
        return np.array(self.geometry.stroke_maximum)

    def forward(self, values: Array) -> Array:
        """Tip (n, 2) in m at strokes (n, 3)."""
        return forward(self.geometry, values)

    def inverse(
        self, targets: Array, current: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """Exact strokes with the extension rule of Rouvinen's appendix B.

        The extension is the smallest that the original target needs, so that a correction of a few
        centimetres does not change the combination. Where the target is not reached with it, the
        smallest larger one is taken; where no larger one reaches, the smallest that reaches at all.
        The rule leaves nothing to choose, so the current strokes serve unreached rows only.
        """
        geometry = self.geometry
        original = targets if original_targets is None else original_targets
        needed = np.nan_to_num(smallest_extension(geometry, original), nan=0.0)
        extension = smallest_extension(geometry, targets, at_least=needed)
        extension = np.where(np.isnan(extension), smallest_extension(geometry, targets), extension)
        # where nothing reaches, any extension tells why
        extension = np.where(np.isnan(extension), needed, extension)
        return inverse(geometry, targets, extension).or_current(current)

    def branch(self, values: Array) -> Array:
        """Extension strokes (n, 1)."""
        return values[:, 2:]

    def initial_positions(self, targets: Array) -> Array:
        """Strokes (n, 3) near `targets` (n, 2), in m, in full centimetres within the limits.

        The smallest extension that reaches the target, the rigid inverse for lift and jib, all
        rounded "to create some noise" (Rouvinen 1999, chapter 4 and appendix B): so all methods use
        the same combination. Raises UnreachableError naming the targets that are not reached.
        """
        solution = inverse_with_smallest_extension(self.geometry, targets)
        if not solution.reached.all():
            missed = ", ".join(
                f"({x:g}, {y:g})" for x, y in np.unique(targets[~solution.reached], axis=0)
            )
            raise UnreachableError(f"the rigid crane does not reach {missed} (x, y in m)")
        # whole steps inside the limits; the slack is for limits that are whole steps themselves
        most = np.floor(self.upper / STEP + 1e-6)
        return np.round(np.minimum(np.round(solution.values / STEP), most) * STEP, 2)
