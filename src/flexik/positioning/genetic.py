"""Rigid inverse by a genetic algorithm, as published (Rouvinen 1999, section 4.1).

Fitness is the distance from rigid tip to target. Two of the 15 individuals start at the current
coordinates, the others at random within the limits; a solution is accepted below 5 mm and at most
1000 generations are made. The operators are not published: pymoo's own for real numbers.
"""

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from flexik.kinematics.manipulator import Manipulator, RigidSolution
from flexik.kinematics.status import NOT_CONVERGED, REACHED
from flexik.parameters.model import Count, Model, Positive, Seed
from flexik.positioning.method import Array

# Targets closer than this share their random numbers, so that round-off does not change them, m
SEED_STEP = 1e-6


class Genetic(Model):
    """Settings of the genetic algorithm; the first four are the published ones.

    n_individuals : individuals of a generation.
    n_current : those of the first generation that start at the current coordinates.
    tolerance : a solution is accepted below this distance, m.
    n_generations : most generations made, the first included.
    crossover_eta, mutation_eta : distribution indices of simulated binary crossover and
        polynomial mutation; larger values keep children nearer to their parents.
    """

    n_individuals: Annotated[int, Field(ge=2)] = 15
    n_current: Annotated[int, Field(ge=0)] = 2
    tolerance: Positive = 5e-3
    n_generations: Count = 1000
    seed: Seed = 0
    crossover_eta: Positive = 15.0
    mutation_eta: Positive = 20.0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.n_current > self.n_individuals:
            raise ValueError("n_current: must not exceed n_individuals")
        return self


@dataclass(frozen=True)
class GeneticManipulator:
    """`rigid` with an inverse by a genetic algorithm.

    A row's random numbers follow from the seed, its target and its current coordinates alone, so
    the grouping and order of rows do not matter and equal rows are solved once. There is no rule
    for redundant coordinates: the individuals at the current ones draw the search to them.
    """

    rigid: Manipulator
    settings: Genetic

    @property
    def lower(self) -> Array:
        """Least actuator coordinates (k,)."""
        return self.rigid.lower

    @property
    def upper(self) -> Array:
        """Largest actuator coordinates (k,)."""
        return self.rigid.upper

    def forward(self, values: Array) -> Array:
        """Tip (n, 2) in m at coordinates (n, k)."""
        return self.rigid.forward(values)

    def branch(self, values: Array) -> Array:
        """See Manipulator."""
        return self.rigid.branch(values)

    def inverse(
        self, targets: Array, current: Array, original_targets: Array | None = None
    ) -> RigidSolution:
        """See Manipulator. Diagnostics `n_generations` and `rigid_distance`, the best found, m.

        A row above the tolerance is NOT_CONVERGED and keeps the current coordinates.
        """
        k = current.shape[1]
        rows, row_of = np.unique(np.hstack([targets, current]), axis=0, return_inverse=True)
        found = [_search(self.rigid, self.settings, row[:2], row[2:]) for row in rows]
        values = np.array([result[0] for result in found]).reshape(-1, k)[row_of]
        distance = np.array([result[1] for result in found], dtype=float)[row_of]
        n_generations = np.array([result[2] for result in found], dtype=np.int64)[row_of]
        accepted = distance < self.settings.tolerance
        return RigidSolution(
            np.where(accepted[:, None], values, current),
            np.where(accepted, REACHED, NOT_CONVERGED),
            {"n_generations": n_generations, "rigid_distance": distance},
        )


def first_generation(
    manipulator: Manipulator, settings: Genetic, current: Array, rng: np.random.Generator
) -> Array:
    """Coordinates (n_individuals, k): the current ones (k,) `n_current` times, then random."""
    lower, upper = manipulator.lower, manipulator.upper
    n_random = settings.n_individuals - settings.n_current
    copies = np.tile(np.clip(current, lower, upper), (settings.n_current, 1))
    return np.vstack([copies, rng.uniform(lower, upper, (n_random, len(upper)))])


class _Distance(Problem):
    """Distance from rigid tip to target, for a whole generation at once."""

    def __init__(self, manipulator: Manipulator, target: Array) -> None:
        k = len(manipulator.upper)
        super().__init__(n_var=k, n_obj=1, xl=manipulator.lower, xu=manipulator.upper)
        self.manipulator, self.target = manipulator, target

    def _evaluate(self, x: Array, out: dict[str, Array], *args: object, **kwargs: object) -> None:
        miss = self.manipulator.forward(x) - self.target
        out["F"] = np.hypot(miss[:, 0], miss[:, 1])[:, None]


def _search(
    manipulator: Manipulator, settings: Genetic, target: Array, current: Array
) -> tuple[Array, float, int]:
    """Best coordinates (k,), their distance in m and the number of generations made."""
    rng = _generator(settings.seed, np.concatenate([target, current]))
    algorithm = GA(
        pop_size=settings.n_individuals,
        sampling=first_generation(manipulator, settings, current, rng),
        crossover=SBX(eta=settings.crossover_eta),
        mutation=PM(eta=settings.mutation_eta),
        # the first generation has equal individuals on purpose
        eliminate_duplicates=False,
    )
    algorithm.setup(
        _Distance(manipulator, target),
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
