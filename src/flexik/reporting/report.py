"""A report as a whole: tables, figures, metrics and page of a case, written where they changed."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.errors import DataError
from flexik.files import file_checksum, read_json, write_json, write_text
from flexik.parameters.section import CaseSection
from flexik.reporting import style
from flexik.reporting.page import render
from flexik.reporting.tables import Table

PROVENANCE = (
    "\n## Provenance\n\nChecksums of parameters, machine and reference files that this report was "
    "made from: [provenance.csv](provenance.csv).\n"
)
# code that decides how a figure looks, besides the module of its kind
DRAWING = ("style", "chart", "kinds", "plane")
FEW = 3  # figures that are drawn sooner than other processes start


Drawing = partial[Figure]  # a figure that is drawn when it is called


def draw(kind: Callable[..., Figure], *data: Any, **options: Any) -> Drawing:
    """Figure of `kind` (reporting.chart, kinds, plane, or one of a case), drawn later."""
    return partial(kind, *data, **options)


@dataclass(frozen=True)
class Content:
    """What a report, or a part of it, consists of.

    tables, figures : by name, which is their path below the folder of the report (tables) or below
        its `figures`, without suffix.
    metrics : for metrics.json.
    values : for the sentences of the template.
    files : further texts by path below the folder.
    """

    tables: Mapping[str, Table] = field(default_factory=dict)
    figures: Mapping[str, Drawing] = field(default_factory=dict)
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    def __or__(self, other: "Content") -> "Content":
        """Both."""
        pairs = {f.name: {**getattr(self, f.name), **getattr(other, f.name)} for f in fields(self)}
        return Content(**pairs)


def write_case(
    section: CaseSection, template: Path, content: Content, files: Iterable[Path | str]
) -> None:
    """Write the report of a case; it is made from its section, its machine and `files` too."""
    write_section(section, template, content, [section.machine_file, *files])


def write_section(
    section: CaseSection, template: Path, content: Content, files: Iterable[Path | str]
) -> None:
    """Write the report of a case whose section, machine included, and `files` it is made from."""
    keys = section.model_dump(mode="json")
    sources = {f"params.yaml: {key}": digest(value) for key, value in keys.items()}
    sources |= {Path(path).as_posix(): file_checksum(path) for path in files}
    record = section.data / "report.json"
    write_report(section.report, template, content, sources=sources, record=record)


def write_report(
    folder: Path,
    template: Path,
    content: Content,
    *,
    sources: Mapping[str, str] | None = None,
    record: Path,
) -> None:
    """Write README.md, metrics.json, tables (CSV, Markdown) and figures (PNG) into `folder`.

    template : page, see reporting.page; shows all tables and figures.
    sources : checksums by the name of what the report was made from: provenance.csv.
    record : JSON file of what was written and drawn from what. A figure whose data and drawing code
        are those of the record is not drawn again; a file of it that is no longer made goes.

    Raises DataError, see reporting.page.render and the kinds; nothing but figures is written then.
    """
    page = render(template, content.tables, content.figures, content.values)
    texts, figures = dict(content.files), content.figures
    for name, table in content.tables.items():
        texts |= {f"{name}.csv": table.csv, f"{name}.md": page.tables[name]}
    if sources:
        rows = pd.DataFrame({"source": list(sources), "SHA-256": list(sources.values())})
        texts["provenance.csv"] = rows.to_csv(index=False, lineterminator="\n")
    texts["README.md"] = page.text + (PROVENANCE if sources else "")
    earlier = read_json(record) if record.is_file() else {"files": [], "figures": {}}
    drawn = _draw_all(folder, figures, earlier["figures"])
    for name, text in texts.items():
        write_text(folder / name, text)
    write_json(folder / "metrics.json", dict(content.metrics))
    made = sorted([*texts, "metrics.json", *(f"figures/{name}.png" for name in figures)])
    for name in set(earlier["files"]) - set(made):
        (folder / name).unlink(missing_ok=True)
    write_json(record, {"files": made, "figures": drawn})


def _draw_all(
    folder: Path, figures: Mapping[str, Drawing], earlier: Mapping[str, Any]
) -> dict[str, list[str]]:
    """Draw what changed; checksums of data and code, and of the PNG, by name."""
    wanted = {name: digest(drawing) for name, drawing in figures.items()}
    # absolute: processes that draw may have begun elsewhere
    paths = {name: folder.absolute() / f"figures/{name}.png" for name in figures}
    jobs = [
        (path, figures[name])
        for name, path in paths.items()
        if not path.is_file() or earlier.get(name) != [wanted[name], file_checksum(path)]
    ]
    # here, never on a cluster: files are written
    n_workers = 1 if len(jobs) <= FEW else from_environment(ParallelSettings()).n_workers
    for _ in parallel_map(_draw, jobs, ParallelSettings(n_workers), "figures"):
        pass
    return {name: [wanted[name], file_checksum(path)] for name, path in paths.items()}


def _draw(job: tuple[Path, Drawing]) -> None:
    style.write_png(*job)


def digest(value: Any) -> str:
    """SHA-256 of data: numbers, texts, arrays, frames, dataclasses, functions (with their module).

    Raises DataError for what has no lasting value.
    """
    hasher = hashlib.sha256()
    for part in _parts(value):
        hasher.update(f"{len(part)} ".encode() + part)
    return hasher.hexdigest()


def _parts(value: Any) -> Iterable[bytes]:
    yield type(value).__name__.encode()
    if value is None or isinstance(value, str | int | float | np.number | np.bool_):
        yield repr(value).encode()
    elif isinstance(value, pd.DataFrame | pd.Series):
        for name, column in pd.DataFrame(value).items():
            yield from _parts([str(name), column.to_numpy()])
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape}".encode()
        if value.dtype.hasobject:
            yield from _parts(value.tolist())
        else:
            yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Mapping):
        yield from _parts([item for pair in value.items() for item in pair])
    elif isinstance(value, list | tuple):
        yield str(len(value)).encode()
        for item in value:
            yield from _parts(item)
    elif is_dataclass(value):
        yield from _parts([getattr(value, each.name) for each in fields(value)])
    elif isinstance(value, partial):
        yield from _parts([value.func, value.args, value.keywords])
    elif callable(value):
        yield f"{value.__module__}.{value.__qualname__} {_code(value.__module__)}".encode()
    else:
        raise DataError(f"figure: no checksum of {type(value).__name__}")


@cache
def _code(module: str) -> str:
    """Checksum of a module, of the drawing code and of matplotlib's version."""
    names = [module, *(f"flexik.reporting.{name}" for name in DRAWING)]
    files = [str(import_module(name).__file__) for name in names]
    return " ".join([str(mpl.__version__), *map(file_checksum, files)])
