"""Parts: current ones are left alone, failures harm nothing, and a killed run goes on."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from flexik.datasets import code, parts
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import Part, Work, is_current, json_file, key, make, rows, whole
from flexik.datasets.tables import Field, read_table
from flexik.errors import DataError, FlexikError, SolverError
from flexik.files import read_json

FIELDS = (Field("angle", "rad", "joint angle"), Field("item", "1", "number", "int64"))
N_ITEMS = 12
ONE = ParallelSettings(1)


def angles(calls: Path, seconds: float, item: int) -> dict[str, np.ndarray]:
    """Columns of an item, of a length of its own; leaves a file for every call."""
    (calls / f"{item}-{os.getpid()}-{time.monotonic_ns()}").touch()
    time.sleep(seconds)
    n = item % 4
    return {"angle": np.random.default_rng(item).normal(size=n), "item": np.full(n, item)}


def prepare(calls, n_items=N_ITEMS, seconds=0.0, fails_at=None, fields=FIELDS):
    function = partial(angles, calls, seconds)
    if fails_at is not None:
        function = partial(fail, fails_at, function)
    return Work(function, range(n_items), rows(*fields))


def fail(at, function, item):
    if item == at:
        raise SolverError(f"sample {item}")
    return function(item)


def count(table):
    return whole(lambda: {".json": json_file(len(read_table(table)))})


def sample(folder, **settings):
    calls = folder / "calls"
    calls.mkdir(exist_ok=True)
    return Part("grid", prepare, {"calls": calls, **settings})


def calls(folder: Path) -> Counter[int]:
    return Counter(int(path.name.partition("-")[0]) for path in (folder / "calls").iterdir())


def content(folder: Path) -> bytes:
    return (folder / "samples/grid.parquet").read_bytes()


def names(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("expected")
    make(folder / "samples", [sample(folder)], ONE)
    return content(folder)


@pytest.mark.parametrize("n_workers", [1, 2, 3])
def test_same_bytes_for_any_number_of_workers(tmp_path, expected, n_workers, monkeypatch):
    monkeypatch.setattr("flexik.datasets.parallel.START_SECONDS", 0.0)
    make(tmp_path / "samples", [sample(tmp_path)], ParallelSettings(n_workers))
    assert content(tmp_path) == expected
    assert calls(tmp_path) == dict.fromkeys(range(N_ITEMS), 1)
    frame = read_table(tmp_path / "samples/grid.parquet", FIELDS)
    assert frame["item"].tolist() == [item for item in range(N_ITEMS) for _ in range(item % 4)]
    assert names(tmp_path / "samples") == ["grid.parquet", "grid.part"]
    assert {path.name for path in tmp_path.iterdir()} == {"calls", "samples"}


def test_what_is_current_is_left_alone_and_a_changed_setting_or_file_is_not(tmp_path):
    samples = tmp_path / "samples"
    table = samples / "grid.parquet"
    counted = Part("count", count, inputs={"table": table})
    make(samples, [counted, sample(tmp_path)], ONE)  # in the order that their files ask for
    assert read_json(samples / "count.json") == 18
    before = {path: path.stat().st_mtime_ns for path in samples.iterdir()}
    make(samples, [sample(tmp_path), counted], ONE)
    assert {path: path.stat().st_mtime_ns for path in samples.iterdir()} == before
    make(samples, [sample(tmp_path, n_items=8), counted], ONE)
    assert read_json(samples / "count.json") == 12
    table.unlink()
    make(samples, [sample(tmp_path, n_items=8), counted], ONE)
    assert table.is_file()


def test_a_part_that_comes_out_the_same_changes_nothing_after_it(tmp_path, monkeypatch):
    samples = tmp_path / "samples"
    counted = Part("count", count, inputs={"table": samples / "grid.parquet"})
    make(samples, [sample(tmp_path), counted], ONE)
    made = key(counted)
    monkeypatch.setattr(parts, "code_checksum", lambda *modules: "other code")
    assert not is_current(samples, sample(tmp_path))
    monkeypatch.undo()
    make(samples, [sample(tmp_path, seconds=1e-6), counted], ONE)
    assert key(counted) == made


def test_a_failure_keeps_the_former_result_and_the_other_parts(tmp_path, expected):
    samples = tmp_path / "samples"
    make(samples, [sample(tmp_path)], ONE)
    other = Part("other", prepare, {"calls": tmp_path / "calls", "n_items": 3})
    after = Part("count", count, inputs={"table": samples / "grid.parquet"})
    with pytest.raises(
        FlexikError, match=r"samples/grid: sample 7 \(its former.*old\)\n.*count: n"
    ):
        make(samples, [sample(tmp_path, fails_at=7), other, after], ONE)
    assert content(tmp_path) == expected
    assert (samples / "other.parquet").is_file()
    assert not (samples / "count.json").exists()


def test_finished_items_are_reused_and_damaged_ones_computed_again(tmp_path, expected):
    with pytest.raises(FlexikError, match="sample 7"):
        make(tmp_path / "samples", [sample(tmp_path, fails_at=7)], ONE)
    (hidden,) = (tmp_path / ".samples_parts").iterdir()
    files = {int(path.stem): path for path in hidden.glob("*.npz")}
    assert sorted(files) == [k for k in range(N_ITEMS) if k != 7]
    files[2].write_bytes(files[2].read_bytes()[:-20])
    damaged = bytearray(files[3].read_bytes())
    damaged[-200] ^= 1
    files[3].write_bytes(damaged)
    # the same part, as its key says, without the failure
    part = sample(tmp_path, fails_at=7)
    mended = Part("grid", prepare, part.settings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(fail.__globals__, "fail", lambda at, function, item: function(item))
        make(tmp_path / "samples", [mended], ONE)
    assert content(tmp_path) == expected
    again = [item for item, n_calls in calls(tmp_path).items() if n_calls == 2]
    assert 2 in again
    assert set(again) <= {2, 3}


def test_only_what_flexik_wrote_is_removed(tmp_path):
    samples = tmp_path / "samples"
    gone = Part("sub/gone", prepare, {"calls": tmp_path / "calls"})
    edited = Part("edited", prepare, {"calls": tmp_path / "calls"})
    make(samples, [sample(tmp_path), gone, edited], ONE)
    strangers = [samples / "notes.txt", samples / "sub/gone.txt", samples / "for_controller.json"]
    for path in strangers:
        path.touch()
    (samples / "edited.parquet").write_bytes(b"mine now")
    (samples / ".grid-a1b2c3_4.parquet").write_bytes(b"half a table")  # as a kill leaves it
    make(samples, [sample(tmp_path)], ONE)
    kept = {"edited.parquet", "for_controller.json", "grid.parquet", "grid.part", "notes.txt"}
    assert set(names(samples)) == kept | {"sub/gone.txt"}


def test_a_damaged_input_is_told(tmp_path):
    samples = tmp_path / "samples"
    table = samples / "grid.parquet"
    make(samples, [sample(tmp_path)], ONE)
    table.write_bytes(table.read_bytes()[:-9])
    counted = Part("count", count, inputs={"table": table})
    with pytest.raises(FlexikError, match=r"grid\.parquet: damaged, or changed since it was made"):
        make(tmp_path / "studies", [counted], ONE)
    with pytest.raises(DataError, match=r"none\.csv: cannot be read"):
        key(Part("count", count, inputs={"table": tmp_path / "none.csv"}))


def test_wrong_columns_name_the_part(tmp_path):
    fields = (*FIELDS, Field("mass", "kg", "payload"))
    with pytest.raises(FlexikError, match=r"samples/grid: expected columns .*\['mass'\] missing"):
        make(tmp_path / "samples", [sample(tmp_path, fields=fields)], ONE)


def test_parts_that_wait_for_each_other_are_told(tmp_path):
    one = Part("one", count, inputs={"table": tmp_path / "two.json"})
    two = Part("two", count, inputs={"table": tmp_path / "one.json"})
    with pytest.raises(DataError, match="these parts wait for each other: one, two"):
        make(tmp_path, [one, two], ONE)


@dataclass(frozen=True)
class Settings:
    """Some settings."""

    rate: float = 0.1


@pytest.mark.parametrize(
    ("settings", "others"),
    [
        ({"n_items": 3}, {"n_items": 4}),
        ({"n_items": Settings()}, {"n_items": Settings(0.2)}),
        ({"n_items": {"a": [1, 2]}}, {"n_items": {"a": [2, 1]}}),
        ({"n_items": angles}, {"n_items": fail}),
        ({"n_items": np.arange(3.0)}, {"n_items": np.arange(4.0)}),
    ],
)
def test_equal_settings_have_equal_keys_and_others_another(settings, others):
    assert key(Part("a", prepare, settings)) == key(Part("a", prepare, dict(settings)))
    assert key(Part("a", prepare, settings)) != key(Part("a", prepare, others))


def test_code_is_what_a_module_imports():
    names = {path.name for path in code.closure("flexik.learning.training")}
    assert {"training.py", "normal_equations.py"} <= names
    assert not names & {"parts.py", "errors.py", "reading.py"}
    assert code.code_checksum("flexik.learning.training") != code.code_checksum("flexik.kinematics")


SLOW_RUN = """
import sys
from pathlib import Path
import test_datasets_parts as t

