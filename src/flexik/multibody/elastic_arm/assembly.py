"""The elastic arm as params.yaml describes it."""

import numpy as np

from flexik import parameters
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.multibody.elastic_arm.model import FlexibleArm, Tube


def flexible_arm(arm: parameters.ElasticArm) -> FlexibleArm:
    """Build the arm of section `elastic_arm`."""
    given = arm.structure
    limits = np.radians([arm.geometry.theta_1_degrees, arm.geometry.theta_2_degrees])
    (low_1, high_1), (low_2, high_2) = limits.tolist()
    return FlexibleArm(
        geometry=ArmGeometry(arm.geometry.lengths, ((low_1, high_1), (low_2, high_2))),
        tube=Tube(**given.tube.model_dump()),
        youngs_modulus=given.youngs_modulus,
        density=given.density,
        joint_mass=given.joint_mass,
        gravity=given.gravity,
        deflection_stations=arm.gauges.deflection_stations,
        strain_stations=arm.gauges.strain_stations,
        n_elements=given.n_elements,
    )
