"""Rigid inverse by a genetic algorithm, as published (Rouvinen 1999, section 4.1).

Fitness is the distance from rigid tip to target. Two of the 15 individuals start at the current
strokes, the others at random within the stroke limits; a solution is accepted below 5 mm and at
most 1000 generations are made. The operators are not published: pymoo's own for real numbers.
"""

from dataclasses import dataclass

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry, forward
from flexik.kinematics.status import REACHED
from flexik.positioning.method import NOT_CONVERGED, Array, checked
from flexik.positioning.rigid_inverse import RigidInverse, RigidSolution

# Targets closer than this share their random numbers, so that round-off does not change them, m
SEED_STEP = 1e-6


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the genetic algorithm; the first four are the published ones.

    n_individuals : individuals of a generation.
    n_current : those of the first generation that start at the current strokes.
    tolerance : a solution is accepted below this distance, m.
    n_generations : most generations made, the first included.
    seed : seed of all random numbers.
    crossover_eta, mutation_eta : distribution indices of simulated binary crossover and
        polynomial mutation; larger values keep children nearer to their parents.
    """

    n_individuals: int = 15
    n_current: int = 2
    tolerance: float = 5e-3
    n_generations: int = 1000
    seed: int = 0
    crossover_eta: float = 15.0
    mutation_eta: float = 20.0

    def __post_init__(self) -> None:
        if self.n_individuals < 2 or not 0 <= self.n_current <= self.n_individuals:
            raise ParameterError(
                f"genetic: {self.n_individuals=}, {self.n_current=}, "
                "expected at least 2 individuals and 0 <= n_current <= n_individuals"
            )
        if self.n_generations < 1 or self.tolerance <= 0.0 or self.seed < 0:
            raise ParameterError(
                f"genetic: {self.n_generations=}, {self.tolerance=}, {self.seed=}, "
                "expected n_generations >= 1, tolerance > 0, seed >= 0"
            )


def genetic(geometry: CraneGeometry, settings: GeneticSettings) -> RigidInverse:
    """Rigid inverse by a genetic algorithm; `n_generations` and `rigid_distance` as diagnostics.

    A row's random numbers follow from the seed, its target and its current strokes alone, so the
    grouping and order of rows do not matter and equal rows are solved once. The extension has no
    rule: the individuals at the current strokes draw the search to them. `rigid_distance` (m) is
    the best found; a row above the tolerance is NOT_CONVERGED and keeps the current strokes.
    """

    def solve(
        targets: Array,
        current_strokes: Array,
        original_targets: Array | None = None,
    ) -> RigidSolution:
        targets = checked("targets", targets, None, 2)
        current = checked("current strokes", current_strokes, len(targets), 3)
        rows, row_of = np.unique(np.hstack([targets, current]), axis=0, return_inverse=True)
        found = [_search(geometry, settings, row[:2], row[2:]) for row in rows]
        strokes = np.array([result[0] for result in found]).reshape(-1, 3)[row_of]
        distance = np.array([result[1] for result in found])[row_of]
        n_generations = np.array([result[2] for result in found], dtype=np.int64)[row_of]
        accepted = distance < settings.tolerance
        return RigidSolution(
            np.where(accepted[:, None], strokes, current),
            np.where(accepted, REACHED, NOT_CONVERGED),
            {"n_generations": n_generations, "rigid_distance": distance},
        )

    return solve


def first_generation(
    geometry: CraneGeometry, settings: GeneticSettings, current: Array, rng: np.random.Generator
) -> Array:
    """Strokes (n_individuals, 3) in m: the current ones (3,) `n_current` times, then random."""
    maximum = np.array(geometry.stroke_maximum)
    n_random = settings.n_individuals - settings.n_current
    copies = np.tile(np.clip(current, 0.0, maximum), (settings.n_current, 1))
    return np.vstack([copies, rng.uniform(0.0, maximum, (n_random, 3))])


class _Distance(Problem):
    """Distance from rigid tip to target, for a whole generation at once."""

    def __init__(self, geometry: CraneGeometry, target: Array) -> None:
        maximum = np.array(geometry.stroke_maximum)
        super().__init__(n_var=3, n_obj=1, xl=np.zeros(3), xu=maximum)
        self.geometry, self.target = geometry, target

    def _evaluate(self, x: Array, out: dict[str, Array], *args: object, **kwargs: object) -> None:
        miss = forward(self.geometry, x) - self.target
        out["F"] = np.hypot(miss[:, 0], miss[:, 1])[:, None]


def _search(
    geometry: CraneGeometry, settings: GeneticSettings, target: Array, current: Array
) -> tuple[Array, float, int]:
    """Best strokes (3,), their distance in m and the number of generations made."""
    rng = _generator(settings.seed, np.concatenate([target, current]))
    algorithm = GA(
        pop_size=settings.n_individuals,
        sampling=first_generation(geometry, settings, current, rng),
        crossover=SBX(eta=settings.crossover_eta),
        mutation=PM(eta=settings.mutation_eta),
        # the first generation has equal individuals on purpose
        eliminate_duplicates=False,
    )
    algorithm.setup(
        _Distance(geometry, target),
        termination=("n_gen", settings.n_generations),
        seed=int(rng.integers(2**31)),
    )
    n_generations, distance = 0, np.inf
    while distance >= settings.tolerance and algorithm.has_next():
        algorithm.next()
        n_generations += 1
        distance = float(algorithm.opt[0].F[0])
    return algorithm.opt[0].X, distance, n_generations


def _generator(seed: int, row: Array) -> np.random.Generator:
    # a seed sequence takes no negative integers: two's complement
    key = np.round(row / SEED_STEP).astype(np.int64).view(np.uint64)
    return np.random.default_rng([seed, *key.tolist()])
