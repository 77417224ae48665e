"""The rigid arm as its machine file describes it."""

import numpy as np

from flexik.cases.elastic_arm.section import Machine
from flexik.kinematics.elastic_arm import ArmGeometry


def geometry_of(machine: Machine) -> ArmGeometry:
    """Lengths and joint limits."""
    given = machine.geometry
    limits = np.radians([given.theta_1_degrees, given.theta_2_degrees])
    (low_1, high_1), (low_2, high_2) = limits.tolist()
    return ArmGeometry(given.lengths, ((low_1, high_1), (low_2, high_2)))
