"""Any planar machine as a manipulator: tip, derivatives, and an inverse with limits and a rule.

The inverse is a damped Newton method (Levenberg-Marquardt) on the gap between tip and target, in
shares of the drives' ranges. A drive that a step takes beyond its limit stays on the limit for that
step. With more drives than two the step is the shortest, so that the solution lies near the start.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.kinematics.loops import CHUNK, Linkage
from flexik.kinematics.manipulator import Array, RigidSolution
from flexik.kinematics.status import ACTUATOR_LIMIT, NOT_CONVERGED, OUT_OF_REACH, REACHED
from flexik.machines.planar import PlanarMachine

Rows = NDArray[np.intp]

# The tip is on its target this near, m
ON_TARGET = 1e-10
# Steps of the inverse; the longest step, and one that ends it, in shares of the ranges
MOST_STEPS, LONGEST_STEP, LAST_STEP = 50, 0.2, 1e-12
# A step that leaves more than this share of the gap is slow; a search with more of them is stuck
SLOW, SLOW_STEPS = 0.9, 4
# Damping at first, in shares of the mean square derivative, and what is too little to matter
DAMPING, UNDAMPED = 1e-5, 1e-12
# Steps along the solutions of a redundant machine to the best one, and one that ends them
IMPROVING_STEPS, IMPROVED = 30, 1e-8


class Search(NamedTuple):
    """Coordinates (n, k) that a search ended on, the gap (n,) in m, and if it was stuck (n,)."""

    values: Array
    gap: Array
    stuck: NDArray[np.bool_]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Rows on target, (n,)."""
        return self.gap <= ON_TARGET

    def but(self, rows: Rows, other: "Search") -> "Search":
        """The same, but for those of `rows` (m,) that `other` of m rows reached."""
        found = Search(self.values.copy(), self.gap.copy(), self.stuck.copy())
        for mine, its in zip(found, other, strict=True):
            mine[rows[other.reached]] = its[other.reached]
        return found


