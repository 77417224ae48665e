"""The stage that draws targets: what it keeps, and that the number of workers decides nothing."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from flexik.datasets.crane.evaluations import TARGET_FIELDS
from flexik.datasets.crane.provenance import targets_checksum
from flexik.datasets.tables import read_table
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import tips
from flexik.parameters import load_parameters

ROOT = Path(__file__).resolve().parents[1]
STAGE = ROOT / "stages" / "crane_targets.py"
SPRING = 8e6  # N m/rad
# small parts, so that a few targets make several; workers find the script by its name
IN_SMALL_PARTS = """
import crane_targets
from flexik import stage
crane_targets.ROWS_PER_PART = 7
stage.run(crane_targets.main)
"""


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("crane_targets", STAGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def folder(tmp_path):
    """Project with little more than a calibrated crane; 20 targets."""
    shutil.copytree(ROOT / "data/reference", tmp_path / "data/reference")
    (tmp_path / "data/crane").mkdir()
    (tmp_path / "data/crane/calibration.json").write_text(f'{{"spring_stiffness": {SPRING}}}')
    change(tmp_path, source=ROOT, n_targets=20)
    return tmp_path


def change(folder, source=None, **values):
    """Set keys of crane.workspace; methods take as many targets as there are."""
    data = yaml.safe_load(((source or folder) / "params.yaml").read_text())
    space = data["crane"]["workspace"]
    space.update(values)
    for method in data["crane"]["methods"].values():
        method["n_workspace_targets"] = space["n_targets"]
    (folder / "params.yaml").write_text(yaml.safe_dump(data))


def run(folder, n_workers=1):
    path = os.pathsep.join([str(ROOT / "src"), str(STAGE.parent)])
    return subprocess.run(
        [sys.executable, "-c", IN_SMALL_PARTS],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path, "FLEXIK_WORKERS": str(n_workers)},
        capture_output=True,
        text=True,
        check=False,
    )


def read(folder, checksum=None):
    return read_table(folder / "data/crane/targets.parquet", TARGET_FIELDS, checksum)


def test_targets_are_reached_and_do_not_depend_on_the_workers(folder, monkeypatch):
    done = run(folder, 1)
    assert done.returncode == 0, done.stderr
    assert "20 kept" in done.stdout
    path = folder / "data/crane/targets.parquet"
    alone = path.read_bytes()
    path.unlink()
    assert run(folder, 2).returncode == 0
    assert path.read_bytes() == alone

    monkeypatch.chdir(folder)
    crane = load_parameters().crane
    table = read(folder, targets_checksum(crane, SPRING))
    assert len(table) == 20
    space = crane.workspace
    limits = {"target_x": space.x, "target_y": space.y, "payload": space.payload}
    for name, (least, most) in limits.items():
        assert table[name].between(least, most).all()
    targets = table[["target_x", "target_y"]].to_numpy()
    strokes = table[["lift_stroke", "jib_stroke", "extension_stroke"]].to_numpy()
    assert (strokes >= 0).all() and (strokes <= crane.geometry.stroke_maximum).all()
    tip = tips(flexible_crane(crane, SPRING), strokes, table["payload"].to_numpy())
    assert (np.linalg.norm(tip - targets, axis=1) < 1.01 * space.tolerance).all()


def test_fewer_targets_are_the_first_of_more_and_another_seed_gives_others(folder):
    targets = ["target_x", "target_y", "payload"]
    assert run(folder).returncode == 0
    more = read(folder)[targets].to_numpy()
    change(folder, n_targets=6)
    assert run(folder).returncode == 0
    assert np.array_equal(read(folder)[targets].to_numpy(), more[:6])
    change(folder, seed=22)
    assert run(folder).returncode == 0
    assert not np.isin(read(folder)[targets].to_numpy(), more).any()


def test_a_workspace_out_of_reach_is_told(folder):
    change(folder, x=[9.0, 10.0], n_targets=3)
    done = run(folder)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()[-1:]
    assert line.startswith("error: crane.workspace: of ") and "only 0 are reached" in line
    assert not (folder / "data/crane/targets.parquet").exists()


def test_candidates_are_drawn_once_in_parts(script, monkeypatch):
    monkeypatch.setattr(script, "ROWS_PER_PART", 40)
    crane = load_parameters(ROOT / "params.yaml").crane
    grid = crane.grid.model_copy(update={"minimum_tip_x": 1.0})
    crane = crane.model_copy(update={"grid": grid})
    generator = np.random.default_rng(3)
    parts = [*script.draw(crane, generator, 60), *script.draw(crane, generator, 90)]
    found = np.concatenate([part.targets for part in parts])
    assert all(0 < len(part.payload) <= 40 for part in parts)
    assert found[:, 0].min() >= 1.0
    assert 100 < len(found) < 150  # of 6.5 m, one is left out
    # the same whatever the calls
    (*whole,) = script.draw(crane, np.random.default_rng(3), 150)
    assert np.array_equal(np.concatenate([part.targets for part in whole]), found)
    payload = np.concatenate([part.payload for part in parts])
    assert np.array_equal(np.concatenate([part.payload for part in whole]), payload)
    assert (payload >= 30).all() and (payload <= 500).all()


def test_candidates_out_of_reach_are_left_out(script, geometry, monkeypatch):
    monkeypatch.chdir(ROOT)
    crane = load_parameters().crane
    targets = np.array([[4.0, 1.0], [6.4, 7.9], [3.0, -1.0]])
    candidates = script.Candidates(targets, np.array([120.0, 120.0, 470.0]))
    found = script.reach(flexible_crane(crane, SPRING), crane.workspace, candidates)
    assert np.array_equal(found.targets, targets[[0, 2]])
    assert found.payload.tolist() == [120, 470]
