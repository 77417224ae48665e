"""One choice of kernels for every x86-64 machine with AVX2, so that all of them get the same bits.

OpenBLAS, NumPy and torch choose kernels by the processor; those of other choices round otherwise,
and training and static equilibria make much of the last digit. The libraries read these variables
once, when they are loaded, so nothing here imports NumPy. What is left is the C library (sin, cos),
which uses the same code on all these processors but may change with its version.
"""

import os
import platform
import sys
from pathlib import Path
from typing import Any

_FIXED = {
    "OPENBLAS_CORETYPE": "Haswell",
    # any but 1024, at which newer OpenBLAS gives some processors blocks of another length even
    # where the core type is fixed, and the kernel's buffer is too short (its issue 6021)
    "OPENBLAS_L2_SIZE": "512",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "ATEN_CPU_CAPABILITY": "avx2",
    # the one branch of MKL that is the same on processors of other makers than Intel
    "MKL_CBWR": "COMPATIBLE",
}
# the order of sums depends on the number of threads
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
# NumPy refuses the first beside the features to disable; the others choose other kernels
_REMOVED = ("NPY_ENABLE_CPU_FEATURES", "OPENBLAS_BLOCK_FACTOR", "EXUDYN_MODULE")
# of Zen, OpenBLAS has Haswell's kernels
_CORES = {"Haswell", "Zen"}
_X86 = {"x86_64", "AMD64"}


def fix() -> None:
    """Set the environment for this process and those it starts; call it before NumPy is imported.

    On a machine without AVX2 only the number of threads is set; `differences` tells.
    """
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    if _has_avx2():
        os.environ.update(_FIXED)
    for name in _REMOVED:
        os.environ.pop(name, None)


def differences() -> str | None:
    """One line on loaded kernels other than the fixed ones, or None when there are none."""
    import numpy as np
    from threadpoolctl import threadpool_info

    simd = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    if platform.machine() not in _X86:
        found = [f"processor {platform.machine()}"]
    elif simd != ["X86_V3"]:
        found = [f"NumPy with {' '.join(simd) or 'no AVX2'}"]
    else:
        found = []
    libraries = [info for info in threadpool_info() if info["user_api"] == "blas"]
    found += sorted(filter(None, map(_of, libraries)))
    torch = sys.modules.get("torch")
    if torch is not None and (level := torch.backends.cpu.get_cpu_capability()) != "AVX2":
        found.append(f"torch for {level}")
    if not found:
        return None
    return f"the last digits may differ from those of other machines: {', '.join(found)}"


def _of(info: dict[str, Any]) -> str | None:
    """What is different about a library of threadpoolctl."""
    if info["internal_api"] == "mkl":
        return None  # torch's, fixed by its variable
    name = f"{info['internal_api']} {info['version']}"
    if (core := info.get("architecture")) not in _CORES:
        return f"{name} for {core or 'an unknown core'}"
    return f"{name} with {info['num_threads']} threads" if info["num_threads"] > 1 else None


def _has_avx2() -> bool:
    if platform.machine() not in _X86:
        return False
    try:
        return " avx2 " in Path("/proc/cpuinfo").read_text()
    except OSError:
        return True  # no Linux: all but the oldest have it
