"""Tables: CSV first, Markdown for people beside it; and the tables of published values beside ours.

CSV keeps EXTRA_DECIMALS more than Markdown and no more, so that round-off of another machine does
not change the file.
"""

import numbers
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.errors import DataError
from flexik.evaluation.errors import comparison
from flexik.files import write_text
from flexik.reporting.style import MM, require

Decimals = int | Mapping[str, int]

DECIMALS = 2
EXTRA_DECIMALS = 3

# As in the thesis' table of simulated positioning errors
STATISTIC_NAMES = {
    "max_abs_dx": "max |dX| (mm)",
    "max_abs_dy": "max |dY| (mm)",
    "max_error": "max R (mm)",
    "mean_abs_dx": "mean |dX| (mm)",
    "mean_abs_dy": "mean |dY| (mm)",
    "mean_error": "mean R (mm)",
}
COUNT_NAMES = {"n_conditions": "conditions", "n_failed": "failed conditions"}


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


def positioning_errors_table(
    by_method: Mapping[str, Mapping[str, float]],
    published: pd.DataFrame,
    column_of: Mapping[str, str | None] | None = None,
) -> pd.DataFrame:
    """Six statistics in mm, ours and the published one for every method; then the counts.

    Parameters
    ----------
    by_method
        Results of evaluation.errors.statistics (m) by label.
    published
        A column `statistic` and a column (mm) for every published method.
    column_of
        Published column of a label where it is not the label itself; None where nothing is
        published, which leaves the cells empty.

    Returns
    -------
    DataFrame
        Columns statistic, `label` and `label published` for every label; nothing is published
        about the counts.

    Raises
    ------
    DataError
        If a published statistic or column, or a count, is missing.
    """
    errors = comparison(by_method, published, column_of)
    names = [STATISTIC_NAMES[str(name)] for name in errors.index]
    columns: dict[str, list[object]] = {"statistic": [*names, *COUNT_NAMES.values()]}
    for label, values in by_method.items():
        require(f"statistics of {label}", values, COUNT_NAMES)
        columns[label] = [*errors[label], *(int(values[count]) for count in COUNT_NAMES)]
        published_name = f"{label} published"
        columns[published_name] = [*errors[published_name], *(None for _ in COUNT_NAMES)]
    return pd.DataFrame(columns, dtype=object)  # integers stay integers beside floats


def calibration_table(
    statistics: Mapping[str, float], published: pd.DataFrame, column: str = "none"
) -> pd.DataFrame:
    """Our six `statistics` (m) beside the published `column` (mm), and the difference in %.

    Raises DataError if a published statistic or the column is missing.
    """
    errors = comparison({column: statistics}, published)
    ours, theirs = errors[column], errors[f"{column} published"]
    return pd.DataFrame(
        {
            "statistic": [STATISTIC_NAMES[str(name)] for name in errors.index],
            "ours": ours.to_numpy(),
            "published": theirs.to_numpy(),
            "difference (%)": (100 * (ours / theirs - 1)).to_numpy(),
        }
    )


def mesh_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Tip differences of a mesh study in mm.

    Parameters
    ----------
    frame
        A row for every mesh; columns `refinement`, `mean_difference` and `max_difference` (m, of
        the tip from the finest mesh). Other columns pass through unchanged.

    Raises
    ------
    DataError
        If a column is missing.
    """
    names = {
        "mean_difference": "mean tip difference (mm)",
        "max_difference": "max tip difference (mm)",
    }
    require("mesh study", frame.columns, ("refinement", *names))
    table = frame.copy()
    for name in names:
        table[name] = MM * table[name]
    return table.rename(columns=names).reset_index(drop=True)


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
