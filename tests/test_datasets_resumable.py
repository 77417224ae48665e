"""A table computed in parts: same bytes for any number of workers, and after a SIGKILL."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.resumable import _sole_run, compute_table
from flexik.datasets.tables import Field, read_table, table_metadata
from flexik.errors import DataError, SolverError

FIELDS = (Field("angle", "rad", "joint angle"), Field("part", "1", "number", "int64"))
N_PARTS = 12


def rows(folder: Path, part: int) -> dict[str, np.ndarray]:
    """Columns of part `part`, of a length of its own; leaves a file for every call."""
    (folder / f"{part}-{os.getpid()}-{time.monotonic_ns()}").touch()
    n_rows = part % 4
    return {
        "angle": np.random.default_rng(part).normal(size=n_rows),
        "part": np.full(n_rows, part),
    }


def compute(folder: Path, n_workers: int = 1, key: str = "k", **changes) -> int:
    (folder / "calls").mkdir(exist_ok=True)
    arguments = {
        "path": folder / "out" / "grid.parquet",
        "function": partial(rows, folder / "calls"),
        "parts": range(N_PARTS),
        "fields": FIELDS,
        "parameters_checksum": "c",
        "key": key,
        "settings": ParallelSettings(n_workers),
        "description": "",
        "folder": folder / "parts",
        "metadata": {"model": "crane"},
    }
    return compute_table(**{**arguments, **changes})


def calls(folder: Path) -> Counter[int]:
    return Counter(int(path.name.partition("-")[0]) for path in (folder / "calls").iterdir())


def content(folder: Path) -> bytes:
    return (folder / "out" / "grid.parquet").read_bytes()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("expected")
    compute(folder)
    return content(folder)


@pytest.mark.parametrize("n_workers", [1, 2, 3])
def test_same_bytes_for_any_number_of_workers(tmp_path, expected, n_workers):
    assert compute(tmp_path, n_workers) == 0
    assert content(tmp_path) == expected
    assert calls(tmp_path) == dict.fromkeys(range(N_PARTS), 1)
    assert not (tmp_path / "parts").exists()


def test_the_table_has_all_rows_in_order(tmp_path):
    compute(tmp_path, 2)
    path = tmp_path / "out" / "grid.parquet"
    frame = read_table(path, FIELDS, "c")
    assert frame["part"].tolist() == [part for part in range(N_PARTS) for _ in range(part % 4)]
    angles = [np.random.default_rng(part).normal(size=part % 4) for part in range(N_PARTS)]
    np.testing.assert_array_equal(frame["angle"], np.concatenate(angles))
    assert table_metadata(path)["model"] == "crane"


def fail_at_seven(folder: Path, part: int) -> dict[str, np.ndarray]:
    if part == 7:
        raise SolverError("sample 7")
    return rows(folder, part)


def interrupt(folder: Path, key: str = "k") -> list[Path]:
    """Files of the seven parts that a run finished before it failed."""
    with pytest.raises(SolverError, match="sample 7"):
        compute(folder, key=key, function=partial(fail_at_seven, folder / "calls"))
    files = sorted((folder / "parts").glob("*/part-*.parquet"))
    assert [file.name for file in files] == [f"part-{i:05d}.parquet" for i in range(7)]
    return files


def test_finished_parts_are_reused_and_damaged_ones_computed_again(tmp_path, expected):
    files = interrupt(tmp_path)
    assert not (tmp_path / "out").exists()
    files[2].write_bytes(files[2].read_bytes()[:-20])
    damaged = bytearray(files[3].read_bytes())
    damaged[30] ^= 1
    files[3].write_bytes(damaged)
    assert compute(tmp_path, 2) == 5
    assert content(tmp_path) == expected
    again = [part for part, n_calls in calls(tmp_path).items() if n_calls == 2]
    assert sorted(again) == [2, 3]


@pytest.mark.parametrize("change", ["key", "checksum", "unit", "cut"])
def test_parts_of_another_table_are_not_reused_but_removed(tmp_path, change):
    interrupt(tmp_path, key="old" if change == "key" else "k")
    changes = {
        "key": {},
        "checksum": {"parameters_checksum": "other"},
        "unit": {"fields": (Field("angle", "deg", ""), FIELDS[1])},
        "cut": {"parts": range(N_PARTS + 1)},
    }[change]
    assert compute(tmp_path, **changes) == 0
    assert not (tmp_path / "parts").exists()


def test_a_part_renamed_from_another_key_is_not_reused(tmp_path, expected):
    other = interrupt(tmp_path, key="old")[0]
    own = interrupt_folder(tmp_path)
    other.replace(own / "part-00001.parquet")
    compute(tmp_path)
    assert content(tmp_path) == expected


def interrupt_folder(folder: Path) -> Path:
    """Folder of the parts of key "k", made by a run that fails at once."""
    before = set((folder / "parts").iterdir())
    with pytest.raises(SolverError):
        compute(folder, function=partial(fail_at_seven, folder / "calls"), parts=range(N_PARTS))
    (own,) = set((folder / "parts").iterdir()) - before
    return own


def test_leftovers_go_and_strangers_stay(tmp_path, expected):
    interrupt(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (out / ".grid-a1b2c3_4.parquet").write_bytes(b"half a table")  # as mkstemp names it
    strangers = {out / "notes.md", out / ".grid-other.parquet", tmp_path / "parts" / "mine.txt"}
    for path in strangers:
        path.touch()
    assert compute(tmp_path) == 7
    assert content(tmp_path) == expected
    kept = {*out.iterdir(), *(tmp_path / "parts").iterdir()}
    assert kept == strangers | {out / "grid.parquet"}


def test_wrong_columns_name_the_part(tmp_path):
    with pytest.raises(DataError, match=r"part-0000\d\.parquet: .*\['angle', 'part'\] missing"):
        compute(tmp_path, function=dict_of_nothing, n_workers=2)


def dict_of_nothing(part: int) -> dict[str, np.ndarray]:
    return {}


def test_no_parts_give_an_empty_table(tmp_path):
    assert compute(tmp_path, parts=[]) == 0
    assert len(read_table(tmp_path / "out" / "grid.parquet", FIELDS, "c")) == 0


SLOW_RUN = """
import sys, time
from functools import partial
from pathlib import Path
import test_datasets_resumable as t

