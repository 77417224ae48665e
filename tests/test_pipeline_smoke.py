"""The whole pipeline on the smoke profile: what it leaves, what it reruns, how it fails."""

import contextlib
import hashlib
import itertools
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from flexik.datasets.crane import FIELDS
from flexik.datasets.tables import read_table
from flexik.mechanisms.crane import forward
from flexik.parameters import PARAMETERS_FILE, read_yaml

ROOT = Path(__file__).parents[1]
METHODS = ("none", "combined", "combined_selected", "combined_ga")
STATISTICS = (
    *("mean_error_mm", "max_error_mm", "mean_abs_dx_mm", "mean_abs_dy_mm"),
    *("max_abs_dx_mm", "max_abs_dy_mm"),
)
GENERATED = ("grid", "selection")


def environment(project=None, **more):
    """As a user of the Makefile has it; the stages of `project` run the code of `project`."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("FLEXIK_")}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    own = {"PYTHONPATH": str(project / "src")} if project else {}
    return kept | {"PATH": path, "DVC_NO_ANALYTICS": "1", "OMP_NUM_THREADS": "1"} | own | more


def call(project, *command, **more):
    return subprocess.run(
        command,
        cwd=project,
        env=environment(project, **more),
        capture_output=True,
        text=True,
        check=False,
    )


def stage(project, script, *arguments, **more):
    return call(project, sys.executable, f"stages/{script}", *arguments, **more)


def reproduce(project):
    return call(project, "dvc", "repro")


def stages_run(done):
    lines = [line for line in done.stdout.splitlines() if line.startswith("Running stage '")]
    return {line.split("'")[1] for line in lines}


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


def edit(project, **values):
    """Set dotted keys (with __ for the dot) of params.yaml."""
    data = read_yaml(project / PARAMETERS_FILE)
    for key, value in values.items():
        *path, last = key.split("__")
        section = data
        for name in path:
            section = section[name]
        assert last in section
        section[last] = value
    (project / PARAMETERS_FILE).write_text(yaml.safe_dump(data, sort_keys=False))


def snapshot(project):
    """Bytes and time of change of all files but what dvc and git keep for themselves."""
    return {
        path.relative_to(project).as_posix(): (
            hashlib.sha256(path.read_bytes()).hexdigest(),
            path.stat().st_mtime_ns,
        )
        for path in sorted(project.rglob("*"))
        if path.is_file()
        and path.relative_to(project).parts[0] not in {".git", ".dvc"}
        and "__pycache__" not in path.parts
    }


def generated(project):
    return [(project / "data/crane" / f"{name}.parquet").read_bytes() for name in GENERATED]


def one_error(done):
    """The line beginning with `error: `, alone of its kind and without a traceback."""
    text = done.stdout + done.stderr
    assert "Traceback" not in text, text
    (line,) = (line for line in text.splitlines() if line.startswith("error: "))
    return line


def test_metrics_hold_every_number_by_its_name(project):
    metrics = json.loads((project / "reports/crane/metrics.json").read_text())
    for method in METHODS:
        for name in STATISTICS:
            value = metrics[f"{method}.{name}"]
            assert isinstance(value, float) and math.isfinite(value) and value >= 0
        assert metrics[f"{method}.mean_error_mm"] <= metrics[f"{method}.max_error_mm"]
        assert metrics[f"{method}.max_abs_dx_mm"] <= metrics[f"{method}.max_error_mm"]
    assert all(isinstance(v, int | float) and math.isfinite(v) for v in metrics.values())
    # what the calibration is made for, whatever the conditions
    assert metrics["none.mean_error_mm"] == pytest.approx(31.9331, abs=1e-3)
    assert metrics["combined.mean_error_mm"] < metrics["none.mean_error_mm"]


def test_counts_are_those_of_the_grid(project, geometry):
    metrics = json.loads((project / "reports/crane/metrics.json").read_text())
    axes = [np.linspace(0, 0.535, 3), np.linspace(0, 0.78, 4), np.linspace(0, 1.6, 3)]
    in_front = forward(geometry, np.array(list(itertools.product(*axes))))[:, 0] >= 0
    n_kept = 4 * int(in_front.sum())  # four payloads
    assert 0 < n_kept < 144
    assert metrics["grid.n_samples"] == 144
    assert metrics["grid.n_kept"] == n_kept
    assert metrics["grid.n_failed"] == 0
    assert metrics["grid.n_left_out"] == 144 - n_kept
    assert metrics["selection.n_samples"] == metrics["selection.n_kept"] == 40


def test_the_grid_holds_every_sample_once(project):
    table = read_table(project / "data/crane/grid.parquet", FIELDS)
    axes = ((0, 0.535, 3), (0, 0.78, 4), (0, 1.6, 3), (50, 500, 4))
    expected = set(itertools.product(*(np.linspace(*axis).tolist() for axis in axes)))
    rows = table[["lift_stroke", "jib_stroke", "extension_stroke", "payload"]]
    assert len(rows) == 144
    assert set(rows.itertuples(index=False, name=None)) == expected


def test_tables_and_figures_are_there_and_linked(project):
    folder = project / "reports/crane"
    for name in ("positioning_errors", "calibration", "mesh_study"):
        for suffix in ("csv", "md"):
            assert (folder / f"{name}.{suffix}").stat().st_size > 100
    figures = sorted((folder / "figures").iterdir())
    assert len(figures) >= 9
    page = (folder / "README.md").read_text()
    for figure in figures:
        assert figure.read_bytes().startswith(b"\x89PNG")
        assert figure.stat().st_size > 5000
        assert f"figures/{figure.name}" in page
    errors = (folder / "errors.csv").read_text().splitlines()
    assert len(errors) == 1 + len(METHODS) * 6  # three points, two payloads
    table = (folder / "positioning_errors.md").read_text()
    assert all(method in table for method in METHODS)
    # the README shows the table that was just made
    assert table.strip().splitlines()[-1] in (project / "README.md").read_text()


def test_reports_say_nothing_of_the_machine(project):
    places = {str(project), str(project.parent), str(ROOT), str(Path.home()), sys.prefix}
    files = [path for path in (project / "reports").rglob("*") if path.is_file()]
    for path in [*files, project / "README.md", project / "data/crane/calibration.json"]:
        content = path.read_bytes()
        for place in places - {"/"}:
            assert place.encode() not in content, f"{path} contains {place}"
        assert os.uname().nodename.encode() not in content or len(os.uname().nodename) < 6


def test_nothing_unfinished_is_left(project):
    hidden = [path for path in (project / "data").rglob(".*") if path.name != ".gitignore"]
    assert not hidden
    assert not [path for path in (project / "reports").rglob(".*") if path.name != ".gitignore"]


def test_run_again_it_does_nothing(project):
    before = snapshot(project)
    done = reproduce(project)
    assert done.returncode == 0, done.stderr
    assert not stages_run(done)
    assert "Data and pipelines are up to date." in done.stdout
    assert snapshot(project) == before


def test_an_edited_method_is_all_that_is_computed_again(copy):
    edit(copy, crane__methods__combined__n_corrections=2)
    before = snapshot(copy)
    done = reproduce(copy)
    assert done.returncode == 0, done.stdout + done.stderr
    again = {"validate", "crane_evaluate@combined", "crane_report", "readme"}
    assert stages_run(done) == again
    after = snapshot(copy)
    for name in ("grid.parquet", "networks/deflection.json", "evaluations/combined_ga.parquet"):
        assert after[f"data/crane/{name}"] == before[f"data/crane/{name}"]
    changed = "data/crane/evaluations/combined.parquet"
    assert after[changed] != before[changed]


def test_a_wrong_parameter_is_one_line_that_names_it(copy):
    edit(copy, crane__structure__beams__lift__mass=-124.6)
    done = reproduce(copy)
    assert done.returncode != 0
    assert one_error(done).startswith("error: params.yaml: crane.structure.beams.lift.mass: ")


def test_a_damaged_table_is_one_line_that_names_it(copy):
    grid = copy / "data/crane/grid.parquet"
    grid.write_bytes(grid.read_bytes()[:-200])
    before = snapshot(copy)
    done = stage(copy, "crane_train.py", "deflection")
    assert done.returncode == 1
    assert "data/crane/grid.parquet" in one_error(done)
    assert len(done.stderr.strip().splitlines()) == 1
    assert snapshot(copy) == before


@pytest.mark.parametrize(
    ("script", "argument", "named"),
    [
        ("crane_train.py", "nothing", "crane.networks"),
        ("crane_evaluate.py", "nothing", "crane.methods"),
    ],
)
def test_an_unknown_name_is_told(copy, script, argument, named):
    before = snapshot(copy)
    done = stage(copy, script, argument)
    assert done.returncode == 1
    line = one_error(done)
    assert named in line and "'nothing'" in line
    assert snapshot(copy) == before


def test_data_of_other_parameters_are_refused(copy):
    edit(copy, crane__structure__gravity=9.8)
    before = snapshot(copy)
    done = stage(copy, "crane_train.py", "deflection")
    assert done.returncode == 1
    assert "data/crane/grid.parquet: made with other parameters" in one_error(done)
    assert snapshot(copy) == before


@pytest.mark.parametrize("n_workers", ["1", "2"])
def test_generated_bytes_do_not_depend_on_the_workers(project, copy, n_workers):
    for name in GENERATED:
        (copy / "data/crane" / f"{name}.parquet").unlink()
    done = stage(copy, "crane_generate.py", FLEXIK_WORKERS=n_workers)
    assert done.returncode == 0, done.stderr
    assert generated(copy) == generated(project)


def test_killed_and_run_again_generates_the_same_bytes(copy, tmp_path):
    # 27 parts, some seconds
    edit(
        copy,
        crane__grid__lift={"minimum": 0.0, "maximum": 0.535, "increment": 0.066875},
        crane__grid__jib={"minimum": 0.0, "maximum": 0.78, "increment": 0.13},
        crane__grid__extension={"minimum": 0.0, "maximum": 1.6, "increment": 0.2},
    )
    for name in GENERATED:
        (copy / "data/crane" / f"{name}.parquet").unlink()
    whole = shutil.copytree(copy, tmp_path / "whole", symlinks=True)
    assert stage(whole, "crane_generate.py").returncode == 0

    data = copy / "data/crane"
    run = subprocess.Popen(
        [sys.executable, "stages/crane_generate.py"],
        cwd=copy,
        env=environment(copy),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # so that its orphaned workers can be ended with it
    )
    try:
        while len(list(data.glob(".grid_parts/*/part-*.parquet"))) < 3:
            assert run.poll() is None
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    n_finished = len(list(data.glob(".grid_parts/*/part-*.parquet")))
    assert not (data / "grid.parquet").exists()

    done = stage(copy, "crane_generate.py")
    assert done.returncode == 0, done.stderr
    assert f"grid: {n_finished} of 27 parts were there from an interrupted run" in done.stdout
    assert generated(copy) == generated(whole)
    assert sorted(path.name for path in data.iterdir()) == sorted(
        path.name for path in (whole / "data/crane").iterdir()
    )


def test_too_many_failed_samples_end_the_stage(copy):
    # no crane holds the heavier half
    edit(copy, crane__grid__payload={"minimum": 100.0, "maximum": 1.0e7, "increment": 9.9999e6})
    (copy / "data/crane/grid.parquet").unlink()
    done = stage(copy, "crane_generate.py")
    assert done.returncode == 1
    line = one_error(done)
    assert "crane.grid.maximum_failed_share" in line
    assert "with 1e+07 kg" in line
    assert not (copy / "data/crane/grid.parquet").exists()


def test_a_profile_with_an_unknown_key_is_told(tmp_path):
    profile = tmp_path / "wrong.yaml"
    profile.write_text("crane: {grid: {lift: {step: 1}}}\n")
    command = [sys.executable, ROOT / "profiles/run.py", profile, tmp_path / "project"]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "crane.grid.lift.step" in one_error(done)


def test_a_profile_does_not_run_over_other_files(tmp_path):
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "mine.txt").touch()
    profile = ROOT / "profiles/smoke.yaml"
    command = [sys.executable, ROOT / "profiles/run.py", profile, tmp_path / "project"]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "expected an empty or a new folder" in one_error(done)
    assert [path.name for path in (tmp_path / "project").iterdir()] == ["mine.txt"]