folder = Path(sys.argv[1])
t.make(folder / "samples", [t.sample(folder, seconds=0.2)], t.ParallelSettings(2))
"""


def test_killed_and_run_again(tmp_path, expected):
    script = [sys.executable, "-c", SLOW_RUN, str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), "src"])}
    # a session of its own, so that the orphaned workers can be ended with it
    run = subprocess.Popen(
        script, env=environment, start_new_session=True, cwd=Path(__file__).parents[1]
    )
    hidden = tmp_path / ".samples_parts"
    try:
        # files at work have other names
        while len(list(hidden.glob("*/[0-9]*.npz"))) < 3:
            assert run.poll() is None
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
        finished = [int(path.stem) for path in hidden.glob("*/[0-9]*.npz")]
        assert 3 <= len(finished) < N_ITEMS
        assert names(tmp_path / "samples") == []
        make(tmp_path / "samples", [sample(tmp_path, seconds=0.2)], ONE)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    assert content(tmp_path) == expected
    assert {item: calls(tmp_path)[item] for item in finished} == dict.fromkeys(finished, 1)
    assert not hidden.exists()


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
    lock, done = tmp_path / ".samples_parts.lock", tmp_path / "first_is_done"
    command = [sys.executable, "-c", script, str(lock), str(done)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"locked\n"
        make(tmp_path / "samples", [], ONE)
        assert done.exists()
    assert "waiting for another run" in capfd.readouterr().err
    assert not lock.exists()
