"""Samples of the crane: the grid of table 4.1 and a random set, in static equilibrium."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parallel import ParallelSettings, parallel_map
from flexik.datasets.resumable import compute_table
from flexik.datasets.tables import Field
from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry, forward
from flexik.multibody.crane.model import FlexibleCrane, solve, tips

Array = NDArray[np.float64]

KEPT, LEFT_OUT, FAILED = 0, 1, 2
FIELDS = (
    Field("lift_stroke", "m", "stroke of the lift cylinder"),
    Field("jib_stroke", "m", "stroke of the jib cylinder"),
    Field("extension_stroke", "m", "stroke of the extension cylinder"),
    Field("payload", "kg", "point mass at the tip"),
    Field("rigid_x", "m", "tip of the rigid crane, forward of the slew axis"),
    Field("rigid_y", "m", "tip of the rigid crane, above ground"),
    Field("tip_x", "m", "tip in static equilibrium; NaN where not solved"),
    Field("tip_y", "m", "tip in static equilibrium; NaN where not solved"),
    Field("status", "1", "0 kept, 1 left out (rigid tip behind the limit), 2 failed", "int64"),
)
STROKES = ("lift_stroke", "jib_stroke", "extension_stroke")
INPUTS = (*STROKES, "payload")

# Poses in a part: large enough to pay for one model, small enough to share out and to lose
POSES_PER_PART = 27

# Times the wanted number of samples is drawn before giving up
MAXIMUM_DRAWS = 100


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
            f"crane.grid.minimum_tip_x: hardly any pose has its tip at x >= {minimum_tip_x} m"
        )
    return Samples(strokes[:n_samples], rng.uniform(*payload, n_samples))


def split(samples: Samples, n_rows: int = 400) -> list[Samples]:
    """`samples` in parts of `n_rows`."""
    cuts = range(0, len(samples), n_rows)
    return [Samples(samples.strokes[k : k + n_rows], samples.payload[k : k + n_rows]) for k in cuts]


def solve_samples(crane: FlexibleCrane, minimum_tip_x: float, samples: Samples) -> dict[str, Array]:
    """Columns FIELDS of `samples`; one that is left out or fails is a row with its status."""
    rigid = forward(crane.geometry, samples.strokes)
    # a linkage that does not close has no rigid tip: that fails, it is not left out
    kept = ~(rigid[:, 0] < minimum_tip_x)
    tips = np.full((len(samples), 2), np.nan)
    status = np.where(kept, KEPT, LEFT_OUT)
    rows = np.flatnonzero(kept)
    tips[rows], failures = solve(crane, samples.strokes[rows], samples.payload[rows])
    status[rows[list(failures)]] = FAILED
    columns = [*samples.strokes.T, samples.payload, *rigid.T, *tips.T, status]
    return {field.name: column for field, column in zip(FIELDS, columns, strict=True)}


def parallel_tips(
    crane: FlexibleCrane,
    strokes: Array,
    payload: Array,
    settings: ParallelSettings,
    description: str = "",
) -> Array:
    """Tip (n, 2) in m at `strokes` (n, 3) in m under `payload` (n,) in kg, in parallel.

    Raises the SolverError of the first row without equilibrium.
    """
    # rows of equal extension share a system
    order = np.lexsort((payload, *strokes.T))
    parts = split(Samples(strokes[order], payload[order]))
    solved = parallel_map(functools.partial(_tips, crane), parts, settings, description)
    result = np.empty((len(strokes), 2))
    result[order] = np.concatenate([np.empty((0, 2)), *solved])
    return result


def _tips(crane: FlexibleCrane, samples: Samples) -> Array:
    return tips(crane, samples.strokes, samples.payload)


def generate(
    path: Path | str,
    crane: FlexibleCrane,
    parts: Sequence[Samples],
    minimum_tip_x: float,
    parameters_checksum: str,
    key: str,
    settings: ParallelSettings,
    description: str,
) -> int:
    """Solve all `parts` in parallel into the Parquet table `path`; see `compute_table`.

    Unfinished work lies in a hidden folder beside `path`. Returns the number of parts that an
    interrupted run had finished.
    """
    path = Path(path)
    function = functools.partial(solve_samples, crane, minimum_tip_x)
    folder = path.parent / f".{path.stem}_parts"
    return compute_table(
        path, function, parts, FIELDS, parameters_checksum, key, settings, description, folder
    )


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


def kept(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that were solved."""
    return table[table["status"] == KEPT].reset_index(drop=True)


def deflection(table: pd.DataFrame) -> Array:
    """Flexible minus rigid tip (n, 2) in m."""
    flexible, rigid = table[["tip_x", "tip_y"]], table[["rigid_x", "rigid_y"]]
    return flexible.to_numpy() - rigid.to_numpy()
