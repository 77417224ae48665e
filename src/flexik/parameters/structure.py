"""The crane itself: its kinematics, what bends and weighs, and studies of the model."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    NotNegative,
    Positive,
    Seed,
    Vector,
    check_increase,
)


class Geometry(Model):
    """Rigid kinematics, see kinematics.crane.CraneGeometry; m."""

    lift_pivot: Vector
    lift_cylinder_base: Vector
    lift_cylinder_head: Vector
    jib_pivot: Vector
    rocker_pivot: Vector
    jib_cylinder_base: Vector
    coupler_pin: Vector
    extension_start: Vector
    lift_cylinder_length: Positive
    jib_cylinder_length: Positive
    rocker_length: Positive
    coupler_length: Positive
    stroke_maximum: tuple[Positive, Positive, Positive]


class BeamModel(Model):
    """One beam, see multibody.beams.Beam."""

    section: str
    span: Interval
    mass: Positive
    centre_of_mass: float
    mass_span: Interval
    mass_offset: float
    n_elements: Count

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.span[0] <= self.mass_span[0] < self.mass_span[1] <= self.span[1]:
            raise ValueError("mass_span: must increase and lie within span")
        if not self.mass_span[0] < self.centre_of_mass < self.mass_span[1]:
            raise ValueError("centre_of_mass: must lie within mass_span")
        return self


class Beams(Model):
    """The four flexible links."""

    pillar: BeamModel
    lift: BeamModel
    jib: BeamModel
    extension: BeamModel


class RodModel(Model):
    """A rigid two-pin link."""

    mass: Positive
    centre_of_mass: NotNegative


class Structure(Model):
    """What bends and weighs, see multibody.crane.structure.CraneStructure."""

    element: Literal["geometrically_exact", "ancf"]
    youngs_modulus: Positive
    gravity: Positive
    lift_axis_height: float
    jib_axis_height: float
    beams: Beams
    rocker: RodModel
    coupler: RodModel


class Calibration(Model):
    """Fit of the ground spring."""

    stiffness_range: tuple[Positive, Positive]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "stiffness_range")
        return self


class MeshStudy(Model):
    """Samples and refinements of the mesh study."""

    n_samples: Count
    refinements: Annotated[list[Count], Field(min_length=2)]
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.refinements != sorted(set(self.refinements)):
            raise ValueError("refinements: must increase, the last one being the reference")
        return self


class Illustration(Model):
    """Sample drawn in the picture of the crane: strokes in m, payload in kg."""

    strokes: tuple[NotNegative, NotNegative, NotNegative]
    payload: NotNegative
    exaggeration: Positive
