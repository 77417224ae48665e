"""What every case gives, and how it is loaded.

A case NAME is an entry under `cases` of params.yaml, the section NAME there, the machine
data/machines/NAME.yaml and the code of the folder flexik/cases/CODE, which the entry names:

    section.py    `Section`, the validated section, a parameters.section.CaseSection (its `machine`
                  is the validated machine file, its `trainers` are the named ones of params.yaml),
                  and `check(section)`, which finds what no single value tells: a linkage that does
                  not close, a target out of reach
    parts/STAGE.py `parts(section)`, the parts of the stage (datasets.parts); a module for each of
                  the STAGES the case has
    report.py     `report(section)`, which writes reports/NAME from data/NAME
    page.md.j2    the page of the report

A method maps queries (n, p) to answers (n, k) in SI units, see positioning.method; errors of all
methods on all conditions are rows of one long table, see evaluation.errors.
"""

import functools
import importlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import Part
from flexik.errors import ParameterError
from flexik.parameters.model import Model, Name
from flexik.parameters.reading import PARAMETERS_FILE, read_yaml, validated
from flexik.parameters.section import MACHINES, CaseSection

# Stages of parts, and the folders of data/NAME that they fill
STAGES = {
    "calibrate": "constants",
    "generate": "samples",
    "select": "sizes",
    "train": "networks",
    "evaluate": "errors",
    "study": "studies",
}
# Keys of params.yaml that are no case
SHARED = ("cases", "parallel", "trainers")


class Entry(Model):
    """An entry under `cases`: the folder whose code the case runs."""

    code: Name


def codes() -> list[str]:
    """Folders of cases, sorted."""
    return sorted(path.parent.name for path in Path(__file__).parent.glob("*/section.py"))


def entries(file: Path | str = PARAMETERS_FILE) -> dict[str, Entry]:
    """What stands under `cases`; raises ParameterError as `load` does."""
    given = {"cases": _read(file).get("cases", {})}
    found = validated(dict[str, dict[Name, Entry]], given, lambda at: (str(file), ".".join(at)))
    for name, entry in found["cases"].items():
        if entry.code not in codes():
            known = ", ".join(codes())
            raise ParameterError(f"{file}: cases.{name}.code: expected one of {known}")
    return found["cases"]


def load(name: str, file: Path | str = PARAMETERS_FILE) -> Any:
    """Validated section of the case `name`, its machine and trainers put in.

    Raises ParameterError, one line a wrong value, if there is no such case, a file is missing or no
    YAML, or a value is unknown, missing or out of range.
    """
    known = entries(file)
    if name not in known:
        raise ParameterError(f"{file}: there is no case {name!r} ({', '.join(known)})")
    return _section(name, known[name].code, _read(file), str(file))


def load_all(file: Path | str = PARAMETERS_FILE) -> dict[str, Any]:
    """Sections of all cases of `file` by name; raises ParameterError as `load` does."""
    names = [*SHARED, *entries(file)]
    for key in _read(file):
        if key not in names:
            raise ParameterError(f"{file}: {key}: unknown, expected one of {', '.join(names)}")
    return {name: load(name, file) for name in entries(file)}


def load_parallel(file: Path | str = PARAMETERS_FILE) -> ParallelSettings:
    """Where to compute; raises ParameterError as `load` does."""
    given = {"parallel": _read(file).get("parallel", {})}
    try:
        found = validated(
            dict[str, ParallelSettings], given, lambda location: (str(file), ".".join(location))
        )
    except ParameterError as error:
        text = str(error)
        raise ParameterError(
            text if text.startswith(f"{file}: ") else f"{file}: parallel: {text}"
        ) from None
    return found["parallel"]


def module(code: str, name: str) -> ModuleType | None:
    """Module `name` of the folder `code`; None if it has none."""
    full = f"flexik.cases.{code}.{name}"
    try:
        return importlib.import_module(full)
    except ModuleNotFoundError as error:
        if error.name is None or not full.startswith(error.name):
            raise
        return None


def check(section: CaseSection) -> None:
    """Find what no single value tells; raises ParameterError, one line with file and key."""
    found = module(section.code, "section")
    assert found is not None  # the section was loaded by it
    found.check(section)


def parts(section: CaseSection, stage: str) -> list[Part]:
    """Parts of `stage`; none where the case has no such stage."""
    found = module(section.code, f"parts.{stage}")
    return [] if found is None else found.parts(section)


@functools.cache
def _read(file: Path | str) -> dict[str, Any]:
    return read_yaml(file)


def _section(name: str, code: str, data: Mapping[str, Any], file: str) -> Any:
    found, machine = module(code, "section"), MACHINES / f"{name}.yaml"
    assert found is not None  # codes() found it
    given = data.get(name)
    if not isinstance(given, Mapping):
        raise ParameterError(f"{file}: {name}: expected a mapping of keys to values")
    whole = {
        **given,
        "name": name,
        "code": code,
        "machine": _read(machine),
        "trainers": data.get("trainers", {}),
    }

    def source(location: list[str]) -> tuple[str, str]:
        if location[:1] == ["machine"]:
            return str(machine), ".".join(location[1:])
        inside = location if location[:1] == ["trainers"] else [name, *location]
        return file, ".".join(inside)

    return validated(found.Section, whole, source)
