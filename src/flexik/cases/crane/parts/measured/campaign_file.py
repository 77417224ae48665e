"""Measurements of a real crane, from a CSV that its user fills in."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

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
    numbers = [number for number, _ in rows]
    texts = pd.DataFrame([cells for _, cells in rows], columns=pd.Index(names), index=numbers)
    if "method" in names:
        _check_methods(path, texts["method"])
    frame = pd.DataFrame(
        {
            _without_unit(name): texts[name]
            if name == "method"
            else _numbers(path, name, texts[name])
            for name in COLUMNS
            if name in names
        }
    )
    if "method" in frame:
        _check_positioning(path, frame)
    _check_repeated(path, frame, list(frame.columns))
    return frame.reset_index(names="line")


def own_campaign(file: Path | str, geometry: CraneGeometry) -> pd.DataFrame:
    """Campaign in `file` with the columns CAMPAIGN, NaN and no text for what it leaves out.

    Raises DataError, naming the line, as `read_campaign` does, and if the rigid crane of `geometry`
    does not reach a target, a stroke is beyond its cylinder, or a tip was measured far from where
    its strokes put the rigid crane.
    """
    table = read_campaign(file)
    if "method" in table:
        missed = np.isnan(smallest_extension(geometry, table[TARGET].to_numpy()))
        if missed.any():
            line, x, y = table.loc[missed, ["line", *TARGET]].iloc[0]
            raise DataError(
                f"{file}, line {line:g}: the rigid crane does not reach the target ({x:g}, {y:g}) m"
            )
    if STROKES[0] in table:
        _check_strokes(file, table, geometry)
    missing = (field for field in CAMPAIGN if field.name not in table)
    return table.assign(**{f.name: "" if f.dtype == "string" else np.nan for f in missing})


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


def _check_methods(path: Path | str, methods: pd.Series) -> None:
    for number, method in methods.items():
        if method not in METHODS:
            raise DataError(
                f"{path}, line {number}, column method: expected one of {list(METHODS)}, "
                f"got {method!r}"
            )


def _numbers(path: Path | str, name: str, texts: pd.Series) -> pd.Series:
    """Finite numbers of the column `name`, within what its unit makes plausible."""
    load = name.endswith("_kg")
    low, high = (0.0, LARGEST_PAYLOAD) if load else (-LARGEST_LENGTH, LARGEST_LENGTH)
    values = []
    for number, text in texts.items():
        where = f"{path}, line {number}, column {name}"
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        # float() takes 1_000 too
        if not np.isfinite(value) or "_" in text:
            raise DataError(f"{where}: expected a number, got {text!r}")
        if not low <= value <= high:
            unit = "kg" if load else "m"
            raise DataError(f"{where}: expected {low:g} to {high:g} {unit}, got {text}")
        values.append(value)
    return pd.Series(values, index=texts.index, dtype=float)


def _check_positioning(path: Path | str, frame: pd.DataFrame) -> None:
    """Raise DataError unless every condition was measured once by both methods, 0 kg among them."""
    missed = np.hypot(
        frame["measured_x"] - frame["target_x"], frame["measured_y"] - frame["target_y"]
    )
    for number, distance in zip(frame.index, missed, strict=True):
        if distance > LARGEST_ERROR:
            raise DataError(
                f"{path}, line {number}: expected a point within {LARGEST_ERROR:g} m of its "
                f"target, got one {distance:.3g} m away"
            )
    keys = ["method", *TARGET, "payload"]
    _check_repeated(path, frame, keys)
    known = set(frame[keys].itertuples(index=False, name=None))
    for number, (method, x, y, payload) in zip(
        frame.index, frame[keys].itertuples(index=False, name=None), strict=True
    ):
        (other,) = set(METHODS) - {method}
        for needed in ((other, x, y, payload), (REFERENCE_METHOD, x, y, REFERENCE_PAYLOAD)):
            if needed not in known:
                what = " (the reference)" if needed[3] == 0 and payload != 0 else ""
                raise DataError(
                    f"{path}, line {number}: expected a line with {needed[3]:g} kg and method "
                    f"{needed[0]!r} for the target ({x:g}, {y:g}) m too{what}"
                )


def _check_strokes(file: Path | str, table: pd.DataFrame, geometry: CraneGeometry) -> None:
    for name, longest in zip(STROKES, geometry.stroke_maximum, strict=True):
        beyond = ~table[name].between(-STROKE_TOLERANCE, longest + STROKE_TOLERANCE)
        if beyond.any():
            line, stroke = table.loc[beyond, ["line", name]].iloc[0]
            raise DataError(
                f"{file}, line {line:g}: {name} {stroke:g} m, expected 0 to {longest:g} m"
            )
    strokes = np.clip(table[STROKES].to_numpy(), 0.0, geometry.stroke_maximum)
    away = np.linalg.norm(table[MEASURED].to_numpy() - forward(geometry, strokes), axis=1)
    if (away > LARGEST_ERROR).any():
        row = int(np.argmax(away > LARGEST_ERROR))
        raise DataError(
            f"{file}, line {table['line'].iloc[row]}: expected a point within {LARGEST_ERROR:g} m "
            f"of where these strokes put the rigid crane, got one {away[row]:.3g} m away"
        )


def _check_repeated(path: Path | str, frame: pd.DataFrame, keys: list[str]) -> None:
    first: dict[tuple[object, ...], object] = {}
    for number, row in zip(
        frame.index, frame[keys].itertuples(index=False, name=None), strict=True
    ):
        if row in first:
            raise DataError(
                f"{path}, line {number}: expected each measurement once, but {', '.join(keys)} "
                f"are those of line {first[row]}"
            )
        first[row] = number


def _without_unit(name: str) -> str:
    return name.removesuffix("_kg").removesuffix("_m")
