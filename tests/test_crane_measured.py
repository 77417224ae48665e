"""Stages of the measured crane and what the report says of it."""

import dataclasses
import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane_measured.own import own_campaign
from flexik.errors import DataError, ParameterError
from flexik.evaluation.conditions import all_conditions
from flexik.kinematics.crane import forward, inverse_with_smallest_extension, pose
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import equilibrium
from flexik.multibody.crane_measured.as_built import Magnitudes, as_built_tips, draw_twin
from flexik.parameters import load_parameters
from flexik.parameters.measured import Misjudged
from flexik.positioning.crane.assembly import uncompensated
from flexik.positioning.method import PositioningError
from flexik.reporting.crane_measured import deviations, identification
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
        update={
            "n_cranes": 1,
            "n_measurements": [3, 6],
            "n_targets": 4,
            "misjudged": Misjudged(share=0.3, n_measurements=[6]),
            **changes,
        }
    )
    return crane.measured.model_copy(update={"adaptation": adaptation})


class NoDeflection:
    """Stands for a trained network."""

    def predict(self, values):
        """Nothing bends."""
        return np.zeros((len(values), 2))


def study_of(stage, measured, nominal):
    method = uncompensated(nominal.geometry)
    return stage.Study(measured, nominal, NoDeflection(), {"first": method, "second": method})


def test_errors_of_a_crane_as_built_are_those_of_its_tips(crane, nominal):
    stage = script("crane_adaptation")
    measured = small(crane)
    study = study_of(stage, measured, nominal)
    table = stage.errors_of(study, 2)
    kinds = [("first", 0), ("second", 0), ("adapted", 3), ("adapted", 6), ("misjudged", 6)]
    found = list(zip(table["method"], table["n_measurements"], strict=True))
    assert found == [kind for kind in kinds for _ in range(4)]
    assert (table["twin"] == 2).all()
    pd.testing.assert_frame_equal(table, stage.errors_of(study, 2))
    assert not np.allclose(table["error"], stage.errors_of(study, 3)["error"])

    # without repeatability the unadapted errors follow from the strokes of the rigid inverse
    still = measured.model_copy(
        update={"deviations": measured.deviations.model_copy(update={"repeatability": 0.0})}
    )
    table = stage.errors_of(dataclasses.replace(study, measured=still), 2)
    targets = table[:4][["target_x", "target_y"]].to_numpy()
    strokes = inverse_with_smallest_extension(nominal.geometry, targets).strokes
    magnitudes = Magnitudes(**still.deviations.model_dump())
    twin = draw_twin(nominal, magnitudes, still.adaptation.seed + 2)
    tips = as_built_tips(twin, strokes, table["payload"].to_numpy()[:4])
    expected = np.linalg.norm(tips - targets, axis=1)
    np.testing.assert_allclose(table["error"][:4], expected, atol=1e-9)
    np.testing.assert_allclose(table["error"][4:8], expected, atol=1e-9)


def test_an_area_out_of_reach_is_told(crane, nominal):
    stage = script("crane_adaptation")
    study = study_of(stage, small(crane, x=(6.3, 7.0)), nominal)
    with pytest.raises(ParameterError, match=r"crane\.measured\.adaptation: the crane reaches"):
        stage.errors_of(study, 0)


def test_a_target_that_is_not_reached_is_told(crane, nominal):
    stage = script("crane_adaptation")
    study = study_of(stage, small(crane), nominal)

    class Fails:
        def __call__(self, targets, payload, initial):
            command = study.baselines["first"](targets, payload, initial)
            return dataclasses.replace(command, status=command.status + 3)

    conditions = stage.drawn(study, 2, np.random.default_rng(0))
    twin = draw_twin(nominal, Magnitudes(*[0.0] * 8), 0)
    with pytest.raises(PositioningError, match="2 targets are not reached, the first is"):
        stage.approached(Fails(), conditions, study, twin, np.random.default_rng(0))


