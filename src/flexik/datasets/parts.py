"""Parts: what a stage makes, each with the checksum of what made it.

A stage makes many things of one kind (networks, errors of methods, studies). Each is a part: it is
computed only if its settings, the files it reads or the code it runs have changed, beside the other
parts in the same processes; a failure leaves the others alone, and the former result in place. Work
is cut into items, whose results wait in a hidden folder, so that a killed run goes on where it was.

A part NAME is the files NAME.* of its folder and NAME.part, the record of what made them.
"""

import contextlib
import fcntl
import json
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from flexik.datasets.code import code_checksum
from flexik.datasets.parallel import ParallelSettings, parallel_unordered
from flexik.datasets.tables import Field, write_table
from flexik.errors import DataError, FlexikError
from flexik.files import atomic_path, checksum, file_checksum, read_json, write_json, write_text

RECORD = ".part"
Columns = Mapping[str, np.ndarray]
Writer = Callable[[Path], None]


@dataclass(frozen=True, eq=False)
class Work:
    """What is left to do once the files are read.

    function : arrays by name of one item; called in other processes, depends on nothing else
    items : its arguments
    finish : the files of the part, as writers by extension, from the results of all items in order
    """

    function: Callable[[Any], Columns]
    items: Sequence[Any]
    finish: Callable[[list[Columns]], Mapping[str, Writer]]


@dataclass(frozen=True, eq=False)
class Part:
    """A result by name.

    name : path below the folder of the stage, without extension
    prepare : called with `settings` and `inputs` by name, reads the inputs and says what to do
    settings : values, dataclasses, models, functions; by value in the checksum
    inputs : files by name, or several in a tuple or mapping; relative to the project. Handed to
        `prepare` as paths, by content in the checksum
    """

    name: str
    prepare: Callable[..., Work]
    settings: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)


def whole(function: Callable[..., Mapping[str, Writer]], **arguments: Any) -> Work:
    """Work that is done at once, in the stage's own process."""
    return Work(dict, [], lambda _: function(**arguments))


def rows(*fields: Field) -> Callable[[list[Columns]], Mapping[str, Writer]]:
    """A `finish` that puts the results, columns `fields`, below each other into a Parquet table."""
    return lambda results: {".parquet": table(stacked(results, fields), fields)}


def stacked(results: Sequence[Columns], fields: Sequence[Field]) -> dict[str, np.ndarray]:
    """Columns `fields` of all `results`, one below the other; DataError if one is missing."""
    for result in results:
        if missing := [f.name for f in fields if f.name not in result]:
            raise DataError(f"expected columns {[f.name for f in fields]}, but {missing} missing")
    types = {"string": np.str_, "int64": np.int64, "float64": np.float64}
    empty: dict[str, list[np.ndarray]] = {f.name: [np.empty(0, types[f.dtype])] for f in fields}
    found = {f.name: [result[f.name] for result in results] for f in fields} if results else empty
    return {name: np.concatenate(pieces) for name, pieces in found.items()}


def table(columns: Columns, fields: Sequence[Field]) -> Writer:
    """Writer of a Parquet table."""
    return lambda path: write_table(path, {f.name: columns[f.name] for f in fields}, fields)


def json_file(data: object) -> Writer:
    """Writer of a JSON file."""
    return lambda path: write_json(path, data)


def text_file(text: str) -> Writer:
    """Writer of a text file."""
    return lambda path: write_text(path, text)


def make(folder: Path | str, parts: Sequence[Part], parallel: ParallelSettings) -> None:
    """Make the files of all `parts` in `folder`, those alone that are not current.

    Parts that read files of others of the same folder are made after them. Files of parts that are
    not among `parts` any more are removed, if they are as flexik wrote them.

    Raises
    ------
    FlexikError
        A line for every part that failed; all others are made.
    """
    folder = Path(folder)
    with _sole_run(folder):
        _remove_unnamed(folder, parts)
        waiting, failed = list(parts), dict[str, str]()
        while waiting:
            ready = [p for p in waiting if not any(_reads(p, q, folder) for q in waiting)]
            if not ready:
                names = ", ".join(part.name for part in waiting)
                raise DataError(f"{folder}: these parts wait for each other: {names}")
            lost = [
                p for p in ready if any(_reads(p, q, folder) for q in parts if q.name in failed)
            ]
            for part in lost:
                failed[part.name] = _message(folder, part, "not made, it reads one that failed")
            failed |= _make_side_by_side(folder, [p for p in ready if p not in lost], parallel)
            waiting = [part for part in waiting if part not in ready]
        if not failed:
            shutil.rmtree(_hidden(folder), ignore_errors=True)
    if failed:
        raise FlexikError("\n".join(failed.values()))


