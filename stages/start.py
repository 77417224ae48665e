"""What every stage does first: take the code beside it, and the kernels that every machine has."""

import sys
from pathlib import Path

# A copy of the project (dvc exp run --temp) runs its own code, whatever is installed; and no script
# of this folder stands in for a module of Python's (select).
sys.path[0] = str(Path(__file__).resolve().parents[1] / "src")

from flexik import kernels  # noqa: E402

kernels.fix()  # before NumPy is imported

from flexik.stage import run, run_stage  # noqa: E402

__all__ = ["run", "run_stage"]
