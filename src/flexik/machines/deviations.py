"""How far a machine as it was built may be from its file."""

from typing import Annotated

from pydantic import Field

from flexik.parameters.model import Model, Share

# Beyond these a number is in another unit, or slipped
Length = Annotated[float, Field(ge=0, le=0.02)]  # m
Clearance = Annotated[float, Field(ge=0, le=0.005)]  # m
Angle = Annotated[float, Field(ge=0, le=0.02)]  # rad
Relative = Annotated[float, Field(ge=0, le=0.5)]

Known = Field(gt=0)  # an expectation of zero would leave nothing to identify


class Deviations(Model):
    """Standard deviations by kind, but for `play`; the values are engineering judgement.

    pivot : of every coordinate of a point where bodies are joined or driven or the payload hangs,
        in the frame of its body, m: bored after welding, within 1 mm. Points at the origin of that
        frame are what the others are measured from.
    length : of cylinders at zero stroke, m: within 1 mm.
    play : median radial clearance of a pin, m: 40 mm pin, H9/d9.
    stroke_offset : of the constant error of a stroke sensor, m: zeroed within 1 mm.
    angle_offset : of that of the angle of a revolute drive, rad.
    repeatability : of what a stroke differs from one approach to the next, m: dead band and
        friction of the servo.
    angle_repeatability : the same of an angle, rad.
    section : of the logarithm of the bending stiffness of a beam: tolerances.
    spring : of the logarithm of the stiffness of a spring in a fixed joint.
    """

    pivot: Length = 0.3e-3
    length: Length = 0.3e-3
    play: Clearance = 0.06e-3
    stroke_offset: Length = 0.3e-3
    angle_offset: Angle = 0.3e-3
    repeatability: Clearance = 0.1e-3
    angle_repeatability: Angle = 0.05e-3
    section: Relative = 0.03
    spring: Relative = 0.05


class Magnitudes(Deviations):
    """Those that a machine as built is drawn with.

    play_spread : of the logarithm of the clearances: wear differs from pin to pin.
    """

    play_spread: Share = 0.3


class Expected(Deviations):
    """Those that an adaptation expects before measuring.

    measurement : of a measured coordinate, m.
    play_deviation : of the clearance of a pin, m.
    """

    measurement: Annotated[Length, Known] = 0.5e-3
    play_deviation: Annotated[Clearance, Known] = 0.02e-3
    pivot: Annotated[Length, Known] = 0.3e-3
    length: Annotated[Length, Known] = 0.3e-3
    stroke_offset: Annotated[Length, Known] = 0.3e-3
    angle_offset: Annotated[Angle, Known] = 0.3e-3
    section: Annotated[Relative, Known] = 0.03
    spring: Annotated[Relative, Known] = 0.05
