"""The log crane and its test conditions, as params.yaml has them; the pipeline run once."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flexik import kernels

kernels.fix()  # as the stages do, before NumPy is imported
# for processes that tests start: flexik itself is not installed
os.environ["PYTHONPATH"] = str(Path(__file__).parents[1] / "src")

import numpy as np  # noqa: E402
from smoke_pipeline import ROOT, environment  # noqa: E402
from virtual_work import GEOMETRY  # noqa: E402


@pytest.fixture(scope="session")
def geometry():
    return GEOMETRY


@pytest.fixture(scope="session")
def points():
    return np.array(
        [
            *([1, 7], [2, 7], [1, 6], [1, -2], [2, 2], [2, -3.95], [6, -1], [6, 3], [4, 5]),
            *([3, -1], [4, 1], [4, -3], [1, 0], [4, 3], [6, 1], [3, 4], [3, 6], [5, -2], [5, 0]),
            *([5, 2], [5, 4], [1, -3], [1, -1], [1, 1], [1, 2]),
        ],
        dtype=float,
    )


@pytest.fixture(scope="session")
def payloads():
    return np.array([30.0, 120.0, 260.0, 310.0, 470.0])


@pytest.fixture(scope="session")
def project(tmp_path_factory):
    """Project whose pipeline has run with the smoke profile; for reading only."""
    folder = tmp_path_factory.mktemp("smoke") / "project"
    command = [sys.executable, ROOT / "profiles/run.py", ROOT / "profiles/smoke.yaml", folder]
    done = subprocess.run(
        command, env=environment(), capture_output=True, text=True, check=False, cwd=folder.parent
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture
def copy(project, tmp_path):
    """Copy of the project to change."""
    return shutil.copytree(project, tmp_path / "copy", symlinks=True)
