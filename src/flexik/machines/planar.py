"""A planar flexible manipulator as a file data/machines/NAME.yaml describes it.

Units: m, kg, N, Pa, rad; an angle may stand in degrees under its key with `_degrees` appended. The
ground has x forward and y up. Every body has a frame of its own, in which its points, its axis and
its centre of mass are given. Names are small letters, digits and underscores; a point of a body is
written `body.point`, and the ground is the body `ground`.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from flexik.errors import DataError, ParameterError
from flexik.machines.bodies import (
    NAME,
    Angle,
    Angled,
    Beam,
    Coordinate,
    Free,
    Length,
    Mass,
    Name,
    Point,
    Reference,
    Rigid,
)
from flexik.parameters.model import Model, check_increase, plausible
from flexik.parameters.reading import read_yaml, validated

GROUND = "ground"
# A section table, constant beyond its ends, may end before its beam by this share of its length
UNCOVERED = 0.01
# What a beam weighs by the volume of its section, kg/m3: from foam to steel with many fittings
DENSITIES = (100.0, 1e5)
# A mass below this share of the machine's is most likely in tonnes
LIGHTEST = 5e-5


Pair = tuple[Reference, Reference]


class Springs(Model):
    """What gives way in a fixed joint: a value or `fit`; not given: it is rigid.

    torsion : N m/rad.
    x, y : N/m, along the axes of the inner body's frame.
    """

    torsion: Free | None = None
    x: Free | None = None
    y: Free | None = None


class _Joint(Angled):
    """What all joints have.

    of : the two points that it joins, of the inner and of the outer body.
    """

    of: Pair


class Pin(_Joint):
    """The two points are one; the bodies turn about it."""

    kind: Literal["pin"]


class Fixed(_Joint):
    """The two points are one, and the outer body stands at an angle to the inner one.

    angle : of the outer body's frame from the inner one's, rad.
    springs : what gives way; not given: nothing.
    """

    kind: Literal["fixed"]
    angle: Angle = 0.0
    springs: Springs = Springs()


class Slide(_Joint):
    """The outer body slides straight along the inner one at `angle` to it, on two pads.

    of : the pads. That of the inner body touches the outer body, on a line along `direction` in the
        inner one's frame; the other touches the inner body, on that line too. A telescope drive
        acts on the outer body's pad.
    angle : of the outer body's frame from the inner one's, rad.
    direction : of sliding, in the frame of the inner body.
    """

    kind: Literal["slide"]
    angle: Angle = 0.0
    direction: Angle = 0.0


class _Drive(Angled):
    """What all drives have.

    limits : least and largest coordinate, m or rad.
    """

    limits: tuple[float, float]

    @model_validator(mode="after")
    def _increases(self) -> Self:
        check_increase(self, "limits")
        return self


class Cylinder(_Drive):
    """Links two points of two bodies, retracted + stroke apart; the stroke is its coordinate.

    of : the two points.
    retracted : distance of the points at stroke 0, m.
    masses : kg that hang on the first and on the second point: what the cylinder weighs.
    """

    kind: Literal["cylinder"]
    of: Pair
    retracted: Length
    limits: Point
    masses: tuple[Mass, Mass] = (0.0, 0.0)

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if not self.retracted + self.limits[0] > 0:
            raise ValueError("limits.0: expected more than minus its retracted length")
        return self


class Telescope(_Drive):
    """Moves the outer body of a slide; the stroke is its coordinate.

    joint : name of the slide.
    of : points of its inner and of its outer body; the second lies retracted + stroke ahead of the
        first, along the slide.
    retracted : how far ahead it is at stroke 0, m.
    """

    kind: Literal["telescope"]
    joint: Name
    of: Pair
    retracted: Coordinate = 0.0
    limits: Point


class Revolute(_Drive):
    """Turns the outer body of a pin by zero + coordinate from the inner one.

    joint : name of the pin.
    zero : angle of the outer body's frame from the inner one's at coordinate 0, rad.
    """

    kind: Literal["revolute"]
    joint: Name
    zero: Angle = 0.0
    limits: tuple[Angle, Angle]


Body = Annotated[Beam | Rigid, Field(discriminator="kind")]
Joint = Annotated[Pin | Fixed | Slide, Field(discriminator="kind")]
Drive = Annotated[Cylinder | Telescope | Revolute, Field(discriminator="kind")]


class Located(NamedTuple):
    """A body's name and a point in its frame, m."""

    body: str
    point: Point


