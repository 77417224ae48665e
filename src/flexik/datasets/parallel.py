"""One function over many items, in processes of this machine or on a Dask cluster.

Results depend neither on the number of workers nor on the order in which they finish: every item
is evaluated alone, with one BLAS thread. Items should take well over a millisecond each.
"""

import contextlib
import os
import re
import sys
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import joblib
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from flexik.errors import FlexikError, ParameterError

T = TypeVar("T")
R = TypeVar("R")

CONNECT_SECONDS = 10.0
_ADDRESS = re.compile(r"[a-z]+://\S+:\d+")
# Items handed to joblib at once, per worker: joblib keeps results until they are fetched, so this
# bounds memory. The workers idle for about half an item at the end of each batch.
BATCH_PER_WORKER = 64
# To start processes takes this long, s: what is done sooner is done without them
START_SECONDS = 1.5


@dataclass(frozen=True)
class ParallelSettings:
    """Where to compute: `n_workers` processes (0: one a core), or the Dask `scheduler` address.

    The workers of a Dask cluster should have one thread each; their number is the cluster's.
    """

    n_workers: int = 0
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if isinstance(self.n_workers, bool) or not isinstance(self.n_workers, int):
            raise ParameterError(f"n_workers must be an integer, got {self.n_workers!r}")
        if self.n_workers < 0:
            raise ParameterError(
                f"n_workers must be 0 (all cores) or positive, got {self.n_workers}"
            )
        if self.scheduler is not None and not _ADDRESS.fullmatch(self.scheduler):
            raise ParameterError(
                f"scheduler (or FLEXIK_SCHEDULER) is {self.scheduler!r}, expected an address like "
                "tcp://127.0.0.1:8786"
            )


def from_environment(settings: ParallelSettings) -> ParallelSettings:
    """Let the variables FLEXIK_WORKERS and FLEXIK_SCHEDULER, if not empty, override `settings`.

    Raises
    ------
    ParameterError
        If FLEXIK_WORKERS is not 0 or a positive integer.
    """
    n_workers = os.environ.get("FLEXIK_WORKERS", "").strip()
    scheduler = os.environ.get("FLEXIK_SCHEDULER", "").strip()
    if n_workers:
        if not (n_workers.isascii() and n_workers.isdigit()):
            raise ParameterError(
                f"FLEXIK_WORKERS must be 0 (all cores) or a positive integer, got {n_workers!r}"
            )
        settings = replace(settings, n_workers=int(n_workers))
    return replace(settings, scheduler=scheduler or settings.scheduler)


def parallel_map(
    function: Callable[[T], R],
    items: Sequence[T],
    settings: ParallelSettings,
    description: str = "",
) -> Generator[R, None, None]:
    """`function(item)` for every item, in order, computed while being fetched.

    Parameters
    ----------
    function
        Called in other processes, unless all is done sooner than they would start.
    items
        Indexed when needed, so a lazy sequence costs no memory.
    settings
        Number of workers, or Dask scheduler.
    description
        Label of a progress bar on stderr; no bar without it.

    Raises
    ------
    FlexikError
        If the scheduler does not answer, or a worker dies.
    Exception
        Whatever `function` raises; the other workers are stopped.
    """
    results = _evaluate_all(function, items, range(len(items)), settings, description, "generator")
    with contextlib.closing(results):
        for _, result in results:
            yield result


def parallel_unordered(
    function: Callable[[T], R],
    items: Sequence[T],
    indices: Sequence[int],
    settings: ParallelSettings,
    description: str = "",
) -> Generator[tuple[int, R], None, None]:
    """Pairs (i, `function(items[i])`) for i in `indices`, as they finish; else `parallel_map`."""
    return _evaluate_all(function, items, indices, settings, description, "generator_unordered")


def _evaluate_all(
    function: Callable[[T], R],
    items: Sequence[T],
    indices: Sequence[int],
    settings: ParallelSettings,
    description: str,
    return_as: str,
) -> Generator[tuple[int, R], None, None]:
    if len(indices) == 0:
        return
    with _progress_bar(len(indices), description) as bar:
        if settings.scheduler is None and START_SECONDS > 0.0:
            started, n = time.perf_counter(), len(indices)
            for done, i in enumerate(indices, 1):
                yield _evaluate(function, i, items[i])
                bar.update()
                seconds = time.perf_counter() - started
                if seconds * (n / done - 1.0) > START_SECONDS:
                    break
            indices = indices[done:]
        if len(indices):
            yield from _in_processes(function, items, indices, settings, bar, return_as)


