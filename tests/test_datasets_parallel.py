"""The parallel map: order, laziness, errors, settings, and a Dask cluster of two workers."""

import os
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from flexik.datasets import parallel
from flexik.datasets.parallel import (
    ParallelSettings,
    from_environment,
    parallel_map,
    parallel_unordered,
)
from flexik.datasets.parts import Part, Work, make, rows
from flexik.datasets.tables import Field
from flexik.errors import FlexikError, ParameterError, SolverError
from flexik.files import write_text

ONE, TWO = ParallelSettings(1), ParallelSettings(2)
FIELDS = (Field("x", "m", "solution"), Field("part", "1", "number", "int64"))


class Squares(Sequence[int]):
    """A lazy sequence that counts how often it is asked."""

    def __init__(self, length: int) -> None:
        self.length, self.asked = length, 0

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, index):
        if not 0 <= index < self.length:
            raise IndexError(index)
        self.asked += 1
        return index**2


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Start processes however short the work."""
    monkeypatch.setattr(parallel, "START_SECONDS", 0.0)


# one process: two clusters at a time are in each other's way
pytestmark = pytest.mark.xdist_group("dask")


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    import dask  # here, because every worker process imports this module
    import distributed

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
        ) as local,
    ):
        yield local.scheduler_address


def late_first(item: int) -> int:
    time.sleep(0.05 if item == 0 else 0)
    return item + 1


@pytest.mark.parametrize("settings", [ONE, TWO])
def test_results_come_in_order(settings):
    assert list(parallel_map(late_first, Squares(150), settings)) == [i**2 + 1 for i in range(150)]
    assert list(parallel_map(late_first, [], settings)) == []


def test_unordered_results_name_their_item():
    pairs = list(parallel_unordered(late_first, Squares(9), [0, 3, 5, 8], TWO))
    assert sorted(pairs) == [(0, 1), (3, 10), (5, 26), (8, 65)]


@pytest.mark.parametrize(("settings", "most"), [(ONE, 1), (TWO, 2 * parallel.BATCH_PER_WORKER)])
def test_items_are_taken_when_needed(settings, most):
    items = Squares(1000)
    results = parallel_map(late_first, items, settings)
    assert items.asked == 0
    assert next(results) == 1
    time.sleep(0.2)  # joblib goes on dispatching meanwhile
    results.close()  # without a warning
    assert items.asked <= most


def fail_at_three(item: int) -> int:
    if item == 3:
        raise SolverError("sample 3: no equilibrium")
    return item


@pytest.mark.parametrize("settings", [ONE, TWO])
def test_an_exception_arrives_as_itself(settings):
    with pytest.raises(SolverError, match=r"^sample 3: no equilibrium$"):
        list(parallel_map(fail_at_three, range(150), settings))


def fail_while_other_works(folder: Path, item: int) -> None:
    started = folder / "pid"
    if item == 0:
        while not started.exists():
            time.sleep(0.01)
        raise SolverError("no equilibrium")
    write_text(started, str(os.getpid()))
    time.sleep(60)


def test_other_workers_are_stopped(tmp_path):
    with pytest.raises(SolverError):
        list(parallel_map(partial(fail_while_other_works, tmp_path), range(2), TWO))
    pid = int((tmp_path / "pid").read_text())
    for _ in range(2000):  # well before it would end by itself
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.01)
    pytest.fail("the other worker goes on")


def die(item: int) -> None:
    if item == 1:
        os._exit(1)


def test_a_lost_worker_is_told():
    with pytest.raises(FlexikError, match="a worker process was lost"):
        list(parallel_map(die, range(4), TWO))


def count_threads(_: int) -> int:
    np.ones((2, 2)) @ np.ones((2, 2))
    return max(library["num_threads"] for library in threadpool_info())


@pytest.mark.parametrize("settings", [ONE, TWO])
def test_one_blas_thread_everywhere(settings):
    with threadpool_limits(limits=2):
        assert set(parallel_map(count_threads, range(4), settings)) == {1}
        assert count_threads(0) == 2


def test_progress_goes_to_stderr_if_named(capsys):
    list(parallel_map(late_first, range(3), ONE))
    assert capsys.readouterr() == ("", "")
    list(parallel_map(late_first, range(3), ONE, "static equilibria"))
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "static equilibria: 100%" in captured.err and "3/3" in captured.err


@pytest.mark.parametrize("n_workers", [-1, 1.5, True, "2"])
def test_bad_number_of_workers(n_workers):
    with pytest.raises(ParameterError, match="n_workers must be"):
        ParallelSettings(n_workers)


def test_environment_overrides(monkeypatch):
    settings = ParallelSettings(3, "tcp://a:1")
    monkeypatch.setenv("FLEXIK_WORKERS", "")
    monkeypatch.delenv("FLEXIK_SCHEDULER", raising=False)
    assert from_environment(settings) == settings
    monkeypatch.setenv("FLEXIK_WORKERS", " 0 ")
    monkeypatch.setenv("FLEXIK_SCHEDULER", "tcp://b:2")
    assert from_environment(settings) == ParallelSettings(0, "tcp://b:2")


@pytest.mark.parametrize("value", ["-1", "two", "1.5", "²"])
def test_bad_environment_is_told(monkeypatch, value):
    monkeypatch.setenv("FLEXIK_WORKERS", value)
    with pytest.raises(ParameterError, match=f"FLEXIK_WORKERS must be 0.*got '{value}'"):
        from_environment(ParallelSettings())


@pytest.mark.parametrize(
    "address", ["garbage", "127.0.0.1:8786", "tcp://127.0.0.1", "nonsense://x"]
)
def test_what_is_no_address_is_told_at_once(address):
    with pytest.raises(ParameterError, match=f"FLEXIK_SCHEDULER.*'{address}', expected an address"):
        ParallelSettings(scheduler=address)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x:1"])
def test_an_unanswered_scheduler_is_told(monkeypatch, address):
    monkeypatch.setattr(parallel, "CONNECT_SECONDS", 0.3)
    settings = ParallelSettings(scheduler=address)
    with pytest.raises(FlexikError, match=f"FLEXIK_SCHEDULER.*'{address}', but no Dask scheduler"):
        list(parallel_map(late_first, range(3), settings))


def test_missing_dask_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    settings = ParallelSettings(scheduler="tcp://127.0.0.1:9")
    with pytest.raises(FlexikError, match=r"install flexik\[dask\]"):
        list(parallel_map(late_first, range(3), settings))


def solve(part: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(part)
    x = np.linalg.solve(rng.normal(size=(90, 90)), rng.normal(size=90))
    return {"x": x, "part": np.full(90, part)}


def prepare():
    return Work(solve, range(20), rows(*FIELDS))


def table_bytes(folder: Path, settings: ParallelSettings) -> bytes:
    make(folder / "out", [Part("table", prepare)], settings)
    return (folder / "out" / "table.parquet").read_bytes()


def test_dask_gives_the_same_bytes(cluster, tmp_path):
    expected = table_bytes(tmp_path, TWO)
    assert table_bytes(tmp_path, ParallelSettings(scheduler=cluster)) == expected


def test_dask_computes_in_its_workers(cluster):
    settings = ParallelSettings(scheduler=cluster)
    processes = set(parallel_map(process_of, range(40), settings))
    assert len(processes) == 2
    assert os.getpid() not in processes


def process_of(_: int) -> int:
    time.sleep(0.01)
    return os.getpid()


def test_dask_errors_arrive(cluster):
    settings = ParallelSettings(scheduler=cluster)
    with pytest.raises(SolverError, match=r"^sample 3: no equilibrium$"):
        list(parallel_map(fail_at_three, range(20), settings))
    with pytest.raises(FlexikError, match="the Dask cluster lost a task"):
        list(parallel_map(die, range(4), settings))
