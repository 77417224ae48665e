"""What every benchmark has first: fixed kernels, the code beside it, and where it is measured.

Import it before NumPy.
"""

import multiprocessing
import os
import platform
import re
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "src"))

from flexik import kernels

kernels.fix()

LOAD_BEFORE = os.getloadavg()[0]
MEGABYTE = 2**20


def remark(n_processes: int, *packages: str) -> str:
    """A note on the machine, its load, and the versions of those `packages` that are installed."""
    found = [f"{name} {number}" for name in packages if (number := installed(name))]
    return (
        f"Processor {processor()}; one core and one BLAS thread a process; {', '.join(found)}; "
        f"load of the machine {LOAD_BEFORE:.1f} at the start, {os.getloadavg()[0]:.1f} at the end, "
        f"of which this benchmark is up to {n_processes}."
    )


def processor() -> str:
    """Model of the processor, as Linux names it."""
    file = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*: (.+)", file.read_text()) if file.is_file() else None
    return model[1] if model else platform.processor() or platform.machine()


def installed(package: str) -> str | None:
    """Version of `package`, or None."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def memory(name: str, process: int | str = "self") -> float:
    """VmRSS or VmHWM (the peak since its program started) of a living process in MB; Linux only.

    ru_maxrss would not do: a process inherits it from the one that started it.
    """
    lines = Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines()
    kilobytes = next(int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))
    return 1024 * kilobytes / MEGABYTE


@contextmanager
def pinned_pool(n_processes: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes with a core each; thread pools that ask for the cores find one."""
    context = multiprocessing.get_context("spawn")
    cores = context.Queue()
    available = sorted(os.sched_getaffinity(0)) if sys.platform == "linux" else []
    for k in range(n_processes):
        cores.put(available[k % len(available)] if available else None)
    with ProcessPoolExecutor(n_processes, context, _pin, (cores,)) as pool:
        yield pool


def _pin(cores: Any) -> None:
    core = cores.get()
    if core is not None and sys.platform == "linux":
        os.sched_setaffinity(0, {core})
