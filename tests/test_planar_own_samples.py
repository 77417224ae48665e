"""Samples of one's own: units and headers, what is refused, and a case that runs on them."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from planar_machines import FILES, ROOT, general

from flexik.cases import case as cases
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import make
from flexik.datasets.tables import read_table
from flexik.errors import DataError, ParameterError
from flexik.machines.planar import read_machine
from flexik.planar.own_samples import divided, read_own
from flexik.planar.section import OwnSamples

MACHINE = read_machine(FILES["excavator"])
SI = ["boom_stroke", "stick_stroke", "payload", "tip_x", "tip_y"]


def samples(n=120):
    """Strokes, payload and a tip that sags by 10 mm a tonne."""
    manipulator = general("excavator")
    rng = np.random.default_rng(5)
    values = rng.uniform(manipulator.lower, manipulator.upper, (n, 2))
    payload = rng.uniform(0.0, 3000.0, n)
    tip = manipulator.forward(values) - 1e-5 * payload[:, None] * [0.0, 1.0]
    return pd.DataFrame(np.column_stack([values, payload, tip]), columns=SI)


def in_other_units(frame):
    return pd.DataFrame(
        {
            "No.": np.arange(len(frame)),
            "Boom stroke [mm]": 1e3 * frame["boom_stroke"],
            "stick_stroke_cm": 1e2 * frame["stick_stroke"],
            "load on hook (t)": 1e-3 * frame["payload"],
            "tip_x (mm)": 1e3 * frame["tip_x"],
            "tip_y m": frame["tip_y"],
        }
    )


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_units_and_headers_as_people_have_them(tmp_path, ending):
    given, path = samples(), tmp_path / f"mine.{ending}"
    other = in_other_units(given)
    other.to_csv(path, index=False) if ending == "csv" else other.to_parquet(path)
    found = read_own(path, MACHINE, {"payload": "load on hook (t)"})
    assert found[SI].to_numpy() == pytest.approx(given.to_numpy(), rel=1e-12, abs=1e-12)
    rigid = general("excavator").forward(given[SI[:2]].to_numpy())
    assert found[["rigid_x", "rigid_y"]].to_numpy() == pytest.approx(rigid, abs=1e-12)


def spoiled(column, value, row=3):
    frame = in_other_units(samples()).astype({column: object}) if column else None
    assert frame is not None
    frame.loc[row, column] = value
    return frame


TONNES = r"payload: expected kg, 2\.9\d* is nothing to a machine of 2480 \(2\.9\d* t would be 29"


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (in_other_units(samples()).drop(columns="tip_y m"), "expected a column tip_y with a unit"),
        (in_other_units(samples()).rename(columns={"tip_y m": "tip_y"}), "expected a unit at its"),
        (in_other_units(samples()).rename(columns={"tip_y m": "tip_y kg"}), "one of m, cm, mm"),
        (spoiled("tip_y m", "high"), "line 5, column tip_y m: expected a number, got 'high'"),
        (spoiled("tip_y m", np.nan), "line 5, column tip_y m: expected a number, got nothing"),
        (spoiled("Boom stroke [mm]", 1500.0), "line 5: boom_stroke: expected 0 to 1.26, got 1.5"),
        (spoiled("tip_x (mm)", 15.0), r"line 5: the tip \(0\.015"),
        (
            in_other_units(samples()).rename(columns={"load on hook (t)": "load on hook (kg)"}),
            TONNES,
        ),
        (spoiled("load on hook (t)", -1.0), "line 5: payload: expected 0 or more"),
    ],
)
def test_what_cannot_be_is_named(tmp_path, frame, message):
    path = tmp_path / "mine.csv"
    frame.to_csv(path, index=False)
    with pytest.raises(DataError, match=message) as raised:
        read_own(path, MACHINE, {"payload": next(name for name in frame if "load" in name)})
    assert str(raised.value).startswith(f"{path}")
    assert "\n" not in str(raised.value)


def test_a_column_map_that_names_nothing_and_no_file_are_said(tmp_path):
    path = tmp_path / "mine.csv"
    with pytest.raises(DataError, match="cannot be read"):
        read_own(path, MACHINE, {})
    path.write_text("")
    with pytest.raises(DataError, match="expected a CSV or Parquet table"):
        read_own(path, MACHINE, {})
    in_other_units(samples()).to_csv(path, index=False)
    with pytest.raises(DataError, match=r"expected a column 'load \(kg\)'"):
        read_own(path, MACHINE, {"payload": "load (kg)"})


def test_lines_are_those_of_the_file_with_its_blank_ones(tmp_path):
    path = tmp_path / "mine.csv"
    spoiled("tip_y m", "high", row=3).to_csv(path, index=False)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:2], "", *lines[2:], "", ""]))
    with pytest.raises(DataError, match="line 6, column tip_y m"):
        read_own(path, MACHINE, {"payload": "load on hook (t)"})
    path.write_text("\n".join([*lines[:2], "", *lines[2:4], "", ""]))
    assert len(read_own(path, MACHINE, {"payload": "load on hook (t)"})) == 3


def test_rows_of_one_pose_stay_together():
    poses = samples(40)
    frame = poses.loc[poses.index.repeat(5)].reset_index(drop=True)
    frame["payload"] = np.tile([0.0, 100.0, 200.0, 300.0, 400.0], 40)
    found = divided(frame, MACHINE, OwnSamples(file="mine.csv"))
    assert {name: len(rows) for name, rows in found.items()} == {
        "selection": 40,
        "held_out": 40,
        "grid": 120,
    }
    assert sorted(np.concatenate([*found.values()])) == list(range(200))
    strokes = {name: set(frame["boom_stroke"].iloc[rows]) for name, rows in found.items()}
    assert not strokes["grid"] & (strokes["held_out"] | strokes["selection"])


@pytest.fixture
def section(tmp_path, monkeypatch):
    """The excavator on samples of its own."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "data/machines", "data/machines")
    in_other_units(samples()).to_csv("mine.csv", index=False)
    given = yaml.safe_load((ROOT / "params.yaml").read_text())
    given["excavator"] = {
        "samples": {"file": "mine.csv", "columns": {"payload": "load on hook (t)"}, "seed": 3},
        "networks": {
            "deflection": {"learns": "deflection", "n_hidden": 3, "n_restarts": 2},
            "tip": {"learns": "tip", "n_hidden": 6, "n_restarts": 2},
        },
    }
    files = {"params.yaml": given}
    for file in (ROOT / "data/machines").glob("*.yaml"):
        files[f"data/machines/{file.name}"] = yaml.safe_load(file.read_text())
    monkeypatch.setattr(cases, "_read", lambda path: files[str(path)])
    return files, cases.load("excavator")


