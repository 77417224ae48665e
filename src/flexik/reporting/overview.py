"""The blocks of README.md that the pipeline keeps up to date.

Between `<!-- flexik:NAME -->` and `<!-- /flexik:NAME -->` stands the table reports/NAME.md, or, for
`overview`, what all cases reached beside the published values: the rows of cases/*/overview.csv.
"""

import csv
import re
from fnmatch import fnmatch
from pathlib import Path

import pandas as pd

from flexik.errors import DataError
from flexik.files import read_json, write_text
from flexik.reporting.tables import Table

REPORTS, REFERENCE = Path("reports"), Path("data/reference")
CASES = Path(__file__).parents[1] / "cases"
ABSENT = "not in this run"


def update(readme: Path | str) -> None:
    """Renew all blocks of `readme`; raises DataError if a file is missing."""
    try:
        text = Path(readme).read_text(encoding="utf-8")
        for name in re.findall(r"<!-- flexik:(\S+) -->", text):
            table = REPORTS / f"{name}.md"
            new = overview() if name == "overview" else table.read_text("utf-8")
            text = replace_block(text, name, new)
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be read ({error.strerror})") from None
    write_text(readme, text)


def overview() -> str:
    """Table in Markdown.

    Columns of cases/NAME/overview.csv: case, what (with its unit), metric (with * the mean of all
    that match), form of the number, scale to the unit, published (FILE ROW COLUMN [SCALE] in
    data/reference/NAME, or a text); optional: spread (two metrics, from and to, in brackets).
    """
    rows = []
    for file in sorted(CASES.glob("*/overview.csv")):
        metrics = read_json(REPORTS / file.parent.name / "metrics.json")
        for entry in csv.DictReader(file.read_text("utf-8").splitlines()):
            found = [v for name, v in metrics.items() if fnmatch(name, entry["metric"])]
            value = _number(sum(found) / len(found), entry) if found else ABSENT
            published = _published(file.parent.name, entry["published"])
            value += _spread(metrics, entry) if found else ""
            rows.append((entry["case"], entry["what"], published, value))
    return Table(pd.DataFrame(rows, columns=["case", "what", "published", "flexik"])).markdown()


def _number(value: float, entry: dict[str, str]) -> str:
    return format(float(entry["scale"]) * value, entry["form"])


def _spread(metrics: dict[str, float], entry: dict[str, str]) -> str:
    """The two metrics that `spread` names, if it does and the run has both."""
    named = [metrics.get(name) for name in (entry.get("spread") or "").split()]
    ends = [_number(end, entry) for end in named if end is not None]
    return f" ({ends[0]} to {ends[1]})" if len(ends) == 2 else ""


def _published(case: str, where: str) -> str:
    """The value that FILE ROW COLUMN [SCALE] tells, or the text itself."""
    file, *place = where.split(" ")
    if not file.endswith(".csv"):
        return where
    row, column, scale = [*place, "1"][:3]
    table = pd.read_csv(REFERENCE / case / file, index_col=0)
    return format(float(scale) * float(table[column][row]), "g")


def replace_block(text: str, name: str, new: str) -> str:
    """`text` with `new` between the markers of `name`.

    Raises DataError unless `text` has each marker once, in this order, and `new` has neither.
    """
    start, end = f"<!-- flexik:{name} -->", f"<!-- /flexik:{name} -->"
    before, _, rest = text.partition(start)
    _, found, after = rest.partition(end)
    if not found or start in new or end in new or text.count(start) * text.count(end) != 1:
        raise DataError(f"expected {start} and then {end} in the text, once, and not in the new")
    # blank lines, or Markdown takes the text for part of the comment
    return f"{before}{start}\n\n{new.strip(chr(10))}\n\n{end}{after}"
