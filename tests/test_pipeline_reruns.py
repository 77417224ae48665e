"""The whole pipeline on the smoke profile: what it reruns, and how it fails."""

import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from smoke_pipeline import (
    CRANE,
    GENERATED,
    ROOT,
    call,
    edit,
    environment,
    generated,
    one_error,
    reproduce,
    snapshot,
    stage,
    stages_run,
)

from flexik.datasets.tables import read_table, stored_fields
from flexik.parameters import PARAMETERS_FILE

# one process, which makes the project once
pytestmark = pytest.mark.xdist_group("pipeline")


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
    again = {
        *("validate", "crane_evaluate@combined", "crane_tolerance_study"),
        *("crane_measured", "crane_error_budget", "crane_identify", "crane_adaptation"),
        "crane_report",
    }
    assert stages_run(done) == {*again, "readme"}
    after = snapshot(copy)
    for name in ("grid.parquet", "networks/deflection.json", "evaluations/combined_ga.parquet"):
        assert after[f"data/crane/{name}"] == before[f"data/crane/{name}"]
    for place in ("evaluations", "workspace"):
        changed = f"data/crane/{place}/combined.parquet"
        assert after[changed] != before[changed]


def test_another_trainer_of_a_network_is_followed_by_what_uses_the_network(copy):
    edit(copy, crane__modular_networks__modular__trainer="study")
    before = snapshot(copy)
    done = reproduce(copy)
    assert done.returncode == 0, done.stdout + done.stderr
    assert stages_run(done) - {"readme"} == {
        *("validate", "crane_train_modular@modular", "crane_tolerance_study", "crane_report"),
        *("crane_evaluate@modular", "crane_evaluate@modular_gauss_newton"),
        # any network
        *("crane_measured", "crane_error_budget", "crane_identify", "crane_adaptation"),
    }
    after = snapshot(copy)
    for name in ("rigid", "modular_selected"):
        kept = f"data/crane/networks/{name}.json"
        assert after[kept] == before[kept]


SECTION_OF = {
    "crane_train": "networks",
    "crane_select": "selected_networks",
    "crane_train_modular": "modular_networks",
    "crane_train_selected": "selected_networks",
    "crane_select_modular": "selected_modular_networks",
    "crane_train_selected_modular": "selected_modular_networks",
}


def trained_with(trainer):
    """Stages of the networks that `trainer` trains or is studied with."""
    return {
        f"{name}@{key}"
        for name, section in SECTION_OF.items()
        for key, network in CRANE[section].items()
        if trainer in (network["trainer"], network.get("select", network)["trainer"])
    }


JUDGED = {"crane_evaluate_none", *(f"crane_evaluate@{label}" for label in CRANE["methods"])}
WATCHING = [
    ({"trainers__study__n_iterations": 11}, {*trained_with("study"), "crane_fitting"}),
    ({"trainers__accelerated__mu": 0.02}, trained_with("accelerated")),
    ({"trainers__levenberg_marquardt__mu": 0.01}, trained_with("levenberg_marquardt")),
    ({"networks__rigid__seed": 2}, {"crane_train@rigid"}),
    (
        {"selected_networks__rigid_selected__seed": 2},
        {"crane_select@rigid_selected", "crane_train_selected@rigid_selected"},
    ),
    (
        {"selected_modular_networks__modular_selected__seed": 2},
        {f"crane_{job}_modular@modular_selected" for job in ("select", "train_selected")},
    ),
    ({"workspace__seed": 22}, {"crane_targets"}),
    (
        {"methods__direct__inversion__n_iterations": 501},
        {"crane_evaluate@direct", "crane_tolerance_study"},
    ),
    (
        {"measured__seed": 2},
        {"crane_measured", "crane_error_budget", "crane_identify"},
    ),
    ({"measured__source": "file"}, {"crane_measured", "crane_identify"}),
    ({"measured__budget__factor": 2.0}, {"crane_error_budget"}),
    ({"measured__adaptation__n_targets": 6}, {"crane_adaptation"}),
    ({"tolerance_study__tolerances": [1.0e-5]}, {"crane_tolerance_study"}),
    (
        {"evaluation__payloads": [120.0, 310.0]},
        {"crane_calibrate"},
    ),
]


