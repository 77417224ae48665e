"""Report pages in Markdown."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import pandas as pd

from flexik.errors import DataError
from flexik.files import write_text
from flexik.reporting.tables import markdown


@dataclass(frozen=True)
class Section:
    """A part of a page: heading, text, then tables, then figures.

    tables : Markdown files made by tables.write_table, shown whole, with a link to the CSV beside.
    figures : image files and their captions.
    """

    title: str
    text: str = ""
    tables: Sequence[Path | str] = ()
    figures: Sequence[tuple[Path | str, str]] = ()


def page(
    path: Path | str,
    title: str,
    sections: Sequence[Section],
    parameters: Mapping[str, str],
    inputs: Mapping[str, str],
) -> None:
    """Write a report page with relative links and, last, what it was made from.

    Parameters
    ----------
    path
        Markdown file to write.
    title
        Heading of the page.
    sections
        Its parts, in order.
    parameters, inputs
        Checksums by the name of the parameter section and of the input file.

    Raises
    ------
    DataError
        If a table or figure is missing.
    """
    path = Path(path)
    blocks = [f"# {title}"]
    for section in sections:
        blocks.append(f"## {section.title}")
        if section.text:
            blocks.append(section.text.strip("\n"))
        blocks += [_table(path, Path(table)) for table in section.tables]
        blocks += [_figure(path, Path(figure), caption) for figure, caption in section.figures]
    blocks += ["## Provenance", _checksums("parameters", parameters), _checksums("input", inputs)]
    write_text(path, "\n\n".join(blocks) + "\n")


def _table(page_path: Path, table: Path) -> str:
    try:
        text = table.read_text(encoding="utf-8").strip("\n")
    except OSError as error:
        raise DataError(f"{page_path}: no table {table}") from error
    csv = table.with_suffix(".csv")
    return f"{text}\n\n[{csv.name}]({_link(page_path, csv)})"


def _figure(page_path: Path, figure: Path, caption: str) -> str:
    alternative = caption.replace("[", "(").replace("]", ")")
    return f"![{alternative}]({_link(page_path, figure)})\n\n*{caption}*"


def _link(page_path: Path, target: Path) -> str:
    if not target.is_file():
        raise DataError(f"{page_path}: no file {target}")
    return quote(Path(os.path.relpath(target, page_path.parent)).as_posix())


def _checksums(what: str, checksums: Mapping[str, str]) -> str:
    rows = [{what: name, "SHA-256": f"`{value}`"} for name, value in sorted(checksums.items())]
    return markdown(pd.DataFrame(rows, columns=[what, "SHA-256"])).strip("\n")
