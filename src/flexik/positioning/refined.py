"""Damped Newton steps after any method of a serial arm."""

from dataclasses import dataclass

from flexik.kinematics.pose_representation import asked
from flexik.kinematics.serial_arm import SerialArm, refine
from flexik.kinematics.status import limit_status
from flexik.positioning.method import Answer, Array, Method


@dataclass(frozen=True, eq=False)
class Refined:
    """`method`, and after it `n_steps` of kinematics.serial_arm.refine towards the pose."""

    arm: SerialArm
    method: Method
    n_steps: int
    damping: float
    orientation_length: float

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        joints = self.method(query, current).values
        target = asked(query)[0]
        steps = (self.n_steps, self.damping, self.orientation_length)
        found = refine(self.arm, target, joints, *steps)
        return Answer(found, limit_status(found, self.arm.minimum, self.arm.maximum))
