"""Poses of the bodies of any planar machine, by Newton's method on its constraints, vectorised.

A pose (n, b, 3) holds x and y in m and the angle in rad of the frame of each of b bodies, the first
of which is the ground. The constraints fall into blocks, each the smallest group of bodies that
those before it hold; a block is solved after the other. On one way of putting a block together the
determinant of its Jacobian keeps its sign, and it is zero at a dead point.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexik.errors import ParameterError
from flexik.kinematics.constraints import Block, Equation, blocks_of, equations_of
from flexik.kinematics.manipulator import Array
from flexik.machines.planar import GROUND, PlanarMachine

# Newton's method is quadratic: after a step this small, in m and rad, only round-off is left
LAST_STEP = 1e-8
NEWTON_STEPS = 12
# How often a way is halved on which the poses are lost
HALVINGS = 6
# Rows that are solved together: they fit the cache
CHUNK = 4096
# About how many poses are kept to start from, and along a drive on either side of the middle
N_STARTS, MOST_STARTS = 700, 16
# How far the angles of a machine file may be off, and the largest turn in one step from them, rad
ASSEMBLY_ANGLE, ASSEMBLY_TURN = np.radians(50.0), 0.3
# A block whose Jacobian has a condition number above this is held twice and free at once
SINGULAR = 1e10


@dataclass(frozen=True)
class Linkage:
    """The rigid bodies of a machine; raises ParameterError where they are free or held twice.

    machine : as its file says.
    near : that of a machine much like it, from whose poses its own are found.
    """

    machine: PlanarMachine
    near: "Linkage | None" = None

    def __post_init__(self) -> None:
        self.starts  # noqa: B018  what is wrong with a machine shows at once

    @cached_property
    def names(self) -> list[str]:
        """Bodies in the order of the poses."""
        return [GROUND, *self.machine.bodies]

    @cached_property
    def lower(self) -> Array:
        """Least actuator coordinates (k,)."""
        return np.array([drive.limits[0] for drive in self.machine.drives.values()])

    @cached_property
    def upper(self) -> Array:
        """Largest actuator coordinates (k,)."""
        return np.array([drive.limits[1] for drive in self.machine.drives.values()])

    @cached_property
    def equations(self) -> list[Equation]:
        """All constraints of joints and drives."""
        return equations_of(self.machine, self.names)

    @cached_property
    def blocks(self) -> list[Block]:
        """Groups of bodies in the order of solving."""
        return blocks_of(self.names, self.equations)

    @cached_property
    def starts(self) -> tuple[Array, Array, Array]:
        """Coordinates (s, k), poses (s, b, 3) and tangents (s, b, 3, k) on a grid of the limits.

        Those of `near` will do where there is one. Raises ParameterError, which names drive and
        loop, if the loops do not close on all of it.
        """
        if self.near is not None:
            return self.near.starts
        middle = (self.lower + self.upper)[None] / 2
        values, poses = middle, self._assembled(middle)
        half = min(max(1, int(N_STARTS ** (1 / len(self.lower))) // 2), MOST_STARTS)
        for drive, step in enumerate((self.upper - self.lower) / 2 / half):
            sides = [(values, poses)]
            for sign in (-1, 1):
                at, pose = values, poses
                for k in range(1, half + 1):
                    ahead = values.copy()
                    ahead[:, drive] += sign * step * k
                    pose, at = self._followed(drive, pose, at, ahead), ahead
                    sides.append((at, pose))
            values = np.concatenate([side[0] for side in sides])
            poses = np.concatenate([side[1] for side in sides])
        order = np.lexsort(values.T[::-1])
        values, poses = values[order], poses[order]
        return values, poses, self.tangents(poses, values)

    @cached_property
    def payload(self) -> tuple[int, Array]:
        """Number of the body that carries the payload, and the tip in its frame."""
        body, point = self.machine.located(self.machine.payload)
        return self.names.index(body), np.array(point)

    def tip(self, poses: Array) -> tuple[Array, Array]:
        """Tip (n, 2) at `poses` (n, b, 3), and its arm (n, 2) from the origin of its body."""
        body, (x, y) = self.payload
        c, s = np.cos(poses[:, body, 2]), np.sin(poses[:, body, 2])
        arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
        return poses[:, body, :2] + arm, arm

    def poses(self, values: Array) -> Array:
        """Poses (n, b, 3) at `values` (n, k), NaN where the loops do not close."""
        grid, poses, tangents = self.starts
        per_drive = round(len(grid) ** (1 / grid.shape[1]))
        found = np.empty((len(values), *poses.shape[1:]))
        for begin in range(0, len(values), CHUNK):
            ahead = values[begin : begin + CHUNK]
            share = np.nan_to_num((ahead - self.lower) / (self.upper - self.lower))
            index = np.clip(np.rint(share * (per_drive - 1)), 0, per_drive - 1).astype(int)
            start = np.ravel_multi_index(tuple(index.T), (per_drive,) * grid.shape[1])
            found[begin : begin + CHUNK] = self.follow(
                poses[start], grid[start], ahead, tangents[start]
            )
        return found

    def follow(
        self, poses: Array, values: Array, ahead: Array, tangents: Array | None = None
    ) -> Array:
        """Poses (n, b, 3) at `ahead` (n, k) on the way from `poses` at `values`; NaN where lost."""
        return self._follow(poses, values, ahead, tangents, HALVINGS)

    def tangents(self, poses: Array, values: Array) -> Array:
        """Derivatives (n, b, 3, k) of `poses` (n, b, 3) by the coordinates `values` (n, k)."""
        found = np.zeros((*poses.shape, values.shape[1]))
        for block in self.blocks:
            _, jacobian, earlier = block.system(poses, values)
            right = np.zeros((*jacobian.shape[:2], values.shape[1]))
            for body, derivative in earlier:
                right -= derivative @ found[:, body]
            row = 0
            for equation in block.equations:
                if equation.drive is not None:
                    right[:, row, equation.drive] += 1.0
                row += equation.n_rows
            found[:, block.bodies] = _solved(jacobian, right).reshape(
                len(poses), len(block.bodies), 3, values.shape[1]
            )
        return found

    @cached_property
    def _signs(self) -> list[float]:
        """Sign of the determinant of each block, as assembled."""
        if self.near is not None:
            return self.near._signs
        middle = (self.lower + self.upper)[None] / 2
        poses = self._assembled(middle)
        return [float(_sign(b.system(poses, middle)[1])[0]) for b in self.blocks]

    def _follow(
        self, poses: Array, values: Array, ahead: Array, tangents: Array | None, halvings: int
    ) -> Array:
        if tangents is None:
            tangents = self.tangents(poses, values)
        found = poses + np.einsum("nbcd,nd->nbc", tangents, ahead - values)
        lost = np.zeros(len(poses), dtype=bool)
        for block, sign in zip(self.blocks, self._signs, strict=True):
            lost |= ~_newton(block, found, ahead, sign)
        found[lost] = np.nan
        lost &= np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(ahead).all(axis=1)
        if lost.any() and halvings:
            middle = (values[lost] + ahead[lost]) / 2
            between = self._follow(poses[lost], values[lost], middle, tangents[lost], halvings - 1)
            found[lost] = self._follow(between, middle, ahead[lost], None, halvings - 1)
        return found

    def _followed(self, drive: int, poses: Array, values: Array, ahead: Array) -> Array:
        """`follow` as `drive` alone moves; raises ParameterError if a row is lost."""
        found = self.follow(poses, values, ahead)
        lost = np.isnan(found).any(axis=(1, 2))
        if not lost.any():
            return found
        row = np.flatnonzero(lost)[:1]
        pose, at = poses[row], values[row]
        step = (ahead[row] - at) / 2
        for _ in range(12):  # how far it does go
            nearer = self.follow(pose, at, at + step)
            if np.isfinite(nearer).all():
                pose, at = nearer, at + step
            step = step / 2
        name, given = list(self.machine.drives.items())[drive]
        condition = [np.linalg.cond(b.system(pose, at)[1])[0] for b in self.blocks]
        loop = self._words(self.blocks[int(np.argmax(condition))].bodies)
        unit = "rad" if given.kind == "revolute" else "m"
        span, dead = "", float(at[0, drive])
        if given.kind == "cylinder":
            low, high = (given.retracted + limit for limit in given.limits)
            span = (
                f", where the points are {given.retracted + dead:.4g} m apart; with retracted it "
            )
            span += f"spans {low:.4g} to {high:.4g} m"
        raise ParameterError(
            f"drives.{name}.limits: expected a loop that closes from {given.limits[0]:g} to "
            f"{given.limits[1]:g} {unit}; that of {loop} has its dead point at {dead:.4g}{span}"
        )

    def _words(self, bodies: tuple[int, ...]) -> str:
        return ", ".join(self.names[body] for body in bodies)

    def _angles(self, values: Array) -> Array:
        """Angles (b,) of the machine file, at `values` (k,); those that joints give are theirs."""
        angles = np.array([0.0, *(body.angle for body in self.machine.bodies.values())])
        for block in self.blocks:
            for e in block.equations:
                if e.kind == "angle" and len(block.bodies) == 1:
                    turn = e.constant + (0.0 if e.drive is None else values[e.drive])
                    inner, outer = e.bodies
                    if outer in block.bodies:
                        angles[outer] = angles[inner] + turn
                    else:
                        angles[inner] = angles[outer] - turn
        return angles

    def _apart(self, block: Block, poses: Array) -> str:
        """What the cylinders of a block span, and how far apart their points are in `poses`."""
        words = ""
        for e in block.equations:
            if e.kind == "distance" and e.drive is not None:
                distance = float(e.evaluate(poses, np.zeros((1, len(self.lower))))[0][0, 0])
                shortest, longest = (
                    e.constant + self.lower[e.drive],
                    e.constant + self.upper[e.drive],
                )
                words += (
                    f"; {e.key}.retracted + limits are {shortest:.4g} to {longest:.4g} m, at the "
                    f"angles given its points are {distance + e.constant:.4g} m apart"
                )
        return words

    def _assembled(self, values: Array) -> Array:
        """Pose (1, b, 3) at `values` (1, k) that the angles of the machine file mean."""
        angles = self._angles(values[0])
        poses = _placed(angles, self.equations)
        for block in self.blocks:
            apart = self._apart(block, poses)
            closed = _newton(block, poses, values, None, ASSEMBLY_TURN, 5 * NEWTON_STEPS)
            words = self._words(block.bodies)
            joints = ", ".join(dict.fromkeys(e.key for e in block.equations))
            if not closed.all():
                raise ParameterError(
                    f"bodies: {words} cannot be put together ({joints}) with all drives in the "
                    f"middle of their limits: expected other dimensions or angles{apart}"
                )
            if np.linalg.cond(block.system(poses, values)[1])[0] > SINGULAR:
                raise ParameterError(
                    f"bodies: {words}: {joints} hold one motion twice and leave another free"
                )
            for body in block.bodies:
                angle = np.angle(np.exp(1j * poses[0, body, 2]))
                if np.cos(angle - angles[body]) < np.cos(ASSEMBLY_ANGLE):
                    raise ParameterError(
                        f"bodies.{self.names[body]}.angle: expected about its angle with all "
                        f"drives in the middle of their limits, {angle:.3g} rad is one"
                    )
        return poses


def _newton(
    block: Block,
    poses: Array,
    values: Array,
    sign: float | None,
    turn: float = np.inf,
    steps: int = NEWTON_STEPS,
) -> NDArray[np.bool_]:
    """Solve a block in `poses` (n, b, 3), in place; which rows (n,) closed, with `sign` if given.

    turn : largest turn of a body in one step, rad.
    """
    rows = np.arange(len(poses))
    closed = np.zeros(len(poses), dtype=bool)
    bodies = list(block.bodies)
    for _ in range(steps):
        some = slice(None) if len(rows) == len(poses) else rows
        residual, jacobian, _ = block.system(poses[some], values[some])
        step = _solved(jacobian, -residual[..., None]).reshape(len(rows), len(bodies), 3)
        if np.isfinite(turn):
            step *= np.minimum(1.0, turn / (np.abs(step[..., 2]).max(axis=1) + 1e-300))[
                :, None, None
            ]
        poses[rows[:, None], bodies] += step
        last = np.abs(step).max(axis=(1, 2)) <= LAST_STEP
        if last.any():
            closed[rows[last]] = True if sign is None else _sign(jacobian[last]) == sign
            rows = rows[~last]
            if not len(rows):
                break
    return closed


def _placed(angles: Array, equations: list[Equation]) -> Array:
    """Pose (1, b, 3) of bodies at `angles` (b,), their joints as closed as that lets them."""
    poses = np.zeros((1, len(angles), 3))
    poses[0, :, 2] = angles
    matrix, right = [], []
    for equation in equations:
        if equation.kind in ("point", "line") and equation.drive is None:
            residual, derivative = equation.evaluate(poses, np.zeros((1, 0)))
            for value, by in zip(residual[0], derivative[0], strict=True):
                row = np.zeros((len(angles), 2))
                row[equation.bodies[0]] += by[:2]
                row[equation.bodies[1]] += by[3:5]
                matrix.append(row[1:].ravel())
                right.append(-value)
    places = np.linalg.lstsq(np.array(matrix), np.array(right), rcond=None)[0]
    poses[0, 1:, :2] = places.reshape(-1, 2)
    return poses


def _solved(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=float)
    except np.linalg.LinAlgError:  # exactly singular: any large step does
        nearly = matrix + 1e-12 * np.eye(matrix.shape[-1])
        return np.asarray(np.linalg.solve(nearly, right), dtype=float)


def _sign(jacobian: Array) -> Array:
    return np.sign(np.linalg.det(jacobian))