WATCHING_ARM = [
    ({"networks__config2__seed": 2}, {"fanuc_train@config2", "fanuc_evaluate"}),
    ({"trainers__adam__beta_1": 0.8}, {"fanuc_train_workspace", "fanuc_evaluate"}),
    ({"study__n_restarts": 2}, {"fanuc_study"}),
    ({"path__seed": 2}, {"fanuc_generate", "fanuc_evaluate"}),
    ({"success__position": 0.002}, set()),
]


WATCHING_PLATE = [
    ({"networks__best__seed": 2}, {"smartee_train@best", "smartee_evaluate"}),
    ({"sizes__n_restarts": 3}, {"smartee_sizes"}),
    ({"starts__success": 1e-4}, {"smartee_starts"}),
    ({"poses__random__seed": 9}, {"smartee_generate@random", "smartee_evaluate"}),
    ({"outside__seed": 2}, {"smartee_evaluate"}),
]


def disjoint(entries):
    """Edits of one case in groups whose stages are all different: DVC takes seconds to look."""
    groups = []
    for values, stages in entries:
        for edits, seen in groups:
            if not seen & stages:
                edits.update(values)
                seen |= stages
                break
        else:
            groups.append((dict(values), set(stages)))
    return groups


def test_an_edited_section_is_noticed_by_the_stages_that_read_it(copy):
    original = (copy / PARAMETERS_FILE).read_text()
    cases = {"crane": WATCHING, "fanuc": WATCHING_ARM, "smartee": WATCHING_PLATE}
    by_case = [[(case, *group) for group in disjoint(own)] for case, own in cases.items()]
    # cases do not touch each other, so one edit of each is looked at together
    for together in itertools.zip_longest(*by_case):
        (copy / PARAMETERS_FILE).write_text(original)
        expected = {"validate"}
        for case, values, stages in filter(None, together):
            edit(copy, **{f"{case}__{key}": value for key, value in values.items()})
            expected |= {f"{case}_report", *stages}
        done = call(copy, "dvc", "status", "--json")
        assert done.returncode == 0, done.stderr
        assert set(json.loads(done.stdout)) == expected, together


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
        ("crane_train.py", "nothing", "crane: there is no network"),
        ("crane_select.py", "nothing", "crane: there is no network of selected size"),
        ("crane_select.py", "modular", "crane: there is no network of selected size"),
        ("crane_evaluate.py", "nothing", "crane.methods"),
        ("fanuc_train.py", "nothing", "fanuc: there is no network"),
        ("smartee_train.py", "nothing", "smartee.networks: there is no network"),
        ("smartee_generate.py", "nothing", "smartee.poses: there is no set"),
    ],
)
def test_an_unknown_name_is_told(copy, script, argument, named):
    before = snapshot(copy)
    done = stage(copy, script, argument)
    assert done.returncode == 1
    line = one_error(done)
    assert named in line and repr(argument) in line
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


def test_other_stages_do_not_depend_on_the_workers(project, copy):
    folder = "data/crane"
    made = {
        ("crane_targets.py",): ["targets.parquet"],
        ("crane_train.py", "modular"): ["networks/modular.json"],
        ("crane_select.py", "modular_selected"): ["size_selection/modular_selected.parquet"],
        ("crane_evaluate.py", "combined"): [
            *("evaluations/combined.parquet", "workspace/combined.parquet"),
        ],
    }
    for command, names in made.items():
        for name in names:
            (copy / folder / name).unlink()
        done = stage(copy, *command, FLEXIK_WORKERS="2")
        assert done.returncode == 0, done.stderr
        for name in names:
            path = Path(folder) / name
            assert (copy / path).read_bytes() == (project / path).read_bytes(), name


def test_networks_of_other_parameters_are_refused(copy):
    edit(copy, crane__networks__rigid__seed=2)
    before = snapshot(copy)
    for command in (("crane_train.py", "modular"), ("crane_evaluate.py", "modular")):
        done = stage(copy, *command)
        assert done.returncode == 1
        assert ".json: parameters_checksum is " in one_error(done)
    assert snapshot(copy) == before


def test_a_method_may_leave_the_workspace_out(copy):
    edit(copy, crane__methods__inverse__n_workspace_targets=0)
    done = stage(copy, "crane_evaluate.py", "inverse")
    assert done.returncode == 0, done.stderr
    path = copy / "data/crane/workspace/inverse.parquet"
    assert len(read_table(path, stored_fields(path))) == 0


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
    payload = {"minimum": 100.0, "maximum": 1.0e7, "increment": 9.9999e6}
    edit(copy, crane__grid__payload=payload, crane__fitting__payload=100.0)
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
