"""The whole pipeline on the smoke profile: what it computes again, and how it fails."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from smoke_pipeline import (
    PARAMETERS,
    PROFILE,
    ROOT,
    call,
    changed,
    edit,
    environment,
    one_error,
    reproduce,
    snapshot,
    stage,
    stages_run,
)

# one process, which makes the project once
pytestmark = pytest.mark.xdist_group("pipeline")

CASES = tuple(PARAMETERS["cases"])


def succeeded(done):
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_run_again_it_does_nothing_but_look(project):
    before = snapshot(project)
    assert stages_run(succeeded(reproduce(project))) == {"validate"}
    after = snapshot(project)
    assert {name: digest for name, (digest, _) in after.items()} == {
        name: digest for name, (digest, _) in before.items()
    }
    written = {name.split("/")[1] for name in changed(before, after) if name.startswith("data/")}
    assert written <= {"validated", "validated.txt"}


def test_an_edited_method_is_all_that_is_computed_again(copy):
    edit(copy, crane__methods__combined__n_corrections=2)
    before = snapshot(copy, "data")
    done = succeeded(reproduce(copy))
    ran = {"validate", "evaluate@crane", "study@crane", "report@crane", "readme"}
    assert stages_run(done) == ran
    again = changed(before, snapshot(copy, "data"))
    assert {"data/crane/errors/published/combined.parquet"} <= again
    assert not [name for name in again if name.startswith("data/crane/networks")]
    of_methods = {name for name in again if name.startswith("data/crane/errors/")}
    assert {name.split("/")[-1].partition(".")[0] for name in of_methods} == {"combined"}


def test_a_network_is_followed_by_what_uses_it(copy):
    edit(copy, crane__networks__rigid__seed=2)
    before = snapshot(copy, "data")
    succeeded(reproduce(copy))
    again = {name.partition(".")[0] for name in changed(before, snapshot(copy, "data"))}
    networks = {name.split("/")[-1] for name in again if "/networks/" in name}
    assert networks == {"rigid", *(
        name
        for name, network in PARAMETERS["crane"]["networks"].items()
        if network.get("corrects") == "rigid"
    )}  # fmt: skip
    assert "data/crane/errors/published/modular" in again
    assert "data/crane/errors/published/combined" not in again


def append(path, text):
    path.write_text(path.read_text() + text)


def test_code_counts(copy):
    """Edit a trainer: networks are trained again; edit a figure: nothing but the report."""
    append(copy / "src/flexik/reporting/kinds.py", "\n# another look\n")
    before = snapshot(copy, "data")
    assert stages_run(succeeded(reproduce(copy))) == {
        *("validate", "readme"),
        *(f"report@{case}" for case in CASES),
    }
    again = changed(before, snapshot(copy, "data"))
    assert {name for name in again if not name.startswith("data/validated")} == {
        f"data/{case}/report.json" for case in CASES
    }

    append(copy / "src/flexik/learning/accelerated.py", "\n# another step\n")
    done = succeeded(stage(copy, "train", "crane"))
    assert "error" not in done.stderr
    networks = {name: was for name, was in before.items() if "crane/networks" in name}
    again = changed(networks, snapshot(copy, "data/crane/networks"))
    trained = {name for name in again if name.endswith(".part")}
    assert {
        f"data/crane/networks/{name}.part" for name in PARAMETERS["crane"]["networks"]
    } == trained


def test_a_default_and_a_file_of_the_user_count(copy):
    networks = copy / "src/flexik/parameters/networks.py"
    networks.write_text(networks.read_text().replace("seed: Seed = 1", "seed: Seed = 2"))
    own = copy / "own.csv"
    shutil.copyfile(copy / "data/reference/crane/campaign_example.csv", own)
    edit(copy, crane__studies__measured__campaign__file="own.csv")
    succeeded(stage(copy, "validate"))
    found = json.loads(succeeded(call(copy, "dvc", "status", "--json")).stdout)
    assert {"train@crane", "select@crane", "study@crane"} <= set(found)


def test_a_wrong_parameter_is_one_line_and_nothing_is_lost(copy):
    edit(copy, crane__networks__deflection__n_hiden=3, crane__methods__combined__n_corrections=3)
    before = snapshot(copy, "data", "reports")
    done = reproduce(copy)
    assert done.returncode != 0
    assert one_error(done).startswith("error: params.yaml: crane.networks.deflection.n_hiden: ")
    assert not changed(before, snapshot(copy, "data", "reports"))


def test_a_damaged_table_is_told_and_made_again(copy):
    grid = copy / "data/crane/samples/grid.parquet"
    whole = grid.read_bytes()
    grid.write_bytes(whole[:-200])
    edit(copy, crane__networks__deflection__seed=3)
    done = stage(copy, "train", "crane")
    assert done.returncode == 1
    assert "data/crane/samples/grid.parquet: damaged" in done.stderr
    assert "Traceback" not in done.stderr
    succeeded(stage(copy, "generate", "crane"))
    assert grid.read_bytes() == whole


def test_an_unknown_case_is_told(copy):
    done = stage(copy, "train", "digger")
    assert done.returncode == 1
    assert "there is no case 'digger'" in one_error(done)


def test_bytes_do_not_depend_on_the_workers(project, copy):
    for folder in ("samples", "networks", "errors"):
        shutil.rmtree(copy / "data/crane" / folder)
    for name in ("generate", "train", "evaluate"):
        succeeded(stage(copy, name, "crane", FLEXIK_WORKERS="2"))
    for folder in ("samples", "networks", "errors"):
        for path in sorted((project / "data/crane" / folder).rglob("*")):
            if path.is_file():
                assert (copy / path.relative_to(project)).read_bytes() == path.read_bytes(), path


def test_killed_and_run_again_generates_the_same_bytes(copy, tmp_path):
    edit(
        copy,
        crane__samples__grid__lift={"minimum": 0.0, "maximum": 0.535, "increment": 0.066875},
        crane__samples__grid__jib={"minimum": 0.0, "maximum": 0.78, "increment": 0.13},
        crane__samples__grid__extension={"minimum": 0.0, "maximum": 1.6, "increment": 0.2},
    )
    whole = shutil.copytree(copy, tmp_path / "whole", symlinks=True)
    succeeded(stage(whole, "generate", "crane"))
    hidden = copy / "data/crane/.samples_parts"
    run = subprocess.Popen(
        [sys.executable, "stages/generate.py", "crane"],
        cwd=copy,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # so that its orphaned workers can be ended with it
    )
    try:
        while len(list(hidden.glob("grid-*/*.npz"))) < 3:
            assert run.poll() is None
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    done = succeeded(stage(copy, "generate", "crane"))
    assert "items were there already" in done.stdout
    for path in (whole / "data/crane/samples").iterdir():
        assert (copy / path.relative_to(whole)).read_bytes() == path.read_bytes(), path
    assert not hidden.exists()


def test_a_part_that_fails_leaves_the_others(copy):
    # no crane holds the heavier half of the grid; few samples, they fail slowly
    largest = {"lift": 0.535, "jib": 0.78, "extension": 1.6}
    grid = {name: {"minimum": 0.0, "maximum": a, "increment": a} for name, a in largest.items()}
    edit(
        copy,
        crane__samples__grid=grid
        | {"payload": {"minimum": 100.0, "maximum": 1.0e7, "increment": 9.9999e6}},
        crane__samples__selection__seed=12,
        crane__studies__fitting__payload=100.0,
        crane__studies__fitting__jib=0.0,
        crane__studies__fitting__n_samples=10,
    )
    before = snapshot(copy, "data/crane/samples")
    done = stage(copy, "generate", "crane")
    assert done.returncode == 1
    assert "maximum_failed_share" in one_error(done)
    again = changed(before, snapshot(copy, "data/crane/samples"))
    assert {name.split("/")[-1].partition(".")[0] for name in again} == {"selection"}


def test_queued_experiments_run_the_code_of_their_own_copy(copy):
    for command in (("add", "-A"), ("commit", "-qm", "smoke")):
        identity = ("-c", "user.name=a", "-c", "user.email=a@b")
        succeeded(call(copy, "git", *identity, *command))
    change = "crane.methods.combined.n_corrections=3"
    succeeded(call(copy, "dvc", "exp", "run", "--queue", "-S", change))
    broken = copy / "src/flexik/positioning/combined.py"
    broken.write_text("raise SystemExit('code of the workspace')\n")
    done = call(copy, "dvc", "exp", "run", "--run-all")
    assert done.returncode == 0, done.stdout + done.stderr
    shown = succeeded(call(copy, "dvc", "exp", "show", "--csv")).stdout
    assert "n_corrections" in shown or "workspace" in shown
    assert "code of the workspace" not in done.stdout + done.stderr


def test_a_profile_does_not_run_over_other_files(tmp_path):
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "mine.txt").touch()
    done = call(ROOT, sys.executable, "profiles/run.py", str(PROFILE), str(tmp_path / "project"))
    assert done.returncode == 1
    assert "expected an empty or a new folder" in one_error(done)
    assert [path.name for path in (tmp_path / "project").iterdir()] == ["mine.txt"]
