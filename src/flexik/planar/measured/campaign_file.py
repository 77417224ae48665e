"""Measurements of a real machine, from a CSV that its user fills in."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from flexik.errors import DataError
from flexik.kinematics.loops import Linkage
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.planar.fields import coordinates
from flexik.planar.measured.errors import REFERENCE_METHOD, REFERENCE_PAYLOAD
from flexik.planar.measured.fields import MEASURED, METHODS, TARGET, campaign_fields

Rows = list[tuple[int, list[str]]]  # line numbers and cells

# Columns of the file with their units; the frame's names have none
ALWAYS = ("payload_kg", "measured_x_m", "measured_y_m")
POSITIONING = ("method", "target_x_m", "target_y_m")

# Beyond these a number is in another unit, or slipped. Smaller slips show in the surprise of a
# measurement, see predictions.py
LARGEST = {"kg": (0.0, 1e5), "m": (-50.0, 50.0), "rad": (-10.0, 10.0)}
# How far from where it should be a point is measured, in shares of the largest distance from the
# origin: cranes miss by centimetres of 7 m, a long slender boom sags by a metre of 30 m
LARGEST_ERROR = 0.07
# A sensor may say a little beyond the limits of its drive, in shares of its range
BEYOND = 0.02
POINT = "({target_x:g}, {target_y:g})"


def coordinate_columns(machine: PlanarMachine) -> tuple[str, ...]:
    """Columns of coordinates in the file: the strokes in m and angles in rad of the drives."""
    return tuple(f"{field.name}_{field.unit}" for field in coordinates(machine))


def read_campaign(path: Path | str, machine: PlanarMachine) -> pd.DataFrame:
    """Measurements of the CSV `path` on `machine`, checked.

    The first line that is not empty and does not begin with `#` names the columns, in any order:

    - `payload_kg`, `measured_x_m`, `measured_y_m`: always. The load, and where the tip came to
      rest; x forward and y up, as on the ground of the machine file.
    - `method`, `target_x_m`, `target_y_m`: for the tables of positioning errors. The method is
      `none` (coordinates of the rigid model) or `combined` (compensated). Each target is approached
      once with each of its payloads under both methods; 0 kg is one of the payloads, because
      the point that `combined` reaches with it is the reference of table 4.3.
    - `DRIVE_stroke_m` or, of a revolute drive, `DRIVE_angle_rad` for every drive: to correct the
      compensator. The coordinates that were commanded.

    One of the two groups, or both. Numbers have a decimal point; cells are separated by commas.

    Parameters
    ----------
    path
        CSV file in UTF-8.

    Returns
    -------
    DataFrame
        Columns line (of the file) and those of the file without their units, in the order of
        `campaign_fields`; those of a missing group are absent. Rows in the order of the file.

    Raises
    ------
    DataError
        At the first thing that is not as described, naming the file, the line and what was
        expected.
    """
    (first, names), rows = _split(path)
    _check_header(path, first, names, coordinate_columns(machine))
    for number, cells in rows:
        if len(cells) != len(names):
            raise DataError(
                f"{path}, line {number}: expected {len(names)} cells separated by commas, as in "
                f"line {first}, got {len(cells)}"
            )
    table = pd.DataFrame([cells for _, cells in rows], columns=pd.Index(names))
    table.insert(0, "line", [number for number, _ in rows])
    if "method" in table:
        message = f"column method: expected one of {list(METHODS)}, got {{method!r}}"
        _expect(path, table, table["method"].isin(METHODS), message)
    columns = columns_of(coordinate_columns(machine))
    found = table[["line", *(name for name in columns if name in names)]].copy()
    for name in names:
        if name != "method":
            found[name] = _numbers(path, table[["line", name]], name)
    found = found.rename(columns=_without_unit)
    if "method" in found:
        _check_positioning(path, found, _farthest(machine))
    _check_repeated(path, found, list(found.columns[1:]))
    return found


def own_campaign(file: Path | str, machine: PlanarMachine) -> pd.DataFrame:
    """Campaign in `file`, columns `campaign_fields`, NaN and no text for what it leaves out.

    Raises DataError, naming the line, as `read_campaign` does, and if the rigid `machine` does not
    reach a target, a coordinate is beyond its drive, or a tip was measured far from where its
    coordinates put the rigid machine.
    """
    table, manipulator = read_campaign(file, machine), manipulator_of(machine)
    lower, upper = manipulator.lower, manipulator.upper
    if "method" in table:
        middle = np.tile((lower + upper) / 2, (len(table), 1))
        reached = manipulator.inverse(table[TARGET].to_numpy(), middle).reached
        _expect(file, table, reached, f"the rigid machine does not reach the target {POINT} m")
    fields = coordinates(machine)
    if fields[0].name in table:
        for field, low, high in zip(fields, lower, upper, strict=True):
            slack = BEYOND * (high - low)
            inside = table[field.name].between(low - slack, high + slack)
            limits = f"{low:g} to {high:g} {field.unit}"
            message = f"{field.name} {{{field.name}:g}} {field.unit}, expected {limits}"
            _expect(file, table, inside, message)
        values = np.clip(table[[field.name for field in fields]].to_numpy(), lower, upper)
        where = "where these coordinates put the rigid machine"
        _check_near(file, table, manipulator.forward(values), where, _farthest(machine))
    missing = (field for field in campaign_fields(machine) if field.name not in table)
    return table.assign(**{f.name: "" if f.dtype == "string" else np.nan for f in missing})


def columns_of(given: tuple[str, ...]) -> tuple[str, ...]:
    """All columns that a file may have, with those `given` of coordinates."""
    return (*POSITIONING, "payload_kg", *given, "measured_x_m", "measured_y_m")


def _farthest(machine: PlanarMachine) -> float:
    """How far from where it should be a point may be, m."""
    linkage = Linkage(machine)
    return LARGEST_ERROR * float(np.linalg.norm(linkage.tip(linkage.starts[1])[0], axis=1).max())


def _expect(path: Path | str, table: pd.DataFrame, good: ArrayLike, message: str) -> None:
    """Raise DataError at the first row that is not `good`; its cells are put into `message`."""
    if not (rows := np.asarray(good, dtype=bool)).all():
        row = {str(name): table[name].iloc[int(np.argmin(rows))] for name in table}
        raise DataError(f"{path}, line {row['line']}: {message.format(**row)}")


def _split(path: Path | str) -> tuple[tuple[int, list[str]], Rows]:
    """Header and rows of `path`, each with its line number, comments and empty lines left out."""
    try:
        # spreadsheets put a byte order mark before the text
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        used = [
            (number, [cell.strip() for cell in next(csv.reader([line]))])
            for number, line in enumerate(lines, start=1)
            if line.strip() and not line.lstrip().startswith("#")
        ]
    except (OSError, ValueError, csv.Error) as error:
        reason = " ".join(str(error).split())
        raise DataError(f"{path}: expected a CSV table in UTF-8 ({reason})") from None
    if len(used) < 2:
        raise DataError(f"{path}: expected a line of column names and one or more of measurements")
    return used[0], used[1:]


def _check_header(
    path: Path | str, number: int, names: Sequence[str], adaptation: tuple[str, ...]
) -> None:
    where, columns = f"{path}, line {number}", columns_of(adaptation)
    if len(names) == 1:
        raise DataError(f"{where}: expected columns separated by commas, got {names[0]!r}")
    for name in names:
        if name in columns:
            continue
        meant = [c for c in columns if f"{name}_".startswith(f"{_without_unit(c)}_")]
        expected = f"{meant[0]!r} (its unit in its name)" if meant else f"one of {list(columns)}"
        raise DataError(f"{where}: expected as column {expected}, got {name!r}")
    if repeated := [name for name in columns if list(names).count(name) > 1]:
        raise DataError(f"{where}: expected each column once, got {repeated} more often")
    if missing := [name for name in ALWAYS if name not in names]:
        raise DataError(f"{where}: expected the columns {missing} too")
    found = [group for group in (POSITIONING, adaptation) if set(group) & set(names)]
    if not found:
        raise DataError(
            f"{where}: expected the columns {list(POSITIONING)}, {list(adaptation)} or both"
        )
    for group in found:
        if missing := [name for name in group if name not in names]:
            raise DataError(
                f"{where}: expected the columns {list(group)} together, but {missing} missing"
            )


def _numbers(path: Path | str, table: pd.DataFrame, name: str) -> pd.Series:
    """Finite numbers of the column `name`, within what its unit makes plausible."""

    def number(text: str) -> float:
        try:
            return float("nan" if "_" in text else text)  # float() takes 1_000 too
        except ValueError:
            return np.nan

    values = table[name].map(number).astype(float)
    where, unit = f"column {name}: expected", name.rpartition("_")[2]
    _expect(path, table, np.isfinite(values), f"{where} a number, got {{{name}!r}}")
    low, high = LARGEST[unit]
    message = f"{where} {low:g} to {high:g} {unit}, got {{{name}}}"
    _expect(path, table, values.between(low, high), message)
    return values


def _check_positioning(path: Path | str, table: pd.DataFrame, farthest: float) -> None:
    """Raise DataError unless every condition was measured once by both methods, 0 kg among them."""
    _check_near(path, table, table[TARGET].to_numpy(), "its target", farthest)
    keys = ["method", *TARGET, "payload"]
    _check_repeated(path, table, keys)
    known = set(table[keys].itertuples(index=False, name=None))
    other = table["method"].map(dict(zip(METHODS, METHODS[::-1], strict=True)))
    reference = {"method": REFERENCE_METHOD, "payload": REFERENCE_PAYLOAD}
    for needed, what in (({"method": other}, ""), (reference, " (the reference)")):
        wanted = table.assign(**needed)
        there = [row in known for row in wanted[keys].itertuples(index=False, name=None)]
        line = f"a line with {{payload:g}} kg and method {{method!r}} for the target {POINT} m"
        _expect(path, wanted, there, f"expected {line} too{what}")


def _check_near(
    path: Path | str, table: pd.DataFrame, points: ArrayLike, what: str, farthest: float
) -> None:
    """Raise DataError unless each point was measured within `farthest` m of `points` (n, 2)."""
    away = np.linalg.norm(table[MEASURED].to_numpy() - points, axis=1)
    message = f"expected a point within {farthest:.1g} m of {what}, got one {{away:.3g}} m away"
    _expect(path, table.assign(away=away), away <= farthest, message)


def _check_repeated(path: Path | str, table: pd.DataFrame, keys: list[str]) -> None:
    first = table.groupby(keys, sort=False)["line"].transform("first")
    message = f"expected each measurement once, but {', '.join(keys)} are those of line {{first}}"
    _expect(path, table.assign(first=first), first == table["line"], message)


def _without_unit(name: str) -> str:
    for unit in LARGEST:
        name = name.removesuffix(f"_{unit}")
    return name
