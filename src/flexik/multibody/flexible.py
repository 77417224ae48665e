"""A planar machine of a file as what bends and weighs, and its meshes (NumPy only)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from flexik.errors import ParameterError, SolverError
from flexik.kinematics.loops import Linkage
from flexik.machines import bodies
from flexik.machines.planar import GROUND, Fixed, Joint, PlanarMachine, Revolute, Slide
from flexik.machines.sections import Array
from flexik.multibody.beams import Beam, Elements, discretise


@dataclass(frozen=True)
class FlexibleMachine:
    """A machine whose equilibria can be computed.

    refinement : every beam is cut into this many times its n_elements.
    near : see kinematics.loops.Linkage.

    Raises ParameterError where a constant is not known, or what the elements cannot do is asked of
    them.
    """

    machine: PlanarMachine
    refinement: int = 1
    near: Linkage | None = None

    def __post_init__(self) -> None:
        machine = self.machine
        if machine.free:
            raise ParameterError(f"{', '.join(machine.free)}: fit, expected a value by now")
        if machine.element == "ancf":
            self._check_ancf()

    def _check_ancf(self) -> None:
        """They have straight axes, do not shear, and tell a rotation by a slope, if upright."""
        machine, instead = self.machine, "expected element: geometrically_exact"
        if machine.shear == "included":
            raise ParameterError(f"shear: included, which elements ancf do not know; {instead}")
        for name, beam in machine.beams.items():
            if len(beam.axis) > 2:
                raise ParameterError(f"bodies.{name}.axis: elements ancf are straight; {instead}")
        held: dict[str, Joint] = {
            name: j for name, j in machine.joints.items() if isinstance(j, Fixed)
        }
        for drive in machine.drives.values():
            if isinstance(drive, Revolute):
                held[drive.joint] = machine.joints[drive.joint]
        for name, joint in held.items():
            inner, outer = (machine.located(end).body for end in joint.of)
            bends = [machine.beams[body] for body in (inner, outer) if body in machine.beams]
            if bends and (inner != GROUND or bends[0].axis[0][0] != bends[0].axis[1][0]):
                raise ParameterError(
                    f"joints.{name}: holds a beam that is not upright, by a rotation that elements "
                    f"ancf do not have; {instead}"
                )

    @cached_property
    def linkage(self) -> Linkage:
        """The rigid bodies."""
        return Linkage(self.machine, self.near)

    def like(self, machine: PlanarMachine) -> Self:
        """The same of a `machine` whose dimensions are a little off its own."""
        return replace(self, machine=machine, near=self.linkage)

    @cached_property
    def size(self) -> float:
        """How far from the origin of the ground its beams reach at most, about, m."""
        farthest = np.abs(self.linkage.starts[1][..., :2]).max()
        return float(farthest + max((np.ptp(b.span) for b in self.beams.values()), default=0.0))

    @cached_property
    def beams(self) -> dict[str, Beam]:
        """What bends, along its abscissa."""
        return {
            name: _bending(beam, self.machine.shear) for name, beam in self.machine.beams.items()
        }

    @cached_property
    def pads(self) -> list[tuple[Slide, tuple[str, str], tuple[Array, Array]]]:
        """Every slide with its bodies, inner first, and their pads."""
        slides = [j for j in self.machine.joints.values() if isinstance(j, Slide)]
        ends = [[self.machine.located(end) for end in slide.of] for slide in slides]
        return [
            (slide, (a.body, b.body), (np.array(a.point), np.array(b.point)))
            for slide, (a, b) in zip(slides, ends, strict=True)
        ]

    def tilt(self, name: str) -> float:
        """Angle of the markers on a body in its frame, rad: ANCF nodes turn with the axis."""
        beam = self.machine.beams.get(name)
        return beam.place(beam.start)[1] if beam and self.machine.element == "ancf" else 0.0

    def touched(self, poses: Array) -> Array:
        """Where pads touch with the bodies at `poses` (n, b, 3), (n, slides, 2, 2) in m.

        First that of the inner body, in the frame of the outer one, then the other way round.
        """
        found = np.empty((len(poses), len(self.pads), 2, 2))
        for k, (_, (inner, outer), (first, second)) in enumerate(self.pads):
            a, b = (poses[:, self.linkage.names.index(name)] for name in (inner, outer))
            found[:, k, 0], found[:, k, 1] = _seen_from(b, a, first), _seen_from(a, b, second)
        return found

    def meshes(self, touched: Array, names: Sequence[str]) -> list[dict[str, Elements]]:
        """Meshes of the beams `names` with pads at `touched` (n, slides, 2, 2)."""
        found = []
        for name in names:
            beam = self.machine.beams[name]
            fixed = np.tile(stations_of(beam), (len(touched), 1))
            feet = [
                feet_of(beam, points)
                for k, (_, (inner, outer), _) in enumerate(self.pads)
                for body, points in ((outer, touched[:, k, 0]), (inner, touched[:, k, 1]))
                if body == name
            ]
            pins = [tuple(row) for row in np.column_stack([fixed, *feet]).tolist()]
            found.append(discretise(self.beams[name], pins, self.refinement))
        if not found:
            return [{} for _ in touched]
        return [dict(zip(names, row, strict=True)) for row in zip(*found, strict=True)]

    @property
    def sliding(self) -> list[str]:
        """Beams whose mesh follows pads."""
        return [name for name in self.beams if any(name in names for _, names, _ in self.pads)]


def failed(machine: FlexibleMachine, values: Array, what: str) -> SolverError:
    """An error at coordinates (k,)."""
    given = zip(machine.machine.drives, values.tolist(), strict=True)
    return SolverError(f"{what} at {', '.join(f'{name} {value:.6g}' for name, value in given)}")


def _bending(beam: bodies.Beam, shear: str) -> Beam:
    """A beam of the file along its abscissa."""
    section, factor = beam.profile(), beam.stiffness_factor
    assert isinstance(factor, float)
    section = replace(section, second_moment=factor * section.second_moment)
    found = Beam(
        section,
        beam.youngs_modulus,
        beam.span,
        1.0,
        0.0,
        beam.mass_span or beam.span,
        0.0,
        beam.n_elements,
    )
    if beam.shear_coefficient is not None and shear == "included":
        found = replace(found, shear=2 * (1 + beam.poisson) / beam.shear_coefficient)
    if beam.density is not None:
        area, area_x = found.integrals(np.array(beam.span))[4:6, -1].tolist()
        return replace(found, mass=beam.density * area, centre_of_mass=area_x / area)
    assert beam.mass is not None and beam.centre is not None
    return replace(found, mass=beam.mass, centre_of_mass=beam.foot(beam.centre)[0])


def stations_of(beam: bodies.Beam) -> list[float]:
    """Abscissas of corners, then of the points beside the axis, m."""
    corners = beam.start + np.cumsum(np.hypot(*np.diff(beam.axis, axis=0).T))[:-1]
    low, high = beam.span
    feet = [beam.foot(point)[0] for point in beam.points.values()]
    return [*corners.tolist(), *(x for x in feet if low <= x <= high)]


def feet_of(beam: bodies.Beam, points: Array) -> Array:
    """Abscissas (n,) of the places on the axis nearest to `points` (n, 2), m."""
    if len(beam.axis) > 2:
        return np.array([beam.foot((x, y))[0] for x, y in points.tolist()])
    first, last = np.array(beam.axis)
    along = (last - first) / np.hypot(*(last - first))
    return np.asarray(beam.start + (points - first) @ along, dtype=float)


def places_of(beam: bodies.Beam, stations: Array) -> Array:
    """Points (m, 2) of the axis at `stations` (m,), in the frame of the body."""
    corners = np.array(beam.axis)
    if len(corners) == 2:
        low, high = beam.span
        return corners[0] + (stations - low)[:, None] / (high - low) * (corners[1] - corners[0])
    at = beam.start + np.append(0.0, np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))
    return np.column_stack([np.interp(stations, at, corners[:, k]) for k in (0, 1)])


def hung_at(beam: bodies.Beam, mesh: Elements) -> Array:
    """Where the masses of the nodes hang, (m + 1, 2) in m, in the frame of the body."""
    places = places_of(beam, mesh.stations + mesh.mass_ahead)
    if beam.centre is None:
        return places
    return places + (np.array(beam.centre) - mesh.node_mass @ places / mesh.node_mass.sum())


def _seen_from(outer: Array, inner: Array, point: Array) -> Array:
    """Point (2,) of a body at poses `inner` (n, 3), in the frame of one at `outer` (n, 3)."""
    c, s = np.cos(inner[:, 2]), np.sin(inner[:, 2])
    x = inner[:, 0] + c * point[0] - s * point[1] - outer[:, 0]
    y = inner[:, 1] + s * point[0] + c * point[1] - outer[:, 1]
    c, s = np.cos(outer[:, 2]), np.sin(outer[:, 2])
    return np.column_stack([c * x + s * y, c * y - s * x])
