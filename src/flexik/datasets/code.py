"""Which code a module runs: its file and, transitively, all of flexik that it imports."""

import ast
import functools
from pathlib import Path

from flexik.files import checksum

ROOT = Path(__file__).parents[2]
# These check settings, report errors, write files or share work out: what they do cannot change a
# number, and a part's settings count by their values. Packages' docstrings are no code.
UNCOUNTED = (
    *("flexik", "flexik.errors", "flexik.files", "flexik.kernels", "flexik.stage"),
    *("flexik.parameters", "flexik.machines.deviations", "flexik.cases.case"),
    *("flexik.datasets.code", "flexik.datasets.parts", "flexik.datasets.parallel"),
)


@functools.cache
def code_checksum(*modules: str) -> str:
    """SHA-256 of the files of `modules` and of all that they import of flexik, UNCOUNTED aside."""
    files = sorted({file for module in modules for file in closure(module)})
    texts = (part for file in files for part in (file.relative_to(ROOT).as_posix(), _text(file)))
    return checksum(*texts)


@functools.cache
def closure(module: str) -> frozenset[Path]:
    """Files that `import module` runs in this repository, without UNCOUNTED ones."""
    found: set[Path] = set()
    waiting = [module]
    seen = set()
    while waiting:
        name = waiting.pop()
        if name in seen or _uncounted(name):
            continue
        seen.add(name)
        if file := module_file(name):
            found.add(file)
            waiting += _imports(file)
    return frozenset(found)


def module_file(name: str) -> Path | None:
    """File of the flexik module or package `name`; None for anything else."""
    stem = ROOT.joinpath(*name.split("."))
    for file in (stem.with_suffix(".py"), stem / "__init__.py"):
        if file.is_file():
            return file
    return None


def _uncounted(name: str) -> bool:
    if name.startswith(("flexik.cases.", "flexik.planar.")) and name.endswith("section"):
        return True
    return any(name == known or name.startswith(f"{known}.") for known in UNCOUNTED[1:]) or (
        name == UNCOUNTED[0]
    )


@functools.cache
def _imports(file: Path) -> tuple[str, ...]:
    """Names of flexik that `file` imports anywhere; `from a import b` gives a and a.b."""
    names: list[str] = []
    for node in ast.walk(ast.parse(_text(file))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(name for name in names if name.startswith("flexik."))


@functools.cache
def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")
