"""The elastic two-link arm in static equilibrium (Al-Khafaji and Jweeg 2017).

Both links are beams under their own weight. Link 1 is clamped at its joint angle to the ground,
link 2 to the end of link 1: the drives hold the joints. The second joint and the payload are masses
at the ends of the links.
"""

from dataclasses import dataclass
from typing import NamedTuple

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from flexik.errors import SolverError
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.machines.sections import Section
from flexik.multibody.beams import Array, Beam, Elements, discretise, nearest
from flexik.multibody.elements import PlacedBeam, hang, place_beam, solved, static_settings, weigh

# Newton's residual, N and N m: the last step falls far below it, onto the round-off floor
NEWTON_TOLERANCE = 1e-6

ELEMENT = "geometrically_exact"
POSITION, STRAIN = exu.OutputVariableType.Position, exu.OutputVariableType.StrainLocal


@dataclass(frozen=True)
class Tube:
    """Hollow rectangular section: `width`, `height` in the plane of bending and `wall`, in m."""

    width: float
    height: float
    wall: float

    @property
    def area(self) -> float:
        """Area, m2."""
        return self.width * self.height - self._inner_width * self._inner_height

    @property
    def second_moment(self) -> float:
        """Second moment of area about the bending axis, m4."""
        return (self.width * self.height**3 - self._inner_width * self._inner_height**3) / 12

    @property
    def _inner_width(self) -> float:
        return self.width - 2 * self.wall

    @property
    def _inner_height(self) -> float:
        return self.height - 2 * self.wall


@dataclass(frozen=True)
class FlexibleArm:
    """An arm whose equilibria can be computed.

    tube : section of both links.
    youngs_modulus, density : of both links, Pa and kg/m3.
    joint_mass : at the end of link 1, kg.
    gravity : m/s2, downwards.
    deflection_stations : abscissa on each link, m, whose deflection a gauge tells.
    strain_stations : abscissa on each link, m, whose axial strain a pair of gauges tells.
    n_elements : of each link; a station adds a node.
    """

    geometry: ArmGeometry
    tube: Tube
    youngs_modulus: float
    density: float
    joint_mass: float
    gravity: float
    deflection_stations: tuple[float, float]
    strain_stations: tuple[float, float]
    n_elements: int

    def mesh(self, link: int) -> Elements:
        """Finite elements of link 0 or 1."""
        length = self.geometry.lengths[link]
        ends = np.array([0.0, length])
        section = Section(ends, np.full(2, self.tube.second_moment), np.full(2, self.tube.area))
        span, mass = (0.0, length), self.density * self.tube.area * length
        beam = Beam(
            section, self.youngs_modulus, span, mass, length / 2, span, 0.0, self.n_elements
        )
        pins = self.deflection_stations[link], self.strain_stations[link]
        return discretise(beam, [pins])[0]


class Equilibria(NamedTuple):
    """Static equilibria of n samples; NaN where none was found.

    tip : (n, 2) in m.
    deformation : (n, 6) in m and rad, columns kinematics.elastic_arm.DEFORMATION.
    station_deflection : (n, 2) in m, across each link at its deflection station.
    axial_strain : (n, 2) of each link at its strain station.
    """

    tip: Array
    deformation: Array
    station_deflection: Array
    axial_strain: Array


def solve(
    arm: FlexibleArm, angles: Array, payload: Array
) -> tuple[Equilibria, dict[int, SolverError]]:
    """Equilibria at `angles` (n, 2) in rad with `payload` (n,) in kg, and the rows that failed.

    Each row is solved from the unloaded pose, so that no row depends on another.
    """
    angles, payload = np.atleast_2d(angles), np.atleast_1d(payload)
    found = Equilibria(*(np.full((len(angles), width), np.nan) for width in (2, 6, 2, 2)))
    failures: dict[int, SolverError] = {}
    model = ArmModel(arm)
    for k, (row, mass) in enumerate(zip(angles, payload, strict=True)):
        try:
            model.solve(row, float(mass))
        except SolverError as error:
            failures[k] = error
            continue
        for values, of_row in zip(found, model.equilibrium(), strict=True):
            values[k] = of_row
    return found, failures


def equilibria(arm: FlexibleArm, angles: Array, payload: Array) -> Equilibria:
    """Equilibria as by `solve`; raises the SolverError of the first row that fails."""
    found, failures = solve(arm, angles, payload)
    if failures:
        raise next(iter(failures.values()))
    return found


