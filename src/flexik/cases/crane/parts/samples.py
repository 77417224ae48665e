"""Samples of the crane in static equilibrium: the grid of table 4.1 and a random set."""

import functools
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.crane.parts.crane import FlexibleCrane, flexible, model_inputs
from flexik.cases.crane.parts.fields import FAILED, INPUTS, KEPT, LEFT_OUT, SAMPLE_FIELDS
from flexik.cases.crane.section import Grid, Section, Selection
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import CraneGeometry, forward
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import solve

Array = NDArray[np.float64]

# Poses in an item: large enough to pay for one model, small enough to share out and to lose
POSES_PER_PART = 27

# Times the wanted number of samples is drawn before giving up
MAXIMUM_DRAWS = 100
SHOWN_FAILURES = 10


def parts(section: Section) -> list[Part]:
    """`grid` and `selection`, tables of SAMPLE_FIELDS."""
    given = section.samples
    shared = {
        "machine": section.machine,
        "minimum_tip_x": given.minimum_tip_x,
        "maximum_failed_share": given.maximum_failed_share,
    }
    return [
        Part(name, prepare, {**shared, "name": name, "drawn": drawn}, model_inputs(section))
        for name, drawn in (("grid", given.grid), ("selection", given.selection))
    ]


def prepare(
    *,
    name: str,
    machine: PlanarMachine,
    minimum_tip_x: float,
    maximum_failed_share: float,
    drawn: Grid | Selection,
    spring: Path,
    sections: dict[str, Path],
) -> Work:
    """The training grid, in pieces of equal extension, or the random set."""
    crane = flexible(machine, spring)
    pieces: Sequence[Samples]
    if isinstance(drawn, Grid):
        pieces = GridParts(**{n: axis(**dict(getattr(drawn, n))) for n in GridParts.AXES})
    else:
        given = drawn.n_samples, drawn.payload, minimum_tip_x, drawn.seed
        pieces = split(random_samples(crane.geometry, *given))
    function = functools.partial(solve_samples, crane, minimum_tip_x)
    return Work(function, pieces, functools.partial(_finish, name, maximum_failed_share))


def _finish(
    name: str, maximum_failed_share: float, results: list[Mapping[str, NDArray]]
) -> Mapping[str, Writer]:
    """Print the counts and the failed samples; raises SolverError if there are too many."""
    columns = stacked(results, SAMPLE_FIELDS)
    frame = pd.DataFrame(columns)
    n = counts(frame)
    print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in n.items()))
    failed = failed_samples(frame)
    for line in failed[:SHOWN_FAILURES]:
        print(f"{name}: no static equilibrium at {line}", file=sys.stderr)
    if n["n_failed"] > maximum_failed_share * n["n_samples"]:
        raise SolverError(
            f"{n['n_failed']} of {n['n_samples']} samples failed, more than "
            f"crane.samples.maximum_failed_share {maximum_failed_share:g}; first: {failed[0]}"
        )
    return {".parquet": table(columns, SAMPLE_FIELDS)}


@dataclass(frozen=True)
class Samples:
    """Strokes (n, 3) in m and payloads (n,) in kg."""

    strokes: Array
    payload: Array

    def __len__(self) -> int:
        return len(self.payload)


