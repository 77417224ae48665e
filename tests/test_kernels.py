"""The same bits on every x86-64 machine with AVX2, whatever the environment says before."""

import os
import subprocess
import sys

import pytest

from flexik import kernels

# every trainer for a moment: what is printed is the checksum of all weights
TRAIN = """
from flexik import kernels
{fix}
import hashlib
import numpy as np
from pydantic import TypeAdapter
from flexik.learning.perceptron import Quantity
from flexik.learning.training import TRAINERS, Architecture, Lesson, train
from flexik.parameters.trainers import Trainer

inputs = np.random.default_rng(1).uniform(-1.0, 1.0, (1500, 4))
outputs = inputs @ np.arange(8.0).reshape(4, 2) / 8.0
outputs = np.exp(outputs / (1.0 + outputs**2))
names = [[Quantity(name, "m") for name in names] for names in ("abcd", "ef")]
found = hashlib.sha256()
for kind in TRAINERS:
    settings = TypeAdapter(Trainer).validate_python({{"kind": kind, "n_iterations": 10}})
    network, _ = train(Lesson(inputs, outputs, *names, Architecture((9, 6)), settings))
    for matrix in network.weights:
        found.update(np.ascontiguousarray(matrix).tobytes())
print(kernels.differences())
print(found.hexdigest())
"""
ENVIRONMENTS = {
    "nothing": {},
    "other core": {"OPENBLAS_CORETYPE": "Sandybridge", "OPENBLAS_L2_SIZE": "1024"},
    "AVX-512": {"OPENBLAS_CORETYPE": "SkylakeX", "NPY_ENABLE_CPU_FEATURES": "X86_V3"},
    "AVX2 off": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4", "ATEN_CPU_CAPABILITY": "default"},
    "threads": {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "MKL_NUM_THREADS": "2"},
}
NAMES = {*kernels._FIXED, *kernels._REMOVED, *kernels._THREADS}

needs_avx2 = pytest.mark.skipif(not kernels._has_avx2(), reason="no x86-64 processor with AVX2")


def run(environment, fix="kernels.fix()"):
    """Lines that TRAIN prints."""
    inherited = {name: value for name, value in os.environ.items() if name not in NAMES}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", TRAIN.format(fix=fix)],
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@needs_avx2
def test_every_trainer_gives_the_same_bits_in_every_environment():
    found = {name: run(environment) for name, environment in ENVIRONMENTS.items()}
    assert all(differences == "None" for differences, _ in found.values()), found
    assert len({checksum for _, checksum in found.values()}) == 1, found


@needs_avx2
def test_other_kernels_give_other_bits_and_are_told():
    (_, expected), (told, other) = run({}), run(ENVIRONMENTS["other core"], fix="")
    assert other != expected
    assert told.startswith("the last digits may differ")
    assert "openblas" in told and "Sandybridge" in told


def test_settings_that_choose_other_kernels_are_removed(monkeypatch):
    monkeypatch.setattr(os, "environ", {"EXUDYN_MODULE": "fast", "OPENBLAS_CORETYPE": "Zen"})
    monkeypatch.setattr(kernels, "_has_avx2", lambda: True)
    kernels.fix()
    assert os.environ["OPENBLAS_CORETYPE"] == "Haswell"
    assert "EXUDYN_MODULE" not in os.environ


def test_without_avx2_only_threads_are_set(monkeypatch):
    monkeypatch.setattr(os, "environ", {})
    monkeypatch.setattr(kernels.platform, "machine", lambda: "aarch64")
    kernels.fix()
    assert set(os.environ) == set(kernels._THREADS)
    assert "processor aarch64" in kernels.differences()


def test_nothing_is_imported_before_it():
    code = "import sys, flexik.kernels; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "False"
