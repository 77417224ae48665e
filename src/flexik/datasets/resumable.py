"""A table computed part by part, which survives being killed.

Every finished part is a small file in a folder of its own; the next run takes it from there. The
folder is apart from the output, because DVC deletes a stage's outputs before running it.
"""

import contextlib
import fcntl
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from flexik.datasets.parallel import ParallelSettings, parallel_unordered
from flexik.datasets.tables import (
    Field,
    concatenate_tables,
    read_arrow,
    table_metadata,
    write_table,
)
from flexik.errors import DataError
from flexik.files import checksum

T = TypeVar("T")


def compute_table(
    path: Path | str,
    function: Callable[[T], Mapping[str, np.ndarray]],
    parts: Sequence[T],
    fields: Sequence[Field],
    parameters_checksum: str,
    key: str,
    settings: ParallelSettings,
    description: str,
    folder: Path | str,
    metadata: Mapping[str, str] | None = None,
) -> int:
    """Write the rows of `function(part)` for all parts, in order, to the Parquet file `path`.

    Parts are computed in parallel and saved as they finish, so that a run after an interruption
    computes only what is missing and ends with the same bytes. Memory does not grow with the
    number of parts.

    Parameters
    ----------
    path
        Table to write, whole or not at all.
    function
        Columns of a part, arrays of shape (n_rows,); called in other processes.
    parts
        Arguments of `function`.
    fields, parameters_checksum, metadata
        As for `write_table`.
    key
        Names everything that determines the data: the parameters and the version of the code.
    settings, description
        As for `parallel_map`.
    folder
        Where finished parts wait for the others; serves this table alone, emptied at the end.

    Returns
    -------
    int
        Number of parts taken from an earlier run.

    Raises
    ------
    DataError
        If the columns of a part are not the fields.
    Exception
        Whatever `function` raises. Finished parts are kept.
    """
    path, folder = Path(path), Path(folder)
    with _sole_run(folder):
        files = _part_files(folder, key, len(parts))
        missing = [
            i
            for i, file in enumerate(files)
            if not _is_finished(file, fields, parameters_checksum, key)
        ]
        with contextlib.closing(
            parallel_unordered(function, parts, missing, settings, description)
        ) as results:
            for i, columns in results:
                write_table(files[i], columns, fields, parameters_checksum, {"key": key})
        concatenate_tables(files, path, fields, parameters_checksum, metadata)
        _clean(path, folder)
    return len(parts) - len(missing)


@contextlib.contextmanager
def _sole_run(folder: Path) -> Iterator[None]:
    """Wait for another run on `folder`: killing DVC may leave its stage at work."""
    file = folder.with_name(f"{folder.name}.lock")
    file.parent.mkdir(parents=True, exist_ok=True)
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


def _part_files(folder: Path, key: str, n_parts: int) -> list[Path]:
    # other cuts of the same rows must not meet in one folder
    own = folder / checksum(key, str(n_parts))[:16]
    return [own / f"part-{i:05d}.parquet" for i in range(n_parts)]


def _is_finished(file: Path, fields: Sequence[Field], parameters_checksum: str, key: str) -> bool:
    """Whether `file` is a whole, undamaged part of this table."""
    try:
        read_arrow(file, fields, parameters_checksum)
        return table_metadata(file).get("key") == key
    except DataError:
        return False


def _clean(path: Path, folder: Path) -> None:
    """Remove all parts, of other keys too, and what a kill left beside `path`."""
    for child in folder.glob("*"):
        if child.is_dir() and re.fullmatch("[0-9a-f]{16}", child.name):
            shutil.rmtree(child)
    with contextlib.suppress(OSError):
        folder.rmdir()  # unless someone keeps other things there
    leftover = re.compile(rf"\.{re.escape(path.stem)}-[a-z0-9_]{{8}}{re.escape(path.suffix)}")
    for child in path.parent.iterdir():
        if leftover.fullmatch(child.name):
            child.unlink()