@dataclass(frozen=True)
class GridParts(Sequence[Samples]):
    """The grid in parts, made when asked for: extension slowest, then lift, jib, payload fastest.

    Axes in m and kg; a part never spans two extensions, so that it needs one model.
    """

    AXES: ClassVar = ("lift", "jib", "extension", "payload")

    lift: Array
    jib: Array
    extension: Array
    payload: Array

    @property
    def n_samples(self) -> int:
        """Samples in all parts."""
        return len(self.lift) * len(self.jib) * len(self.extension) * len(self.payload)

    @property
    def _parts_per_extension(self) -> int:
        return -(-len(self.lift) * len(self.jib) // POSES_PER_PART)

    def __len__(self) -> int:
        return len(self.extension) * self._parts_per_extension

    def __getitem__(self, index: int) -> Samples:  # type: ignore[override]
        """Part `index`; slices are not needed."""
        if not 0 <= index < len(self):
            raise IndexError(index)
        of_extension, part = divmod(index, self._parts_per_extension)
        n_poses = len(self.lift) * len(self.jib)
        pose = np.arange(part * POSES_PER_PART, min((part + 1) * POSES_PER_PART, n_poses))
        lift, jib = np.divmod(pose, len(self.jib))
        extension = np.full(len(pose), self.extension[of_extension])
        strokes = np.column_stack([self.lift[lift], self.jib[jib], extension])
        n = len(self.payload)
        return Samples(np.repeat(strokes, n, axis=0), np.tile(self.payload, len(pose)))


def axis(minimum: float, maximum: float, increment: float) -> Array:
    """Evenly spaced values from `minimum` to `maximum`, both included."""
    n = round((maximum - minimum) / increment) + 1
    return np.linspace(minimum, maximum, n)


def random_samples(
    geometry: CraneGeometry,
    n_samples: int,
    payload: tuple[float, float],
    minimum_tip_x: float,
    seed: int,
) -> Samples:
    """Strokes and payloads drawn uniformly, with the rigid tip at x >= `minimum_tip_x` m.

    Raises ParameterError if hardly any pose has its tip there.
    """
    rng = np.random.default_rng(seed)
    strokes = np.empty((0, 3))
    for _ in range(MAXIMUM_DRAWS):
        drawn = rng.uniform(0.0, geometry.stroke_maximum, (n_samples, 3))
        strokes = np.vstack([strokes, drawn[forward(geometry, drawn)[:, 0] >= minimum_tip_x]])
        if len(strokes) >= n_samples:
            break
    else:
        raise ParameterError(
            f"crane.samples.minimum_tip_x: hardly any pose has its tip at x >= {minimum_tip_x} m"
        )
    return Samples(strokes[:n_samples], rng.uniform(*payload, n_samples))


def split(samples: Samples, n_rows: int = 400) -> list[Samples]:
    """`samples` in parts of `n_rows`."""
    cuts = range(0, len(samples), n_rows)
    return [Samples(samples.strokes[k : k + n_rows], samples.payload[k : k + n_rows]) for k in cuts]


def solve_samples(crane: FlexibleCrane, minimum_tip_x: float, samples: Samples) -> dict[str, Array]:
    """SAMPLE_FIELDS of `samples`; one that is left out or fails is a row with its status."""
    rigid = forward(crane.geometry, samples.strokes)
    # a linkage that does not close has no rigid tip: that fails, it is not left out
    kept = ~(rigid[:, 0] < minimum_tip_x)
    tips = np.full((len(samples), 2), np.nan)
    status = np.where(kept, KEPT, LEFT_OUT)
    rows = np.flatnonzero(kept)
    tips[rows], failures = solve(crane, samples.strokes[rows], samples.payload[rows])
    status[rows[list(failures)]] = FAILED
    columns = [*samples.strokes.T, samples.payload, *rigid.T, *tips.T, status]
    return {field.name: column for field, column in zip(SAMPLE_FIELDS, columns, strict=True)}


def counts(table: pd.DataFrame) -> dict[str, int]:
    """Number of samples, and of those kept, left out and failed."""
    status = table["status"]
    return {
        "n_samples": len(status),
        "n_kept": int((status == KEPT).sum()),
        "n_left_out": int((status == LEFT_OUT).sum()),
        "n_failed": int((status == FAILED).sum()),
    }


def failed_samples(table: pd.DataFrame) -> list[str]:
    """Strokes and payload of each failed sample, in words."""
    rows = table.loc[table["status"] == FAILED, list(INPUTS)].to_numpy()
    return [f"strokes ({a:.6g}, {b:.6g}, {c:.6g}) m with {m:g} kg" for a, b, c, m in rows]