class PlanarMachine(Angled):
    """The whole machine.

    title : what it is, for reports.
    gravity : downwards, m/s2.
    element : of all beams, see multibody.elements.
    shear : whether beams shear; `included` needs the shear_coefficient of every beam.
    kinematics : `general`, or the closed form of a machine whose bodies and points bear its names.
    ground : points of the ground by name, x forward and y up, m.
    bodies : beams and rigid bodies by name; the ground is none of these.
    joints : what joins two bodies, by name.
    drives : cylinders and the like by name, in the order of the actuator coordinates; one to six.
    payload : the tip, where the payload hangs, a body.point.
    notes : sources and assumptions that the report tells.
    instruments : what measures the machine, if a case reads it; nothing here does.
    smallest_first : the drive whose coordinate the inverse keeps as small as it can where there is
        more than one solution; not given: the solution nearest to the current one.
    """

    title: Annotated[str, Field(min_length=1)]
    gravity: Annotated[float, Field(gt=0), plausible(0.1, 30.0, "m/s2")]
    element: Literal["geometrically_exact", "ancf"] = "geometrically_exact"
    shear: Literal["neglected", "included"] = "neglected"
    kinematics: Literal["general", "crane", "elastic_arm"] = "general"
    ground: Annotated[dict[Name, Point], Field(min_length=1)]
    bodies: Annotated[dict[Name, Body], Field(min_length=1)]
    joints: Annotated[dict[Name, Joint], Field(min_length=1)]
    drives: Annotated[dict[Name, Drive], Field(min_length=1, max_length=6)]
    payload: Reference
    notes: tuple[str, ...] = ()
    instruments: Any = None
    smallest_first: Name | None = None

    @property
    def beams(self) -> dict[str, Beam]:
        """The bodies that bend."""
        return {name: body for name, body in self.bodies.items() if isinstance(body, Beam)}

    @property
    def section_files(self) -> dict[str, str]:
        """Files of section tables by beam."""
        kinds = {name: beam.section for name, beam in self.beams.items()}
        return {name: kind.file for name, kind in kinds.items() if kind.kind == "table"}

    def masses(self) -> dict[str, tuple[str, Point, float]]:
        """What weighs by dotted key: body, point in its frame, kg.

        Raises DataError if a section cannot be read.
        """
        found: dict[str, tuple[str, Point, float]] = {}
        for name, body in self.bodies.items():
            mass, centre = body.weight()
            found[f"bodies.{name}.mass"] = (name, centre, mass)
            for point, further in body.masses.items():
                found[f"bodies.{name}.masses.{point}"] = (name, body.points[point], further)
        for name, drive in self.drives.items():
            if isinstance(drive, Cylinder):
                for k, (end, mass) in enumerate(zip(drive.of, drive.masses, strict=True)):
                    found[f"drives.{name}.masses.{k}"] = (*self.located(end), mass)
        return found

    def located(self, reference: str) -> Located:
        """Body and point of `body.point`; raises ValueError if there is none."""
        body, _, point = reference.partition(".")
        known = {GROUND: self.ground, **{name: b.points for name, b in self.bodies.items()}}
        if body not in known:
            raise ValueError(f"there is no body {body!r}; known are {', '.join(known)}")
        if point not in known[body]:
            raise ValueError(f"{body} has no point {point!r}; it has {', '.join(known[body])}")
        return Located(body, known[body][point])

    @property
    def free(self) -> list[str]:
        """Dotted keys of the constants that are to be fitted."""
        return [".".join(key) for key, value in _leaves(self.model_dump()) if value == "fit"]

    def with_constants(self, constants: Mapping[str, Any]) -> "PlanarMachine":
        """The same with values for dotted keys; raises ParameterError if one is no such key."""
        data = self.model_dump()
        for key, value in constants.items():
            *outer, last = key.split(".")
            inside: Any = data
            for part in outer:
                inside = inside.get(part) if isinstance(inside, dict) else None
            if not isinstance(inside, dict) or last not in inside:
                raise ParameterError(f"constants: {key}: the machine has no such key")
            inside[last] = value
        return validated(PlanarMachine, data, lambda keys: ("constants", ".".join(keys)))

    @model_validator(mode="after")
    def _refers_to_what_there_is(self) -> Self:
        if GROUND in self.bodies:
            raise ValueError(f"bodies.{GROUND}: this name is the ground's")
        for group in ("joints", "drives"):
            for name, part in getattr(self, group).items():
                self._check_pair(f"{group}.{name}", part)
        driven: dict[str, str] = {}
        for name, drive in self.drives.items():
            if (joint := getattr(drive, "joint", None)) in driven:
                raise ValueError(
                    f"drives.{name}.joint: {joint} is driven by {driven[joint]} already"
                )
            driven |= {} if joint is None else {joint: name}
        for name, body in self.bodies.items():
            for point in body.masses:
                if point not in body.points:
                    known = ", ".join(body.points)
                    raise ValueError(
                        f"bodies.{name}.masses.{point}: the body has no such point, only {known}"
                    )
        for name, beam in self.beams.items():
            if self.shear == "included" and beam.shear_coefficient is None:
                raise ValueError(f"bodies.{name}.shear_coefficient: missing, and shear is included")
        self._check_end(self.payload, "payload")
        if self.smallest_first is not None and self.smallest_first not in self.drives:
            raise ValueError(
                f"smallest_first: expected the name of a drive ({', '.join(self.drives)}), got "
                f"{self.smallest_first}"
            )
        return self

    def _check_end(self, reference: str, key: str) -> str:
        try:
            return self.located(reference).body
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None

    def _check_pair(self, key: str, part: Any) -> None:
        wanted = {"telescope": "slide", "revolute": "pin"}.get(part.kind)
        if wanted:
            joint = self.joints.get(part.joint)
            if joint is None or joint.kind != wanted:
                known = [name for name, other in self.joints.items() if other.kind == wanted]
                raise ValueError(
                    f"{key}.joint: expected the name of a {wanted} ({', '.join(known) or 'none'}), "
                    f"got {part.joint}"
                )
        if part.kind == "revolute":
            return
        ends = [self._check_end(end, f"{key}.of") for end in part.of]
        if ends[0] == ends[1]:
            raise ValueError(f"{key}.of: both points belong to {ends[0]}")
        if wanted and ends != [end.partition(".")[0] for end in self.joints[part.joint].of]:
            raise ValueError(f"{key}.of: expected points of the two bodies of its joint, in order")


