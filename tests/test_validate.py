"""The stage that looks at params.yaml before any other."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry, check_assembly
from flexik.parameters import load_parameters

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "params.yaml").write_text((ROOT / "params.yaml").read_text())
    shutil.copytree(ROOT / "data/reference", tmp_path / "data/reference")
    return tmp_path


def change(folder, *path_and_value, case="crane"):
    data = yaml.safe_load((folder / "params.yaml").read_text())
    section = data[case]
    *path, last, value = path_and_value
    for name in path:
        section = section[name]
    section[last] = value
    (folder / "params.yaml").write_text(yaml.safe_dump(data))


def validate(folder, *arguments):
    return subprocess.run(
        [sys.executable, ROOT / "stages/validate.py", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )


def test_valid_parameters_pass_and_leave_a_constant_file(folder):
    assert validate(folder, "--check").returncode == 0
    assert not (folder / "data/validated.txt").exists()
    assert validate(folder).returncode == 0
    before = (folder / "data/validated.txt").read_bytes()
    change(folder, "grid", "minimum_tip_x", 0.1)
    assert validate(folder).returncode == 0
    assert (folder / "data/validated.txt").read_bytes() == before


@pytest.mark.parametrize(
    ("where", "key"),
    [
        (("evaluation", "points", [[4.0, 1.0], [9.0, 9.0]]), "crane.evaluation.points.1"),
        (("geometry", "jib_cylinder_length", 0.2), "crane.geometry: the linkage does not close"),
        (("geometry", "stroke_maximum", [0.535, 1.5, 1.6]), "crane.geometry: the linkage"),
        (("structure", "beams", "lift", "span", [0.0, 2.9]), "structure.beams.lift.span.1"),
        (("structure", "rocker", "centre_of_mass", 5.0), "structure.rocker.centre_of_mass"),
        (("methods", "combined", "network", "foo"), "crane.methods.combined.network"),
        (("methods", None), "crane.methods"),
        (("foo", 1), "crane.foo"),
        (("trainers", "study", "mu", 1e11), "crane.trainers.study.mu: must not exceed"),
        (("networks", "rigid", "trainer", "foo"), "crane.networks.rigid.trainer"),
        (("modular_networks", "modular", "rigid", "foo"), "crane.modular_networks.modular.rigid"),
        (("tolerance_study", "methods", ["inverse"]), "crane.tolerance_study.methods.0"),
        (
            ("structure", "beams", "jib", "section", "data/nosuch.csv"),
            "crane.structure.beams.jib.section: section table data/nosuch.csv",
        ),
    ],
)
def test_a_mistake_is_one_line_that_names_the_key(folder, where, key):
    change(folder, *where)
    done = validate(folder)
    assert done.returncode == 1
    assert key in done.stderr
    assert "Traceback" not in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (folder / "data/validated.txt").exists()


def test_results_of_names_that_are_gone_are_removed(folder):
    crane = load_parameters(folder / "params.yaml").crane
    data = folder / "data/crane"
    labels = ("none", *crane.methods)
    kept = [data / f"{place}/{m}.parquet" for place in ("evaluations", "workspace") for m in labels]
    for name in crane.all_networks:
        kept += [data / f"networks/{name}.json", data / f"networks/{name}_training.csv"]
    for name in crane.studies:
        kept += [data / f"size_selection/{name}.json", data / f"size_selection/{name}.parquet"]
    stale = [
        *(data / f"{place}/gone.parquet" for place in ("evaluations", "workspace")),
        *(data / "networks" / name for name in ("gone.json", "gone_training.csv")),
        # of a network whose size is given
        *(data / "size_selection" / f"rigid.{end}" for end in ("json", "parquet")),
    ]
    for path in (*kept, *stale):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    done = validate(folder)
    assert done.returncode == 0, done.stderr
    assert all(path.exists() for path in kept) and not any(path.exists() for path in stale)
    assert done.stdout.count("removing") == len(stale)
    assert "data/crane/workspace/gone.parquet" in done.stdout


def test_linkage_closes_over_the_strokes(geometry):
    check_assembly(geometry)
    longer = CraneGeometry(**{**vars(geometry), "stroke_maximum": (0.535, 1.5, 1.6)})
    with pytest.raises(ParameterError, match="jib stroke of"):
        check_assembly(longer)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        (("joints", 4, "d", 0.1), "fanuc.joints: the closed form needs d5 = 0, got 0.1"),
        (("joints", 0, "alpha", 1.0), "fanuc.joints: the closed form needs alpha1 = +-pi/2"),
        (("path", "n_via_points", 2), "fanuc.path.n_via_points: "),
        (
            ("path", "region", 3, [-6.28, 6.28]),
            "fanuc.path: the path of seed 1 leaves limits of J4",
        ),
    ],
)
def test_a_mistake_about_the_arm_is_one_line(folder, where, message):
    change(folder, *where, case="fanuc")
    done = validate(folder)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: params.yaml: {message}")


def test_networks_of_the_arm_that_are_gone_are_removed(folder):
    kept = [folder / "data/fanuc/networks/config1/joints_1.json"]
    kept += [folder / "data/fanuc/curves/config1.parquet"]
    stale = [folder / "data/fanuc/networks/gone/joints_1.json"]
    stale += [folder / "data/fanuc/curves/gone.parquet"]
    for path in (*kept, *stale):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    done = validate(folder)
    assert done.returncode == 0, done.stderr
    assert all(path.exists() for path in kept) and not any(path.exists() for path in stale)
    assert not stale[0].parent.exists() and done.stdout.count("removing") == len(stale)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        (("geometry", "plate_radius", 0.3), "smartee.poses.dense: the legs do not reach 4000 of"),
        (("workspace", "centre", [0.0, 0.0, 0.3]), "smartee.poses.dense: the legs do not reach"),
        (("geometry", "first_link", 0.0), "smartee.geometry.first_link: "),
        (("networks", "network", "poses", "gone"), "smartee.networks.network.poses: there is no"),
    ],
)
def test_a_mistake_about_the_plate_is_one_line(folder, where, message):
    change(folder, *where, case="smartee")
    done = validate(folder)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: params.yaml: {message}")


def test_results_of_the_plate_that_are_gone_are_removed(folder):
    kept = [folder / "data/smartee/networks/best.json", folder / "data/smartee/poses/dense.parquet"]
    stale = [folder / "data/smartee/networks/gone_training.csv"]
    stale += [folder / "data/smartee/poses/gone.parquet"]
    for path in (*kept, *stale):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    done = validate(folder)
    assert done.returncode == 0, done.stderr
    assert all(path.exists() for path in kept) and not any(path.exists() for path in stale)
    assert done.stdout.count("removing") == len(stale)
