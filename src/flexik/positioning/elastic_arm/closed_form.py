"""Rigid inverse of the arm in closed form."""

import numpy as np

from flexik.kinematics.elastic_arm import ArmGeometry, elbow, inverse, inverse_by_rule
from flexik.positioning.method import REACHED, Array, checked
from flexik.positioning.rigid_inverse import RigidInverse, RigidSolution


def closed_form(geometry: ArmGeometry) -> RigidInverse:
    """Exact inverse on the elbow that `inverse_by_rule` chooses for the original target.

    So a correction of some millimetres does not turn the elbow over. Where the corrected target is
    not reached with this elbow, the rule is asked again, which reaches what either elbow reaches.
    The rule leaves nothing to choose, so the current angles serve unreached rows only.
    """

    def solve(
        targets: Array, current_strokes: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        targets = checked("targets", targets, None, 2)
        current = checked("current angles", current_strokes, len(targets), 2)
        by_rule = inverse_by_rule(geometry, targets)
        angles, status = by_rule.angles, by_rule.status
        if original_targets is not None:
            original = checked("original targets", original_targets, len(targets), 2)
            side = elbow(np.nan_to_num(inverse_by_rule(geometry, original).angles))
            same = inverse(geometry, targets, side)
            angles = np.where(same.reached[:, None], same.angles, angles)
        return RigidSolution(np.where((status == REACHED)[:, None], angles, current), status, {})

    return solve
