"""Method `interpolated`: linear between two samples that follow one another on a path."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.kinematics.status import REACHED
from flexik.positioning.method import Answer, Array


@dataclass(frozen=True, eq=False)
class Interpolated:
    """Answers at the points of a path nearest in the first columns of the query.

    queries : (m, p) of the samples in the order of the path, columns of one unit.
    answers : (m, k) of the samples.
    """

    queries: Array
    answers: Array

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`; columns of `query` beyond p do not count."""
        there = nearest_on(self.queries, query[:, : self.queries.shape[1]])
        before, after = self.answers[there.segment], self.answers[there.segment + 1]
        values = before + there.share[:, None] * (after - before)
        return Answer(values, np.full(len(query), REACHED))


class Nearest(NamedTuple):
    """Nearest points of a path: segment (n,), share of it (n,), distance (n,) from it."""

    segment: NDArray[np.int64]
    share: Array
    distance: Array


def nearest_on(path: Array, points: Array) -> Nearest:
    """Where `points` (n, p) are nearest to the straight segments between `path` (m, p)."""
    along = np.diff(path, axis=0)
    away = points[:, None] - path[None, :-1]
    squares = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    share = np.clip(np.sum(away * along, axis=2) / squares, 0.0, 1.0)
    distance = np.linalg.norm(away - share[:, :, None] * along, axis=2)
    segment = np.argmin(distance, axis=1)
    rows = np.arange(len(points))
    return Nearest(segment, share[rows, segment], distance[rows, segment])
