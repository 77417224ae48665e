"""Report pages: a Jinja template with the prose, tables and figures by name.

In a template stand sentences with numbers by name; a paragraph may be wrapped. Functions:
`table("name")`, `{% call table("name") %}caption, then "- notes"{% endcall %}`,
`figure("name", "caption")`; filters: see FILTERS. An unknown name is an error.
"""

import re
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2

from flexik.errors import DataError
from flexik.reporting import style
from flexik.reporting.tables import Table

# lines that end a paragraph: lists, tables, headings, figures, markers
_OWN_LINE = re.compile(r"\s*([-*|] |#+ |<|!\[|\d+\. )")


def _unit(scale: float, unit: str) -> Callable[..., str]:
    def write(value: float, decimals: int = 2) -> str:
        return f"{scale * value:.{decimals}f} {unit}"

    return write


def _several(values: Iterable[Any], last: str = " and ") -> str:
    texts = [str(value) for value in values]
    return last.join(filter(None, [", ".join(texts[:-1]), texts[-1]])) if texts else "none"


FILTERS: dict[str, Callable[..., Any]] = {
    # 0.00178 -> "1.78 mm", and so on, decimals as argument
    "mm": _unit(style.MM, "mm"),
    "mrad": _unit(style.MM, "mrad"),
    "um": _unit(style.MICRO, "um"),
    "deg": _unit(style.DEGREES, "deg"),
    "percent": lambda value, decimals=0: f"{100 * value:.{decimals}f} %",
    "fixed": lambda value, decimals=2: f"{value:.{decimals}f}",
    "short": lambda value: f"{value:g}",  # 470.0 -> "470"
    "digits": style.digits,
    "point": lambda point: style.coordinates(*point),  # (1, -2) -> "(1, −2)"
    "code": lambda name: f"`{name}`",
    "words": lambda name: str(name).replace("_", " "),
    "several": _several,  # "a, b and c"
}


@dataclass
class Page:
    """Texts rendered from a template, and which tables and figures it showed.

    text : of the page.
    tables : Markdown by name of the table, caption and notes around it.
    figures : names in the order of the page.
    """

    text: str = ""
    tables: dict[str, str] = field(default_factory=dict)
    figures: list[str] = field(default_factory=list)


def render(
    template: Path | str,
    tables: Mapping[str, Table],
    figures: Iterable[str],
    values: Mapping[str, Any],
) -> Page:
    """Fill the file `template` with `values`; links are relative to the page.

    Raises
    ------
    DataError
        If the template names a value, table or figure that is not given, or leaves one out.
    """
    page, known = Page(), set(figures)
    path = Path(template)

    def table(name: str, caption: str = "", caller: Callable[[], str] | None = None) -> str:
        style.require(f"{path}: tables", tables, [name])
        lines = unwrapped(caller()).strip("\n").splitlines() if caller else []
        notes = [line.removeprefix("- ") for line in lines if line.startswith("- ")]
        above = " ".join(line for line in lines if line and not line.startswith("- "))
        page.tables[name] = tables[name].markdown(above or caption, notes)
        csv = f"{name}.csv"
        return f"\n{page.tables[name]}\n[{Path(csv).name}]({quote(csv)})\n\n"

    def figure(name: str, caption: str) -> str:
        style.require(f"{path}: figures", known, [name])
        page.figures.append(name)
        alternative = caption.replace("[", "(").replace("]", ")")
        return f"\n![{alternative}]({quote(f'figures/{name}.png')})\n\n*{caption}*\n"

    environment = jinja2.Environment(
        # its own templates first, then those that cases share
        loader=jinja2.FileSystemLoader([path.parent, Path(__file__).parent]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
    )
    environment.filters |= FILTERS
    environment.globals |= {"table": table, "figure": figure, "zip": zip}
    try:
        text = environment.get_template(path.name).render(**values)
    except jinja2.TemplateError as error:
        # of the page or of what it includes
        frames = reversed(traceback.extract_tb(error.__traceback__))
        places = [f"{f.filename}, line {f.lineno}" for f in frames if f.filename.endswith(".j2")]
        raise DataError(f"{[*places, path][0]}: {error}") from error
    page.text = re.sub(r"\n{3,}", "\n\n", unwrapped(text)).strip("\n") + "\n"
    if left := sorted((set(tables) - set(page.tables)) | (known - set(page.figures))):
        raise DataError(f"{path}: nowhere shows {', '.join(left)}")
    return page


def unwrapped(text: str) -> str:
    """`text` with the lines of each paragraph and list entry joined."""
    lines: list[str] = []
    joins = False  # whether the last line takes a further one
    for line in text.splitlines():
        if joins and line.strip() and not _OWN_LINE.match(line):
            lines[-1] += f" {line.strip()}"
            continue
        lines.append(line.rstrip())
        joins = bool(line.strip()) and not re.match(r"\s*(\| |#+ |<|!\[)", line)
    return "\n".join(lines)
