"""Methods whose network gives the angles: the published one, told by gauges, and one without.

`gauges` is the network of Al-Khafaji and Jweeg 2017, equation 59: it must be given the deformation
of the very pose that it should find, which no controller knows before the arm is there. `inverse`
knows target and payload alone.
"""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.elastic_arm import DEFORMATION, ArmGeometry, elbow, inverse_by_rule
from flexik.positioning.method import REACHED, Array, Command, Network, checked


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

    geometry: ArmGeometry
    network: Network
    inputs: tuple[str, ...]
    deformation: Array

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        targets = checked("targets", targets, None, 2)
        deformation = checked("deformation by the gauges", self.deformation, len(targets), 6)
        side = elbow(np.nan_to_num(inverse_by_rule(self.geometry, targets).angles))
        known = dict(zip(DEFORMATION, deformation.T, strict=True))
        known |= {"p_x": targets[:, 0], "p_y": targets[:, 1], "elbow": side}
        predicted = self.network.predict(np.column_stack([known[name] for name in self.inputs]))
        angles, n_clipped = _within(self.geometry, predicted, len(targets))
        return Command(angles, np.full(len(targets), REACHED), {"n_clipped": n_clipped})


@dataclass(frozen=True)
class InverseNetwork:
    """Angles as a network predicts them from target, payload and elbow.

    network : predicts both angles (rad) from tip x and y (m), payload (kg) and elbow (1 or -1).

    The elbow is that of the rigid arm's rule; a target that the rigid arm does not reach keeps the
    initial angles and the rigid inverse's status. Diagnostic as for GaugeNetwork.
    """

    geometry: ArmGeometry
    network: Network

    def __call__(self, targets: Array, payload: Array, initial_strokes: Array) -> Command:
        """See `flexik.positioning.method.Method`."""
        targets = checked("targets", targets, None, 2)
        payload = checked("payload", payload, len(targets))
        angles = checked("initial angles", initial_strokes, len(targets), 2).copy()
        rigid = inverse_by_rule(self.geometry, targets)
        rows = rigid.reached
        inputs = np.column_stack([targets[rows], payload[rows], elbow(rigid.angles[rows])])
        n_clipped = np.zeros(len(targets), dtype=np.int64)
        angles[rows], n_clipped[rows] = _within(
            self.geometry, self.network.predict(inputs), len(inputs)
        )
        return Command(angles, rigid.status, {"n_clipped": n_clipped})


def _within(geometry: ArmGeometry, predicted: Array, n: int) -> tuple[Array, Array]:
    """Angles (n, 2) clipped to the joint limits, and how many of a row were clipped (n,)."""
    predicted = checked("predicted angles", predicted, n, 2)
    clipped = np.clip(predicted, geometry.lower, geometry.upper)
    return clipped, np.sum(clipped != predicted, axis=1)
