"""Samples of one's own, of another program or of measurements, in place of a model's."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.parts import Part, Work, Writer, table, whole
from flexik.errors import DataError
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.planar.fields import KEPT, PAYLOAD, TIP, coordinates, sample_fields
from flexik.planar.section import OwnSamples, PlanarSection, payload_fault

# What one of a unit is in SI
UNITS: Mapping[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "rad": ("rad", 1.0),
    "deg": ("rad", np.pi / 180),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "t": ("kg", 1e3),
    "lb": ("kg", 0.45359237),
}
HEADER = re.compile(rf"(.*?)[ _]*[\[(]?({'|'.join(sorted(UNITS, key=len, reverse=True))})[\])]?")
# Beyond the limits of a drive by this share of its range a coordinate is in another unit, or a slip
BEYOND = 0.01
# As is a tip this far from where the rigid machine has it, over the size of the machine
FAR = 0.25
SETS = ("grid", "selection", "held_out")


def parts(section: PlanarSection, own: OwnSamples) -> list[Part]:
    """`grid` to learn from, `selection` and `held_out`, tables of sample_fields."""
    settings = {"machine": section.machine, "own": own}
    inputs = {"file": Path(own.file)}
    return [Part(name, prepare, {**settings, "name": name}, inputs) for name in SETS]


def prepare(*, name: str, machine: PlanarMachine, own: OwnSamples, file: Path) -> Work:
    """One of the SETS."""
    return whole(_divided, name=name, machine=machine, own=own, file=file)


def _divided(name: str, machine: PlanarMachine, own: OwnSamples, file: Path) -> dict[str, Writer]:
    samples = read_own(file, machine, own.columns)
    sets = divided(samples, machine, own)
    if not all(len(rows) for rows in sets.values()):
        raise DataError(f"{file}: {len(samples)} rows are too few to divide as asked for")
    if name == "grid":
        print(f"{len(samples)} samples: " + ", ".join(f"{k} {len(r)}" for k, r in sets.items()))
    fields = sample_fields(machine)
    chosen = samples.iloc[sets[name]]
    return {".parquet": table({f.name: chosen[f.name].to_numpy() for f in fields}, fields)}


def divided(
    samples: pd.DataFrame, machine: PlanarMachine, own: OwnSamples
) -> dict[str, np.ndarray]:
    """Rows of `samples` by the SETS; those of equal coordinates stay together.

    A row whose pose was learnt from with another payload would flatter the networks.
    """
    names = [field.name for field in coordinates(machine)]
    pose = samples.groupby(names, sort=False).ngroup().to_numpy()
    order = np.random.default_rng(own.seed).permutation(int(pose.max(initial=-1)) + 1)
    shares = np.array([own.selection_share, own.selection_share + own.held_out_share])
    parts = np.split(order, np.round(shares * len(order)).astype(int))
    found = zip(("selection", "held_out", "grid"), parts, strict=True)
    return {name: np.flatnonzero(np.isin(pose, poses)) for name, poses in found}


def read_own(path: Path, machine: PlanarMachine, columns: Mapping[str, str]) -> pd.DataFrame:
    """Columns sample_fields of the CSV or Parquet file `path`, in SI units.

    A header is a name of these columns with its unit, `boom_stroke (mm)`, `tip_x_m`, or another
    text with a unit that `columns` names. What is not asked for is left out.

    Raises DataError, which names the file, the column and the line (of Parquet the row), for what
    is missing, no number, without a unit, beyond a drive, far from where the rigid machine has its
    tip, or a payload in another unit.
    """
    try:
        if path.suffix == ".parquet":
            given = pd.read_parquet(path)
            given.index = pd.RangeIndex(1, len(given) + 1, name="row")
        else:
            given = pd.read_csv(path, skip_blank_lines=False)
            given.index = pd.RangeIndex(2, len(given) + 2, name="line")  # after the header's
            given = given.dropna(how="all")
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise DataError(f"{path}: expected a CSV or Parquet table ({reason})") from None
    headers = {_plain(str(header)): str(header) for header in given}
    found: dict[str, np.ndarray] = {}
    for field in (*coordinates(machine), PAYLOAD, *TIP):
        wanted = columns.get(field.name)
        header = wanted if wanted in given else headers.get(field.name)
        if header is None:
            known = ", ".join(map(str, given))
            what = f"{field.name} with a unit" if wanted is None else repr(wanted)
            raise DataError(f"{path}: expected a column {what}, got {known}")
        found[field.name] = _numbers(path, header, given[header], field.unit)
    return _checked(path, machine, pd.DataFrame(found, index=given.index))


def _place(rows: pd.DataFrame | pd.Series, row: int) -> str:
    """Where `row` stands in its file."""
    return f"{rows.index.name} {rows.index[row]}"


def _plain(header: str) -> str:
    """The name in a header, without its unit."""
    text = re.sub(r"\s+", "_", header.strip().lower())
    match = HEADER.fullmatch(text)
    return match.group(1) if match else text


def _numbers(path: Path, header: str, column: pd.Series, unit: str) -> np.ndarray:
    match = HEADER.fullmatch(header.strip())
    units = ", ".join(name for name, (si, _) in UNITS.items() if si == unit)
    if match is None or UNITS[match.group(2)][0] != unit:
        raise DataError(f"{path}, column {header}: expected a unit at its end, one of {units}")
    values = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        got = column.iloc[row]
        told = "nothing" if pd.isna(got) else repr(got)
        raise DataError(
            f"{path}, {_place(column, row)}, column {header}: expected a number, got {told}"
        )
    return values * UNITS[match.group(2)][1]


def _checked(path: Path, machine: PlanarMachine, samples: pd.DataFrame) -> pd.DataFrame:
    manipulator = manipulator_of(machine)
    names = [field.name for field in coordinates(machine)]
    values, tips = samples[names].to_numpy(), samples[[f.name for f in TIP]].to_numpy()
    slack = BEYOND * (manipulator.upper - manipulator.lower)
    inside = (values >= manipulator.lower - slack) & (values <= manipulator.upper + slack)
    if not inside.all():
        row, k = np.argwhere(~inside)[0]
        limits = f"{manipulator.lower[k]:g} to {manipulator.upper[k]:g}"
        raise DataError(
            f"{path}, {_place(samples, row)}: {names[k]}: expected {limits}, got {values[row, k]:g}"
        )
    rigid = manipulator.forward(np.clip(values, manipulator.lower, manipulator.upper))
    far = np.hypot(*(tips - rigid).T) > FAR * np.ptp(rigid, axis=0).max(initial=1.0)
    if far.any():
        row = int(np.argmax(far))
        raise DataError(
            f"{path}, {_place(samples, row)}: the tip ({tips[row, 0]:g}, {tips[row, 1]:g}) m is "
            f"far from that of the rigid machine, ({rigid[row, 0]:g}, {rigid[row, 1]:g}) m"
        )
    if fault := payload_fault(float(samples["payload"].max()), machine):
        raise DataError(f"{path}: payload: {fault}")
    if (samples["payload"] < 0).any():
        row = int(np.argmax(samples["payload"] < 0))
        raise DataError(f"{path}, {_place(samples, row)}: payload: expected 0 or more")
    return samples.assign(rigid_x=rigid[:, 0], rigid_y=rigid[:, 1], status=KEPT)
