"""Samples of one's own: units and headers, what is refused, and a case that runs on them."""

import shutil

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
from flexik.planar.own_samples import read_own
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


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (in_other_units(samples()).drop(columns="tip_y m"), "expected a column tip_y with a unit"),
        (in_other_units(samples()).rename(columns={"tip_y m": "tip_y"}), "expected a unit at its"),
        (in_other_units(samples()).rename(columns={"tip_y m": "tip_y kg"}), "one of m, cm, mm"),
        (spoiled("tip_y m", "high"), "column tip_y m, row 4: expected a number"),
        (spoiled("tip_y m", np.nan), "column tip_y m, row 4: expected a number"),
        (spoiled("Boom stroke [mm]", 1500.0), "row 4: boom_stroke 1.5, expected 0 to 1.26"),
        (spoiled("tip_x (mm)", 15.0), r"row 4: the tip \(0\.015"),
    ],
)
def test_what_cannot_be_is_named(tmp_path, frame, message):
    path = tmp_path / "mine.csv"
    frame.to_csv(path, index=False)
    with pytest.raises(DataError, match=message) as raised:
        read_own(path, MACHINE, {"payload": "load on hook (t)"})
    assert str(raised.value).startswith(f"{path}")
    assert "\n" not in str(raised.value)


def test_a_column_map_that_names_nothing_and_no_file_are_said(tmp_path):
    path = tmp_path / "mine.csv"
    with pytest.raises(DataError, match="expected a CSV or Parquet table"):
        read_own(path, MACHINE, {})
    in_other_units(samples()).to_csv(path, index=False)
    with pytest.raises(DataError, match=r"expected a column 'load \(kg\)'"):
        read_own(path, MACHINE, {"payload": "load (kg)"})


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
        "conditions": {},
        "methods": {"none": {}},
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
            "conditions: expected",
        ),
        ("methods", {"none": {}, "combined": {"network": "deflection"}}, "conditions: expected"),
        ("samples", {"file": "mine.csv", "held_out_share": 0.9}, "leaves nothing to learn from"),
    ],
)
def test_what_needs_a_model_says_so(section, key, value, message):
    section[0]["params.yaml"]["excavator"][key] = value
    with pytest.raises(ParameterError, match=message):
        cases.load("excavator")
