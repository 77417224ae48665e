"""What joints and drives of a planar machine ask of the poses of its bodies, as equations."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.manipulator import Array
from flexik.machines.bodies import Point
from flexik.machines.planar import PlanarMachine

Ends = Point | tuple[Array, Array]


@dataclass(frozen=True)
class Equation:
    """One or two constraints between two bodies, 0 = residual.

    key : of the joint or drive in the machine file.
    kind : `point` (the points are one, two equations), `angle` (between the bodies), `distance` (of
        the points) or `line` (distance of the points along `direction` of the first body).
    constant, drive : what angle or distance is, in rad or m; plus a coordinate if there is a drive.
    of : names of the points in the machine file.

    Points, constant and direction may be numbers of every row, (n,).
    """

    key: str
    kind: str
    bodies: tuple[int, int]
    points: tuple[Ends, Ends]
    constant: Array | float = 0.0
    direction: Array | float = 0.0
    drive: int | None = None
    of: tuple[str, str] = ("", "")

    @property
    def n_rows(self) -> int:
        """How many equations it is."""
        return 2 if self.kind == "point" else 1

    def by_point(self, poses: Array, end: int) -> Array:
        """Derivatives (n, rows, 2) of the residuals by the point of its first or second body."""
        inner, outer = (poses[:, body] for body in self.bodies)
        angle = (inner, outer)[end][:, 2]
        turned = np.stack([_turned(angle, (1.0, 0.0)), _turned(angle, (0.0, 1.0))], axis=-1)
        sign = 1.0 if end else -1.0
        if self.kind == "point":
            return sign * turned
        if self.kind == "angle":
            return np.zeros((len(poses), 1, 2))
        if self.kind == "distance":
            arms = [_turned(b[:, 2], p) for b, p in zip((inner, outer), self.points, strict=True)]
            gap = outer[:, :2] - inner[:, :2] + (arms[1] - arms[0])
            along = gap / np.hypot(gap[:, 0], gap[:, 1])[:, None]
        else:
            along = _turned(inner[:, 2] + self.direction, (1.0, 0.0))
        return sign * along[:, None] @ turned

    def evaluate(self, poses: Array, values: Array) -> tuple[Array, Array]:
        """Residuals (n, rows), and their derivatives (n, rows, 6) by the poses of both bodies."""
        inner, outer = (poses[:, body] for body in self.bodies)
        derivative = np.zeros((len(poses), self.n_rows, 6))
        wanted: Array | float = self.constant
        if self.drive is not None:
            wanted = wanted + values[:, self.drive]
        if self.kind == "angle":
            derivative[:, 0, 2], derivative[:, 0, 5] = -1.0, 1.0
            return (outer[:, 2] - inner[:, 2] - wanted)[:, None], derivative
        arms = [_turned(b[:, 2], p) for b, p in zip((inner, outer), self.points, strict=True)]
        gap = outer[:, :2] - inner[:, :2] + (arms[1] - arms[0])
        if self.kind == "point":
            derivative[:, [0, 1], [0, 1]], derivative[:, [0, 1], [3, 4]] = -1.0, 1.0
            derivative[:, 0, 2], derivative[:, 0, 5] = arms[0][:, 1], -arms[1][:, 1]
            derivative[:, 1, 2], derivative[:, 1, 5] = -arms[0][:, 0], arms[1][:, 0]
            return gap, derivative
        turning: Array | float = 0.0
        if self.kind == "distance":
            along = gap / np.hypot(gap[:, 0], gap[:, 1])[:, None]
        else:
            along = _turned(inner[:, 2] + self.direction, (1.0, 0.0))
            turning = _cross(along, gap)
        derivative[:, 0, :2], derivative[:, 0, 3:5] = -along, along
        derivative[:, 0, 2] = turning - _cross(arms[0], along)
        derivative[:, 0, 5] = _cross(arms[1], along)
        length = along[:, 0] * gap[:, 0] + along[:, 1] * gap[:, 1]
        return (length - wanted)[:, None], derivative


@dataclass(frozen=True)
class Block:
    """Bodies that `equations`, as many as they have coordinates, hold to the bodies before."""

    bodies: tuple[int, ...]
    equations: tuple[Equation, ...]

    def system(self, poses: Array, values: Array) -> tuple[Array, Array, list[tuple[int, Array]]]:
        """Residual (n, m), Jacobian (n, m, m), and the derivatives (n, m, 3) by earlier bodies."""
        size, n = 3 * len(self.bodies), len(poses)
        residual, jacobian = np.empty((n, size)), np.zeros((n, size, size))
        earlier: list[tuple[int, Array]] = []
        row = 0
        for equation in self.equations:
            rows = slice(row, row + equation.n_rows)
            residual[:, rows], derivative = equation.evaluate(poses, values)
            for body, part in zip(equation.bodies, np.split(derivative, 2, axis=2), strict=True):
                if body in self.bodies:
                    column = 3 * self.bodies.index(body)
                    jacobian[:, rows, column : column + 3] = part
                elif body:
                    whole = np.zeros((n, size, 3))
                    whole[:, rows] = part
                    earlier.append((body, whole))
            row = rows.stop
        return residual, jacobian, earlier


def equations_of(machine: PlanarMachine, names: list[str]) -> list[Equation]:
    """Constraints of the joints and drives of `machine`; `names` of bodies, ground first."""
    found: list[Equation] = []

    def add(
        key: str,
        kind: str,
        of: tuple[str, str],
        constant: float = 0.0,
        direction: float = 0.0,
        drive: int | None = None,
    ) -> None:
        ends = [machine.located(end) for end in of]
        bodies = names.index(ends[0].body), names.index(ends[1].body)
        points = ends[0].point, ends[1].point
        found.append(Equation(key, kind, bodies, points, constant, direction, drive, of))

    for name, joint in machine.joints.items():
        key = f"joints.{name}"
        if joint.kind == "slide":
            add(key, "line", joint.of, 0.0, joint.direction + np.pi / 2)
        else:
            add(key, "point", joint.of)
        if joint.kind != "pin":
            add(key, "angle", joint.of, joint.angle)
    for number, (name, drive) in enumerate(machine.drives.items()):
        key = f"drives.{name}"
        if drive.kind == "cylinder":
            add(key, "distance", drive.of, drive.retracted, drive=number)
        elif drive.kind == "telescope":
            slide = machine.joints[drive.joint]
            direction = slide.direction if slide.kind == "slide" else 0.0
            add(key, "line", drive.of, drive.retracted, direction, drive=number)
        else:
            add(key, "angle", machine.joints[drive.joint].of, drive.zero, drive=number)
    return found


def blocks_of(names: list[str], equations: list[Equation]) -> list[Block]:
    """Blocks in order of solving; raises ParameterError where bodies are free or held twice."""
    held, waiting = {0}, list(range(1, len(names)))
    blocks: list[Block] = []
    while waiting:
        block = _next_block(held, waiting, equations)
        rows = sum(equation.n_rows for equation in block.equations)
        words = ", ".join(names[body] for body in block.bodies)
        missing = 3 * len(block.bodies) - rows
        if missing:
            joints = ", ".join(dict.fromkeys(e.key for e in block.equations)) or "nothing"
            what = f"leave {missing} free" if missing > 0 else f"hold {-missing} too often"
            drives = [e.key for e in block.equations if e.drive is not None]
            if missing < 0 and len(drives) > 1:
                what += f"; is one of {', '.join(drives)} too many?"
            raise ParameterError(
                f"bodies: {words}: expected each of {3 * len(block.bodies)} motions held once by "
                f"joints and drives, but {joints} {what}"
            )
        blocks.append(block)
        held |= set(block.bodies)
        waiting = [body for body in waiting if body not in held]
    return blocks


def _next_block(held: set[int], waiting: list[int], equations: list[Equation]) -> Block:
    """The smallest group of `waiting` bodies that the `held` ones hold, or else all of them."""
    for size in range(1, len(waiting) + 1):
        for bodies in combinations(waiting, size):
            known = held | set(bodies)
            own = [e for e in equations if set(e.bodies) <= known and not set(e.bodies) <= held]
            if sum(e.n_rows for e in own) >= 3 * size:
                return Block(bodies, tuple(own))
    return Block(tuple(waiting), tuple(own))


def _turned(angle: Array, point: Ends) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * point[0] - s * point[1], s * point[0] + c * point[1]], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