def key(part: Part) -> str:
    """Checksum of all that determines the files of `part`.

    Raises DataError if a file it reads is missing, or is not as the part that made it left it.
    """
    modules = {part.prepare.__module__}
    settings = _plain(dict(part.settings), modules)
    files = {name: _plain(_each(_checked, given), modules) for name, given in part.inputs.items()}
    made_of = json.dumps([settings, files], sort_keys=True)
    return checksum(part.prepare.__qualname__, made_of, code_checksum(*sorted(modules)))


def is_current(folder: Path | str, part: Part) -> bool:
    """Whether the files of `part` are there, undamaged, and would come out as they are."""
    path = _record_path(Path(folder), part)
    record = _record(path)
    return (
        record is not None
        and record["made_with"] == key(part)
        and all(_is_as_made(path.with_name(name), made) for name, made in record["files"].items())
    )


def _make_side_by_side(
    folder: Path, parts: Sequence[Part], parallel: ParallelSettings
) -> dict[str, str]:
    """Make the `parts` that are not current; messages of those that failed by name."""
    failed, jobs = dict[str, str](), list[_Job]()
    for part in parts:
        try:
            if not is_current(folder, part):
                jobs.append(_Job.of(folder, part))
                jobs[-1].finish_if_ready(failed)
        except FlexikError as error:
            failed[part.name] = _message(folder, part, str(error))
    tasks = [(job, number) for job in jobs for number in job.missing]
    calls = [(job.work.function, job.work.items[number]) for job, number in tasks]
    with contextlib.closing(
        parallel_unordered(_result, calls, range(len(calls)), parallel, folder.as_posix())
    ) as results:
        for index, (columns, message) in results:
            job, number = tasks[index]
            job.take(number, columns, message)
            job.finish_if_ready(failed)
    return failed


def _result(call: tuple[Callable[[Any], Columns], Any]) -> tuple[Columns | None, str]:
    """Result of an item, or the user's mistake that it met."""
    function, item = call
    try:
        return {name: _array(values) for name, values in function(item).items()}, ""
    except FlexikError as error:
        return None, str(error)


def _array(values: Any) -> np.ndarray:
    array = np.asarray(values)
    return array.astype(np.str_) if array.dtype.kind in "OT" else array


@dataclass(eq=False)
class _Job:
    """A part at work.

    hidden : where results of items wait for each other
    """

    folder: Path
    part: Part
    made_with: str
    work: Work
    hidden: Path
    results: dict[int, Columns]
    message: str = ""
    done: bool = False

    @classmethod
    def of(cls, folder: Path, part: Part) -> "_Job":
        """Read the inputs of `part`, and what an interrupted run has left of it."""
        made_with = key(part)
        paths = {name: _each(Path, given) for name, given in part.inputs.items()}
        work = part.prepare(**part.settings, **paths)
        n = len(work.items)
        # other cuts of the same work must not meet in one folder
        hidden = _hidden(folder) / f"{part.name.replace('/', '-')}-{made_with[:16]}-{n}"
        found = {k: _read_item(hidden / f"{k}.npz") for k in range(n)} if hidden.is_dir() else {}
        results = {k: columns for k, columns in found.items() if columns is not None}
        if results:
            print(f"{folder / part.name}: {len(results)} of {n} items were there already")
        return cls(folder, part, made_with, work, hidden, results)

    @property
    def missing(self) -> list[int]:
        """Items left to compute."""
        return [number for number in range(len(self.work.items)) if number not in self.results]

    def take(self, number: int, columns: Columns | None, message: str) -> None:
        """Keep the result of an item, or why there is none."""
        if columns is None:
            self.message = self.message or message
            return
        self.results[number] = columns
        if len(self.work.items) > 1:
            with atomic_path(self.hidden / f"{number}.npz") as temporary:
                np.savez(temporary, **columns)  # type: ignore[arg-type]

    def finish_if_ready(self, failed: dict[str, str]) -> None:
        """Write the part once all its items are there; note a failure in `failed`."""
        if self.done or not (self.message or len(self.results) == len(self.work.items)):
            return
        self.done = True
        try:
            if self.message:
                raise FlexikError(self.message)
            writers = self.work.finish([self.results[k] for k in range(len(self.results))])
            _write(_record_path(self.folder, self.part), self.made_with, writers)
            shutil.rmtree(self.hidden, ignore_errors=True)
        except FlexikError as error:
            failed[self.part.name] = _message(self.folder, self.part, str(error))
        self.results.clear()


