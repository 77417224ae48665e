"""How far a machine as it was built may be from its file."""

from typing import Annotated

from pydantic import Field

from flexik.parameters.model import Model, Share

# Beyond these a number is in another unit, or slipped
Length = Annotated[float, Field(ge=0, le=0.02)]  # m
Clearance = Annotated[float, Field(ge=0, le=0.005)]  # m
Relative = Annotated[float, Field(ge=0, le=0.5)]


class Magnitudes(Model):
    """How far a machine as built may be off. Standard deviations, but for `play`.

    pivot : of every coordinate of a point where bodies are joined or driven, in the frame of its
        body, m; points at the origin of that frame are what the others are measured from.
    length : of cylinders at zero stroke, m.
    play : median radial clearance of a pin, m.
    play_spread : of the logarithm of the clearances.
    stroke_offset : of the constant error of a stroke sensor, m.
    repeatability : of what a stroke differs from one approach to the next, m.
    section : of the logarithm of the bending stiffness of a beam.
    spring : of the logarithm of the stiffness of a spring in a fixed joint.
    """

    pivot: Length
    length: Length
    play: Clearance
    play_spread: Share
    stroke_offset: Length
    repeatability: Clearance
    section: Relative
    spring: Relative
