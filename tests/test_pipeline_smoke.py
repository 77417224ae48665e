"""The whole pipeline on the smoke profile: what it leaves."""

import json
import math
import os
import sys
from pathlib import Path

import pytest
from smoke_pipeline import PARAMETERS, ROOT

from flexik.cases.case import STAGES
from flexik.datasets.tables import read_table

# one process, which makes the project once
pytestmark = pytest.mark.xdist_group("pipeline")

each_case = pytest.mark.parametrize("case", list(PARAMETERS["cases"]))


def metrics(project, case):
    return json.loads((project / "reports" / case / "metrics.json").read_text())


@each_case
def test_metrics_are_numbers_by_name(project, case):
    found = metrics(project, case)
    assert len(found) > 20
    assert all(isinstance(v, int | float) and math.isfinite(v) for v in found.values())


@each_case
def test_every_part_has_its_record_and_nothing_unfinished_is_left(project, case):
    data = project / "data" / case
    for folder in STAGES.values():
        files = [path for path in (data / folder).rglob("*") if path.is_file()]
        recorded = {
            path.with_name(name)
            for path in files
            if path.suffix == ".part"
            for name in json.loads(path.read_text())["files"]
        }
        assert recorded == {path for path in files if path.suffix != ".part"}
    hidden = [*(project / "data").rglob(".*"), *(project / "reports").rglob(".*")]
    assert not [path for path in hidden if path.name != ".gitignore"]


@each_case
def test_every_named_network_and_method_has_its_files(project, case):
    data = project / "data" / case
    networks = {path.stem for path in (data / "networks").rglob("*.part")}
    assert set(PARAMETERS[case]["networks"]) <= networks
    errors = {path.stem for path in (data / "errors").rglob("*.part")}
    assert set(PARAMETERS[case]["methods"]) <= errors


@each_case
def test_tables_and_figures_are_there_and_on_the_page(project, case):
    folder = project / "reports" / case
    page = (folder / "README.md").read_text()
    figures = sorted((folder / "figures").glob("*.png"))
    assert len(figures) >= 3
    for figure in figures:
        assert figure.read_bytes().startswith(b"\x89PNG")
        assert figure.stat().st_size > 5000
        assert f"figures/{figure.name}" in page
    tables = sorted(folder.rglob("*.md"))
    for table in tables:
        if table.name != "README.md":
            assert table.with_suffix(".csv").is_file()
            assert table.relative_to(folder).with_suffix(".csv").as_posix() in page


def test_the_crane_is_calibrated_and_compensated(project):
    found = metrics(project, "crane")
    for method in ("none", *PARAMETERS["crane"]["methods"]):
        assert found[f"{method}.mean_error_mm"] <= found[f"{method}.max_error_mm"]
        mean, most = (found[f"{method}.workspace_{name}_error_mm"] for name in ("mean", "max"))
        assert mean <= most
    assert found["combined.mean_error_mm"] < found["none.mean_error_mm"]
    assert found["grid.n_samples"] == 144
    assert found["grid.n_failed"] == 0


def test_methods_under_the_same_conditions_get_the_same_queries(project):
    folder = project / "data/crane/errors"
    asked = ["target_x", "target_y", "payload"]
    for conditions in ("published", "workspace"):
        tables = [read_table(path) for path in (folder / conditions).glob("[a-z]*.parquet")
                  if path.suffixes == [".parquet"]]  # fmt: skip
        longest = max(tables, key=len)[asked]
        assert all(table[asked].equals(longest.head(len(table))) for table in tables)


def test_exact_methods_are_exact_whatever_the_networks_learnt(project):
    six_joints, plate = metrics(project, "fanuc"), metrics(project, "smartee")
    assert six_joints["closed_form.max_position_error_mm"] == 0.0
    assert six_joints["closed_form.success_percent"] == 100.0
    assert plate["newton2.peak_elbow_rad"] < plate["newton1.peak_elbow_rad"]
    assert plate["newton.random_n_failed"] == 0


def test_the_readme_shows_the_tables_just_made(project):
    table = (project / "reports/crane/positioning_errors.md").read_text()
    rows = [line for line in table.splitlines() if line.startswith("| mean R")]
    assert rows
    assert rows[0] in (project / "README.md").read_text()


def test_reports_say_nothing_of_the_machine(project):
    places = {str(project), str(project.parent), str(ROOT), str(Path.home()), sys.prefix}
    files = [path for path in (project / "reports").rglob("*") if path.is_file()]
    for path in [*files, project / "README.md"]:
        content = path.read_bytes()
        for place in places - {"/"}:
            assert place.encode() not in content, f"{path} contains {place}"
        assert os.uname().nodename.encode() not in content or len(os.uname().nodename) < 6