@dataclass(frozen=True)
class PlanarManipulator:
    """See kinematics.manipulator.Manipulator; any number of drives, strokes in m or angles in rad.

    near : see kinematics.loops.Linkage.

    Raises ParameterError, which names the key, where the machine is no mechanism.
    """

    machine: PlanarMachine
    near: Linkage | None = None

    def __post_init__(self) -> None:
        self.linkage  # noqa: B018  what is wrong with a machine shows at once

    @cached_property
    def linkage(self) -> Linkage:
        """The bodies and what holds them."""
        return Linkage(self.machine, self.near)

    @property
    def lower(self) -> Array:
        """Least actuator coordinates (k,)."""
        return self.linkage.lower

    @property
    def upper(self) -> Array:
        """Largest actuator coordinates (k,)."""
        return self.linkage.upper

    def forward(self, values: Array) -> Array:
        """Tip (n, 2) in m at coordinates (n, k); NaN where the loops do not close."""
        values = np.atleast_2d(np.asarray(values, dtype=float))
        return self.linkage.tip(self.linkage.poses(values))[0]

    def derivatives(self, values: Array) -> Array:
        """Derivatives (n, 2, k) of the tip by the coordinates `values` (n, k)."""
        values = np.atleast_2d(np.asarray(values, dtype=float))
        return self._moved(self.linkage.poses(values), values)[1]

    @cached_property
    def reach(self) -> Array:
        """About the least and the largest x and y of the tip, (2, 2) in m, row by row."""
        tips = self._starts[0]
        return np.stack([tips.min(axis=0), tips.max(axis=0)], axis=1)

    def branch(self, values: Array) -> Array:
        """Coordinates from the third on (n, k - 2); of two drives the side of the elbow (n, 1)."""
        values = np.atleast_2d(values)
        if values.shape[1] != 2:
            return values[:, 2:]
        return np.where(self._side(self.derivatives(values)) < 0, -1.0, 1.0)[:, None]

    def inverse(
        self, targets: Array, current: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """See Manipulator.

        With `smallest_first`, that drive is as near to its lower limit as the original target lets
        it be; where the target is not reached with it, as the target lets it be from there on, or
        else at all. On the side of the elbow of the assembly pose, unless only the other reaches.
        Without, the solution is the nearest one to that of the original target, which is the
        nearest to `current`, in shares of the ranges; of two drives, where the search leads to.
        """
        targets, current = (np.atleast_2d(np.asarray(v, dtype=float)) for v in (targets, current))
        original = targets if original_targets is None else np.atleast_2d(original_targets)
        parts = [
            self._inverse(*(v[k : k + CHUNK] for v in (targets, current, original)))
            for k in range(0, len(targets), CHUNK)
        ]
        if not parts:
            return RigidSolution(current, np.zeros(0, dtype=np.int64))
        values, status = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
        return RigidSolution(values, status).or_current(current)

    @cached_property
    def _first(self) -> int | None:
        """Number of the drive of `smallest_first`."""
        name = self.machine.smallest_first
        return None if name is None else list(self.machine.drives).index(name)

    @cached_property
    def _starts(self) -> tuple[Array, Array]:
        """Tip (s, 2) and side of the elbow (s,) of the poses that the linkage starts from."""
        values, poses, _ = self.linkage.starts
        tip, derivatives, _ = self._moved(poses, values)
        return tip, self._side(derivatives)

    def _inverse(
        self, targets: Array, current: Array, original: Array
    ) -> tuple[Array, NDArray[np.int64]]:
        changed = not np.array_equal(original, targets)
        if self._first is None:
            if changed:
                found = self._nearest(original, current)
                current = np.where(found.reached[:, None], found.values, current)
            found = self._nearest(targets, current)
        else:
            least = np.full(len(targets), self.lower[self._first])
            needed = least
            if changed:
                found = self._smallest(original, least)
                needed = np.where(found.reached, found.values[:, self._first], least)
            found = self._smallest(targets, needed)
            rows = np.flatnonzero(~found.reached & (needed > least))
            found = found.but(rows, self._smallest(targets[rows], least[rows]))
        return found.values, self._status(targets, found)

    def _nearest(self, targets: Array, current: Array) -> Search:
        """Search from `current` (n, k), or else from the poses whose tip is nearest to a target."""
        low, high = (np.tile(limit, (len(targets), 1)) for limit in (self.lower, self.upper))
        found = self._search(targets, current, low, high)
        for side in self._sides:
            rows = np.flatnonzero(~found.reached)
            start = self._start(targets[rows], side)
            found = found.but(rows, self._search(targets[rows], start, low[rows], high[rows]))
        return found if current.shape[1] < 3 else self._improved(targets, found, low, high, current)

    def _smallest(self, targets: Array, least: Array) -> Search:
        """Search with the drive of `smallest_first` from `least` (n,) on as small as it can be."""
        low, high = (np.tile(limit, (len(targets), 1)) for limit in (self.lower, self.upper))
        low[:, self._first] = least
        held = high.copy()
        held[:, self._first] = least
        found = self._search(targets, self._start(targets, self._sides[0], least), low, held)
        rows = np.flatnonzero(~found.reached)
        start = self._start(targets[rows], self._sides[1], least[rows])
        found = found.but(rows, self._search(targets[rows], start, low[rows], held[rows]))
        beyond = np.flatnonzero(~found.reached)
        farther = (least + self.upper[self._first]) / 2
        for side, near in ((s, n) for n in (None, farther) for s in self._sides):
            # either side may need less; a start farther out is for what neither reached
            rows = beyond if near is None else np.flatnonzero(~found.reached)
            start = self._start(targets[rows], side, None if near is None else near[rows])
            ahead = self._search(targets[rows], start, low[rows], high[rows])
            ahead = self._improved(targets[rows], ahead, low[rows], high[rows])
            larger = ahead.values[:, self._first] >= found.values[rows, self._first]
            larger &= found.reached[rows]
            found = found.but(rows, ahead._replace(gap=np.where(larger, np.inf, ahead.gap)))
        return found

    def _improved(
        self, targets: Array, found: Search, low: Array, high: Array, near: Array | None = None
    ) -> Search:
        """`found` as near to `near` (n, k) as the solutions lead, where reached.

        Without `near`, with as small a first drive. A projected gradient method whose steps are
        those of Barzilai and Borwein: with three drives a secant method for the place where the
        solutions turn back. A step that gains nothing is cut.
        """
        rows = np.flatnonzero(found.reached)
        span, values, factor = self.upper - self.lower, found.values.copy(), np.ones(len(low))
        last, turn = np.full_like(values, np.nan), np.zeros_like(values)
        for _ in range(IMPROVING_STEPS):
            if not len(rows):
                break
            here, still = values[rows], np.zeros((len(rows), 2))
            slope = self.derivatives(here) * span
            room = (low[rows] - here) / span, (high[rows] - here) / span
            worth, wish = self._worth(here, near, rows)
            # where the solutions lead: only drives on a limit are held
            down, up = (np.sign(r) * (np.abs(r) > LAST_STEP) for r in room)
            pull = _step(slope, still, (down, up), UNDAMPED, wish)
            moved, turned = (here - last[rows]) / span, turn[rows] - pull
            bent = np.abs(np.sum(moved * turned, axis=1))
            fresh = bent > 0  # not at first, and not where the last step was cut
            factor[rows[fresh]] = (np.sum(moved**2, axis=1)[fresh] / bent[fresh]).clip(max=1e6)
            step = _shortened(factor[rows, None] * pull, LONGEST_STEP)
            step = _step(slope, still, room, UNDAMPED, step)
            tried = self._search(targets[rows], here + step * span, low[rows], high[rows])
            gained = tried.reached & (self._worth(tried.values, near, rows)[0] < worth)
            last[rows] = np.where(gained[:, None], here, np.nan)
            turn[rows], factor[rows] = pull, factor[rows] * np.where(gained, 1.0, 0.2)
            values[rows[gained]] = tried.values[gained]
            rows = rows[np.abs(step).max(axis=1) > IMPROVED]
        return found._replace(values=values)

    def _worth(self, values: Array, near: Array | None, rows: Rows) -> tuple[Array, Array]:
        """What `_improved` lessens (n,), and the way (n, k), at most 1 long, in which it falls."""
        if near is not None:
            away = (near[rows] - values) / (self.upper - self.lower)
            return _length(away), away
        first = self._first or 0
        return values[:, first], np.repeat(-np.eye(values.shape[1])[[first]], len(values), axis=0)

    def _search(self, targets: Array, start: Array, lower: Array, upper: Array) -> Search:
        """Search for `targets` (n, 2) from `start` (n, k) within bounds (n, k)."""
        span = self.upper - self.lower
        values = np.clip(start, lower, upper)
        poses = self.linkage.poses(values)
        tip, slope, tangents = self._moved(poses, values)
        gap = _length(targets - tip)
        damping, slow = np.full(len(values), DAMPING), np.zeros(len(values), dtype=int)
        stuck = np.zeros(len(values), dtype=bool)
        for _ in range(MOST_STEPS):
            rows = np.flatnonzero((gap > ON_TARGET) & ~stuck)
            if not len(rows):
                break
            at, low, high = values[rows], lower[rows], upper[rows]
            room = (low - at) / span, (high - at) / span
            step = _step(slope[rows] * span, (targets - tip)[rows], room, damping[rows])
            size = np.abs(step).max(axis=1)
            ahead = np.clip(at + _shortened(step, LONGEST_STEP) * span, low, high)
            pose = self.linkage.follow(poses[rows], at, ahead, tangents[rows])
            moved = ahead, pose, *self._moved(pose, ahead)
            left = _length(targets[rows] - moved[2])
            nearer = left < gap[rows]
            slow[rows] += ~(left < SLOW * gap[rows])
            for mine, its in zip((values, poses, tip, slope, tangents), moved, strict=True):
                mine[rows[nearer]] = its[nearer]
            gap[rows] = _length(targets[rows] - tip[rows])
            damping[rows] *= np.where(nearer, 0.1, 30.0)
            stuck[rows] = (slow[rows] > SLOW_STEPS) | (size <= LAST_STEP)
        return Search(values, gap, stuck)

    def _status(self, targets: Array, found: Search) -> NDArray[np.int64]:
        """Codes (n,) of what a search ended on."""
        span = self.upper - self.lower
        low, high = self.reach.T
        margin = 0.05 * np.max(high - low)
        outside = np.any((targets < low - margin) | (targets > high + margin), axis=1)
        limited = np.any(
            (found.values <= self.lower + 1e-9 * span) | (found.values >= self.upper - 1e-9 * span),
            axis=1,
        )
        failed = np.where(
            outside | (found.stuck & ~limited),
            OUT_OF_REACH,
            np.where(limited, ACTUATOR_LIMIT, NOT_CONVERGED),
        )
        return np.where(found.reached, REACHED, failed).astype(np.int64)

    @cached_property
    def _sides(self) -> tuple[float, float]:
        """Side of the elbow of the assembly pose, and the other one."""
        side = float(self._side(self.derivatives((self.lower + self.upper)[None] / 2))[0])
        return (side or 1.0), -(side or 1.0)

    def _side(self, derivatives: Array) -> Array:
        """Sign (n,) of the elbow of the two main drives; 0 where the arm is stretched."""
        main = [k for k in range(derivatives.shape[2]) if k != self._first][:2]
        if len(main) < 2:
            return np.ones(len(derivatives))
        return np.sign(np.linalg.det(derivatives[:, :, main]))

    def _start(self, targets: Array, side: float, least: Array | None = None) -> Array:
        """Coordinates (n, k) of start poses whose tips are near, on a side, with a small drive."""
        values = self.linkage.starts[0]
        tips, sides = self._starts
        pool = np.flatnonzero(sides == side)
        pool = pool if len(pool) else np.arange(len(tips))
        distance = np.sum((targets[:, None] - tips[pool]) ** 2, axis=2)
        if least is not None:
            low, high = self.reach.T
            scale = np.max(high - low) / (self.upper - self.lower)[self._first]
            distance += ((least[:, None] - values[pool, self._first]) * scale) ** 2
        return values[pool[distance.argmin(axis=1)]] if len(targets) else values[:0]

    def _moved(self, poses: Array, values: Array) -> tuple[Array, Array, Array]:
        """Tip (n, 2), its derivatives (n, 2, k), and those of the poses (n, b, 3, k)."""
        tangents = self.linkage.tangents(poses, values)
        tip, arm = self.linkage.tip(poses)
        of_body = tangents[:, self.linkage.payload[0]]
        across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        return tip, of_body[:, :2] + across[:, :, None] * of_body[:, 2:], tangents


def _step(
    slope: Array,
    gap: Array,
    room: tuple[Array, Array],
    damping: Array | float,
    pull: Array | None = None,
) -> Array:
    """Step (n, k) that closes `gap` (n, 2) by `slope` (n, 2, k), within `room` down and up (n, k).

    The shortest one, or that nearest to `pull` (n, k).
    """
    low, high = room
    wanted = np.zeros_like(low) if pull is None else pull
    fixed, free = np.zeros_like(low), high > low
    lift = damping * np.mean(slope**2, axis=(1, 2)) + 1e-300
    for _ in range(low.shape[1] + 1):
        own = slope * free[:, None]
        rest = gap - np.einsum("nik,nk->ni", slope, np.where(free, wanted, fixed))
        matrix = own @ own.transpose(0, 2, 1)
        matrix[:, [0, 1], [0, 1]] += lift[:, None]
        force = np.linalg.solve(matrix, rest[..., None])
        step = np.where(free, wanted + (own.transpose(0, 2, 1) @ force)[..., 0], fixed)
        beyond = np.where(free, np.maximum(low - step, step - high), 0.0)
        if not (beyond > 0).any():
            break
        # one at a time: the others may well stay free
        over = (beyond > 0) & (np.arange(low.shape[1]) == beyond.argmax(axis=1)[:, None])
        fixed = np.where(over, np.clip(step, low, high), fixed)
        free = free & ~over
    return np.clip(step, low, high)


def _shortened(step: Array, longest: float) -> Array:
    size = np.abs(step).max(axis=1, keepdims=True)
    return step * np.minimum(1.0, longest / np.maximum(size, 1e-300))


def _length(vectors: Array) -> Array:
    return np.sqrt(np.sum(vectors**2, axis=1))