def test_the_budget_has_every_deviation_alone_and_larger():
    stage = script("crane_error_budget")
    given = Magnitudes(1e-3, 2e-3, 3e-4, 0.3, 4e-3, 5e-4, 0.03, 0.05)
    cases = stage.cases(given, 3.0, 2)
    by_kind = {(case.deviation, case.factor): case.magnitudes for case in cases}
    assert len(cases) == 2 * len(by_kind) == 2 * (2 + 2 * 7)
    assert [case.twin for case in cases] == [0, 1] * len(by_kind)
    assert by_kind["all", 1.0] == given
    assert by_kind["none", 1.0] == Magnitudes(*[0.0] * 8)
    assert by_kind["play", 0.0] == Magnitudes(0, 0, 3e-4, 0.3, 0, 0, 0, 0)
    assert by_kind["length", 0.0] == Magnitudes(0, 2e-3, 0, 0, 0, 0, 0, 0)
    assert by_kind["length", 3.0] == dataclasses.replace(given, length=3 * 2e-3)
    assert ("play_spread", 0.0) not in by_kind


def test_the_budget_counts_errors_from_targets_and_from_the_reference(crane, nominal):
    stage = script("crane_error_budget")
    conditions = all_conditions(POINTS, [0.0, 172.0])
    strokes = inverse_with_smallest_extension(nominal.geometry, conditions.targets).strokes
    study = stage.Study(nominal, conditions, {"none": strokes, "combined": strokes}, 0.0, 5)
    (case,) = (c for c in stage.cases(Magnitudes(*[0.0] * 8), 3.0, 1) if c.deviation == "none")
    table = stage.errors_of(study, case)
    tips = np.array(
        [equilibrium(nominal, *row).tip for row in zip(strokes, conditions.payload, strict=True)]
    )
    expected = np.linalg.norm(tips - conditions.targets, axis=1)
    np.testing.assert_allclose(table["error"], np.tile(expected, 2), atol=1e-7)
    moved = np.linalg.norm(tips - np.repeat(tips[::2], 2, axis=0), axis=1)
    np.testing.assert_allclose(table["reference_error"], np.tile(moved, 2), atol=1e-7)


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


def budget(nominal):
    """Three cranes; compensation makes the second point worse on two of them."""
    rows = campaign(nominal)
    tables = []
    for twin, off in enumerate((0.009, 0.011, 0.012)):
        spoilt = (rows["method"] == "combined") & (rows["target_y"] == POINTS[1, 1])
        table = rows[["method", "target_x", "target_y", "payload"]].assign(
            deviation="all",
            factor=1.0,
            twin=twin,
            error=np.where(spoilt, off, np.where(rows["method"] == "none", 0.010, 0.002)),
        )
        table["reference_error"] = table["error"] - 0.001
        tables.append(table)
    given = pd.concat(tables)
    larger = [
        given.assign(deviation=name, factor=3.0, reference_error=times * given["reference_error"])
        for name, times in (("play", 1.5), ("repeatability", 2.0))
    ]
    # without deviations the network's error makes the second point worse
    perfect = given.assign(deviation="none")
    spoilt = (perfect["method"] == "combined") & (perfect["target_y"] == POINTS[1, 1])
    for name in ("error", "reference_error"):
        perfect[name] = perfect[name].where(~spoilt, 0.02)
    return pd.concat([perfect, given, *larger])


@pytest.fixture
def measured(crane, nominal):
    adaptation = pd.DataFrame(
        {
            "method": ["combined_selected", "adapted"] * 2,
            "twin": [0, 0, 1, 1],
            "n_measurements": [0, 9, 0, 9],
            "error": [0.01, 0.002, 0.03, 0.004],
        }
    )
    nothing = pd.DataFrame()
    return measured_report.Measured(
        crane.measured, campaign(nominal), budget(nominal), adaptation, *[nothing] * 3, {}
    )