class ArmModel:
    """An Exudyn system that is placed at joint angles and solved for payloads."""

    def __init__(self, arm: FlexibleArm) -> None:
        self.arm = arm
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        self._meshes = tuple(arm.mesh(link) for link in (0, 1))
        self.links: tuple[PlacedBeam, ...] = tuple(
            place_beam(self.system, ELEMENT, mesh, np.zeros(2), 0.0) for mesh in self._meshes
        )
        for link, mesh in zip(self.links, self._meshes, strict=True):
            for node, mass in zip(link.nodes, mesh.node_mass, strict=True):
                self._hang(node, mass)
        self._hang(self.links[0].nodes[-1], arm.joint_mass)
        self._payload = self._hang(self.links[1].nodes[-1], 0.0)
        self._clamp()
        self.system.Assemble()
        self._angles = np.zeros(2)

    def solve(self, angles: Array, payload: float) -> None:
        """Find the equilibrium at `angles` (2,) in rad with `payload` in kg.

        Raises SolverError, naming them, where there is none.
        """
        self._angles = angles
        first, second = angles[0], angles[0] + angles[1]
        elbow = self.arm.geometry.lengths[0] * np.array([np.cos(first), np.sin(first)])
        self.links[0].move(np.zeros(2), float(first))
        self.links[1].move(elbow, float(second))
        weigh(self.system, self._payload, payload, self.arm.gravity)
        self.system.AssembleInitializeSystemCoordinates()
        if not solved(self.system, _SETTINGS):
            degrees = ", ".join(f"{angle:.6g}" for angle in angles)
            raise SolverError(
                f"no static equilibrium at angles ({degrees}) rad with {payload:g} kg"
            )

    def equilibrium(self) -> Equilibria:
        """The last solution, of arrays without the axis of the samples."""
        arm, base, turned = self.arm, np.zeros(2), 0.0
        deformation: list[float] = []
        deflections, strains = [], []
        for k, (link, mesh) in enumerate(zip(self.links, self._meshes, strict=True)):
            turned += self._angles[k]
            axis = np.array([np.cos(turned), np.sin(turned)])
            across = np.array([-axis[1], axis[0]])
            rotation, at_end = link.rotation(-1), self._position(link.nodes[-1]) - base
            station = nearest(mesh.stations, arm.deflection_stations[k])
            at_station = self._position(link.nodes[station]) - base
            deformation += [
                float(at_end @ across),
                float(at_end @ axis) - arm.geometry.lengths[k],
                rotation - turned,
            ]
            deflections.append(float(at_station @ across))
            strains.append(self._strain(link, nearest(mesh.stations, arm.strain_stations[k])))
            base, turned = base + at_end, rotation
        return Equilibria(base, *(np.array(v) for v in (deformation, deflections, strains)))

    def _position(self, node: int) -> Array:
        return np.array(self.system.GetNodeOutput(node, POSITION)[:2])

    def _strain(self, link: PlacedBeam, station: int) -> float:
        """Axial strain of the element that begins at a station, which is the same all along it.

        At the end of the link, that of the last element.
        """
        element = link.objects[min(station, len(link.objects) - 1)]
        strain = self.system.GetObjectOutputBody(element, STRAIN, [0.0, 0.0, 0.0])
        return float(strain[0])

    def _clamp(self) -> None:
        """Hold the base of link 1, and the base of link 2 to the end of link 1.

        The coordinates of nodes count from the rigid pose, so those of the two ends at the second
        joint are equal, whatever its angle.
        """
        ground = self.system.AddNode(item.NodePointGround())
        fixed = self.system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        first, second = self.links
        for k in range(3):
            for held, moved in (
                (fixed, first.coordinate_marker(0, k)),
                (first.coordinate_marker(-1, k), second.coordinate_marker(0, k)),
            ):
                connector = item.ObjectConnectorCoordinate(markerNumbers=[held, moved])
                self.system.AddObject(connector)

    def _hang(self, node: int, mass: float) -> int:
        """Hang `mass` in kg on a node; returns the load."""
        marker = self.system.AddMarker({"markerType": "NodePosition", "nodeNumber": node})
        return hang(self.system, marker, mass, self.arm.gravity)


_SETTINGS = static_settings(NEWTON_TOLERANCE)