def slow(folder, part):
    time.sleep(0.2)
    return t.rows(folder, part)

folder = Path(sys.argv[1])
t.compute(folder, 2, function=partial(slow, folder / "calls"))
"""


def test_killed_and_run_again(tmp_path, expected):
    script = [sys.executable, "-W", "error", "-c", SLOW_RUN, str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    # a session of its own, so that the orphaned workers can be ended with it
    run = subprocess.Popen(script, env=environment, start_new_session=True)
    try:
        while len(list((tmp_path / "parts").glob("*/part-*"))) < 3:
            assert run.poll() is None
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
        finished = [int(f.stem[5:]) for f in (tmp_path / "parts").glob("*/part-*.parquet")]
        assert 3 <= len(finished) < N_PARTS
        assert not (tmp_path / "out").exists()
        assert compute(tmp_path) == len(finished)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    assert content(tmp_path) == expected
    assert {part: calls(tmp_path)[part] for part in finished} == dict.fromkeys(finished, 1)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["grid.parquet"]
    assert not (tmp_path / "parts").exists()


def test_a_second_run_waits_for_the_first(tmp_path, capfd):
    """Killing DVC may leave its stage at work on the same parts."""
    script = (
        "import fcntl, sys, time\n"
        "lock = open(sys.argv[1], 'w')\n"
        "fcntl.flock(lock, fcntl.LOCK_EX)\n"
        "print('locked', flush=True)\n"
        "time.sleep(0.7)\n"
        "open(sys.argv[2], 'w').close()\n"
    )
    folder, done = tmp_path / ".parts", tmp_path / "first_is_done"
    other = subprocess.Popen(
        [sys.executable, "-c", script, f"{folder}.lock", str(done)], stdout=subprocess.PIPE
    )
    assert other.stdout.readline() == b"locked\n"
    with _sole_run(folder):
        assert done.exists()
    assert "waiting for another run" in capfd.readouterr().err
    other.communicate()
    assert [child.name for child in tmp_path.iterdir()] == ["first_is_done"]
