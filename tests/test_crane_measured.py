"""Stages of the measured crane and what the report says of it."""

import dataclasses
import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.crane.grid import STROKES
from flexik.errors import DataError, ParameterError
from flexik.mechanisms.crane import forward, inverse_with_smallest_extension
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import equilibrium
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.positioning.crane.assembly import uncompensated
from flexik.positioning.method import PositioningError
from flexik.reporting.crane_measured import report as measured_report

ROOT = Path(__file__).parents[1]
SPRING = 8.45e6  # N m/rad
POINTS = np.array([[2.2, 0.95], [2.2, 0.15], [3.8, 0.95]])


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "stages" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def crane():
    return load_parameters(ROOT / "params.yaml").crane


@pytest.fixture(scope="module")
def nominal(crane):
    return flexible_crane(crane, SPRING)


def small(crane, **changes):
    adaptation = crane.measured.adaptation.model_copy(
        update={"n_cranes": 1, "n_measurements": [3, 6], "n_targets": 4, **changes}
    )
    return crane.measured.model_copy(update={"adaptation": adaptation})


class NoDeflection:
    """Stands for a trained network."""

    def predict(self, values):
        """Nothing bends."""
        return np.zeros((len(values), 2))


def test_errors_of_a_crane_as_built_are_those_of_its_tips(crane, nominal):
    stage = script("crane_adaptation")
    measured = small(crane)
    study = stage.Study(measured, nominal, NoDeflection(), uncompensated(nominal.geometry))
    table = stage.errors_of(study, 2)
    assert table["n_measurements"].tolist() == [0] * 4 + [3] * 4 + [6] * 4
    assert (table["twin"] == 2).all()
    pd.testing.assert_frame_equal(table, stage.errors_of(study, 2))
    assert not np.allclose(table["error"], stage.errors_of(study, 3)["error"])

    # without repeatability the unadapted errors follow from the strokes of the rigid inverse
    still = measured.model_copy(
        update={"deviations": measured.deviations.model_copy(update={"repeatability": 0.0})}
    )
    study = dataclasses.replace(study, measured=still)
    table = stage.errors_of(study, 2)[:4]
    targets = table[["target_x", "target_y"]].to_numpy()
    strokes = inverse_with_smallest_extension(nominal.geometry, targets).strokes
    magnitudes = Magnitudes(**still.deviations.model_dump())
    twin = draw_twin(nominal, magnitudes, still.adaptation.seed + 2)
    tips = as_built_tips(twin, strokes, table["payload"].to_numpy())
    expected = np.linalg.norm(tips - targets, axis=1)
    np.testing.assert_allclose(table["error"], expected, atol=1e-9)


def test_an_area_out_of_reach_is_told(crane, nominal):
    stage = script("crane_adaptation")
    study = stage.Study(
        small(crane, x=(6.3, 7.0)), nominal, NoDeflection(), uncompensated(nominal.geometry)
    )
    with pytest.raises(ParameterError, match=r"crane\.measured\.adaptation: the crane reaches"):
        stage.errors_of(study, 0)


def test_a_target_that_is_not_reached_is_told(crane, nominal):
    stage = script("crane_adaptation")
    study = stage.Study(small(crane), nominal, NoDeflection(), uncompensated(nominal.geometry))

    class Fails:
        def __call__(self, targets, payload, initial):
            command = study.compensator(targets, payload, initial)
            return dataclasses.replace(command, status=command.status + 3)

    conditions = stage.drawn(study, 2, np.random.default_rng(0))
    twin = draw_twin(nominal, Magnitudes(*[0.0] * 8), 0)
    with pytest.raises(PositioningError, match="2 targets are not reached, the first is"):
        stage.approached(Fails(), conditions, study, twin, np.random.default_rng(0))


def campaign(nominal, payloads=(0.0, 172.0)):
    """Reached points 10 mm off without compensation, 2 mm with it, but for the second point."""
    rows = []
    strokes = inverse_with_smallest_extension(nominal.geometry, POINTS).strokes
    for method, error in (("none", 0.010), ("combined", 0.002)):
        for number, (point, row) in enumerate(zip(POINTS, strokes, strict=True)):
            for payload in payloads:
                off = 0.012 if method == "combined" and number == 1 else error
                rows.append([method, *point, payload, *row, point[0] - off, point[1]])
    columns = ["method", "target_x", "target_y", "payload", *STROKES, "measured_x", "measured_y"]
    return pd.DataFrame(rows, columns=columns)


