"""The section `crane` of params.yaml."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from flexik.kinematics.crane import CraneGeometry
from flexik.kinematics.machine_file import crane_geometry
from flexik.parameters.conditions import Points, RandomTargets, check_different
from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    Name,
    NotNegative,
    Positive,
    Seed,
    Vector,
)
from flexik.planar import section as planar
from flexik.planar.measured.section import Measured
from flexik.planar.section import SAME, PlanarNetwork, PlanarSection, check
from flexik.planar.study_section import (
    CorrectionStudy,
    LearningCurves,
    PhysicsStudy,
    check_curves,
    check_physics,
)
from flexik.positioning.inverted_network import InvertedSettings

__all__ = ["Section", "check"]

# The one free constant of the machine file
SPRING = "joints.slew.springs.torsion"

# The published test conditions [chapter 4], as far as they are known: see `conditions` there
PUBLISHED = Points(
    points=[
        *[(1.0, 7.0), (2.0, 7.0), (1.0, 6.0), (1.0, -2.0), (2.0, 2.0), (2.0, -3.95), (6.0, -1.0)],
        *[(6.0, 3.0), (4.0, 5.0), (3.0, -1.0), (4.0, 1.0), (4.0, -3.0), (1.0, 0.0), (4.0, 3.0)],
        *[(6.0, 1.0), (3.0, 4.0), (3.0, 6.0), (5.0, -2.0), (5.0, 0.0), (5.0, 2.0), (5.0, 4.0)],
        *[(1.0, -3.0), (1.0, -1.0), (1.0, 1.0), (1.0, 2.0)],
    ],
    payloads=[30.0, 120.0, 260.0, 310.0, 470.0],
)


class Calibration(planar.Calibration):
    """Of the ground spring; conditions: what the published mean error belongs to."""

    conditions: Points | Name = PUBLISHED


class MeshStudy(Model):
    """Random samples on meshes of every beam cut into so many times its elements."""

    n_samples: Count
    refinements: Annotated[list[Count], Field(min_length=2)]
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.refinements != sorted(set(self.refinements)):
            raise ValueError("refinements: must increase, the last one being the reference")
        return self


class Shape(Model):
    """Sample drawn in the picture of the crane: strokes in m, payload in kg."""

    strokes: tuple[NotNegative, NotNegative, NotNegative]
    payload: NotNegative
    exaggeration: Positive


class Fitting(Model):
    """Networks of several sizes on a thinned grid, along the lift stroke at the other values."""

    n_samples: Count
    n_hidden: Annotated[list[Count], Field(min_length=1)]
    jib: NotNegative
    extension: NotNegative
    payload: NotNegative
    trainer: Name = "study"
    seed: Seed = 1


class ToleranceStudy(Model):
    """Tolerances tried with each of `methods`, names of methods that invert a network."""

    methods: Annotated[list[Name], Field(min_length=1)]
    tolerances: Annotated[list[Positive], Field(min_length=1)]

    @model_validator(mode="after")
    def _different(self) -> Self:
        for name in ("methods", "tolerances"):
            check_different(name, getattr(self, name))
        return self


class PointStudy(Model):
    """Test points drawn anew: those `named` in the thesis, and whole metres of the area x, y.

    methods : those that are judged on each draw, besides `none`.
    """

    named: Annotated[list[Vector], Field(min_length=1)]
    x: Interval = (1.0, 6.0)
    y: Interval = (-4.0, 7.0)
    methods: Annotated[list[Name], Field(min_length=1)]
    n_draws: Annotated[Count, Field(le=10_000)] = 100
    seed: Seed = 4


class Studies(Model):
    """What varies one thing."""

    corrections: CorrectionStudy
    points: PointStudy
    mesh: MeshStudy
    shape: Shape
    fitting: Fitting
    tolerance: ToleranceStudy
    learning_curves: LearningCurves | None = None
    physics: PhysicsStudy | None = None
    measured: Measured


class Section(PlanarSection):
    """The log crane."""

    calibration: Calibration
    studies: Studies

    @property
    def geometry(self) -> CraneGeometry:
        """Dimensions of the machine."""
        return crane_geometry(self.machine)

    @property
    def measured(self) -> Measured:
        """Studies of the measured crane."""
        return self.studies.measured

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.machine.kinematics != "crane":
            raise ValueError("machine.kinematics: expected crane, of which this case is")
        if self.machine.free != [SPRING]:
            raise ValueError(
                f"machine.{SPRING}: expected fit, and a value for everything else; a known value "
                "stands under calibration.known"
            )
        for name, kind in (("published", Points), ("workspace", RandomTargets)):
            if not isinstance(self.conditions.get(name), kind):
                raise ValueError(f"conditions.{name}: expected {kind.__name__}, which is reported")
        self._check_shape()
        self._check_fitting()
        self._check_methods()
        check_curves(self, self.studies.learning_curves)
        check_physics(self, self.studies.physics)
        return self

    def _check_shape(self) -> None:
        for stroke, (name, drive) in zip(
            self.studies.shape.strokes, self.machine.drives.items(), strict=True
        ):
            if stroke > drive.limits[1] + SAME:
                raise ValueError(
                    f"studies.shape.strokes: {name} beyond the cylinder, {drive.limits[1]} m"
                )

    def _check_fitting(self) -> None:
        fitting, grid = self.studies.fitting, self.samples.grid
        for name in ("jib", "extension", "payload"):
            axis, value = grid[name], getattr(fitting, name)
            steps = (value - axis.minimum) / axis.increment
            if not axis.minimum <= value <= axis.maximum or abs(steps - round(steps)) > 1e-6:
                raise ValueError(f"studies.fitting.{name}: {value} is no value of the grid")
        n_vectors = math.prod(axis.n_values for axis in grid.values())
        if fitting.n_samples > n_vectors:
            raise ValueError(f"studies.fitting.n_samples: the grid has {n_vectors} vectors")
        if fitting.trainer not in self.trainers:
            raise ValueError(f"studies.fitting.trainer: there is no trainer {fitting.trainer!r}")

    def _check_methods(self) -> None:
        for key, names in (
            ("corrections.methods", self.studies.corrections.methods),
            ("points.methods", self.studies.points.methods),
        ):
            for number, name in enumerate(names):
                if name not in self.methods:
                    raise ValueError(f"studies.{key}.{number}: there is no method {name!r}")
        if self.studies.corrections.conditions not in self.conditions:
            raise ValueError("studies.corrections.conditions: there are no such conditions")
        needed = {
            f"tolerance.methods.{number}": (name, InvertedSettings)
            for number, name in enumerate(self.studies.tolerance.methods)
        }
        for key, (name, kind) in needed.items():
            known = [other for other, given in self.methods.items() if isinstance(given, kind)]
            known = [n for n in known if isinstance(self._network_of(n), PlanarNetwork)]
            if name not in known:
                raise ValueError(
                    f"studies.{key}: {name!r} is none of the methods that serve, "
                    f"{', '.join(known) or 'of which there is none'}"
                )

    def _network_of(self, method: str) -> object:
        return self.networks.get(self.methods[method].network or "")
