"""Any planar machine of a file in static equilibrium.

Beams bend, the other bodies are rigid; pins, pads and cylinders join points of them, drives hold
their coordinates. A slide touches the inner body with one pad and the outer one with the other.
"""

from collections.abc import Callable, Mapping
from typing import Any

import exudyn as exu
import numpy as np

from flexik.errors import SolverError
from flexik.machines import bodies
from flexik.machines.planar import GROUND, Fixed, Slide
from flexik.machines.sections import Array
from flexik.multibody.beams import Elements
from flexik.multibody.elements import (
    PlacedBeam,
    PlacedBody,
    hang,
    neighbours,
    place_beam,
    solved,
    static_settings,
    weigh,
)
from flexik.multibody.flexible import FlexibleMachine, feet_of, mass_offset, places_of

# Newton's residual over the weight of machine and payload; round-off grows with finer meshes
TOLERANCE = 1e-6
# Pads this close touch the same place, m
SAME_PLACE = 1e-9
# Share of the load below which a stubborn equilibrium is given up, and steps of the payload on the
# way to one that is not found at once
SMALLEST_LOAD_STEP, RAMP = 0.05, 40

Read = Callable[["PlanarModel"], Array]


def solve(
    machine: FlexibleMachine,
    values: Array,
    payload: Array,
    read: "Read | None" = None,
    size: int = 2,
) -> tuple[Array, dict[int, SolverError]]:
    """Tip (n, 2) in m at coordinates (n, k) with `payload` (n,) in kg, and the rows that failed.

    Rows whose meshes have the same layout share one system, each starting from a neighbour; which
    one changes a tip by less than 1e-7 m. A row without equilibrium holds NaN and is in the second
    result, with an error that names its coordinates and payload. `read` takes something else
    than the tip, `size` numbers, from the model of every row.
    """
    read = read or PlanarModel.tip
    values, payload = np.atleast_2d(values), np.atleast_1d(payload)
    poses = machine.linkage.poses(values)
    closed = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    failures = {
        int(k): _failed(machine, values[k], "cannot be assembled") for k in np.flatnonzero(~closed)
    }
    order = neighbours(values, payload)
    order = order[closed[order]]
    touched, sliding = machine.touched(poses), machine.sliding
    # where pads have moved along; poses of equal strokes differ by round-off
    steps = np.abs(np.diff(touched[order], axis=0, prepend=np.inf))
    changed = order[steps.max(axis=(1, 2, 3), initial=0.0) > SAME_PLACE]
    meshes = dict(zip(changed.tolist(), machine.meshes(touched[changed], sliding), strict=False))
    models: dict[Any, PlanarModel] = {}
    found: dict[int, Array] = {}
    new: dict[str, Elements] = {}
    for k in order.tolist():
        new = meshes.get(k, new)
        layout = tuple((len(mesh.stations), *mesh.pins) for mesh in new.values())
        if layout not in models:
            models[layout] = PlanarModel(machine, touched[k])
        model = models[layout]
        try:
            if not np.array_equal(values[k], model.values):
                model.slide(new, touched[k])
                model.place(values[k], poses[k])
            model.solve(float(payload[k]))
            found[k] = read(model)
        except SolverError as error:
            failures[k] = error
    result = np.full((len(values), size), np.nan)
    for k, of_row in found.items():
        result[k] = of_row
    return result, dict(sorted(failures.items()))


def tips(machine: FlexibleMachine, values: Array, payload: Array) -> Array:
    """Tip (n, 2) in m as by `solve`; raises the SolverError of the first row that fails."""
    result, failures = solve(machine, values, payload)
    if failures:
        raise next(iter(failures.values()))
    return result


