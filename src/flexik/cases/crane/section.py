"""The section `crane` of params.yaml."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from flexik.cases.crane.measured_section import Measured
from flexik.cases.crane.parts.measured.campaign_file import own_campaign
from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry, smallest_extension
from flexik.kinematics.machine_file import check_machine, crane_geometry
from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import ConditionSet, Points, RandomTargets, check_different
from flexik.parameters.model import Count, Model, Name, NotNegative, Positive, Seed, Share
from flexik.parameters.networks import Axis, Network, check_networks
from flexik.parameters.section import CaseSection
from flexik.positioning.combined import Settings as Combined
from flexik.positioning.inverted_network import InvertedSettings
from flexik.positioning.registry import Methods, check_methods

STROKES = ("lift", "jib", "extension")
# The one free constant of the machine file
SPRING = "joints.slew.springs.torsion"
# Strokes closer than this are the same, m
LENGTH_TOLERANCE = 1e-9

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


class Calibration(Model):
    """The ground spring: known, `stiffness` in N m/rad, or fitted between those of the range.

    conditions : what the published mean error without compensation belongs to.
    """

    stiffness: Positive | None = None
    stiffness_range: tuple[Positive, Positive] = (1e6, 1e9)
    conditions: Points = PUBLISHED

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.stiffness_range[0] >= self.stiffness_range[1]:
            raise ValueError("stiffness_range: must increase")
        return self


class Grid(Model):
    """Training grid, table 4.1; m and kg."""

    lift: Axis
    jib: Axis
    extension: Axis
    payload: Axis


class Selection(Model):
    """Random set that chooses among restarts."""

    n_samples: Count
    payload: tuple[NotNegative, NotNegative]
    seed: Seed


class Samples(Model):
    """Poses to learn from and to select by; left out are those with the tip behind a limit."""

    grid: Grid
    selection: Selection
    minimum_tip_x: float = 0.0
    maximum_failed_share: Share = 0.01


class CraneNetwork(Network):
    """A network of the crane."""

    learns: Literal["deflection", "tip", "rigid_tip", "coordinates"] | None = None


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


class Studies(Model):
    """What varies one thing."""

    mesh: MeshStudy
    shape: Shape
    fitting: Fitting
    tolerance: ToleranceStudy
    measured: Measured


class Section(CaseSection):
    """The log crane."""

    machine: PlanarMachine
    calibration: Calibration = Calibration()  # type: ignore[assignment]
    samples: Samples
    networks: Annotated[dict[Name, CraneNetwork], Field(min_length=1)]
    conditions: dict[Name, ConditionSet]
    methods: Methods
    studies: Studies

    @property
    def geometry(self) -> CraneGeometry:
        """Dimensions of the machine."""
        return crane_geometry(self.machine)

    @property
    def files(self) -> list[Path]:
        """Section tables, and a campaign of the user's own."""
        own = self.studies.measured.campaign.file
        tables = self.machine.section_files.values()
        return [Path(file) for file in (*tables, *([] if own is None else [own]))]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.machine.kinematics != "crane":
            raise ValueError("machine.kinematics: expected crane, of which this case is")
        if self.machine.free != [SPRING]:
            raise ValueError(
                f"machine.{SPRING}: expected fit, and a value for everything else; a known value "
                "stands under calibration.stiffness"
            )
        self._check_strokes()
        self._check_fitting()
        check_networks(self.networks, self.trainers)
        for name, network in self.networks.items():
            if network.corrects and self.networks[network.corrects].learns != "rigid_tip":
                raise ValueError(f"networks.{name}.corrects: expected a network of the rigid_tip")
            if len(network.layers) != 1:
                raise ValueError(f"networks.{name}.n_hidden: expected one layer")
        check_methods(self.methods, self.networks)
        self._check_methods()
        for name, kind in (("published", Points), ("workspace", RandomTargets)):
            if not isinstance(self.conditions.get(name), kind):
                raise ValueError(f"conditions.{name}: expected {kind.__name__}, which is reported")
        if taken := self.conditions.keys() & type(self.samples).model_fields.keys():
            raise ValueError(f"conditions.{min(taken)}: the name is taken")
        return self

    def _check_strokes(self) -> None:
        reach = dict(zip(STROKES, self.geometry.stroke_maximum, strict=True))
        for name, longest in reach.items():
            axis = getattr(self.samples.grid, name)
            if axis.minimum < 0.0 or axis.maximum > longest + LENGTH_TOLERANCE:
                raise ValueError(
                    f"samples.grid.{name}: lies beyond the cylinder, {longest} m at most"
                )
        shown = self.studies.shape.strokes
        for stroke, (name, longest) in zip(shown, reach.items(), strict=True):
            if stroke > longest:
                raise ValueError(
                    f"studies.shape.strokes: {name} beyond the cylinder, {longest} m at most"
                )

    def _check_fitting(self) -> None:
        fitting, grid = self.studies.fitting, self.samples.grid
        for name in ("jib", "extension", "payload"):
            axis, value = getattr(grid, name), getattr(fitting, name)
            steps = (value - axis.minimum) / axis.increment
            if not axis.minimum <= value <= axis.maximum or abs(steps - round(steps)) > 1e-6:
                raise ValueError(f"studies.fitting.{name}: {value} is no value of the grid")
        n_vectors = math.prod(getattr(grid, name).n_values for name in type(grid).model_fields)
        if fitting.n_samples > n_vectors:
            raise ValueError(f"studies.fitting.n_samples: the grid has {n_vectors} vectors")
        if fitting.trainer not in self.trainers:
            raise ValueError(f"studies.fitting.trainer: there is no trainer {fitting.trainer!r}")

    def _check_methods(self) -> None:
        if "none" not in self.methods:
            raise ValueError("methods.none: expected, the others are compared with it")
        needed = {
            f"tolerance.methods.{number}": (name, InvertedSettings)
            for number, name in enumerate(self.studies.tolerance.methods)
        } | {
            f"measured.{key}.method": (name, Combined)
            for key, name in self.studies.measured.methods.items()
        }
        for key, (name, kind) in needed.items():
            known = [other for other, given in self.methods.items() if isinstance(given, kind)]
            if name not in known:
                raise ValueError(
                    f"studies.{key}: {name!r} is none of the methods that serve, "
                    f"{', '.join(known) or 'of which there is none'}"
                )


