"""The flexible log crane in static equilibrium (Rouvinen 1999, chapters 2.3 and 3.2).

Pillar, lift arm, jib and extension are beams; cylinders, rocker and coupler are rigid; the
extension slides in the jib on two pads; a torsion spring holds the pillar to the ground.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from flexik.errors import SolverError
from flexik.mechanisms.crane import CraneGeometry, CranePose, Vector, pose
from flexik.multibody.elements import PlacedBeam, place_beam
from flexik.multibody.structure import Array, Beam, discretise

# Newton's residual, N and N m: it falls quadratically onto a round-off floor of about 1e-4 (stiff
# axial terms); one step after passing this tolerance the solution is on the floor
NEWTON_TOLERANCE = 1e-2

# Share of the load below which a stubborn equilibrium is given up
SMALLEST_LOAD_STEP = 0.05

BEAMS = ("pillar", "lift", "jib", "extension")


@dataclass(frozen=True)
class Rod:
    """A rigid two-pin link: mass in kg and distance of its centre from its first pin in m."""

    mass: float
    centre_of_mass: float


@dataclass(frozen=True)
class CraneStructure:
    """What bends and weighs. Lengths in m, masses in kg.

    axis_height : height of the lift and jib axes above B and G in the lift and jib frames.

    The front pad sits at the end of the jib, the rear pad at the rear end of the extension.
    """

    pillar: Beam
    lift: Beam
    jib: Beam
    extension: Beam
    rocker: Rod
    coupler: Rod
    lift_axis_height: float
    jib_axis_height: float
    gravity: float

    @property
    def front_pad(self) -> float:
        """Abscissa of the front pad, jib frame."""
        return self.jib.span[1]

    @property
    def extension_length(self) -> float:
        """Rear end to tip."""
        return self.extension.span[1] - self.extension.span[0]


@dataclass(frozen=True)
class FlexibleCrane:
    """A crane whose equilibria can be computed.

    spring_stiffness : of the ground connection, N m/rad.
    element : one of multibody.elements.ELEMENTS.
    refinement : every beam is cut into this many times its n_elements.
    """

    geometry: CraneGeometry
    structure: CraneStructure
    spring_stiffness: float
    element: str = "geometrically_exact"
    refinement: int = 1


@dataclass(frozen=True)
class Equilibrium:
    """One static equilibrium.

    tip : (2,) in m.
    shapes : node positions (k, 2) in m by beam.
    forces : tension in N of lift_cylinder, jib_cylinder, rocker and coupler, and the push of the
        front_pad on the extension along the jib's upward normal.
    reaction : force (x, y) in N and moment in N m of the ground on the pillar.
    """

    tip: Array
    shapes: dict[str, Array]
    forces: dict[str, float]
    reaction: Array


def solve(
    crane: FlexibleCrane, strokes: Array, payload: Array
) -> tuple[Array, dict[int, SolverError]]:
    """Tip (n, 2) in m at `strokes` (n, 3) in m with `payload` (n,) in kg, and the rows that failed.

    Rows in a run of equal strokes are solved one from the other; rows in a run of equal extension
    share one system. Each run of strokes starts from the unloaded pose. A row without equilibrium
    holds NaN and is in the second result, with an error that names its strokes and payload.
    """
    strokes, payload = np.atleast_2d(strokes), np.atleast_1d(payload)
    result = np.full((len(strokes), 2), np.nan)
    failures: dict[int, SolverError] = {}
    model: CraneModel | None = None
    for k, (row, mass) in enumerate(zip(strokes, payload, strict=True)):
        if model is None or row[2] != model.extension:
            model = CraneModel(crane, float(row[2]))
        try:
            if not np.array_equal(row, model.strokes):
                model.place(row)
            model.solve(float(mass))
            result[k] = model.tip()
        except SolverError as error:
            failures[k] = error
    return result, failures


def tips(crane: FlexibleCrane, strokes: Array, payload: Array) -> Array:
    """Tip (n, 2) in m as by `solve`; raises the SolverError of the first row that fails."""
    result, failures = solve(crane, strokes, payload)
    if failures:
        raise next(iter(failures.values()))
    return result


def equilibrium(
    crane: FlexibleCrane, strokes: Sequence[float] | Array, payload: float
) -> Equilibrium:
    """Solve one sample and read shapes and forces; raises SolverError as `tips` does."""
    model = CraneModel(crane, float(strokes[2]))
    model.place(np.asarray(strokes, dtype=float))
    model.solve(payload)
    return model.equilibrium()


def reference_shapes(crane: FlexibleCrane, strokes: Sequence[float] | Array) -> dict[str, Array]:
    """Node positions (k, 2) in m by beam in the rigid pose at `strokes` (3,) in m."""
    model = CraneModel(crane, float(strokes[2]))
    model.place(np.asarray(strokes, dtype=float))
    return {name: beam.shape() for name, beam in model.beams.items()}


class CraneModel:
    """An Exudyn system for one extension stroke (m), placed at strokes and solved for payloads.

    The extension fixes where the pads meet the beams, hence the mesh; lift and jib stroke only turn
    the reference configuration, which costs far less than a new system.
    """

    def __init__(self, crane: FlexibleCrane, extension: float) -> None:
        self.crane, self.extension = crane, extension
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        self._weights: list[tuple[int, float]] = []
        rigid = pose(crane.geometry, np.array([[0.0, 0.0, extension]]))
        self.beams = self._place_beams(rigid)
        self._head = self.system.AddNode(item.NodePoint2D())
        self._supports = self._support_pillar()
        self._connectors = self._connect()
        self._payload_load = self._load()
        self.strokes = np.full(3, np.nan)

    def place(self, strokes: Array) -> None:
        """Move the reference configuration to the rigid pose at `strokes` (3,) in m.

        Raises SolverError where the linkage cannot be assembled.
        """
        rigid = pose(self.crane.geometry, strokes[None])
        if not np.isfinite(rigid.tip).all():
            raise SolverError(f"strokes {_listed(strokes)} m: the linkage cannot be assembled")
        self.strokes = strokes
        for name, (origin, angle) in self._frames(rigid).items():
            self.beams[name].move(origin, angle)
        self.system.SetNodeParameter(self._head, "referenceCoordinates", list(rigid.rocker_head[0]))
        geometry = self.crane.geometry
        for name, length in (
            ("lift_cylinder", geometry.lift_cylinder_length + strokes[0]),
            ("jib_cylinder", geometry.jib_cylinder_length + strokes[1]),
        ):
            self.system.SetObjectParameter(self._connectors[name], "distance", length)
        self.system.Assemble()
        self._solved: list[tuple[float, Array, Array]] = []

    def solve(self, payload: float) -> None:
        """Find the equilibrium with `payload` in kg, starting from the last solutions."""
        force = [0.0, -payload * self.crane.structure.gravity, 0.0]
        self.system.SetLoadParameter(self._payload_load, "loadVector", force)
        self._predict(payload)
        try:
            solved = exu.MainSolverStatic().SolveSystem(self.system, _SETTINGS)  # type: ignore[call-arg,misc]
        except exu.SolverError:  # a singular matrix
            solved = False
        data = self.system.systemData
        solution = np.array(data.GetODE2Coordinates()), np.array(data.GetAECoordinates())
        if not solved or not np.isfinite(solution[0]).all():
            self.system.Assemble()  # back to the unloaded pose
            self._solved = []
            raise SolverError(
                f"no static equilibrium at strokes {_listed(self.strokes)} m with {payload:g} kg"
            )
        self._solved = [*self._solved[-1:], (payload, *solution)]

    def _predict(self, payload: float) -> None:
        """Start Newton's method on the line through the last two solutions: one step fewer."""
        if not self._solved:
            return
        (m0, *q0), (m1, *q1) = self._solved[0], self._solved[-1]
        step = (payload - m1) / (m1 - m0) if m1 != m0 else 0.0
        ode2, ae = (b + step * (b - a) for a, b in zip(q0, q1, strict=True))
        data = self.system.systemData
        data.SetODE2Coordinates(list(ode2), configuration=exu.ConfigurationType.Initial)
        data.SetAECoordinates(list(ae), configuration=exu.ConfigurationType.Initial)

    def tip(self) -> Array:
        """Tip (2,) in m of the last solution."""
        node = self.beams["extension"].nodes[-1]
        return np.array(self.system.GetNodeOutput(node, exu.OutputVariableType.Position)[:2])

    def equilibrium(self) -> Equilibrium:
        """Shapes and forces of the last solution."""
        return Equilibrium(
            self.tip(),
            {name: beam.shape() for name, beam in self.beams.items()},
            # Exudyn counts the push of a distance constraint and the pad's pull as positive
            {name: -self._force(number) for name, number in self._connectors.items()},
            self._reaction(),
        )

    def _frames(self, rigid: CranePose) -> dict[str, tuple[Array, float]]:
        """Where abscissa zero of each beam lies and how its axis points."""
        structure = self.crane.structure
        lift, jib = float(rigid.lift_angle[0]), float(rigid.jib_angle[0])
        overlap = structure.extension_length - self.extension
        return {
            "pillar": (np.zeros(2), np.pi / 2),
            "lift": (_shift(rigid.lift_pivot[0], lift, 0.0, structure.lift_axis_height), lift),
            "jib": (_shift(rigid.jib_pivot[0], jib, 0.0, structure.jib_axis_height), jib),
            "extension": (_shift(rigid.extension_start[0], jib, -overlap, 0.0), jib),
        }

    def _place_beams(self, rigid: CranePose) -> dict[str, PlacedBeam]:
        geometry, structure = self.crane.geometry, self.crane.structure
        pins = {
            "pillar": (geometry.lift_pivot[1] + geometry.lift_cylinder_base[1],),
            "lift": (
                geometry.lift_cylinder_head[0],
                geometry.jib_cylinder_base_in_lift[0],
                geometry.rocker_pivot_in_lift[0],
            ),
            "jib": (geometry.coupler_pin[0], 0.0, self._rear_pad),
            "extension": (structure.front_pad - self._rear_pad,),
        }
        beams = {}
        for name, frame in self._frames(rigid).items():
            beam: Beam = getattr(structure, name)
            elements = discretise(beam, pins[name], self.crane.refinement)
            beams[name] = place_beam(self.system, self.crane.element, elements, *frame)
            for abscissa, mass in zip(elements.stations, elements.node_mass, strict=True):
                marker = beams[name].marker(abscissa, beam.mass_offset)
                self._weights.append((marker, mass))
        return beams

    @property
    def _rear_pad(self) -> float:
        """Abscissa of the rear pad on the jib, m."""
        start = self.crane.geometry.extension_start_in_jib[0]
        return start + self.extension - self.crane.structure.extension_length

    def _support_pillar(self) -> tuple[int, int, int]:
        """Pin the base and hold its rotation by the ground spring: connectors of x, y, rotation."""
        ground = self.system.AddNode(item.NodePointGround())
        fixed = self.system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        x, y, rotation = (self.beams["pillar"].coordinate_marker(0, c) for c in range(3))
        # the third ANCF coordinate is the slope -sin(rotation)
        spring = item.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=[fixed, rotation], stiffness=self.crane.spring_stiffness
        )
        return (
            self.system.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[fixed, x])),
            self.system.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[fixed, y])),
            self.system.AddObject(spring),
        )

    def _connect(self) -> dict[str, int]:
        """Join the beams by pins, pads and rods; returns the connectors whose force is reported."""
        geometry, structure = self.crane.geometry, self.crane.structure
        extension = self.beams["extension"]
        height = geometry.extension_start_in_jib[1]
        self._pin(self._on_pillar((0.0, 0.0)), self._on_lift((0.0, 0.0)))
        self._pin(self._on_lift(geometry.jib_pivot), self._on_jib((0.0, 0.0)))
        self._pin(self._on_jib((self._rear_pad, height)), extension.marker(0.0))
        sliding = extension.marker(structure.front_pad - self._rear_pad)
        pad = item.ObjectJointPrismatic2D(
            markerNumbers=[sliding, self._on_jib((structure.front_pad, height))],
            constrainRotation=False,
        )
        head = self.system.AddMarker(item.MarkerNodePosition(nodeNumber=self._head))
        rocker_pin = self._on_lift(geometry.rocker_pivot_in_lift)
        coupler_pin = self._on_jib(geometry.coupler_pin)
        self._hang_rod(structure.rocker, geometry.rocker_length, rocker_pin, head)
        self._hang_rod(structure.coupler, geometry.coupler_length, head, coupler_pin)
        lift_base = self._on_pillar(geometry.lift_cylinder_base)
        lift_head = self._on_lift(geometry.lift_cylinder_head)
        jib_base = self._on_lift(geometry.jib_cylinder_base_in_lift)
        return {
            "lift_cylinder": self._rod(lift_base, lift_head, geometry.lift_cylinder_length),
            "jib_cylinder": self._rod(jib_base, head, geometry.jib_cylinder_length),
            "rocker": self._rod(rocker_pin, head, geometry.rocker_length),
            "coupler": self._rod(head, coupler_pin, geometry.coupler_length),
            "front_pad": self.system.AddObject(pad),
        }

    def _on_pillar(self, from_lift_pivot: Vector) -> int:
        """Marker on the pillar; its axis is vertical, so its left is -x."""
        x, y = np.add(self.crane.geometry.lift_pivot, from_lift_pivot)
        return self.beams["pillar"].marker(float(y), -float(x))

    def _on_lift(self, point: Vector) -> int:
        return self.beams["lift"].marker(point[0], point[1] - self.crane.structure.lift_axis_height)

    def _on_jib(self, point: Vector) -> int:
        return self.beams["jib"].marker(point[0], point[1] - self.crane.structure.jib_axis_height)

    def _pin(self, a: int, b: int) -> None:
        self.system.AddObject(item.ObjectJointRevolute2D(markerNumbers=[a, b]))

    def _rod(self, a: int, b: int, length: float) -> int:
        rod = item.ObjectConnectorDistance(markerNumbers=[a, b], distance=length)
        return self.system.AddObject(rod)

    def _hang_rod(self, rod: Rod, length: float, first: int, second: int) -> None:
        """Put the weight of a rigid link on its two pins, which is the same for the rest."""
        share = rod.centre_of_mass / length
        self._weights += [(first, rod.mass * (1 - share)), (second, rod.mass * share)]

    def _load(self) -> int:
        """Apply all weights; returns the load of the payload, still zero."""
        for marker, mass in self._weights:
            self._add_force(marker, -mass * self.crane.structure.gravity)
        extension = self.beams["extension"]
        return self._add_force(extension.marker(extension.stations[-1]), 0.0)

    def _add_force(self, marker: int, vertical: float) -> int:
        load = item.LoadForceVector(markerNumber=marker, loadVector=[0.0, vertical, 0.0])
        return self.system.AddLoad(load)

    def _reaction(self) -> Array:
        x, y, moment = (self._force(number) for number in self._supports)
        return np.array([x, y, moment if self.beams["pillar"].ancf else -moment])

    def _force(self, connector: int) -> float:
        data = self.system.systemData
        if connector == self._connectors["front_pad"]:
            # this joint reports no force; its first multiplier is the normal force
            return float(data.GetAECoordinates()[data.GetObjectLTGAE(connector)[0]])
        force = self.system.GetObjectOutput(connector, exu.OutputVariableType.Force)
        return float(np.atleast_1d(force)[0])


def _settings() -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.staticSolver.newton.absoluteTolerance = NEWTON_TOLERANCE
    settings.staticSolver.newton.relativeTolerance = 0.0
    settings.staticSolver.minimumStepSize = SMALLEST_LOAD_STEP
    # weights hardly stiffen the crane, and its Jacobian hardly changes: both only cost time
    settings.staticSolver.computeLoadsJacobian = False
    settings.staticSolver.newton.useModifiedNewton = True
    return settings


def _shift(point: Array, angle: float, along: float, left: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return point + np.array([c * along - s * left, s * along + c * left])


def _listed(values: Array) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in values) + ")"


_SETTINGS = _settings()
