"""The flexible log crane in static equilibrium (Rouvinen 1999, chapters 2.3 and 3.2).

Pillar, lift arm, jib and extension are beams; cylinders, rocker and coupler are rigid; the
extension slides in the jib on two pads; a torsion spring holds the pillar to the ground.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from flexik.errors import SolverError
from flexik.kinematics.crane import (
    CranePose,
    extension_start_in_jib,
    jib_cylinder_base_in_lift,
    placed,
    pose,
    rocker_pivot_in_lift,
)
from flexik.machines.crane import Rod
from flexik.multibody.beams import Array, Elements
from flexik.multibody.crane.structure import SLIDING, FlexibleCrane, Meshes, beam_meshes
from flexik.multibody.elements import hang, neighbours, place_beam, solved, static_settings, weigh
from flexik.parameters.model import Vector

# Newton's residual, N and N m: it falls quadratically onto a round-off floor of about 1e-4 (stiff
# axial terms); one step after passing this tolerance the solution is on the floor
NEWTON_TOLERANCE = 1e-2

# Share of the load below which a stubborn equilibrium is given up
SMALLEST_LOAD_STEP = 0.05

RODS = ("lift_cylinder", "jib_cylinder", "rocker", "coupler")
PIVOTS = ("lift_pivot", "jib_pivot")


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
    crane: FlexibleCrane,
    strokes: Array,
    payload: Array,
    settle: "Callable[[CraneModel, float, int], None] | None" = None,
) -> tuple[Array, dict[int, SolverError]]:
    """Tip (n, 2) in m at `strokes` (n, 3) in m with `payload` (n,) in kg, and the rows that failed.

    Rows whose meshes have the same layout share one system, each starting from a neighbour; which
    one changes a tip by less than 1e-7 m. A row without equilibrium holds NaN and is in the second
    result, with an error that names its strokes and payload. `settle` finds it in place of
    `CraneModel.solve`, told the number of the row.
    """
    strokes, payload = np.atleast_2d(strokes), np.atleast_1d(payload)
    poses = pose(crane.geometry, strokes)
    result = np.full((len(strokes), 2), np.nan)
    failures: dict[int, SolverError] = {}
    models: dict[tuple[tuple[int, ...], ...], CraneModel] = {}
    order = neighbours(strokes, payload)
    changed = order[np.diff(strokes[order, 2], prepend=np.nan) != 0.0]
    new = zip(changed.tolist(), beam_meshes(crane, strokes[changed, 2], SLIDING), strict=True)
    meshes_at = dict(new)
    model: CraneModel
    for k in order.tolist():
        row, mass = strokes[k], float(payload[k])
        if meshes := meshes_at.get(k):
            layout = tuple((len(mesh.stations), *mesh.pins) for mesh in meshes.values())
            if layout in models:
                models[layout].extend(float(row[2]), meshes)
            else:
                models[layout] = CraneModel(crane, float(row[2]))
            model = models[layout]
        try:
            if not np.array_equal(row, model.strokes):
                model.place(row, CranePose(*(values[k : k + 1] for values in poses)))
            if settle is None:
                model.solve(mass)
            else:
                settle(model, mass, k)
            result[k] = model.tip()
        except SolverError as error:
            failures[k] = error
    return result, dict(sorted(failures.items()))


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

    The extension fixes where the pads meet the beams, hence the mesh. Another extension with the
    same layout of nodes only changes elements and weights; lift and jib stroke only turn the
    reference configuration. Both cost far less than a new system.
    """

    def __init__(self, crane: FlexibleCrane, extension: float) -> None:
        self.crane, self.extension = crane, extension
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        (meshes,) = beam_meshes(crane, [extension])
        self.beams = {
            name: place_beam(self.system, crane.element, mesh, np.zeros(2), 0.0)
            for name, mesh in meshes.items()
        }
        self._weights = {name: self._weigh(name, mesh) for name, mesh in meshes.items()}
        self._head = self.system.AddNode(item.NodePoint2D())
        self._supports = self._support_pillar()
        self._connectors = self._connect()
        tip = self.beams["extension"].marker(crane.structure.extension.span[1])
        self._payload_load = self._add_weight(tip, 0.0)
        self.system.Assemble()
        self.strokes = np.full(3, np.nan)
        self._angles: Mapping[str, float] = {}
        self._solved: list[tuple[float, Array, Array]] = []

    def extend(self, extension: float, meshes: Meshes) -> None:
        """Change to stroke `extension` in m and its `meshes` of jib and extension.

        They must have as many stations as those of the model, and pins at the same ones.
        """
        self.extension = extension
        for name, mesh in meshes.items():
            self.beams[name].reshape(mesh)
            for load, mass in zip(self._weights[name], mesh.node_mass, strict=True):
                self._set_weight(load, mass)
        rear_pad = self.crane.rear_pad(extension)
        self.beams["jib"].slide(self._rear_pad, rear_pad)
        self.beams["extension"].slide(self._front_pad, self.crane.structure.front_pad - rear_pad)
        self.strokes = np.full(3, np.nan)

    def place(self, strokes: Array, rigid: CranePose | None = None) -> None:
        """Move the reference configuration to the pose at `strokes` (3,) in m, `rigid` if known.

        Raises SolverError where the linkage cannot be assembled.
        """
        rigid = rigid or pose(self.crane.geometry, strokes[None])
        if not np.isfinite(rigid.tip).all():
            raise SolverError(f"strokes {listed(strokes)} m: the linkage cannot be assembled")
        self.strokes = strokes
        frames = self._frames(rigid)
        start = self._turned({name: angle for name, (_, angle) in frames.items()})
        for name, (origin, angle) in frames.items():
            self.beams[name].move(origin, angle)
        self.system.SetNodeParameter(self._head, "referenceCoordinates", list(rigid.rocker_head[0]))
        geometry = self.crane.geometry
        self._lengths = {
            "lift_cylinder": geometry.lift_cylinder_length + strokes[0],
            "jib_cylinder": geometry.jib_cylinder_length + strokes[1],
            "rocker": geometry.rocker_length,
            "coupler": geometry.coupler_length,
        }
        self.seat(dict.fromkeys(RODS, 0.0), dict.fromkeys(PIVOTS, np.zeros(2)))
        self._unload()
        if start is not None:
            self._start_from(*start)

    def _turned(self, angles: Mapping[str, float]) -> tuple[Array, Array] | None:
        """The last solution with every beam turned to its new angle, or None before the first."""
        before, self._angles = self._angles, angles
        if not self._solved:
            return None
        ode2, ae = self._solved[-1][1:]
        # Exudyn numbers coordinates as nodes were added: the beams come first
        turned, first = ode2.copy(), 0
        for name, beam in self.beams.items():
            last = first + beam.n_coordinates
            turned[first:last] = beam.turned(ode2[first:last], angles[name] - before[name])
            first = last
        return turned, ae

    def seat(self, rods: Mapping[str, float], pivots: Mapping[str, Array]) -> None:
        """Put pins off their places until the model is placed anew or seated again.

        Each of RODS becomes longer by `rods` in m; the outer body of each of PIVOTS hangs `pivots`
        (2,) in m, ground frame, off the pin of the inner one.
        """
        for name, longer in rods.items():
            length = self._lengths[name] + longer
            self.system.SetObjectParameter(self._connectors[name], "distance", length)
        for name, by in pivots.items():
            beam, marker, _ = self._pivots[name]
            self.beams[beam].shift(marker, by)

    def solve(self, payload: float) -> None:
        """Find the equilibrium with `payload` in kg, starting from the last solutions."""
        self._set_weight(self._payload_load, payload)
        self._predict(payload)
        if not solved(self.system, _SETTINGS):
            self._unload()
            if not solved(self.system, _SETTINGS):
                self._unload()
                raise SolverError(
                    f"no static equilibrium at strokes {listed(self.strokes)} m with {payload:g} kg"
                )
        data = self.system.systemData
        solution = np.array(data.GetODE2Coordinates()), np.array(data.GetAECoordinates())
        self._solved = [*self._solved[-1:], (payload, *solution)]

    def _unload(self) -> None:
        self.system.AssembleInitializeSystemCoordinates()
        self._solved = []

    def _predict(self, payload: float) -> None:
        """Start Newton's method on the line through the last two solutions: one step fewer."""
        if not self._solved:
            return
        (m0, *q0), (m1, *q1) = self._solved[0], self._solved[-1]
        step = (payload - m1) / (m1 - m0) if m1 != m0 else 0.0
        self._start_from(*(b + step * (b - a) for a, b in zip(q0, q1, strict=True)))

    def _start_from(self, ode2: Array, ae: Array) -> None:
        data = self.system.systemData
        data.SetODE2Coordinates(list(ode2), configuration=exu.ConfigurationType.Initial)
        data.SetAECoordinates(list(ae), configuration=exu.ConfigurationType.Initial)

    def tip(self) -> Array:
        """Tip (2,) in m of the last solution."""
        node = self.beams["extension"].nodes[-1]
        return np.array(self.system.GetNodeOutput(node, exu.OutputVariableType.Position)[:2])

    def pin_forces(self) -> tuple[dict[str, float], dict[str, Array]]:
        """Tension of RODS in N, and force (2,) in N of the inner on the outer body of PIVOTS."""
        data = self.system.systemData
        # a revolute joint reports no force either: its multipliers are it
        multipliers = np.array(data.GetAECoordinates())
        joints = {name: joint for name, (_, _, joint) in self._pivots.items()}
        return (
            {name: -self._force(self._connectors[name]) for name in RODS},
            {name: multipliers[data.GetObjectLTGAE(joint)] for name, joint in joints.items()},
        )

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
        overlap = structure.extension_length - self.extension
        frames = {
            "lift": (rigid.lift_pivot, rigid.lift_angle, (0.0, structure.lift_axis_height)),
            "jib": (rigid.jib_pivot, rigid.jib_angle, (0.0, structure.jib_axis_height)),
            "extension": (rigid.extension_start, rigid.jib_angle, (-overlap, 0.0)),
        }
        found = {name: (placed(*given)[0], float(given[1][0])) for name, given in frames.items()}
        return {"pillar": (np.zeros(2), np.pi / 2), **found}

    def _weigh(self, name: str, mesh: Elements) -> list[int]:
        """Hang the mass of a beam on its nodes; returns the loads."""
        beam, offset = self.beams[name], getattr(self.crane.structure, name).mass_offset
        pairs = zip(mesh.stations, mesh.node_mass, strict=True)
        return [self._add_weight(beam.marker(x, offset), mass) for x, mass in pairs]

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
        height = extension_start_in_jib(geometry)[1]
        rear_pad = self.crane.rear_pad(self.extension)
        self._rear_pad = self._on_jib((rear_pad, height))
        self._front_pad = extension.marker(structure.front_pad - rear_pad)
        # beam and marker of the pin, and its joint
        pin = self._on_pillar((0.0, 0.0))
        self._pivots = {"lift_pivot": ("pillar", pin, self._pin(pin, self._on_lift((0.0, 0.0))))}
        pin = self._on_lift(geometry.jib_pivot)
        self._pivots["jib_pivot"] = ("lift", pin, self._pin(pin, self._on_jib((0.0, 0.0))))
        self._pin(self._rear_pad, extension.marker(0.0))
        pad = item.ObjectJointPrismatic2D(
            markerNumbers=[self._front_pad, self._on_jib((structure.front_pad, height))],
            constrainRotation=False,
        )
        head = self.system.AddMarker(item.MarkerNodePosition(nodeNumber=self._head))
        rocker_pin = self._on_lift(rocker_pivot_in_lift(geometry))
        coupler_pin = self._on_jib(geometry.coupler_pin)
        self._hang_rod(structure.rocker, geometry.rocker_length, rocker_pin, head)
        self._hang_rod(structure.coupler, geometry.coupler_length, head, coupler_pin)
        lift_base = self._on_pillar(geometry.lift_cylinder_base)
        lift_head = self._on_lift(geometry.lift_cylinder_head)
        jib_base = self._on_lift(jib_cylinder_base_in_lift(geometry))
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

    def _pin(self, a: int, b: int) -> int:
        return self.system.AddObject(item.ObjectJointRevolute2D(markerNumbers=[a, b]))

    def _rod(self, a: int, b: int, length: float) -> int:
        rod = item.ObjectConnectorDistance(markerNumbers=[a, b], distance=length)
        return self.system.AddObject(rod)

    def _hang_rod(self, rod: Rod, length: float, first: int, second: int) -> None:
        """Put the weight of a rigid link on its two pins, which is the same for the rest."""
        share = rod.centre_of_mass / length
        self._add_weight(first, rod.mass * (1 - share))
        self._add_weight(second, rod.mass * share)

    def _add_weight(self, marker: int, mass: float) -> int:
        """Hang `mass` in kg on a marker; returns the load."""
        return hang(self.system, marker, mass, self.crane.structure.gravity)

    def _set_weight(self, load: int, mass: float) -> None:
        weigh(self.system, load, mass, self.crane.structure.gravity)

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


def listed(values: Array) -> str:
    """Numbers in parentheses, for messages."""
    return "(" + ", ".join(f"{v:.6g}" for v in values) + ")"


_SETTINGS = static_settings(NEWTON_TOLERANCE)
_SETTINGS.staticSolver.minimumStepSize = SMALLEST_LOAD_STEP
# the Jacobian of the crane hardly changes
_SETTINGS.staticSolver.newton.useModifiedNewton = True
