"""Beam theory of any planar machine, in NumPy alone: no elements, no Exudyn, no training.

Joints and drives are as many as its bodies have coordinates, so loads fix the forces in them, see
multibody.joint_forces, and these the bending moment along every beam. Integrated over the section,
as Euler and Bernoulli have it, moments and tensions move the points of a beam; with these the
bodies are put together again. On the rigid pose and for small loads that is the linear theory, by
the principle of virtual work; passes over the deformed pose lead to the equilibrium of
geometrically exact beams.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexik.kinematics.constraints import Block, Ends, Equation
from flexik.kinematics.loops import CHUNK
from flexik.machines.planar import GROUND, Fixed, Slide, Telescope
from flexik.machines.sections import Array
from flexik.multibody.bending import SAME, Bent, Span
from flexik.multibody.flexible import FlexibleMachine, feet_of, stations_of

# Share of the loads that is small: of second order is left this share, and some digits are lost
SMALL = 1e-5


class Place(NamedTuple):
    """A point (2, n) of body `number` in m, in its frame, on a rigid arm from a station of it.

    number, column : of the body, and of the station among those of its beam; -1 on a rigid body.
    """

    number: int
    point: Array
    column: int


@dataclass(frozen=True)
class BeamTheory:
    """Tips of a flexible machine by beam theory.

    n_passes : over the deformed pose; 0: linear theory on the rigid pose, so that the deflection is
        linear in the payload.
    n_panels : of a beam, at least; within one the bending moment is linear.
    """

    flexible: FlexibleMachine
    n_passes: int = 0
    n_panels: int = 8

    def predict(self, values: Array) -> Array:
        """Deflection (n, 2) in m at `values` (n, k + 1): coordinates, and payload in kg.

        NaN where the rigid machine cannot be put together, or gives way without end.
        """
        parts = [self._deflection(values[k : k + CHUNK]) for k in range(0, len(values), CHUNK)]
        return np.concatenate(parts) if parts else np.empty((0, 2))

    def _deflection(self, values: Array) -> Array:
        poses = self.flexible.linkage.poses(values[:, :-1])
        closed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        found = np.full((len(values), 2), np.nan)
        if len(closed):
            at = values[closed]
            rows = _Rows(self.flexible, at[:, :-1], at[:, -1], poses[closed], self.n_panels)
            found[closed] = rows.linear() if self.n_passes == 0 else rows.deflection(self.n_passes)
        return found


class _Rows:
    """A machine at coordinates (n, k) with payloads (n,) in kg, its rigid bodies at (n, b, 3)."""

    def __init__(
        self,
        flexible: FlexibleMachine,
        values: Array,
        payload: Array,
        poses: Array,
        n_panels: int,
    ) -> None:
        self.flexible, self.machine = flexible, flexible.machine
        self.values, self.poses, self.gravity = values, poses, self.machine.gravity
        self.names = flexible.linkage.names
        self.rows = np.arange(len(values))
        self._stations: dict[str, list[Array]] = {}
        for name, beam in self.machine.beams.items():
            cuts = [*beam.span, *stations_of(beam)[: len(beam.axis) - 2]]
            self._stations[name] = [np.full(len(values), x) for x in cuts]
        self.held = [*self._held_by_joints(), *self._held_by_pads()]
        self.tip = self._place(*self.machine.located(self.machine.payload))
        self.masses: list[tuple[Place, Array]] = [(self.tip, payload)]
        own = {f"bodies.{name}.mass" for name in self.machine.beams}
        for key, (body, point, mass) in self.machine.masses().items():
            if key not in own and body != GROUND:
                self.masses.append((self._place(body, point), np.full(len(values), mass)))
        self.spans = {}
        for name, marks in self._stations.items():
            beam, along = self.machine.beams[name], flexible.beams[name]
            span = Span.cut(beam, along, np.stack(marks, axis=1), n_panels)
            self.spans[self.names.index(name)] = span

    def linear(self) -> Array:
        """Deformed minus rigid tip (n, 2) in m, by linear theory."""
        self.gravity = SMALL * self.machine.gravity
        return self.deflection(0) / SMALL

    def deflection(self, n_passes: int) -> Array:
        """Deformed minus rigid tip (n, 2) in m, after so many passes over the deformed pose."""
        bent = {number: span.straight for number, span in self.spans.items()}
        poses, n = self.poses.copy(), len(self.poses)
        rigid = self._on_ground(self.tip, poses, bent)
        forces = np.zeros((n, 3 * len(self.names) - 3))
        for _ in range(1 + n_passes):
            equations = self._displaced(poses, bent, forces)
            loads = self._loads(poses, bent)
            inverse = _inverse(self._system(equations, poses)[1])
            whole = _summed(loads, poses)
            forces = np.einsum("ncr,nc->nr", inverse, whole[:, 1:].reshape(n, -1))
            bent = self._bend(equations, forces, loads, poses, bent)
            gap = self._system(self._displaced(poses, bent, forces), poses)[0]
            poses[:, 1:] -= np.einsum("ncr,nr->nc", inverse, gap).reshape(n, -1, 3)
        return self._on_ground(self.tip, poses, bent) - rigid

    def _place(self, body: str, point: Ends | Array) -> Place:
        """Place at `point`, (2,) or (n, 2) in m, of a body; a beam gets a station there."""
        number, at = self.names.index(body), np.broadcast_to(np.array(point), (len(self.rows), 2))
        if body not in self._stations:
            return Place(number, at.T, -1)
        beam, known = self.machine.beams[body], self._stations[body]
        foot = np.clip(feet_of(beam, at), *beam.span)
        for column, other in enumerate(known):
            if np.abs(other - foot).max(initial=0.0) < SAME:
                return Place(number, at.T, column)
        known.append(foot)
        return Place(number, at.T, len(known) - 1)

    def _held_by_joints(self) -> list[tuple[Equation, Place, Place]]:
        """Equations but those of slides and telescopes, and their points on both bodies."""
        pads = [f"joints.{n}" for n, j in self.machine.joints.items() if isinstance(j, Slide)]
        pads += [f"drives.{n}" for n, d in self.machine.drives.items() if isinstance(d, Telescope)]
        found = []
        for equation in self.flexible.linkage.equations:
            if equation.key not in pads:
                (first, second), bodies = equation.points, [self.names[b] for b in equation.bodies]
                places = self._place(bodies[0], first), self._place(bodies[1], second)
                found.append((equation, *places))
        return found

    def _held_by_pads(self) -> list[tuple[Equation, Place, Place]]:
        """Equations of slides, as multibody.model has them: each pad on a line of the other body.

        A telescope holds the outer body's pad where it touches the inner body.
        """
        joints = self.machine.joints
        names = [name for name, joint in joints.items() if isinstance(joint, Slide)]
        telescopes = [d.joint for d in self.machine.drives.values() if isinstance(d, Telescope)]
        touched, found = self.flexible.touched(self.poses), []
        for k, (slide, (inner, outer), (first, second)) in enumerate(self.flexible.pads):
            on_outer, on_inner = (
                self._place(b, touched[:, k, i]) for i, b in ((0, outer), (1, inner))
            )
            front, rear = self._place(inner, first), self._place(outer, second)
            kind = "point" if names[k] in telescopes else "line"
            pads = (
                ("line", on_outer, front, slide.direction - slide.angle),
                (kind, on_inner, rear, slide.direction),
            )
            for kind, a, b, direction in pads:
                bodies, nowhere = (a.number, b.number), ((0.0, 0.0), (0.0, 0.0))
                normal = direction + np.pi / 2
                equation = Equation(f"joints.{names[k]}", kind, bodies, nowhere, 0.0, normal)
                found.append((equation, a, b))
        return found

    def _displaced(self, poses: Array, bent: Mapping[int, Bent], forces: Array) -> list[Equation]:
        """Equations with their points where `bent` beams and springs under `forces` have them."""
        found, row = [], 0
        for equation, inner, outer in self.held:
            points = [self._in_body(place, bent) for place in (inner, outer)]
            turns = [self._turn(place, bent) for place in (inner, outer)]
            constant: Array | float = equation.constant
            force = forces[:, row : row + equation.n_rows]
            row += equation.n_rows
            kind, _, name = equation.key.partition(".")
            joint = self.machine.joints[name] if kind == "joints" else None
            springs = joint.springs if isinstance(joint, Fixed) else None
            if equation.kind == "angle":
                constant = constant + turns[0] - turns[1]
                if springs and isinstance(springs.torsion, float):
                    constant = constant + force[:, 0] / springs.torsion
            elif springs and equation.kind == "point":
                soft = [1.0 / k if isinstance(k, float) else 0.0 for k in (springs.x, springs.y)]
                local = _turned(-poses[:, inner.number, 2] - turns[0], force.T)
                given = np.stack([soft[0] * local[0], soft[1] * local[1]])
                points[0] = points[0] + _turned(turns[0], given)
            direction = equation.direction + (turns[0] if equation.kind == "line" else 0.0)
            ends = (tuple(points[0]), tuple(points[1]))
            found.append(replace(equation, points=ends, constant=constant, direction=direction))
        return found

    def _system(self, equations: list[Equation], poses: Array) -> tuple[Array, Array]:
        """Residual (n, m) and Jacobian (n, m, m) of all bodies but the ground."""
        block = Block(tuple(range(1, len(self.names))), tuple(equations))
        return block.system(poses, self.values)[:2]

    def _loads(self, poses: Array, bent: Mapping[int, Bent]) -> list[tuple[Place | int, Array]]:
        """Weights: those of nodes (n, m, 3) of every beam by number, others (n, 3) by their place.

        Forces along the axes of the body's frame, N, and moments about its origin, N m.
        """
        found: list[tuple[Place | int, Array]] = []
        for place, mass in self.masses:
            force = _down(poses[:, place.number, 2], self.gravity * mass)
            found.append((place, _wrench(self._in_body(place, bent), force)))
        for number, span in self.spans.items():
            nodes, turn = bent[number]
            angle = np.broadcast_to(poses[:, number, 2][:, None], turn.shape)
            force = _down(angle, self.gravity * span.node_mass)
            offset = span.mass_offset.T[:, :, None] * np.ones_like(turn)
            found.append(
                (number, _wrench(np.moveaxis(nodes, -1, 0) + _turned(turn, offset), force))
            )
        return found

    def _bend(
        self,
        equations: list[Equation],
        forces: Array,
        loads: list[tuple[Place | int, Array]],
        poses: Array,
        bent: Mapping[int, Bent],
    ) -> dict[int, Bent]:
        """Beams under `loads` and what joints and drives hold them by."""
        nodes = {number: np.zeros((*span.x.shape, 3)) for number, span in self.spans.items()}

        def add(place: Place, wrench: Array) -> None:
            if place.number in nodes:
                at = self.spans[place.number].node_of[:, place.column]
                nodes[place.number][self.rows, at] += wrench

        for where, load in loads:
            if isinstance(where, Place):
                add(where, load)
            else:
                nodes[where] += load
        row = 0
        for equation, (_, *places) in zip(equations, self.held, strict=True):
            _, derivative = equation.evaluate(poses, self.values)
            held = np.einsum("nr,nrc->nc", forces[:, row : row + equation.n_rows], derivative)
            row += equation.n_rows
            for place, on in zip(places, (held[:, :3], held[:, 3:]), strict=True):
                force = _turned(-poses[:, place.number, 2], on[:, :2].T)
                add(place, -np.column_stack([force[0], force[1], on[:, 2]]))
        return {n: span.bent(bent[n], nodes[n]) for n, span in self.spans.items()}

    def _turn(self, place: Place, bent: Mapping[int, Bent]) -> Array | float:
        """How far (n,) the body turned at a place, rad."""
        if place.column < 0:
            return 0.0
        node = self.spans[place.number].node_of[:, place.column]
        return bent[place.number].turn[self.rows, node]

    def _in_body(self, place: Place, bent: Mapping[int, Bent]) -> Array:
        """Point (2, n) of a place in the frame of its body, m."""
        if place.column < 0:
            return place.point
        span, (nodes, turn) = self.spans[place.number], bent[place.number]
        node = span.node_of[:, place.column]
        arm = place.point - span.straight.nodes[self.rows, node].T
        return nodes[self.rows, node].T + _turned(turn[self.rows, node], arm)

    def _on_ground(self, place: Place, poses: Array, bent: Mapping[int, Bent]) -> Array:
        """Point (n, 2) of a place in the frame of the ground, m."""
        at = poses[:, place.number]
        return at[:, :2] + _turned(at[:, 2], self._in_body(place, bent)).T


def _summed(loads: list[tuple[Place | int, Array]], poses: Array) -> Array:
    """Forces and moments (n, b, 3) on the bodies about the origins of their frames, ground axes."""
    found = np.zeros_like(poses)
    for where, load in loads:
        number = where.number if isinstance(where, Place) else where
        found[:, number] += load if isinstance(where, Place) else load.sum(axis=1)
    found[..., :2] = np.moveaxis(_turned(poses[..., 2], np.moveaxis(found[..., :2], -1, 0)), 0, -1)
    return found


def _inverse(matrix: Array) -> Array:
    """Inverses (n, m, m); NaN where one is singular."""
    try:
        return np.asarray(np.linalg.inv(matrix))
    except np.linalg.LinAlgError:
        singular = ~(np.linalg.det(matrix) != 0.0)
        found = np.linalg.inv(np.where(singular[:, None, None], np.eye(matrix.shape[-1]), matrix))
        found[singular] = np.nan
        return np.asarray(found)


def _down(angle: Array, force: Array) -> Array:
    """Weight (2, ...) of `force` in N along the axes of a frame at `angle`."""
    return np.stack([-force * np.sin(angle), -force * np.cos(angle)])


def _wrench(point: Array, force: Array) -> Array:
    """Force (2, ...) at a point (2, ...), and its moment about the origin, (..., 3)."""
    moment = point[0] * force[1] - point[1] * force[0]
    return np.stack([force[0], force[1], moment], axis=-1)


def _turned(angle: Array | float, point: Array) -> Array:
    """`point` (2, ...) turned by `angle` in rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * point[0] - s * point[1], s * point[0] + c * point[1]])
