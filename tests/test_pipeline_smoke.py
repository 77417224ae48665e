"""The whole pipeline on the smoke profile: what it leaves."""

import itertools
import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from smoke_pipeline import CRANE, FANUC, ROOT, SMARTEE

from flexik.datasets.crane.evaluations import TARGET_FIELDS, TOLERANCE_FIELDS
from flexik.datasets.crane.grid import FIELDS
from flexik.datasets.tables import read_table, stored_fields
from flexik.learning.storage import load_network
from flexik.kinematics.crane import forward

METHODS = ("none", *CRANE["methods"])
STATISTICS = (
    *("mean_error_mm", "max_error_mm", "mean_abs_dx_mm", "mean_abs_dy_mm"),
    *("max_abs_dx_mm", "max_abs_dy_mm", "workspace_mean_error_mm", "workspace_max_error_mm"),
)
# Targets of the workspace that the smoke profile gives a method
N_TARGETS = {label: 5 if label == "combined_ga" else 40 for label in METHODS}

# one process, which makes the project once
pytestmark = pytest.mark.xdist_group("pipeline")


def test_metrics_hold_every_number_by_its_name(project):
    metrics = json.loads((project / "reports/crane/metrics.json").read_text())
    for method in METHODS:
        for name in STATISTICS:
            value = metrics[f"{method}.{name}"]
            assert isinstance(value, float) and math.isfinite(value) and value >= 0
        assert metrics[f"{method}.mean_error_mm"] <= metrics[f"{method}.max_error_mm"]
        assert metrics[f"{method}.max_abs_dx_mm"] <= metrics[f"{method}.max_error_mm"]
        mean, most = (metrics[f"{method}.workspace_{name}_error_mm"] for name in ("mean", "max"))
        assert mean <= most
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


def test_every_method_has_its_conditions_and_targets(project):
    folder = project / "data/crane"
    targets = read_table(folder / "targets.parquet", TARGET_FIELDS)
    assert len(targets) == 40
    for method in METHODS:
        for place, n in (("evaluations", 6), ("workspace", N_TARGETS[method])):
            path = folder / place / f"{method}.parquet"
            table = read_table(path, stored_fields(path))
            assert len(table) == n
            if place == "workspace":
                asked = ["target_x", "target_y", "payload"]
                assert np.array_equal(table[asked], targets[asked].head(n))
    assert {path.stem for path in (folder / "workspace").glob("[!.]*")} == set(METHODS)


def test_the_tolerance_study_has_a_row_for_every_method_and_tolerance(project):
    table = read_table(project / "data/crane/tolerance_study.parquet", TOLERANCE_FIELDS)
    methods = CRANE["tolerance_study"]["methods"]
    expected = list(itertools.product(methods, (1e-4, 1e-5)))
    assert list(zip(table["method"], table["tolerance"], strict=True)) == expected
    # a search that goes on for longer has a smaller tolerance
    steps = table["mean_iterations"].to_numpy().reshape(len(methods), 2)
    assert (steps[:, 0] <= steps[:, 1]).all()


def test_modular_networks_are_their_rigid_network_and_more(project):
    for section in ("modular_networks", "selected_modular_networks"):
        for name, given in CRANE[section].items():
            files = [project / f"data/crane/networks/{n}.json" for n in (name, given["rigid"])]
            joined, rigid = (load_network(file)[0] for file in files)
            assert joined.n_hidden > rigid.n_hidden
            assert [quantity.name for quantity in joined.outputs] == ["tip_x", "tip_y"]


def test_tables_and_figures_are_there_and_linked(project):
    folder = project / "reports/crane"
    tables = ("positioning_errors", "calibration", "mesh_study", "workspace", "tolerance_study")
    for name in tables:
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
    tables = "".join(path.read_text() for path in folder.glob("positioning_errors*.md"))
    assert all(method in tables for method in METHODS)
    # the README shows the table that was just made
    assert table.strip().splitlines()[-1] in (project / "README.md").read_text()


def test_the_report_of_the_arm_is_there_with_its_metrics(project):
    folder = project / "reports/fanuc"
    metrics = json.loads((folder / "metrics.json").read_text())
    assert all(isinstance(v, int | float) and math.isfinite(v) for v in metrics.values())
    for name in FANUC["networks"]:
        for joint in range(1, 7):
            assert metrics[f"{name}.joint{joint}_error_percent"] > 0.0
        assert metrics[f"{name}.mean_position_error_mm"] > 0.0
        assert metrics[f"{name}.mean_orientation_error_deg"] > 0.0
    # whatever the networks learnt
    assert metrics["closed_form.max_position_error_mm"] == 0.0
    assert metrics["closed_form.success_percent"] == 100.0
    page = (folder / "README.md").read_text()
    assert "not available" in page and "Not measured with these settings" in page
    for figure in (folder / "figures").iterdir():
        assert figure.read_bytes().startswith(b"\x89PNG")
        assert f"figures/{figure.name}" in page


def test_the_report_of_the_plate_is_there_with_its_metrics(project):
    folder = project / "reports/smartee"
    metrics = json.loads((folder / "metrics.json").read_text())
    assert all(isinstance(v, int | float) and math.isfinite(v) for v in metrics.values())
    for name in SMARTEE["networks"]:
        for key in ("peak_elbow_rad", "peak_position_mm", "peak_orientation_rad"):
            assert metrics[f"{name}.{key}"] > 0.0
    assert metrics["newton2.peak_elbow_rad"] < metrics["newton1.peak_elbow_rad"]
    # whatever the networks learnt
    assert metrics["newton.random_n_failed"] == 0
    page = (folder / "README.md").read_text()
    # the benchmark was run with other parameters
    assert "No times" in page
    for figure in (folder / "figures").iterdir():
        assert figure.read_bytes().startswith(b"\x89PNG")
        assert f"figures/{figure.name}" in page


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
