"""What every case gives, and how it is loaded.

A case NAME is the section NAME of params.yaml, the machine data/machines/NAME.yaml and the folder
flexik/cases/NAME:

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
from flexik.parameters.reading import PARAMETERS_FILE, read_yaml, validated

MACHINES, DATA, REPORTS = Path("data/machines"), Path("data"), Path("reports")
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
SHARED = ("parallel", "trainers")


def case_names() -> list[str]:
    """Names of all cases, sorted."""
    return sorted(path.parent.name for path in Path(__file__).parent.glob("*/section.py"))


def load(name: str, file: Path | str = PARAMETERS_FILE) -> Any:
    """Validated section of the case `name`, its machine and trainers put in.

    Raises ParameterError, one line a wrong value, if there is no such case, a file is missing or no
    YAML, or a value is unknown, missing or out of range.
    """
    return _section(name, _read(file), str(file))


def load_all(file: Path | str = PARAMETERS_FILE) -> dict[str, Any]:
    """Sections of all cases of `file` by name; raises ParameterError as `load` does."""
    data = _read(file)
    for key in data:
        if key not in (*SHARED, *case_names()):
            known = ", ".join((*SHARED, *case_names()))
            raise ParameterError(f"{file}: {key}: unknown, expected one of {known}")
    return {name: _section(name, data, str(file)) for name in case_names() if name in data}


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


def module(case: str, name: str) -> ModuleType | None:
    """Module `name` of a case; None if the case has none."""
    full = f"flexik.cases.{case}.{name}"
    try:
        return importlib.import_module(full)
    except ModuleNotFoundError as error:
        if error.name is None or not full.startswith(error.name):
            raise
        return None


def parts(name: str, section: Any, stage: str) -> list[Part]:
    """Parts of `stage` of the case `name`; none where the case has no such stage."""
    found = module(name, f"parts.{stage}")
    return [] if found is None else found.parts(section)


def folder(name: str, stage: str) -> Path:
    """Where the parts of `stage` lie."""
    return DATA / name / STAGES[stage]


@functools.cache
def _read(file: Path | str) -> dict[str, Any]:
    return read_yaml(file)


def _section(name: str, data: Mapping[str, Any], file: str) -> Any:
    found = module(name, "section")
    if found is None or name not in data:
        raise ParameterError(f"{file}: there is no case {name!r} ({', '.join(case_names())})")
    machine = MACHINES / f"{name}.yaml"
    if not isinstance(data[name], Mapping):
        raise ParameterError(f"{file}: {name}: expected a mapping of keys to values")
    whole = {
        **data[name],
        "name": name,
        "machine": _read(machine),
        "trainers": data.get("trainers", {}),
    }

    def source(location: list[str]) -> tuple[str, str]:
        if location[:1] == ["machine"]:
            return str(machine), ".".join(location[1:])
        inside = location if location[:1] == ["trainers"] else [name, *location]
        return file, ".".join(inside)

    return validated(found.Section, whole, source)
