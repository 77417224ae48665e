"""Method `gauges`: the published network, told the deformation by gauges beside the target.

The network of Al-Khafaji and Jweeg 2017, equation 59. It must be given the deformation of the very
pose that it should find, which no controller knows before the arm is there.
"""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.kinematics.manipulator import Manipulator
from flexik.kinematics.status import REACHED
from flexik.positioning.method import Answer, Array, Network, checked, planar


@dataclass(frozen=True)
class GaugeNetwork:
    """Angles as a network predicts them from deformation and target.

    network : predicts both angles (rad) from `inputs`.
    inputs : names of DEFORMATION (m and rad), p_x and p_y, which the target stands for, and elbow,
        that of the rigid arm's rule.
    deformation : (n, 6), what gauges show in the poses that put the loaded tip on the n targets of
        the next call.

    Diagnostic: `n_clipped`, predicted angles that were clipped to the joint limits; the network's
    own error is not known, so such rows count as reached.
    """

    manipulator: Manipulator
    network: Network
    inputs: tuple[str, ...]
    deformation: Array

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, _ = planar(query)
        deformation = checked("deformation by the gauges", self.deformation, len(targets), 6)
        rigid = self.manipulator.inverse(targets, current).values
        known = dict(zip(DEFORMATION, deformation.T, strict=True))
        known |= {"p_x": targets[:, 0], "p_y": targets[:, 1]}
        known["elbow"] = self.manipulator.branch(rigid)[:, 0]
        asked = np.column_stack([known[name] for name in self.inputs])
        predicted = checked("predicted angles", self.network.predict(asked), len(targets), 2)
        values = np.clip(predicted, self.manipulator.lower, self.manipulator.upper)
        n_clipped = np.sum(values != predicted, axis=1)
        return Answer(values, np.full(len(targets), REACHED), {"n_clipped": n_clipped})
