"""The Exudyn model of a planar machine of a file, placed at coordinates and solved for payloads.

Beams bend, the other bodies are rigid; pins, pads and cylinders join points of them, drives hold
their coordinates. A slide touches the inner body with one pad and the outer one with the other.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import exudyn as exu
import numpy as np

from flexik.machines import bodies
from flexik.machines.planar import GROUND, Fixed, Slide
from flexik.machines.sections import Array
from flexik.multibody.beams import Elements
from flexik.multibody.elements import (
    PlacedBeam,
    PlacedBody,
    hang,
    pad,
    pin,
    place_beam,
    rotation_of,
    spring,
    weigh,
)
from flexik.multibody.flexible import FlexibleMachine, failed, feet_of, hung_at, places_of
from flexik.multibody.newton import solved, solved_exactly, static_settings

# Newton's residual over the weight of machine and payload; and, where that is less, over the forces
# in all elements by the last digit of the size of the machine: it falls to 0.1 to 0.7 of them
TOLERANCE, LAST_DIGITS = 1e-6, 1.5
# Step of the payload, as a share of it, below which a stubborn equilibrium is given up
SMALLEST_RAMP = 1e-4
Method = Callable[[exu.MainSystem, exu.SimulationSettings], bool]


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
        # body and marker of the pin, and the joint
        self._pinned: dict[str, tuple[str, int, int]] = {}
        for name, joint in self.machine.joints.items():
            if not isinstance(joint, Slide):
                self._join(name, joint)
        self._pads = self._put_on_pads(touched)
        self.rods = self._drive()
        self._tip = self._marker(self.machine.payload)
        self._payload = hang(self.system, self._tip, 0.0, self.machine.gravity)
        self.system.Assemble()
        self.values = np.full(len(self.machine.drives), np.nan)
        self._seated: set[str] = set()
        self._unshifted: dict[int, list[float]] = {}
        # in m, and more than a turn: what bends so far is an equilibrium on paper alone
        self._longest = 2 * np.pi + sum(np.ptp(beam.span) for beam in self.machine.beams.values())
        self._noise = {name: mesh.noise for name, mesh in meshes.items()}
        self._angles = np.zeros(1 + len(self.bodies))
        self._meshes: Mapping[str, Elements] = {}
        self._solved: list[tuple[float, Array, Array]] = []

    @classmethod
    def placed(cls, flexible: FlexibleMachine, values: Array) -> "PlanarModel":
        """Model at coordinates (k,); raises SolverError where it cannot be assembled."""
        poses = flexible.linkage.poses(values[None])
        if not np.isfinite(poses).all():
            raise failed(flexible, values, "cannot be assembled")
        model = cls(flexible, flexible.touched(poses)[0])
        model.place(values, poses[0])
        return model

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
            self._noise[name] = mesh.noise
            self.beams[name].reshape(mesh, places_of(self.machine.beams[name], mesh.stations))
            points = hung_at(self.machine.beams[name], mesh)
            hung = zip(self._weights[name], points, mesh.node_mass, strict=True)
            for (marker, load), point, mass in hung:
                self.beams[name].slide_to(marker, point)
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
        at = zip(self.machine.drives.items(), values.tolist(), strict=True)
        self._lengths = {
            f"drives.{name}": drive.retracted + value
            for (name, drive), value in at
            if drive.kind == "cylinder"
        }
        self.seat({})
        self._unload()
        if start is not None:
            self._start_from(*start)

    def seat(self, seats: Mapping[str, Array]) -> None:
        """Put pins off their places until the model is placed anew or seated again.

        By `joints.NAME` or `drives.NAME`: the outer body of a pin hangs (2,) in m, ground frame,
        off the pin of the inner one, a cylinder becomes longer by (1,) in m.
        """
        for key, length in self._lengths.items():
            longer = float(seats[key][0]) if key in seats else 0.0
            self.system.SetObjectParameter(self.rods[key], "distance", length + longer)
        for key, (body, marker, _) in self._pinned.items():
            if key in seats or key in self._seated:
                self._shift(body, marker, seats.get(key, np.zeros(2)))
        self._seated = set(seats)

    def pin_forces(self, keys: Iterable[str]) -> dict[str, Array]:
        """Forces of pins and cylinders, see multibody.joint_forces.Forces."""
        data = self.system.systemData
        # a revolute joint reports no force: its multipliers are it
        multipliers = np.array(data.GetAECoordinates())
        found = {}
        for key in keys:
            if key in self._pinned:
                found[key] = -multipliers[data.GetObjectLTGAE(self._pinned[key][2])]
            else:
                output = exu.OutputVariableType.Force
                force = self.system.GetObjectOutput(self.rods[key], output)
                found[key] = -np.atleast_1d(force)[:1]
        return found

    def solve(self, payload: float) -> None:
        """Find the equilibrium with `payload` in kg, starting from the last solutions.

        Raises SolverError, which names coordinates and payload, where there is none.
        """
        for _ in range(2):
            if self._solved_with(payload):
                return
            self._unload()
        reached = self._ramped(payload)
        if reached < payload:
            self._unload()
            what = f"no static equilibrium with {payload:g} kg"
            ends = f" (the last one is that with {reached:.4g} kg)" if reached > 0.0 else ""
            raise failed(self.flexible, self.values, what + ends)

    def tip(self) -> Array:
        """Tip (2,) in m of the last solution."""
        position = self.system.GetMarkerOutput(self._tip, exu.OutputVariableType.Position)
        return np.array(position[:2])

    def shapes(self) -> dict[str, Array]:
        """Node positions (m, 2) in m by beam of the last solution."""
        return {name: beam.shape() for name, beam in self.beams.items()}

    def _ramped(self, payload: float) -> float:
        """Put the payload on little by little; how much the machine can bear, kg.

        Less than 0 if not even itself.
        """
        if not self._solved_with(0.0, solved_exactly):
            return -1.0
        on, step = 0.0, payload / 2
        while on < payload and step > SMALLEST_RAMP * payload:
            ahead = min(on + step, payload)
            if self._solved_with(ahead, solved_exactly):
                on, step = ahead, 2 * step
            else:
                step /= 4
        return on

    def _solved_with(self, payload: float, method: Method = solved) -> bool:
        weigh(self.system, self._payload, payload, self.machine.gravity)
        self._predict(payload)
        weight = self.machine.gravity * (self.weight + payload)
        last_digit = float(np.finfo(float).eps) * self.flexible.size
        round_off = LAST_DIGITS * last_digit * float(np.linalg.norm([*self._noise.values()]))
        _SETTINGS.staticSolver.newton.absoluteTolerance = max(TOLERANCE * weight, round_off)
        if not method(self.system, _SETTINGS):
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
            tilt, element = self.flexible.tilt(name), self.machine.element
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

    def _shift(self, body: str, marker: int, by: Array) -> None:
        """Hold a marker of `_at` `by` (2,) in m, ground frame, off its place."""
        placed = self.bodies.get(body)
        if isinstance(placed, PlacedBeam):
            placed.shift(marker, by)
            return
        at = self._unshifted.setdefault(
            marker, self.system.GetMarkerParameter(marker, "localPosition")
        )
        angle = 0.0 if placed is None else rotation_of(self.system, placed.node)
        c, s = float(np.cos(angle)), float(np.sin(angle))
        moved = [at[0] + c * by[0] + s * by[1], at[1] - s * by[0] + c * by[1], 0.0]
        self.system.SetMarkerParameter(marker, "localPosition", moved)

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

    def _join(self, name: str, joint: Any) -> None:
        first, second = joint.of
        springs = joint.springs if isinstance(joint, Fixed) else None
        markers = [self._marker(first), self._marker(second)]
        if springs and (springs.x or springs.y):
            spring(self.system, markers, springs.x, springs.y)
        else:
            body = first.partition(".")[0]
            self._pinned[f"joints.{name}"] = body, markers[0], pin(self.system, *markers)
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
            # the line of sliding in the frame of the markers on either body
            in_inner = slide.direction - self.flexible.tilt(inner)
            in_outer = slide.direction - slide.angle - self.flexible.tilt(outer)
            pad(self.system, moving[0], in_outer, own[0], in_inner)
            if any(slide is joint for joint in held):
                pin(self.system, moving[1], own[1])
            else:
                pad(self.system, moving[1], in_inner, own[1], in_outer)
            found.append(moving)
        return found

    def _drive(self) -> dict[str, int]:
        """Hold the coordinates of all drives; returns the cylinders by name."""
        rods = {}
        for name, drive in self.machine.drives.items():
            if drive.kind == "cylinder":
                markers = [self._marker(end) for end in drive.of]
                for marker, mass in zip(markers, drive.masses, strict=True):
                    self._hang(marker, mass)
                rod = {"objectType": "ConnectorDistance", "markerNumbers": markers}
                rods[f"drives.{name}"] = self.system.AddObject({**rod, "distance": drive.retracted})
            elif drive.kind == "revolute":
                self._hold(*self.machine.joints[drive.joint].of)
        return rods

    def _weigh_beam(self, name: str, mesh: Elements) -> list[tuple[int, int]]:
        """Hang the mass of a beam on its nodes; returns markers and loads."""
        found, points = [], hung_at(self.machine.beams[name], mesh)
        for station, point, mass in zip(mesh.stations, points, mesh.node_mass, strict=True):
            marker = self.beams[name].marker_at(station, point)
            found.append((marker, hang(self.system, marker, mass, self.machine.gravity)))
        return found

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


_SETTINGS = static_settings(1.0)
