"""Samples of a machine in static equilibrium: the grid to learn from and a random set."""

import functools
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.errors import ParameterError, SolverError
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import solve
from flexik.parameters.networks import Axis
from flexik.planar.constants import model_inputs
from flexik.planar.fields import FAILED, KEPT, LEFT_OUT, inputs, sample_fields
from flexik.planar.machine import flexible
from flexik.planar.section import PlanarSection, Selection

Array = NDArray[np.float64]

# Poses in an item: large enough to pay for one model, small enough to share out and to lose
POSES_PER_PART = 27

# Times the wanted number of samples is drawn before giving up
MAXIMUM_DRAWS = 100
SHOWN_FAILURES = 10


def parts(section: PlanarSection) -> list[Part]:
    """`grid` and `selection`, tables of sample_fields."""
    given = section.samples
    return [part(section, "grid", given.grid), part(section, "selection", given.selection)]


def part(section: PlanarSection, name: str, drawn: Mapping[str, Axis] | Selection) -> Part:
    """The table `name` of the samples `drawn`."""
    settings = {
        "case": section.name,
        "machine": section.machine,
        "minimum_tip_x": section.samples.minimum_tip_x,
        "maximum_failed_share": section.samples.maximum_failed_share,
        "name": name,
        "drawn": drawn,
    }
    return Part(name, prepare, settings, model_inputs(section))


def prepare(
    *,
    case: str,
    name: str,
    machine: PlanarMachine,
    minimum_tip_x: float | None,
    maximum_failed_share: float,
    drawn: Mapping[str, Axis] | Selection,
    sections: dict[str, Path],
    constants: Path | None = None,
) -> Work:
    """The training grid, in pieces of equal telescopes, or the random set."""
    pieces: Sequence[Samples]
    if isinstance(drawn, Selection):
        given = drawn.n_samples, drawn.payload, minimum_tip_x, drawn.seed
        try:
            pieces = split(random_samples(machine, *given))
        except ParameterError as error:
            raise ParameterError(f"{case}.{error}") from None
    else:
        pieces = GridParts.of(machine, drawn)
    function = functools.partial(solve_samples, flexible(machine, constants), minimum_tip_x)
    return Work(
        function, pieces, functools.partial(_finish, case, name, machine, maximum_failed_share)
    )


def _finish(
    case: str,
    name: str,
    machine: PlanarMachine,
    maximum_failed_share: float,
    results: list[Mapping[str, NDArray]],
) -> Mapping[str, Writer]:
    """Print the counts and the failed samples; raises SolverError if there are too many."""
    fields = sample_fields(machine)
    columns = stacked(results, fields)
    frame = pd.DataFrame(columns)
    n = counts(frame)
    print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in n.items()))
    failed = failed_samples(machine, frame)
    for line in failed[:SHOWN_FAILURES]:
        print(f"{name}: no static equilibrium at {line}", file=sys.stderr)
    if n["n_failed"] > maximum_failed_share * n["n_samples"]:
        raise SolverError(
            f"{n['n_failed']} of {n['n_samples']} samples failed, more than "
            f"{case}.samples.maximum_failed_share {maximum_failed_share:g}; first: {failed[0]}"
        )
    return {".parquet": table(columns, fields)}


@dataclass(frozen=True)
class Samples:
    """Coordinates (n, k) in m or rad and payloads (n,) in kg."""

    values: Array
    payload: Array

    def __len__(self) -> int:
        return len(self.payload)