def test_the_jib_cylinder_pushes_where_the_flexible_crane_says_so(measured, nominal):
    strokes, pushes = measured_report.jib_pushes(measured, nominal)
    expected = [
        any(
            equilibrium(nominal, row, payload).forces["jib_cylinder"] < 0.0
            for payload in (0.0, 172.0)
        )
        for row in strokes
    ]
    assert pushes.tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_points_are_told_by_angle_force_and_share(measured, nominal):
    table = deviations.point_table(measured.budget, nominal)
    poses = pose(
        nominal.geometry, inverse_with_smallest_extension(nominal.geometry, POINTS).strokes
    )
    lean = np.degrees(poses.jib_angle) + 90.0
    np.testing.assert_allclose(table["jib from vertical (deg)"], lean)
    assert (lean < 0).tolist() == [True, True, False]
    np.testing.assert_allclose(table["worse with (%)"], [0, 200 / 3, 0])
    np.testing.assert_allclose(table["R without (mm)"], 10.0)
    np.testing.assert_allclose(table["R with (mm)"], [2, 32 / 3, 2])
    np.testing.assert_allclose(table["R with a load, from reference (mm)"], [1, 29 / 3, 1])
    first, turned, second, perfect = deviations.point_notes(table)
    assert "in point 2, play changes sides" in turned
    assert "lies 9.7 mm from the point of reference, elsewhere 1.0 mm" in turned
    assert "beyond the vertical in points 1 and 2, in the thesis in points 2 and 3" in first
    assert "it pushes in point 2 (172 kg); elsewhere" in first
    assert "here, from either: 2: 67 % and 67 %; 3: 0 % and 0 %. The remark is not rep" in second
    assert perfect.endswith("the shares are 2: 100 % and 100 %; 3: 0 % and 0 %.")


def test_the_budget_names_what_matters_most(measured):
    note = deviations.sensitivity_note(measured.budget, 4.7)
    rows = measured.budget.query("deviation == 'all' and method == 'combined'")
    given = 1e3 * rows["reference_error"].mean()
    assert f"is {given:.1f} mm over these cranes and 4.7 mm" in note
    assert f"repeatability matters most for it: 3 times as large, it makes {2 * given:.1f}" in note
    table = deviations.budget_table(measured.budget)
    assert table["deviation"].tolist() == [
        "none",
        "all",
        "all, joint play x 3",
        "all, repeatability x 3",
    ]
    note = deviations.spread_note(measured.budget)
    assert "Mean R of 3 cranes whose deviations" in note
    assert "without 10.0 (10.0 to 10.0); with 4.9 (4.3 to 5.3)" in note


def test_metrics_are_means_over_all(measured):
    found = measured_report.metrics(measured)
    assert found["measured.none.mean_error_mm"] == pytest.approx(10.0)
    assert found["measured.combined.mean_error_mm"] == pytest.approx((2 + 2 + 12) / 3, abs=1e-3)
    # from the point reached with 0 kg and compensation: 8, 2 and 8 mm without, none with it
    assert found["measured.reference.none.mean_error_mm"] == pytest.approx(6.0)
    assert found["measured.reference.combined.mean_error_mm"] == pytest.approx(0.0)
    assert found["measured.unadapted.combined_selected.mean_error_mm"] == pytest.approx(20.0)
    assert found["measured.adapted_9.mean_error_mm"] == pytest.approx(3.0)
    assert found["measured.cranes.none.mean_error_mm"] == pytest.approx(10.0)
    assert not [name for name in found if "prediction" in name]
    unknown = measured.campaign.assign(target_x=np.nan, target_y=np.nan, method="")
    found = measured_report.metrics(dataclasses.replace(measured, campaign=unknown))
    assert "measured.none.mean_error_mm" not in found
    assert "measured.adapted_9.mean_error_mm" in found


OFFSETS = pd.DataFrame(
    {
        "offset": ["lift_pivot_x", "spring"],
        "unit": ["m", "1"],
        "expected": 0.0,
        "expected_deviation": [3e-4, 0.05],
        "identified": [1e-4, 0.1],
        "deviation": [1e-4, 0.02],
    }
)


