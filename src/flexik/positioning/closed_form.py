"""Method `closed_form`: the analytical inverse of a six-joint arm with a spherical wrist."""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.pose_representation import asked
from flexik.kinematics.serial_arm import SerialArm
from flexik.kinematics.spherical_wrist import inverse
from flexik.kinematics.status import REACHED
from flexik.positioning.method import Answer, Array


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """Joints (rad) of the arm configuration asked for; nan where it does not reach the pose.

    Of several turns within the limits of a joint the one closest to the current joints.
    """

    arm: SerialArm

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        target, number = asked(query)
        found, rows = inverse(self.arm, target, current), np.arange(len(number))
        status = found.status[rows, number]
        reached = (status == REACHED)[:, None]
        return Answer(np.where(reached, found.joints[rows, number], np.nan), status)