def test_a_case_runs_on_samples_of_its_own(section, tmp_path):
    given = section[1]
    assert isinstance(given.samples, OwnSamples)
    cases.check(given)
    for stage in ("generate", "train", "evaluate", "study"):
        folder = given.data / cases.STAGES[stage]
        make(folder, cases.parts(given, stage), ParallelSettings(n_workers=1))
    sets = {n: read_table(given.data / f"samples/{n}.parquet") for n in ("grid", "held_out")}
    assert (len(sets["grid"]), len(sets["held_out"])) == (72, 24)
    together = pd.concat([*sets.values(), read_table(given.data / "samples/selection.parquet")])
    assert len(together.drop_duplicates()) == 120  # divided, none twice
    errors = read_table(given.data / "errors/held_out/deflection.parquet")
    assert len(errors) == 24 and errors["error"].mean() < 5e-4  # of some 15 mm
    cases.module("general", "report").report(given)
    page = (tmp_path / "reports/excavator/README.md").read_text()
    assert "On 24 samples that no network saw, `deflection` is" in page
    assert "rigid kinematics alone are" in page


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "conditions",
            {"published": {"points": [[4, 1]], "payloads": [0]}},
            "conditions: expected none",
        ),
        ("methods", {"none": {}, "combined": {"network": "deflection"}}, "methods: expected none"),
        ("samples", {"file": "mine.csv", "held_out_share": 0.9}, "leaves nothing to learn from"),
    ],
)
def test_what_needs_a_model_says_so(section, key, value, message):
    section[0]["params.yaml"]["excavator"][key] = value
    with pytest.raises(ParameterError, match=message):
        cases.load("excavator")


def test_a_check_reads_the_samples_and_names_the_key(section):
    for spoil, message in (
        (lambda path: path.write_text("a,b\n1,2\n"), "expected a column boom_stroke with a unit"),
        (lambda path: path.unlink(), "mine.csv: cannot be read"),
    ):
        spoil(Path("mine.csv"))
        with pytest.raises(ParameterError, match=message) as raised:
            cases.check(section[1])
        assert str(raised.value).startswith("params.yaml: excavator.samples.file: mine.csv")
        assert "\n" not in str(raised.value)