@dataclass(frozen=True)
class GridParts(Sequence[Samples]):
    """The grid in parts, made when asked for: telescopes slowest, payload fastest.

    axes : values of each drive, m or rad, and then of the payload, kg.
    slow : which drives are telescopes: a part never spans two strokes of them, so that it needs one
        model.
    """

    axes: tuple[Array, ...]
    slow: tuple[bool, ...]

    @classmethod
    def of(cls, machine: PlanarMachine, grid: Mapping[str, Axis]) -> "GridParts":
        """The `grid` of `machine`, axes by name."""
        axes = tuple(axis(**dict(grid[name])) for name in (*machine.drives, "payload"))
        return cls(axes, tuple(drive.kind == "telescope" for drive in machine.drives.values()))

    @property
    def n_samples(self) -> int:
        """Samples in all parts."""
        return math.prod(len(values) for values in self.axes)

    def _shape(self, slow: bool) -> tuple[int, ...]:
        """How many values each drive has; 1 for those that are telescopes if not `slow`, or are."""
        given = zip(self.axes, self.slow, strict=False)
        return tuple(len(values) if is_slow == slow else 1 for values, is_slow in given)

    @property
    def _parts_per_slow(self) -> int:
        return -(-math.prod(self._shape(slow=False)) // POSES_PER_PART)

    def __len__(self) -> int:
        return math.prod(self._shape(slow=True)) * self._parts_per_slow

    def __getitem__(self, index: int) -> Samples:  # type: ignore[override]
        """Part `index`; slices are not needed."""
        if not 0 <= index < len(self):
            raise IndexError(index)
        of_slow, part = divmod(index, self._parts_per_slow)
        shape, begin = self._shape(slow=False), part * POSES_PER_PART
        poses = np.arange(begin, min(begin + POSES_PER_PART, math.prod(shape)))
        fast = np.unravel_index(poses, shape)
        slow = np.unravel_index(of_slow, self._shape(slow=True))
        columns = [v[f + s] for v, f, s in zip(self.axes, fast, slow, strict=False)]
        n = len(self.axes[-1])
        values = np.repeat(np.column_stack(columns), n, axis=0)
        return Samples(values, np.tile(self.axes[-1], len(poses)))


def axis(minimum: float, maximum: float, increment: float) -> Array:
    """Evenly spaced values from `minimum` to `maximum`, both included."""
    n = round((maximum - minimum) / increment) + 1
    return np.linspace(minimum, maximum, n)


def random_samples(
    machine: PlanarMachine,
    n_samples: int,
    payload: tuple[float, float],
    minimum_tip_x: float | None,
    seed: int,
) -> Samples:
    """Coordinates and payloads drawn uniformly, with the rigid tip at x >= `minimum_tip_x` m.

    Raises ParameterError if hardly any pose has its tip there.
    """
    rng, manipulator = np.random.default_rng(seed), manipulator_of(machine)
    values = np.empty((0, len(machine.drives)))
    for _ in range(MAXIMUM_DRAWS):
        drawn = rng.uniform(manipulator.lower, manipulator.upper, (n_samples, values.shape[1]))
        values = np.vstack([values, drawn[_before(manipulator.forward(drawn), minimum_tip_x)]])
        if len(values) >= n_samples:
            break
    else:
        raise ParameterError(
            f"samples.minimum_tip_x: hardly any pose has its tip at x >= {minimum_tip_x} m"
        )
    return Samples(values[:n_samples], rng.uniform(*payload, n_samples))


def _before(tips: Array, minimum_x: float | None) -> NDArray[np.bool_]:
    """Which of the rigid `tips` (n, 2) are not behind the limit; NaN is not left out, it fails."""
    return np.ones(len(tips), dtype=bool) if minimum_x is None else ~(tips[:, 0] < minimum_x)


def split(samples: Samples, n_rows: int = 400) -> list[Samples]:
    """`samples` in parts of `n_rows`."""
    cuts = range(0, len(samples), n_rows)
    return [Samples(samples.values[k : k + n_rows], samples.payload[k : k + n_rows]) for k in cuts]


def solve_samples(
    machine: FlexibleMachine, minimum_tip_x: float | None, samples: Samples
) -> dict[str, Array]:
    """sample_fields of `samples`; one that is left out or fails is a row with its status."""
    rigid = manipulator_of(machine.machine).forward(samples.values)
    kept = _before(rigid, minimum_tip_x)
    tips = np.full((len(samples), 2), np.nan)
    status = np.where(kept, KEPT, LEFT_OUT)
    rows = np.flatnonzero(kept)
    tips[rows], failures = solve(machine, samples.values[rows], samples.payload[rows])
    status[rows[list(failures)]] = FAILED
    columns = [*samples.values.T, samples.payload, *rigid.T, *tips.T, status]
    fields = sample_fields(machine.machine)
    return {field.name: column for field, column in zip(fields, columns, strict=True)}


def counts(table: pd.DataFrame) -> dict[str, int]:
    """Number of samples, and of those kept, left out and failed."""
    status = table["status"]
    return {
        "n_samples": len(status),
        "n_kept": int((status == KEPT).sum()),
        "n_left_out": int((status == LEFT_OUT).sum()),
        "n_failed": int((status == FAILED).sum()),
    }


def failed_samples(machine: PlanarMachine, table: pd.DataFrame) -> list[str]:
    """Coordinates and payload of each failed sample, in words."""
    rows = table.loc[table["status"] == FAILED, inputs(machine)].to_dict("records")
    return [", ".join(f"{name} {value:.6g}" for name, value in row.items()) for row in rows]
