"""A log crane as data/machines/crane.yaml describes it."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Count, Interval, Model, NotNegative, Positive, Share, Vector

# Lengths closer than this are the same, m
LENGTH_TOLERANCE = 1e-9


class CraneGeometry(Model):
    """Dimensions in m. Frames: `ground`; `lift` (origin B, x along the arm); `jib` (origin G).

    lift_pivot : B in the ground frame.
    lift_cylinder_base : C from B, in the ground frame (C sits on the pillar).
    lift_cylinder_head : D in the lift frame.
    jib_pivot : G in the lift frame.
    rocker_pivot : F from G, in the lift frame.
    jib_cylinder_base : E from F, in the lift frame.
    coupler_pin : I in the jib frame.
    extension_start : J from I, in the jib frame; the tip lies `stroke` farther along x.
    lift_cylinder_length, jib_cylinder_length : |CD| and |EH| at zero stroke.
    rocker_length, coupler_length : |FH| and |HI|.
    stroke_maximum : longest strokes of lift, jib and extension cylinder; the shortest are zero.
    """

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


class Beam(Model):
    """One beam, see multibody.beams.Beam."""

    section: Annotated[str, Field(min_length=1)]
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

    pillar: Beam
    lift: Beam
    jib: Beam
    extension: Beam

    @property
    def sections(self) -> dict[str, str]:
        """Files of the section tables by beam."""
        return {name: getattr(self, name).section for name in type(self).model_fields}


class Rod(Model):
    """A rigid two-pin link: mass in kg and distance of its centre from its first pin in m."""

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
    rocker: Rod
    coupler: Rod


class Machine(Model):
    """The whole machine."""

    geometry: CraneGeometry
    structure: Structure

    @model_validator(mode="after")
    def _lengths_agree(self) -> Self:
        """What the geometry and the beams both say must agree."""
        geometry, beams = self.geometry, self.structure.beams
        expected = {
            "pillar.span.1": (beams.pillar.span[1], geometry.lift_pivot[1], "lift_pivot"),
            "lift.span.0": (beams.lift.span[0], 0.0, "the lift pivot"),
            "lift.span.1": (beams.lift.span[1], geometry.jib_pivot[0], "jib_pivot"),
            "extension.span.0": (beams.extension.span[0], 0.0, "its rear end"),
        }
        for key, (found, value, why) in expected.items():
            if abs(found - value) > LENGTH_TOLERANCE:
                raise ValueError(f"structure.beams.{key}: expected {value:g} m ({why})")
        tip = geometry.coupler_pin[0] + geometry.extension_start[0] + geometry.stroke_maximum[2]
        rear_pad = tip - beams.extension.span[1]
        if rear_pad >= beams.jib.span[1]:
            raise ValueError(
                f"geometry.stroke_maximum.2: the rear pad, at {rear_pad:g} m, would leave the jib"
            )
        lengths = {"rocker": geometry.rocker_length, "coupler": geometry.coupler_length}
        for name, length in lengths.items():
            if getattr(self.structure, name).centre_of_mass > length:
                raise ValueError(f"structure.{name}.centre_of_mass: beyond its length, {length} m")
        return self


# Beyond these a number is in another unit, or slipped
Length = Annotated[float, Field(ge=0, le=0.02)]  # m
Clearance = Annotated[float, Field(ge=0, le=0.005)]  # m
Relative = Annotated[float, Field(ge=0, le=0.5)]


class Magnitudes(Model):
    """How far a crane as built may be off. Standard deviations, but for `play`.

    pivot : of every coordinate of every pin, in the frame of its body, m.
    length : of cylinders at zero stroke, rocker and coupler, m.
    play : median radial clearance of a pin, m.
    play_spread : of the logarithm of the clearances.
    stroke_offset : of the constant error of a stroke sensor, m.
    repeatability : of what a stroke differs from one approach to the next, m.
    section : of the logarithm of the bending stiffness of a beam.
    spring : of the logarithm of the stiffness of the ground spring.
    """

    pivot: Length
    length: Length
    play: Clearance
    play_spread: Share
    stroke_offset: Length
    repeatability: Clearance
    section: Relative
    spring: Relative