def check(section: Section) -> None:
    """The machine is one, targets are reached.

    Raises ParameterError naming the key.
    """
    geometry = section.geometry
    try:
        check_machine(section.machine)
    except ValueError as error:
        raise ParameterError(f"{section.machine_file}: {error}") from None
    measured = section.studies.measured
    sets = {f"conditions.{name}": given for name, given in section.conditions.items()} | {
        "calibration.conditions": section.calibration.conditions,
        "studies.measured.campaign": measured.campaign,
        "studies.measured.adaptation": measured.adaptation,
    }
    for key, given in sets.items():
        if isinstance(given, Points):
            points = np.array(given.points)
            missed = np.flatnonzero(np.isnan(smallest_extension(geometry, points)))
            if missed.size:
                x, y = points[missed[0]]
                others = f", nor {missed.size - 1} others" if missed.size > 1 else ""
                raise ParameterError(
                    f"params.yaml: {section.name}.{key}.points.{missed[0]}: the rigid crane does "
                    f"not reach ({x:g}, {y:g}) m{others}"
                )
            continue
        x, y = (axis.ravel() for axis in np.meshgrid(*(np.linspace(*a, 60) for a in _area(given))))
        raster = np.column_stack([x, y])[x >= section.samples.minimum_tip_x]
        if np.isnan(smallest_extension(geometry, raster)).all():
            raise ParameterError(
                f"params.yaml: {section.name}.{key}: the crane reaches nothing in x, y"
            )
    if measured.campaign.file is not None:
        own_campaign(measured.campaign.file, geometry)


def _area(given: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    return given.x, given.y