def read_machine(path: Path | str) -> PlanarMachine:
    """The machine in the file `path`, which may lie anywhere; tables are found from here.

    Raises ParameterError, one line a mistake, that names file, key and what was expected.
    """
    stem = Path(path).stem
    if not re.fullmatch(NAME, stem):
        raise ParameterError(f"{path}: the file's name must be small letters, digits and _")
    machine = validated(PlanarMachine, read_yaml(path), lambda keys: (str(path), ".".join(keys)))
    if wrong := faults(machine):
        raise ParameterError("\n".join(f"{path}: {line}" for line in wrong))
    return machine


def faults(machine: PlanarMachine) -> list[str]:
    """What is wrong with sections and masses, a line a mistake that names the key."""
    wrong = [line for name in machine.beams for line in _wrong_sections(machine, name)]
    return wrong or _wrong_masses(machine)


def _wrong_masses(machine: PlanarMachine) -> list[str]:
    masses = {key: mass for key, (_, _, mass) in machine.masses().items()}
    total = sum(masses.values())
    return [
        f"{key}: expected kg, {mass:g} of {total:.4g} in all ({mass:g} t would be {1e3 * mass:g})"
        for key, mass in masses.items()
        if 0.0 < mass < LIGHTEST * total
    ]


def _wrong_sections(machine: PlanarMachine, name: str) -> list[str]:
    """What is wrong with the section of a beam and with what it weighs."""
    beam, key = machine.beams[name], f"bodies.{name}"
    low, high = beam.span
    try:
        section = beam.profile()
    except DataError as error:
        return [f"{key}.section.file: {error}"]
    x, slack = section.abscissa, UNCOVERED * (high - low)
    if x[0] > low + slack or x[-1] < high - slack:
        covered = f"{x[0]:g} to {x[-1]:g} m"
        return [f"{key}.section: expected a table from {low:g} to {high:g} m, it covers {covered}"]
    radius = np.sqrt(section.second_moment / section.area).max()
    if radius > high - low:
        millimetres = "; are these mm4 and mm2?" if 1e-3 * radius < high - low else ""
        return [
            f"{key}.section: sqrt(Iz/A) = {radius:g} m is more than the beam's length{millimetres}"
        ]
    volume = float(beam.slices()[1].sum()) / (beam.density or 1.0)
    mean, kilograms = (beam.mass or 0.0) / volume, beam.mass or 0.0
    if kilograms and not DENSITIES[0] <= mean <= DENSITIES[1]:
        in_tonnes = (
            f" ({kilograms:g} t would be {1e3 * kilograms:g})" if mean < DENSITIES[0] else ""
        )
        return [
            f"{key}.mass: expected kg, {kilograms:g} is {mean:.3g} kg/m3 of its section{in_tonnes}"
        ]
    return []


def _leaves(data: Any, key: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], Any]]:
    """Values that are no mappings, under their keys."""
    if not isinstance(data, dict):
        return [(key, data)]
    return [leaf for name, value in data.items() for leaf in _leaves(value, (*key, str(name)))]
