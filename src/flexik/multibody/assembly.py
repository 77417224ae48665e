"""The flexible crane as params.yaml describes it."""

from flexik import parameters
from flexik.mechanisms.crane import CraneGeometry
from flexik.multibody.crane import CraneStructure, FlexibleCrane, Rod
from flexik.multibody.structure import Beam, read_section


def flexible_crane(crane: parameters.Crane, spring_stiffness: float) -> FlexibleCrane:
    """Build the crane of section `crane` on a ground spring of `spring_stiffness` N m/rad.

    Raises DataError if a section table cannot be read.
    """
    given = crane.structure
    beams = {
        name: _beam(getattr(given.beams, name), given.youngs_modulus)
        for name in type(given.beams).model_fields
    }
    structure = CraneStructure(
        **beams,
        rocker=Rod(given.rocker.mass, given.rocker.centre_of_mass),
        coupler=Rod(given.coupler.mass, given.coupler.centre_of_mass),
        lift_axis_height=given.lift_axis_height,
        jib_axis_height=given.jib_axis_height,
        extension_overlap=given.extension_overlap,
        front_pad=given.front_pad,
        gravity=given.gravity,
    )
    geometry = CraneGeometry(**crane.geometry.model_dump())
    return FlexibleCrane(geometry, structure, spring_stiffness, given.element)


def _beam(given: parameters.BeamModel, youngs_modulus: float) -> Beam:
    return Beam(
        section=read_section(given.section),
        youngs_modulus=youngs_modulus,
        **given.model_dump(exclude={"section"}),
    )
