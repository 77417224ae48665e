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
from flexik.machines.planar import GROUND, Cylinder, Fixed, Pin, PlanarMachine, Telescope
from flexik.machines.sections import Array

# Forces by `joints.NAME` or `drives.NAME`: of a pin (n, 2) in N, ground frame, on the inner body;
# of a cylinder (n, 1) in N, tension; of a fixed joint (n, 3), the moment last, N m; of a slide
# (n, 2), normal force and moment; of other drives (n, 1)
Forces = dict[str, Array]


class Compliance(NamedTuple):
    """Displacement of the tip in m.

    play : (n, 2, p), for one metre of gap in each of `pins_of` the machine, in their order.
    spring : (n, 2, s), by each of `springs_of` the machine under weights and payload.
    coordinate : (n, 2, k), for one m or rad of each drive.
    point : (n, 2, 2 d), for one metre of x and y of each of `points_of`, in the frame of its body.
    """

    play: Array
    spring: Array
    coordinate: Array
    point: Array


def pins_of(machine: PlanarMachine) -> dict[str, int]:
    """How many pins the joints and drives that have some have, by their key."""
    found = {f"joints.{name}": 1 for name, j in machine.joints.items() if isinstance(j, Pin)}
    return found | {
        f"drives.{name}": 2 for name, d in machine.drives.items() if isinstance(d, Cylinder)
    }


def springs_of(machine: PlanarMachine) -> dict[str, float]:
    """Stiffness of the springs in fixed joints, N m/rad or N/m, by their key."""
    return {
        f"joints.{name}.springs.{axis}": stiffness
        for name, joint in machine.joints.items()
        if isinstance(joint, Fixed)
        for axis, stiffness in joint.springs
        if isinstance(stiffness, float)
    }


def points_of(machine: PlanarMachine) -> list[str]:
    """Points that put the tip where it is: of pins, cylinders and telescopes, and of the payload.

    Origins of frames are left out, for the others are measured from them.
    """
    parts: list[Pin | Cylinder | Telescope]
    parts = [p for p in machine.joints.values() if isinstance(p, Pin)]
    parts += [d for d in machine.drives.values() if isinstance(d, Cylinder | Telescope)]
    ends = dict.fromkeys([*(end for part in parts for end in part.of), machine.payload])
    return [end for end in ends if any(machine.located(end).point)]


def point_key(end: str) -> str:
    """Dotted key in the machine file of a point `body.point`."""
    body, _, point = end.partition(".")
    return end if body == GROUND else f"bodies.{body}.points.{point}"


def joint_forces(
    machine: PlanarMachine, poses: Array, tip_force: Array, gravity: float | None = None
) -> Forces:
    """Forces in joints and drives at `poses` (n, b, 3) under `tip_force` (n, 2) in N and weights.

    gravity : m/s2, of the machine's own weight if not its own; zero leaves the tip force alone.
    """
    gravity = machine.gravity if gravity is None else gravity
    return _forces(machine, poses, [_loads(machine, poses, tip_force, gravity)])[0]


def compliance(machine: PlanarMachine, poses: Array, payload: Array) -> Compliance:
    """What the tip does at `poses` (n, b, 3) with `payload` (n,) in kg, see Compliance."""
    own = _loads(machine, poses, -machine.gravity * payload[:, None] * [0.0, 1.0], machine.gravity)
    units = [_loads(machine, poses, np.tile(e, (len(poses), 1)), 0.0) for e in np.eye(2)]
    load, *unit = _forces(machine, poses, [own, *units])

    def by_unit(key: str) -> Array:
        return np.stack([forces[key] for forces in unit], axis=1)

    play = []
    for key, n_pins in pins_of(machine).items():
        size = np.maximum(np.linalg.norm(load[key], axis=1), np.finfo(float).tiny)
        play.append(n_pins * np.sum(by_unit(key) * load[key][:, None], axis=2) / size[:, None])
    spring = []
    for key, stiffness in springs_of(machine).items():
        joint, _, axis = key.partition(".springs.")
        body = machine.located(machine.joints[joint.partition(".")[2]].of[0]).body
        along = _axis(axis, poses[:, [GROUND, *machine.bodies].index(body), 2])
        of_unit, of_load = by_unit(joint) @ along[..., None], np.sum(load[joint] * along, axis=1)
        spring.append(of_unit[..., 0] * of_load[:, None] / stiffness)
    coordinate = [by_unit(f"drives.{name}")[..., 0] for name in machine.drives]
    stacked = [
        np.stack(columns, axis=2) if columns else np.zeros((len(poses), 2, 0))
        for columns in (play, spring, coordinate)
    ]
    return Compliance(stacked[0], stacked[1], stacked[2], _by_points(machine, poses, unit))


def _axis(name: str, angle: Array) -> Array:
    """Unit force or moment (n, 3) of a spring between bodies, the inner at `angle` (n,)."""
    c, s, zero = np.cos(angle), np.sin(angle), np.zeros(len(angle))
    across = {"x": (c, s, zero), "y": (-s, c, zero), "torsion": (zero, zero, zero + 1.0)}
    return np.stack(across[name], axis=1)


def _by_points(machine: PlanarMachine, poses: Array, unit: list[Forces]) -> Array:
    """Displacement (n, 2, 2 d) of the tip for one metre of x and y of `points_of`."""
    ends, rows = points_of(machine), dict.fromkeys(unit[0], 0)
    found = np.zeros((len(poses), 2, 2 * len(ends)))
    for equation in equations_of(machine, [GROUND, *machine.bodies]):
        at = slice(rows[equation.key], rows[equation.key] + equation.n_rows)
        rows[equation.key] = at.stop
        forces = np.stack([of[equation.key][:, at] for of in unit], axis=1)
        for number, end in enumerate(equation.of):
            if end in ends:
                columns = slice(2 * ends.index(end), 2 * ends.index(end) + 2)
                found[:, :, columns] -= forces @ equation.by_point(poses, number)
    if machine.payload in ends:
        angle = poses[:, [GROUND, *machine.bodies].index(machine.located(machine.payload).body), 2]
        k = 2 * ends.index(machine.payload)
        found[:, :, k : k + 2] += np.stack([_axis(a, angle)[:, :2] for a in "xy"], axis=2)
    return found


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
