"""Tables: CSV first, Markdown for people beside it.

CSV keeps EXTRA_DECIMALS more than Markdown and no more, so that round-off of another machine does
not change the file.
"""

import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.errors import DataError
from flexik.files import write_text
from flexik.reporting.style import MM, require

Decimals = int | Mapping[str, int]

DECIMALS = 2
EXTRA_DECIMALS = 3


@dataclass(frozen=True)
class Table:
    """A frame of numbers, texts or nothing, and the decimals of its floats in Markdown.

    decimals : for all columns, or by column (DECIMALS for the others).
    """

    frame: pd.DataFrame
    decimals: Decimals = DECIMALS

    @property
    def csv(self) -> str:
        """Text of the CSV file."""
        cells = _cells(self.frame, self.decimals, EXTRA_DECIMALS)
        return cells.to_csv(index=False, lineterminator="\n")

    def markdown(self, caption: str = "", notes: Sequence[str] = ()) -> str:
        """Caption, rows, notes as a list; see `markdown`."""
        return markdown(self.frame, self.decimals, caption, notes)


@dataclass(frozen=True)
class Column:
    """A column of a table: from which column of the results, times `scale`."""

    source: str
    decimals: int = DECIMALS
    scale: float = 1.0


def mm(source: str, decimals: int = DECIMALS) -> Column:
    """Column in millimetres of one in metres (or mrad of rad)."""
    return Column(source, decimals, MM)


def table(rows: pd.DataFrame | Sequence[Mapping], columns: Mapping[str, Any]) -> Table:
    """Table of some columns of `rows` under the titles that are the keys of `columns`.

    Values are Columns, or names of columns taken as they are. Raises DataError if one is missing.
    """
    frame = pd.DataFrame(rows)
    given = {t: c if isinstance(c, Column) else Column(c) for t, c in columns.items()}
    if frame.empty:
        return Table(pd.DataFrame(columns=list(given)), {t: c.decimals for t, c in given.items()})
    require("rows of the table", frame.columns, [column.source for column in given.values()])
    found = {
        title: frame[c.source] if c.scale == 1.0 else c.scale * frame[c.source]
        for title, c in given.items()
    }
    return Table(pd.DataFrame(found), {title: c.decimals for title, c in given.items()})


def write_table(
    path_without_suffix: Path | str,
    frame: pd.DataFrame,
    decimals: Decimals = DECIMALS,
    caption: str = "",
    footnotes: Sequence[str] = (),
) -> None:
    """Write `frame` without its index to `.csv` and `.md`, each whole or not at all.

    Parameters
    ----------
    path_without_suffix
        Where; `.csv` and `.md` are appended.
    frame
        Rows of numbers, texts or nothing; integers are written as such.
    decimals
        Of floats in Markdown, for all columns or by column (DECIMALS for the others).
    caption, footnotes
        See `markdown`.

    Raises
    ------
    DataError
        If `decimals` names a column that `frame` lacks, or a number is infinite.
    """
    text = markdown(frame, decimals, caption, footnotes)
    cells = _cells(frame, decimals, EXTRA_DECIMALS)
    path = Path(path_without_suffix)
    write_text(path.with_name(path.name + ".csv"), cells.to_csv(index=False, lineterminator="\n"))
    write_text(path.with_name(path.name + ".md"), text)


def markdown(
    frame: pd.DataFrame,
    decimals: Decimals = DECIMALS,
    caption: str = "",
    footnotes: Sequence[str] = (),
) -> str:
    r"""Table in GitHub's Markdown: caption, rows with numbers to the right, footnotes as a list.

    Empty cells stand for None and NaN; `|` is escaped. Raises DataError as `write_table` does.
    """
    cells = _cells(frame, decimals, 0)
    header = [_escaped(str(name)) for name in cells.columns]
    rows = [[_escaped(text) for text in row] for row in cells.itertuples(index=False, name=None)]
    to_right = [_is_numeric(frame.iloc[:, k]) for k in range(frame.shape[1])]
    widths = [max(3, *(len(row[k]) for row in [header, *rows])) for k in range(len(header))]

    def line(row: Sequence[str]) -> str:
        padded = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(row, widths, to_right, strict=True)
        )
        return "| " + " | ".join(padded) + " |"

    rule = [
        "-" * (width - 1) + (":" if right else "-")
        for width, right in zip(widths, to_right, strict=True)
    ]
    blocks = [caption] if caption else []
    blocks.append("\n".join([line(header), line(rule), *map(line, rows)]))
    if footnotes:
        blocks.append("\n".join(f"- {note}" for note in footnotes))
    return "\n\n".join(blocks) + "\n"


def _cells(frame: pd.DataFrame, decimals: Decimals, extra: int) -> pd.DataFrame:
    """All cells as text."""
    if isinstance(decimals, Mapping):
        require("columns of the table", frame.columns, decimals)
    columns = []
    for k, name in enumerate(frame.columns):
        places = decimals if isinstance(decimals, int) else decimals.get(name, DECIMALS)
        columns.append([_text(value, places + extra, name) for value in frame.iloc[:, k].tolist()])
    rows = list(zip(*columns, strict=True))
    return pd.DataFrame(rows, columns=frame.columns, dtype=object)


def _text(value: object, places: int, column: object) -> str:
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return ""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return str(value)
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if not np.isfinite(float(value)):
        raise DataError(f"table column {column}: {value} is not a number to report")
    text = f"{float(value):.{places}f}"
    # what rounds to zero has no sign
    return text.lstrip("-") if float(text) == 0 else text


def _is_numeric(column: pd.Series) -> bool:
    values = [v for v in column.tolist() if v is not None and v is not pd.NA]
    return bool(values) and all(
        isinstance(v, numbers.Real) and not isinstance(v, bool) for v in values
    )


def _escaped(text: str) -> str:
    return text.replace("|", r"\|").replace("\n", " ")