def test_measurements_that_stand_out_are_named():
    table = pd.DataFrame(
        {
            "line": [7, 8, 9],
            "payload": [0.0, 86.0, 172.0],
            "measured_x": [3.0, 3.1, 3.2],
            "measured_y": 1.0,
            "nominal_error": [0.001, 0.3, 0.02],
            "adapted_error": [0.001, 0.3, np.nan],
            "surprise": [1.0, 30.0, 1.0],
            "left_out_surprise": [1.0, 40.0, np.nan],
            "used": [1, 0, 1],
        }
    )
    first, second = identification.prediction_notes(table, OFFSETS)
    assert first.startswith("1 of 3 measurements stand out")
    assert first.endswith("8 (40, 86 kg, 3.100, 1.000 m).")
    assert second == "Measurements with too few others to be predicted from: 1."
    (note,) = identification.prediction_notes(table[:1], OFFSETS)
    assert note == "No measurement stands out from what the others say."
    rows = identification.prediction_table(table)
    assert rows["measurements"].tolist() == [3, 2]
    np.testing.assert_allclose(rows["max (mm)"], [300, 300])
    assert identification.prediction_table(table[2:])["crane"].tolist() == ["nominal"]


def test_what_does_not_fit_is_told():
    table = pd.DataFrame({"left_out_surprise": [4.0] * 9, "surprise": 1.0, "used": 1})
    table["adapted_error"] = 0.001
    far = OFFSETS.assign(identified=[-30e-4, 0.1])
    _, poor, away = identification.prediction_notes(table, far)
    assert "measurements lie 3.4 times as far" in poor
    assert away.endswith("makes too: lift_pivot_x (10).")


HEAD = "method,target_x_m,target_y_m,payload_kg,measured_x_m,measured_y_m"
ROWS = [
    f"{method},3.8,0.95,{load},3.79,0.94" for method in ("none", "combined") for load in (0, 86)
]


def own(tmp_path, head=HEAD, rows=ROWS):
    file = tmp_path / "own.csv"
    file.write_text("\n".join([head, *rows]) + "\n")
    return file


def test_an_own_campaign_may_leave_out_strokes_or_targets(nominal, tmp_path):
    table = own_campaign(str(own(tmp_path)), nominal.geometry)
    assert table[list(STROKES)].isna().all(axis=None)
    assert table["target_x"].tolist() == [3.8] * 4
    head = "payload_kg,measured_x_m,measured_y_m,lift_stroke_m,jib_stroke_m,extension_stroke_m"
    tip = ",".join(
        f"{value:.4f}" for value in forward(nominal.geometry, np.array([[0.3, 0.4, 0.5]]))[0]
    )
    file = own(tmp_path, head, ["# a comment", f"0,{tip},0.3,0.4,0.5"])
    table = own_campaign(str(file), nominal.geometry)
    assert table[["target_x", "target_y"]].isna().all(axis=None)
    assert table["method"].tolist() == [""]
    assert table["line"].tolist() == [3]
    assert table[list(STROKES)].to_numpy().tolist() == [[0.3, 0.4, 0.5]]
    file = own(tmp_path, head, ["0,3.79,0.94,0.3,0.4,0.5"])
    with pytest.raises(DataError, match=r"own.csv, line 2: expected a point within 0.5 m of where"):
        own_campaign(str(file), nominal.geometry)


def test_an_own_campaign_that_cannot_be_is_told(nominal, tmp_path):
    strokes = ",lift_stroke_m,jib_stroke_m,extension_stroke_m"
    rows = [f"{row},0.3,0.4,-0.5" for row in ROWS]
    file = own(tmp_path, HEAD + strokes, rows)
    with pytest.raises(
        DataError, match=r"own.csv, line 2: extension_stroke -0.5 m, expected 0 to 1.6 m"
    ):
        own_campaign(str(file), nominal.geometry)
    file = own(tmp_path, rows=[row.replace("3.8,0.95", "8.2,0.95") for row in ROWS])
    file.write_text(file.read_text().replace("3.79", "8.19"))
    with pytest.raises(
        DataError, match=r"own.csv, line 2: the rigid crane does not reach .*\(8.2, 0.95\)"
    ):
        own_campaign(str(file), nominal.geometry)