@pytest.fixture
def measured(crane, nominal):
    table = pd.DataFrame(
        {"twin": [0, 0, 1, 1], "n_measurements": [0, 9, 0, 9], "error": [0.01, 0.002, 0.03, 0.004]}
    )
    return measured_report.Measured(crane.measured, campaign(nominal), table, {})


def test_the_jib_cylinder_pushes_where_the_flexible_crane_says_so(measured, nominal):
    push = measured_report.pushes(measured, nominal)
    rows = measured.campaign[measured.campaign["method"] == "none"]
    expected = [
        equilibrium(nominal, row[list(STROKES)].to_numpy(dtype=float), row["payload"]).forces[
            "jib_cylinder"
        ]
        < 0.0
        for _, row in rows.iterrows()
    ]
    assert push["pushes"].tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_notes_name_the_points(measured, nominal):
    (note,) = measured_report.point_notes(measured, nominal)
    assert "pushes in point 2 (with 172 kg), elsewhere it pulls" in note
    assert note.endswith("does not help in point 2.")


def test_metrics_are_means_over_all(measured):
    found = measured_report.metrics(measured)
    assert found["measured.none.mean_error_mm"] == pytest.approx(10.0)
    assert found["measured.combined.mean_error_mm"] == pytest.approx((2 + 2 + 12) / 3, abs=1e-3)
    # from the point reached with 0 kg and compensation: 8, 2 and 8 mm without, none with it
    assert found["measured.reference.none.mean_error_mm"] == pytest.approx(6.0)
    assert found["measured.reference.combined.mean_error_mm"] == pytest.approx(0.0)
    assert found["measured.adapted_0.mean_error_mm"] == pytest.approx(20.0)
    assert found["measured.adapted_9.mean_error_mm"] == pytest.approx(3.0)


HEAD = "method,target_x_m,target_y_m,payload_kg,measured_x_m,measured_y_m"
ROWS = [
    f"{method},3.8,0.95,{load},3.79,0.94" for method in ("none", "combined") for load in (0, 86)
]


def own(tmp_path, head=HEAD, rows=ROWS):
    file = tmp_path / "own.csv"
    file.write_text("\n".join([head, *rows]) + "\n")
    return file


def test_strokes_of_an_own_campaign_may_be_left_out(nominal, tmp_path):
    stage = script("crane_measured")
    table = stage.own_campaign(str(own(tmp_path)), nominal.geometry)
    tip = forward(nominal.geometry, table[list(STROKES)].to_numpy())
    np.testing.assert_allclose(tip, [[3.8, 0.95]] * 4, atol=1e-9)


def test_an_own_campaign_that_cannot_be_is_told(nominal, tmp_path):
    stage = script("crane_measured")
    strokes = ",lift_stroke_m,jib_stroke_m,extension_stroke_m"
    rows = [f"{row},0.3,0.4,-0.5" for row in ROWS]
    file = own(tmp_path, HEAD + strokes, rows)
    with pytest.raises(DataError, match=r"own.csv: extension_stroke -0.5 m, expected 0 to 1.6 m"):
        stage.own_campaign(str(file), nominal.geometry)
    file = own(tmp_path, rows=[row.replace("3.8,0.95", "8.2,0.95") for row in ROWS])
    file.write_text(file.read_text().replace("3.79", "8.19"))
    with pytest.raises(DataError, match=r"own.csv: the rigid crane does not reach .*\(8.2, 0.95\)"):
        stage.own_campaign(str(file), nominal.geometry)
    head = "payload_kg,measured_x_m,measured_y_m" + strokes
    file = own(tmp_path, head, ["0,3.79,0.94,0.3,0.4,0.5"])
    with pytest.raises(DataError, match=r"own.csv: the tables of errors need method, target_x"):
        stage.own_campaign(str(file), nominal.geometry)
