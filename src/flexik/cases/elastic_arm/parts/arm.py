"""The elastic arm as its machine file describes it."""

import numpy as np

from flexik.cases.elastic_arm.section import Machine
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.multibody.elastic_arm import FlexibleArm, Tube


def flexible_arm(machine: Machine) -> FlexibleArm:
    """Build the arm."""
    given = machine.structure.model_dump(exclude={"tube"})
    limits = np.radians([machine.geometry.theta_1_degrees, machine.geometry.theta_2_degrees])
    (low_1, high_1), (low_2, high_2) = limits.tolist()
    return FlexibleArm(
        geometry=ArmGeometry(machine.geometry.lengths, ((low_1, high_1), (low_2, high_2))),
        tube=Tube(**machine.structure.tube.model_dump()),
        deflection_stations=machine.gauges.deflection_stations,
        strain_stations=machine.gauges.strain_stations,
        **given,
    )
