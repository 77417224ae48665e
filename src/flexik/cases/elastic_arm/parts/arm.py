"""The elastic arm as its machine file describes it."""

from flexik.cases.elastic_arm.parts.geometry import geometry_of
from flexik.cases.elastic_arm.section import Machine
from flexik.multibody.elastic_arm import FlexibleArm, Tube


def flexible_arm(machine: Machine) -> FlexibleArm:
    """Build the arm."""
    return FlexibleArm(
        geometry=geometry_of(machine),
        tube=Tube(**machine.structure.tube.model_dump()),
        deflection_stations=machine.gauges.deflection_stations,
        strain_stations=machine.gauges.strain_stations,
        **machine.structure.model_dump(exclude={"tube"}),
    )