def _write(record_path: Path, made_with: str, writers: Mapping[str, Writer]) -> None:
    """Write the files of a part, then their record: without it they would be made again."""
    old, files = _record(record_path), {}
    for extension, write in writers.items():
        path = record_path.with_suffix(extension)
        with atomic_path(path) as temporary:
            write(temporary)
        files[path.name] = file_checksum(path)
    for name in set(old["files"] if old else ()) - set(files):
        record_path.with_name(name).unlink(missing_ok=True)
    write_json(record_path, {"made_with": made_with, "files": files})


def _message(folder: Path, part: Part, message: str) -> str:
    kept = (
        " (its former result is kept, and is old)" if _record_path(folder, part).is_file() else ""
    )
    return f"{folder / part.name}: {message}{kept}"


def _record_path(folder: Path, part: Part) -> Path:
    return folder / f"{part.name}{RECORD}"


def _record(path: Path) -> dict[str, Any] | None:
    """What made a part; None if that is not known."""
    with contextlib.suppress(DataError):
        record = read_json(path)
        if isinstance(record, dict) and isinstance(record.get("files"), dict):
            return record if isinstance(record.get("made_with"), str) else None
    return None


def _is_as_made(path: Path, made: str) -> bool:
    return path.is_file() and file_checksum(path) == made


def _checked(path: Path | str) -> str:
    """Checksum of an input; that of a part must be as it was made."""
    path = Path(path)
    found = file_checksum(path)
    record = _record(_record_of(path))
    if record is not None and record["files"].get(path.name) != found:
        raise DataError(f"{path}: damaged, or changed since it was made; delete it and run again")
    return found


def _record_of(path: Path) -> Path:
    """Record of the part that `path` belongs to."""
    return path.with_name(path.name.partition(".")[0] + RECORD)


def _reads(part: Part, other: Part, folder: Path) -> bool:
    """Whether `part` reads a file of `other`, both of `folder`."""
    paths: list[Path] = []
    for given in part.inputs.values():
        _each(lambda path: paths.append(Path(path)), given)
    return part is not other and any(_record_of(p) == _record_path(folder, other) for p in paths)


def _each(function: Callable[[Any], Any], given: Any) -> Any:
    """`function` of a path, or of every one in a sequence or mapping."""
    if isinstance(given, Mapping):
        return {name: _each(function, path) for name, path in given.items()}
    if isinstance(given, list | tuple):
        return [_each(function, path) for path in given]
    return function(given)


def _plain(value: Any, modules: set[str]) -> Any:
    """`value` for JSON; modules of functions and classes in it are added to `modules`."""
    if isinstance(value, BaseModel):
        return _plain(dict(value), modules)
    if is_dataclass(value) and not isinstance(value, type):
        modules.add(type(value).__module__)
        return {f.name: _plain(getattr(value, f.name), modules) for f in fields(value)}
    if isinstance(value, Mapping):
        return [[_plain(k, modules), _plain(v, modules)] for k, v in value.items()]
    if isinstance(value, list | tuple):
        return [_plain(entry, modules) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Enum | Path):
        return str(value)
    if callable(value):
        modules.add(value.__module__)
        return value.__qualname__
    return value


def _read_item(path: Path) -> Columns | None:
    """Arrays of a finished item; None if there is none, or it is damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except Exception:  # whatever damage makes NumPy or zipfile raise: the item is computed again
        return None


def _hidden(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}_parts")


def _remove_unnamed(folder: Path, parts: Sequence[Part]) -> None:
    """Remove files of parts that are no more; what has no record, or has changed, is not ours."""
    named = {_record_path(folder, part) for part in parts}
    for path in sorted(folder.rglob(f"*{RECORD}")):
        if path in named or (record := _record(path)) is None:
            continue
        print(f"removing {path.with_suffix('')}: its name is not in params.yaml")
        for name, made in record["files"].items():
            if _is_as_made(path.with_name(name), made):
                path.with_name(name).unlink()
        path.unlink()
    # what a kill left of files half written
    leftover = re.compile(r"\.[a-z0-9_]+(\.[a-z]+)*-[a-z0-9_]{8}\.[a-z]+")
    for path in folder.rglob(".*"):
        if path.is_file() and leftover.fullmatch(path.name):
            path.unlink()


@contextlib.contextmanager
def _sole_run(folder: Path) -> Iterator[None]:
    """Wait for another run on `folder`: killing DVC may leave its stage at work."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder.with_name(f".{folder.name}_parts.lock")
    while True:
        with file.open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                print(f"waiting for another run on {folder}", file=sys.stderr)
                fcntl.flock(lock, fcntl.LOCK_EX)
            if os.fstat(lock.fileno()).st_nlink == 0:
                continue  # the other run has removed this file: it locks nothing any more
            try:
                yield
            finally:
                file.unlink(missing_ok=True)
            return
