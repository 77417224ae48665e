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

from flexik.machines.crane import CraneGeometry  # noqa: E402


@pytest.fixture(scope="session")
def geometry():
    return CraneGeometry(
        lift_pivot=(-0.09, 1.115),
        lift_cylinder_base=(0.26, -1.04),
        lift_cylinder_head=(0.3025, -0.105),
        jib_pivot=(2.88, -0.024),
        rocker_pivot=(-0.19, -0.015),
        jib_cylinder_base=(-1.4165, 0.203),
        coupler_pin=(-0.095, 0.24),
        extension_start=(2.141, 0.008),
        lift_cylinder_length=0.8,
        jib_cylinder_length=1.037,
        rocker_length=0.45,
        coupler_length=0.48,
        stroke_maximum=(0.535, 0.78, 1.6),
    )


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
