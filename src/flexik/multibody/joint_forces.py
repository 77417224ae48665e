"""Joint forces of a rigid planar machine, and what gaps and springs in its joints do to the tip.

The constraints that hold the bodies are as many as their coordinates, so weights and payload fix
the force in each: with the Jacobian J of the constraints and the loads f, J^T forces = f. By the
principle of virtual work the tip gives way, along a unit force on it, by the sum over the
constraints of that force's constraint force times the gap there. A gap opens along the force that
the loads put on the joint, so it changes side where that force changes its sign.
"""

from typing import NamedTuple

import numpy as np

from flexik.kinematics.constraints import equations_of
from flexik.machines.bodies import Point
from flexik.machines.planar import GROUND, Cylinder, Fixed, Pin, PlanarMachine
from flexik.machines.sections import Array

# Forces by `joints.NAME` or `drives.NAME`: of a pin (n, 2) in N, ground frame, on the inner body;
# of a cylinder (n, 1) in N, tension; of a fixed joint (n, 3), the moment last, N m; of a slide
# (n, 2), normal force and moment; of other drives (n, 1)
Forces = dict[str, Array]


class Compliance(NamedTuple):
    """Displacement of the tip in m.

    play : (n, 2, p), for one metre of gap in each of `pins_of` the machine, in their order.
    spring : (n, 2), by torsion springs under weights and payload.
    """

    play: Array
    spring: Array


def pins_of(machine: PlanarMachine) -> dict[str, int]:
    """How many pins the joints and drives that have some have, by their key."""
    found = {f"joints.{name}": 1 for name, j in machine.joints.items() if isinstance(j, Pin)}
    return found | {
        f"drives.{name}": 2 for name, d in machine.drives.items() if isinstance(d, Cylinder)
    }


def joint_forces(
    machine: PlanarMachine, poses: Array, tip_force: Array, gravity: float | None = None
) -> Forces:
    """Forces in joints and drives at `poses` (n, b, 3) under `tip_force` (n, 2) in N and weights.

    gravity : m/s2, of the machine's own weight if not its own; zero leaves the tip force alone.
    """
    gravity = machine.gravity if gravity is None else gravity
    return _forces(machine, poses, [_loads(machine, poses, tip_force, gravity)])[0]


def compliance(machine: PlanarMachine, poses: Array, payload: Array) -> Compliance:
    """What gaps and springs add to the rigid tip at `poses` (n, b, 3) with `payload` (n,) in kg."""
    own = _loads(machine, poses, -machine.gravity * payload[:, None] * [0.0, 1.0], machine.gravity)
    units = [_loads(machine, poses, np.tile(e, (len(poses), 1)), 0.0) for e in np.eye(2)]
    load, *unit = _forces(machine, poses, [own, *units])
    pins = pins_of(machine)
    play, spring = np.empty((len(poses), 2, len(pins))), np.zeros((len(poses), 2))
    for k, (key, n_pins) in enumerate(pins.items()):
        size = np.maximum(np.linalg.norm(load[key], axis=1), np.finfo(float).tiny)
        for axis, forces in enumerate(unit):
            play[:, axis, k] = n_pins * np.sum(forces[key] * load[key], axis=1) / size
    for name, joint in machine.joints.items():
        stiffness = joint.springs.torsion if isinstance(joint, Fixed) else None
        if isinstance(stiffness, float):
            moments = (forces[f"joints.{name}"][:, 2] for forces in unit)
            for axis, moment in enumerate(moments):
                spring[:, axis] += moment * load[f"joints.{name}"][:, 2] / stiffness
    return Compliance(play, spring)


def _forces(machine: PlanarMachine, poses: Array, loads: list[Array]) -> list[Forces]:
    """Forces under each of `loads` (n, 3 b)."""
    equations = equations_of(machine, [GROUND, *machine.bodies])
    n, size = len(poses), 3 * len(machine.bodies)
    transposed = np.zeros((n, 3 + size, size))
    at_rest, row, rows = np.zeros((n, len(machine.drives))), 0, []
    for equation in equations:
        rows.append(slice(row, row + equation.n_rows))
        _, derivative = equation.evaluate(poses, at_rest)
        for body, part in zip(equation.bodies, np.split(derivative, 2, axis=2), strict=True):
            transposed[:, 3 * body : 3 * body + 3, rows[-1]] = part.transpose(0, 2, 1)
        row = rows[-1].stop
    found = np.asarray(np.linalg.solve(transposed[:, 3:], np.stack(loads, axis=-1)), dtype=float)
    results: list[Forces] = []
    for number in range(len(loads)):
        of: dict[str, list[Array]] = {}
        for equation, at in zip(equations, rows, strict=True):
            of.setdefault(equation.key, []).append(found[:, at, number])
        results.append({key: np.concatenate(parts, axis=1) for key, parts in of.items()})
    return results


def _loads(machine: PlanarMachine, poses: Array, tip_force: Array, gravity: float) -> Array:
    """Forces and moments (n, 3 b) of weights and `tip_force` (n, 2) on the bodies."""
    names = [GROUND, *machine.bodies]
    found = np.zeros((len(poses), len(names), 3))

    def add(body: str, point: Point, force: Array) -> None:
        number, (x, y) = names.index(body), point
        c, s = np.cos(poses[:, number, 2]), np.sin(poses[:, number, 2])
        found[:, number, :2] += force
        found[:, number, 2] += (c * x - s * y) * force[..., 1] - (s * x + c * y) * force[..., 0]

    add(*machine.located(machine.payload), tip_force)
    for body, point, mass in machine.masses().values() if gravity else []:
        add(body, point, np.array([0.0, -gravity * mass]))
    return found[:, 1:].reshape(len(poses), 3 * len(machine.bodies))