class PlanarModel:
    """An Exudyn system of a machine, placed at coordinates and solved for payloads.

    Other coordinates only turn the reference configuration, and change elements and weights where
    pads slide, as long as the layout of the nodes is the same; that costs far less than a new
    system.
    """

    def __init__(self, flexible: FlexibleMachine, touched: Array) -> None:
        """Model with the pads at `touched` (slides, 2, 2)."""
        self.flexible, self.machine = flexible, flexible.machine
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        self._ground = self.system.AddObject({"objectType": "Ground"})
        (meshes,) = flexible.meshes(touched[None], list(flexible.beams)) or ({},)
        self.bodies: dict[str, PlacedBeam | PlacedBody] = {
            name: self._add_body(name, meshes) for name in self.machine.bodies
        }
        self._fixed = self._coordinate_of_ground()
        self._weights = {name: self._weigh_beam(name, mesh) for name, mesh in meshes.items()}
        self.weight = float(sum(mesh.node_mass.sum() for mesh in meshes.values()))
        self._weigh_others()
        for joint in self.machine.joints.values():
            if not isinstance(joint, Slide):
                self._join(joint)
        self._pads = self._put_on_pads(touched)
        self.rods = self._drive()
        self._tip = self._marker(self.machine.payload)
        self._payload = hang(self.system, self._tip, 0.0, self.machine.gravity)
        self.system.Assemble()
        self.values = np.full(len(self.machine.drives), np.nan)
        # in m, and more than a turn: what bends so far is an equilibrium on paper alone
        self._longest = 2 * np.pi + sum(np.ptp(beam.span) for beam in self.machine.beams.values())
        self._angles = np.zeros(1 + len(self.bodies))
        self._meshes: Mapping[str, Elements] = {}
        self._solved: list[tuple[float, Array, Array]] = []

    @property
    def beams(self) -> dict[str, PlacedBeam]:
        """The bodies that bend."""
        return {n: body for n, body in self.bodies.items() if isinstance(body, PlacedBeam)}

    def slide(self, meshes: Mapping[str, Elements], touched: Array) -> None:
        """Change to `meshes` of sliding beams, with pads at `touched` (slides, 2, 2).

        They must have as many stations as those of the model, and pins at the same ones.
        """
        if meshes is self._meshes:
            return
        self._meshes = meshes
        for name, mesh in meshes.items():
            self.beams[name].reshape(mesh, places_of(self.machine.beams[name], mesh.stations))
            for load, mass in zip(self._weights[name], mesh.node_mass, strict=True):
                weigh(self.system, load, mass, self.machine.gravity)
        for (_, pair, _), markers, at in zip(self.flexible.pads, self._pads, touched, strict=True):
            for name, marker, point in zip(reversed(pair), markers, at, strict=True):
                self._slide(name, marker, point)

    def place(self, values: Array, poses: Array) -> None:
        """Move the reference configuration to `poses` (b, 3) at coordinates (k,)."""
        self.values = values
        start = self._turned(poses[:, 2])
        for name, body in self.bodies.items():
            x, y, angle = poses[self.flexible.linkage.names.index(name)]
            body.move(np.array([x, y]), float(angle))
        for (name, drive), value in zip(self.machine.drives.items(), values.tolist(), strict=True):
            if drive.kind == "cylinder":
                length = drive.retracted + value
                self.system.SetObjectParameter(self.rods[name], "distance", length)
        self._unload()
        if start is not None:
            self._start_from(*start)

    def solve(self, payload: float) -> None:
        """Find the equilibrium with `payload` in kg, starting from the last solutions.

        Raises SolverError, which names coordinates and payload, where there is none.
        """
        if not self._solved_with(payload):
            self._unload()
            if not self._solved_with(payload) and not self._ramped(payload):
                self._unload()
                raise _failed(
                    self.flexible, self.values, f"no static equilibrium with {payload:g} kg"
                )

    def tip(self) -> Array:
        """Tip (2,) in m of the last solution."""
        position = self.system.GetMarkerOutput(self._tip, exu.OutputVariableType.Position)
        return np.array(position[:2])

    def shapes(self) -> dict[str, Array]:
        """Node positions (m, 2) in m by beam of the last solution."""
        return {name: beam.shape() for name, beam in self.beams.items()}

    def _ramped(self, payload: float) -> bool:
        """Whether the payload, put on little by little, leads to an equilibrium."""
        self._unload()
        return all(self._solved_with(payload * k / RAMP) for k in range(RAMP + 1))

    def _solved_with(self, payload: float) -> bool:
        weigh(self.system, self._payload, payload, self.machine.gravity)
        self._predict(payload)
        weight = self.machine.gravity * (self.weight + payload)
        tolerance = TOLERANCE * weight * self.flexible.refinement**2
        _SETTINGS.staticSolver.newton.absoluteTolerance = tolerance
        if not solved(self.system, _SETTINGS):
            return False
        data = self.system.systemData
        solution = np.array(data.GetODE2Coordinates()), np.array(data.GetAECoordinates())
        if np.abs(solution[0]).max() > self._longest:
            return False
        self._solved = [*self._solved[-1:], (payload, *solution)]
        return True

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

    def _turned(self, angles: Array) -> tuple[Array, Array] | None:
        """The last solution with every body turned to its new angle, or None before the first."""
        before, self._angles = self._angles, angles
        if not self._solved:
            return None
        ode2, ae = self._solved[-1][1:]
        # Exudyn numbers coordinates as nodes were added: those of the bodies
        turned, first = ode2.copy(), 0
        for number, body in enumerate(self.bodies.values(), 1):
            last = first + body.n_coordinates
            turned[first:last] = body.turned(
                ode2[first:last], float(angles[number] - before[number])
            )
            first = last
        return turned, ae

    def _add_body(self, name: str, meshes: Mapping[str, Elements]) -> PlacedBeam | PlacedBody:
        body = self.machine.bodies[name]
        if isinstance(body, bodies.Beam):
            mesh = meshes[name]
            places = places_of(body, mesh.stations)
            tilt = body.place(body.start)[1] if self.machine.element == "ancf" else 0.0
            element = self.machine.element
            return place_beam(self.system, element, mesh, np.zeros(2), 0.0, places, tilt)
        node = self.system.AddNode({"nodeType": "RigidBody2D"})
        rigid = self.system.AddObject({"objectType": "RigidBody2D", "nodeNumber": node})
        return PlacedBody(self.system, node, rigid)

    def _at(self, body: str, point: Array) -> int:
        """Marker at `point` (2,) of a body, in m."""
        placed = None if body == GROUND else self.bodies[body]
        if isinstance(placed, PlacedBeam):
            return placed.marker_at(float(feet_of(self.machine.beams[body], point[None])[0]), point)
        number = self._ground if placed is None else placed.body
        marker = {"markerType": "BodyRigid", "bodyNumber": number}
        return self.system.AddMarker({**marker, "localPosition": [*map(float, point), 0.0]})

    def _slide(self, body: str, marker: int, point: Array) -> None:
        """Put a marker of `_at` at another point, on the arm from its node."""
        placed = self.bodies.get(body)
        if isinstance(placed, PlacedBeam):
            placed.slide_to(marker, point)
        else:
            self.system.SetMarkerParameter(marker, "localPosition", [*point.tolist(), 0.0])

    def _marker(self, reference: str) -> int:
        body, point = self.machine.located(reference)
        return self._at(body, np.array(point))

    def _coordinate_of_ground(self) -> int:
        ground = self.system.AddNode({"nodeType": "PointGround"})
        marker = {"markerType": "NodeCoordinate", "nodeNumber": ground, "coordinate": 0}
        return self.system.AddMarker(marker)

    def _rotation(self, reference: str) -> int:
        """Marker on the rotation at a point, counted from the unloaded pose."""
        body, point = self.machine.located(reference)
        if body == GROUND:
            return self._fixed
        placed = self.bodies[body]
        if isinstance(placed, PlacedBody):
            node = placed.node
        else:
            beam = self.machine.beams[body]
            stations = placed.stations
            node = placed.nodes[int(np.abs(stations - beam.foot(point)[0]).argmin())]
        return self.system.AddMarker(
            {"markerType": "NodeCoordinate", "nodeNumber": node, "coordinate": 2}
        )

    def _join(self, joint: Any) -> None:
        first, second = joint.of
        springs = joint.springs if isinstance(joint, Fixed) else None
        markers = [self._marker(first), self._marker(second)]
        if springs and springs.x is not None:
            spring = {"objectType": "ConnectorCartesianSpringDamper", "markerNumbers": markers}
            self.system.AddObject({**spring, "stiffness": [springs.x, springs.y, 0.0]})
        else:
            self._pin(*markers)
        if springs:
            self._hold(first, second, springs.torsion)

    def _hold(self, first: str, second: str, stiffness: Any = None) -> None:
        """Hold the angle between two bodies at two points, by a torsion spring if it is soft."""
        kind, given = "ConnectorCoordinate", {}
        if stiffness is not None:
            kind, given = "ConnectorCoordinateSpringDamper", {"stiffness": stiffness}
        pair = [self._rotation(first), self._rotation(second)]
        self.system.AddObject({"objectType": kind, "markerNumbers": pair, **given})

    def _put_on_pads(self, touched: Array) -> list[tuple[int, int]]:
        """Join every slide by two pads without friction; a telescope holds the second one.

        Returns the markers where the pads touch at `touched`, on the outer and on the inner body.
        """
        telescopes = [d.joint for d in self.machine.drives.values() if d.kind == "telescope"]
        held = [self.machine.joints[name] for name in telescopes]
        found = []
        for (slide, (inner, outer), (first, second)), (on_outer, on_inner) in zip(
            self.flexible.pads, touched, strict=True
        ):
            moving = self._at(outer, on_outer), self._at(inner, on_inner)
            own = self._at(inner, first), self._at(outer, second)
            # the line of sliding in the frame of either body
            in_inner, in_outer = slide.direction, slide.direction - slide.angle
            self._pad(moving[0], in_outer, own[0], in_inner)
            if any(slide is joint for joint in held):
                self._pin(moving[1], own[1])
            else:
                self._pad(moving[1], in_inner, own[1], in_outer)
            found.append(moving)
        return found

    def _pad(self, touched: int, line: float, pad: int, other_line: float) -> None:
        """Keep marker `pad` on a line through marker `touched`, at these angles in their frames."""
        pair = {"markerNumbers": [touched, pad], "constrainRotation": False}
        axis = [float(np.cos(line)), float(np.sin(line)), 0.0]
        normal = [-float(np.sin(other_line)), float(np.cos(other_line)), 0.0]
        pad_joint = {"objectType": "JointPrismatic2D", "axisMarker0": axis, "normalMarker1": normal}
        self.system.AddObject({**pad_joint, **pair})

    def _pin(self, first: int, second: int) -> None:
        pair = {"markerNumbers": [first, second]}
        self.system.AddObject({"objectType": "JointRevolute2D", **pair})

    def _drive(self) -> dict[str, int]:
        """Hold the coordinates of all drives; returns the cylinders by name."""
        rods = {}
        for name, drive in self.machine.drives.items():
            if drive.kind == "cylinder":
                markers = [self._marker(end) for end in drive.of]
                for marker, mass in zip(markers, drive.masses, strict=True):
                    self._hang(marker, mass)
                rod = {"objectType": "ConnectorDistance", "markerNumbers": markers}
                rods[name] = self.system.AddObject({**rod, "distance": drive.retracted})
            elif drive.kind == "revolute":
                self._hold(*self.machine.joints[drive.joint].of)
        return rods

    def _weigh_beam(self, name: str, mesh: Elements) -> list[int]:
        """Hang the mass of a beam on its nodes; returns the loads."""
        beam, placed = self.machine.beams[name], self.beams[name]
        offset, gravity = mass_offset(beam, mesh), self.machine.gravity
        points = placed.places + offset
        pairs = zip(mesh.stations, points, mesh.node_mass, strict=True)
        return [hang(self.system, placed.marker_at(x, p), mass, gravity) for x, p, mass in pairs]

    def _weigh_others(self) -> None:
        for name, body in self.machine.bodies.items():
            if isinstance(body, bodies.Rigid):
                self._hang(self._at(name, np.array(body.centre)), body.mass)
            for point, mass in body.masses.items():
                self._hang(self._marker(f"{name}.{point}"), mass)

    def _hang(self, marker: int, mass: float) -> None:
        if mass > 0.0:
            hang(self.system, marker, mass, self.machine.gravity)
            self.weight += mass


def _failed(machine: FlexibleMachine, values: Array, what: str) -> SolverError:
    given = zip(machine.machine.drives, values.tolist(), strict=True)
    return SolverError(f"{what} at {', '.join(f'{name} {value:.6g}' for name, value in given)}")


_SETTINGS = static_settings(1.0)
_SETTINGS.staticSolver.minimumStepSize = SMALLEST_LOAD_STEP
# the Jacobian of such a machine hardly changes
_SETTINGS.staticSolver.newton.useModifiedNewton = True
