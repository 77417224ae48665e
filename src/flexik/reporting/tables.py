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
        return self._cells(EXTRA_DECIMALS).to_csv(index=False, lineterminator="\n")

    def markdown(self, caption: str = "", notes: Sequence[str] = ()) -> str:
        r"""Caption, rows with numbers to the right, notes as a list, in GitHub's Markdown.

        Empty cells stand for None and NaN; `|` is escaped. Raises DataError if `decimals` names a
        column that is not there, or a number is infinite.
        """
        cells = self._cells(0)
        columns = [[str(name), *cells.iloc[:, k]] for k, name in enumerate(cells)]
        columns = [[t.replace("|", r"\|").replace("\n", " ") for t in texts] for texts in columns]
        lines = []
        for k, texts in enumerate(columns):
            width, right = max(3, *map(len, texts)), _is_numeric(self.frame.iloc[:, k])
            texts = [text.rjust(width) if right else text.ljust(width) for text in texts]
            lines.append([texts[0], "-" * (width - 1) + (":" if right else "-"), *texts[1:]])
        rows = [f"| {' | '.join(row)} |" for row in zip(*lines, strict=True)]
        blocks = [caption, "\n".join(rows), "\n".join(f"- {note}" for note in notes)]
        return "\n\n".join(filter(None, blocks)) + "\n"

    def write(
        self, path_without_suffix: Path | str, caption: str = "", notes: Sequence[str] = ()
    ) -> None:
        """Write `.csv` and `.md`, which are appended, each whole or not at all."""
        csv, text = self.csv, self.markdown(caption, notes)
        write_text(f"{path_without_suffix}.csv", csv)
        write_text(f"{path_without_suffix}.md", text)

    def _cells(self, extra: int) -> pd.DataFrame:
        """All cells as text."""
        places = self.decimals
        if isinstance(places, Mapping):
            require("columns of the table", self.frame.columns, places)
        columns = []
        for k, name in enumerate(self.frame.columns):
            n = extra + (places if isinstance(places, int) else places.get(name, DECIMALS))
            columns.append([_text(value, n, name) for value in self.frame.iloc[:, k].tolist()])
        rows = list(zip(*columns, strict=True))
        return pd.DataFrame(rows, columns=self.frame.columns, dtype=object)


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
        frame = pd.DataFrame(columns=[c.source for c in given.values()])
    require("rows of the table", frame.columns, [column.source for column in given.values()])
    found = {
        title: frame[c.source] if c.scale == 1.0 else c.scale * frame[c.source]
        for title, c in given.items()
    }
    return Table(pd.DataFrame(found), {title: c.decimals for title, c in given.items()})


def spread(values: pd.Series) -> dict[str, Any]:
    """What hangs on the draw, of the values of all restarts."""
    return {"least": values.min(), "median": values.median(), "largest": values.max()}


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
