"""Method `arm_configurations`: a network for each arm configuration, from poses all over."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexik.kinematics.pose_representation import asked, joints_of
from flexik.kinematics.serial_arm import SerialArm
from flexik.kinematics.spherical_wrist import admissible
from flexik.kinematics.status import limit_status
from flexik.positioning.method import Answer, Array, Network, PositioningError


@dataclass(frozen=True, eq=False)
class ArmConfigurations:
    """Joints (rad) of the network of the arm configuration that a pose is asked for.

    networks : by number of the configuration; see kinematics.pose_representation for columns.

    Joints turn to where their limits admit them, if a turn is all that is in the way.
    """

    arm: SerialArm
    networks: Mapping[int, Network]

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`; raises PositioningError without a network."""
        number, joints = asked(query)[1], np.empty((len(query), self.arm.n_joints))
        for each in np.unique(number):
            if int(each) not in self.networks:
                raise PositioningError(f"no network for arm configuration {each}")
            rows = number == each
            outputs = self.networks[int(each)].predict(query[rows, :-1])
            joints[rows] = admissible(self.arm, joints_of(self.arm, outputs, int(each)))
        return Answer(joints, limit_status(joints, self.arm.minimum, self.arm.maximum))
