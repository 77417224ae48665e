"""Measurements of a real crane, from a CSV that its user fills in."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from flexik.cases.crane.parts.measured.errors import REFERENCE_METHOD, REFERENCE_PAYLOAD
from flexik.cases.crane.parts.measured.fields import CAMPAIGN, MEASURED, METHODS, STROKES, TARGET
from flexik.errors import DataError
from flexik.kinematics.crane import CraneGeometry, forward, smallest_extension

Rows = list[tuple[int, list[str]]]  # line numbers and cells

# Columns of the file with their units; the frame's names have none
ALWAYS = ("payload_kg", "measured_x_m", "measured_y_m")
POSITIONING = ("method", "target_x_m", "target_y_m")
ADAPTATION = ("lift_stroke_m", "jib_stroke_m", "extension_stroke_m")
COLUMNS = (*POSITIONING, "payload_kg", *ADAPTATION, "measured_x_m", "measured_y_m")

# Beyond these a number is in another unit, or slipped: a crane of this kind reaches 7 m, and misses
# by centimetres. Smaller slips show in the surprise of a measurement, see predictions.py
LARGEST_LENGTH = 50.0  # m
LARGEST_PAYLOAD = 1e5  # kg
LARGEST_ERROR = 0.5  # m
# a sensor may say a little beyond the ends of its cylinder, m
STROKE_TOLERANCE = 0.01
POINT = "({target_x:g}, {target_y:g})"


def read_campaign(path: Path | str) -> pd.DataFrame:
    """Measurements of the CSV `path`, checked.

    The first line that is not empty and does not begin with `#` names the columns, in any order:

    - `payload_kg`, `measured_x_m`, `measured_y_m`: always. The load, and where the tip came to
      rest; x forward and y up from the ground at the slew axis, as everywhere.
    - `method`, `target_x_m`, `target_y_m`: for the tables of positioning errors. The method is
      `none` (strokes of the rigid model) or `combined` (compensated). Each target is approached
      once with each of its payloads under both methods; 0 kg is one of the payloads, because
      the point that `combined` reaches with it is the reference of table 4.3.
    - `lift_stroke_m`, `jib_stroke_m`, `extension_stroke_m`: to correct the compensator. The strokes
      that were commanded.

    One of the two groups, or both. Numbers have a decimal point; cells are separated by commas.

    Parameters
    ----------
    path
        CSV file in UTF-8.

    Returns
    -------
    DataFrame
        Columns line (of the file) and those of the file without their units (payload in kg, the
        others in m), in the order method, target_x, target_y, payload, lift_stroke, jib_stroke,
        extension_stroke, measured_x, measured_y; those of a missing group are absent. Rows in the
        order of the file.

    Raises
    ------
    DataError
        At the first thing that is not as described, naming the file, the line and what was
        expected.
    """
    (first, names), rows = _split(path)
    _check_header(path, first, names)
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
    found = table[["line", *(name for name in COLUMNS if name in names)]].copy()
    for name in names:
        if name != "method":
            found[name] = _numbers(path, table[["line", name]], name)
    found = found.rename(columns=_without_unit)
    if "method" in found:
        _check_positioning(path, found)
    _check_repeated(path, found, list(found.columns[1:]))
    return found


def own_campaign(file: Path | str, geometry: CraneGeometry) -> pd.DataFrame:
    """Campaign in `file` with the columns CAMPAIGN, NaN and no text for what it leaves out.

    Raises DataError, naming the line, as `read_campaign` does, and if the rigid crane of `geometry`
    does not reach a target, a stroke is beyond its cylinder, or a tip was measured far from where
    its strokes put the rigid crane.
    """
    table = read_campaign(file)
    if "method" in table:
        reached = np.isfinite(smallest_extension(geometry, table[TARGET].to_numpy()))
        _expect(file, table, reached, f"the rigid crane does not reach the target {POINT} m")
    if STROKES[0] in table:
        for name, longest in zip(STROKES, geometry.stroke_maximum, strict=True):
            inside = table[name].between(-STROKE_TOLERANCE, longest + STROKE_TOLERANCE)
            message = f"{name} {{{name}:g}} m, expected 0 to {longest:g} m"
            _expect(file, table, inside, message)
        strokes = np.clip(table[STROKES].to_numpy(), 0.0, geometry.stroke_maximum)
        where = "where these strokes put the rigid crane"
        _check_near(file, table, forward(geometry, strokes), where)
    missing = (field for field in CAMPAIGN if field.name not in table)
    return table.assign(**{f.name: "" if f.dtype == "string" else np.nan for f in missing})


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


def _check_header(path: Path | str, number: int, names: Sequence[str]) -> None:
    where = f"{path}, line {number}"
    if len(names) == 1:
        raise DataError(f"{where}: expected columns separated by commas, got {names[0]!r}")
    for name in names:
        if name in COLUMNS:
            continue
        meant = [c for c in COLUMNS if f"{name}_".startswith(f"{_without_unit(c)}_")]
        expected = f"{meant[0]!r} (its unit in its name)" if meant else f"one of {list(COLUMNS)}"
        raise DataError(f"{where}: expected as column {expected}, got {name!r}")
    if repeated := [name for name in COLUMNS if list(names).count(name) > 1]:
        raise DataError(f"{where}: expected each column once, got {repeated} more often")
    if missing := [name for name in ALWAYS if name not in names]:
        raise DataError(f"{where}: expected the columns {missing} too")
    found = [group for group in (POSITIONING, ADAPTATION) if set(group) & set(names)]
    if not found:
        raise DataError(
            f"{where}: expected the columns {list(POSITIONING)}, {list(ADAPTATION)} or both"
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
    where, load = f"column {name}: expected", name.endswith("_kg")
    _expect(path, table, np.isfinite(values), f"{where} a number, got {{{name}!r}}")
    low, high, unit = (
        (0.0, LARGEST_PAYLOAD, "kg") if load else (-LARGEST_LENGTH, LARGEST_LENGTH, "m")
    )
    message = f"{where} {low:g} to {high:g} {unit}, got {{{name}}}"
    _expect(path, table, values.between(low, high), message)
    return values


def _check_positioning(path: Path | str, table: pd.DataFrame) -> None:
    """Raise DataError unless every condition was measured once by both methods, 0 kg among them."""
    _check_near(path, table, table[TARGET].to_numpy(), "its target")
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


def _check_near(path: Path | str, table: pd.DataFrame, points: ArrayLike, what: str) -> None:
    """Raise DataError unless each point was measured within LARGEST_ERROR of `points` (n, 2)."""
    away = np.linalg.norm(table[MEASURED].to_numpy() - points, axis=1)
    message = f"expected a point within {LARGEST_ERROR:g} m of {what}, got one {{away:.3g}} m away"
    _expect(path, table.assign(away=away), away <= LARGEST_ERROR, message)


def _check_repeated(path: Path | str, table: pd.DataFrame, keys: list[str]) -> None:
    first = table.groupby(keys, sort=False)["line"].transform("first")
    message = f"expected each measurement once, but {', '.join(keys)} are those of line {{first}}"
    _expect(path, table.assign(first=first), first == table["line"], message)


def _without_unit(name: str) -> str:
    return name.removesuffix("_kg").removesuffix("_m")