def _in_processes(
    function: Callable[[T], R],
    items: Sequence[T],
    indices: Sequence[int],
    settings: ParallelSettings,
    bar: Any,
    return_as: str,
) -> Generator[tuple[int, R], None, None]:
    task = joblib.delayed(_evaluate)
    with _pool(settings, return_as, len(indices)) as (parallel, n_workers):
        step = BATCH_PER_WORKER * n_workers
        for start in range(0, len(indices), step):
            batch = indices[start : start + step]
            with _quietly_closing(parallel(task(function, i, items[i]) for i in batch)) as pairs:
                for pair in pairs:
                    bar.update()
                    yield pair


def _evaluate(function: Callable[[T], R], index: int, item: T) -> tuple[int, R]:
    # the number of BLAS threads changes the order of sums, hence the last digits
    with threadpool_limits(limits=1):
        return index, function(item)


@contextlib.contextmanager
def _quietly_closing(results: Any) -> Iterator[Any]:
    try:
        yield results
    finally:
        with warnings.catch_warnings():
            # joblib warns about results that nobody fetched; a caller who stops knows
            warnings.simplefilter("ignore", UserWarning)
            results.close()


def _progress_bar(total: int, description: str) -> Any:
    seconds = 0.1 if sys.stderr.isatty() else 30.0  # do not flood the logs of CI
    return tqdm(
        total=total,
        desc=description,
        disable=not description,
        mininterval=seconds,
        maxinterval=max(10.0, seconds),
    )


@contextlib.contextmanager
def _pool(
    settings: ParallelSettings, return_as: str, n_items: int
) -> Iterator[tuple[joblib.Parallel, int]]:
    """Yield a joblib pool and its number of workers, no more than there are items."""
    options = {"return_as": return_as, "batch_size": 1, "max_nbytes": None}
    if settings.scheduler is not None:
        with _dask_client(settings.scheduler) as client:
            backend = _dask_backend(client)
            try:
                with joblib.Parallel(backend=backend, **options) as parallel:
                    yield parallel, backend.effective_n_jobs(-1)
            except CancelledError as error:
                raise FlexikError(f"lost the Dask scheduler {settings.scheduler!r}") from error
        return
    # joblib's count respects affinity and the quota of a container
    n_workers = min(settings.n_workers or joblib.cpu_count(), n_items)
    with joblib.parallel_config("loky", n_jobs=n_workers, inner_max_num_threads=1):
        parallel = joblib.Parallel(**options)
    try:
        with parallel:
            yield parallel, n_workers
    except BrokenProcessPool as error:
        reason = str(error).partition("\n")[0]
        raise FlexikError(f"a worker process was lost: {reason}") from error


@contextlib.contextmanager
def _dask_client(address: str) -> Iterator[Any]:
    """Yield a client of the scheduler at `address`, which has at least one worker."""
    key = f"scheduler (or FLEXIK_SCHEDULER) is {address!r}"
    try:
        import distributed
    except ImportError as error:
        raise FlexikError(f"{key}, but Dask is not installed: install flexik[dask]") from error
    try:
        client = distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise FlexikError(
            f"{key}, but no Dask scheduler answers there within {CONNECT_SECONDS:g} s"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECT_SECONDS)
        except TimeoutError as error:
            raise FlexikError(
                f"{key}, but that Dask scheduler has no workers after {CONNECT_SECONDS:g} s"
            ) from error
        yield client


def _dask_backend(client: Any) -> Any:
    # imports Dask, which is optional
    from joblib._dask import DaskDistributedBackend

    class Backend(DaskDistributedBackend):
        """joblib's, with two of its habits mended.

        It waits forever for a task whose worker died, and leaves a cluster of one worker idle to
        compute in the calling process.
        """

        def effective_n_jobs(self, n_jobs: int) -> int:
            return max(2, super().effective_n_jobs(n_jobs))

        def submit(self, func: Any, callback: Any = None) -> Any:
            future = super().submit(func, callback)

            def report_loss(done: Any) -> None:
                if (error := done.exception()) is not None:
                    callback(FlexikError(f"the Dask cluster lost a task: {error}"))

            future.add_done_callback(report_loss)
            return future

    return Backend(client=client)
