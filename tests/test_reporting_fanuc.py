"""The report of the six-joint arm: its numbers, notes and files follow from the results."""

import dataclasses
import importlib.util
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fanuc_arm import ARM

from flexik.datasets.fanuc.samples import taught_path
from flexik.datasets.fanuc.tables import COMMANDED, JOINTS, joint_columns
from flexik.errors import DataError
from flexik.evaluation.fanuc.errors import workspace_errors
from flexik.kinematics.fanuc import configuration
from flexik.kinematics.serial_arm import forward
from flexik.parameters import overlay, read_yaml, validate
from flexik.reporting.fanuc import figures, notes, tables
from flexik.reporting.fanuc.report import metrics, write_report
from flexik.reporting.fanuc.results import EXACT, LOOKED_UP, WHOLE, Results

ROOT = Path(__file__).parents[1]
SMALL = {
    "path": {"n_training": 80, "n_test": 20},
    "off_path": {"distances": [0.0, 0.02]},
    "workspace": {"n_targets": 5},
    "study": {"n_hidden": [2, 5], "learning_factors": [0.1]},
}


@pytest.fixture(scope="module")
def fanuc():
    return validate(overlay(read_yaml(ROOT / "params.yaml"), {"fanuc": SMALL})).fanuc


def study_frame():
    rows = [
        ("n_hidden", 2.0, 0, 9.0, 10.0, 9, "iterations"),
        ("n_hidden", 2.0, 1, 3.0, 4.0, 9, "iterations"),
        ("n_hidden", 2.0, 2, 5.0, 6.0, 8, "iterations"),
        ("n_hidden", 5.0, 0, 1.0, 1.0, 9, "iterations"),
        ("n_hidden", 5.0, 1, 2.0, 3.0, 2, "non_finite"),
        ("learning_factor", 0.1, 0, 2.0, 2.0, 9, "iterations"),
        ("learning_factor", 0.3, 0, 40.0, 40.0, 0, "line_search"),
    ]
    names = ("varied", "value", "restart", "training_percent", "error_percent", "kept")
    names = (*names, "stop_reason")
    return pd.DataFrame(rows, columns=names)


def curves_frame(fanuc):
    """Joint 1 is below 5 % after the first pass and comes back."""
    rows = [
        (name, restart, joint, k, error, 1.5 * error)
        for name in fanuc.networks
        for restart in range(3)
        for joint in range(1, 7)
        for k, error in enumerate((0.5, 0.04, 0.3 if joint == 1 else 0.04, 0.03))
    ]
    names = ("network", "restart", "joint", "iteration", "training_error", "test_error")
    return pd.DataFrame(rows, columns=names)


def starts_frame(fanuc):
    """The median start has the error of the commanded joints, the others 0.2 % to either side."""
    errors = zip(fanuc.networks, (1.0, 2.0, 0.1, 0.2), strict=True)
    rows = [
        (name, restart, joint, error * factor, 3, int(restart == 0))
        for name, error in errors
        for restart, factor in enumerate((1.0, 0.8, 1.2))
        for joint in range(1, 7)
    ]
    names = ("network", "restart", "joint", "error_percent", "kept", "is_median")
    return pd.DataFrame(rows, columns=names)


def off_path_frame(fanuc, success):
    rows = []
    for name in [*fanuc.networks, *LOOKED_UP, WHOLE]:
        for n_steps in range(4):
            for distance in (0.0, 0.02):
                n = 20 if distance == 0.0 else 18
                factor = 0.5 if name == "interpolated" else 1.0
                error = factor * 0.01 * (1 + 100 * distance) / 1000**n_steps
                rows += [(name, distance, n_steps, error, error, 1)] * n
    rows += [(EXACT, 0.0, 0, 0.0, 0.0, 1)] * 20 + [(EXACT, 0.02, 0, 0.0, 0.0, 1)] * 18
    names = ("method", "distance", "n_steps", "position_error", "orientation_error")
    return pd.DataFrame(rows, columns=(*names, "within_limits")).assign(in_configuration=1)


def workspace_frame():
    rows = [
        (WHOLE, number, n_steps, 0.1 / 100**n_steps, 0.1 / 100**n_steps, 1)
        for n_steps in range(4)
        for number in range(8)
        for _ in range(5)
    ]
    rows += [(EXACT, number, 0, 3e-16, 0.0, 1) for number in range(8) for _ in range(5)]
    names = ("method", "configuration", "n_steps", "position_error", "orientation_error")
    frame = pd.DataFrame(rows, columns=(*names, "within_limits"))
    frame = frame.assign(in_configuration=1, singular=0)
    return frame.assign(singular_value=np.tile([0.0, 0.005, 0.02, 0.2, 0.4], len(frame) // 5))


@pytest.fixture(scope="module")
def results(fanuc):
    path = taught_path(ARM, fanuc.path)
    position = forward(ARM, path.joints).position
    columns = {"share": path.share, **joint_columns(path.joints)}
    columns |= {name: position[:, k] for k, name in enumerate("xyz")}
    table = pd.DataFrame(columns)
    test, joints = table[path.is_test], path.joints[path.is_test]
    frames = []
    methods = [*fanuc.networks, *LOOKED_UP, WHOLE, EXACT]
    number = configuration(ARM, joints)
    for name, error in zip(methods, (1, 2, 0.1, 0.2, 3, 0.15, 5, 0), strict=True):
        commanded = joints + 0.01 * error * np.ptp(path.joints, axis=0)
        frame = pd.DataFrame(
            {
                "share": test["share"].to_numpy(),
                **joint_columns(joints),
                **joint_columns(commanded, COMMANDED),
                **workspace_errors(ARM, forward(ARM, joints), number, commanded),
            }
        )
        frames.append(frame.assign(method=name))
    empty = [None] * 6
    return Results(
        fanuc=fanuc,
        training=table[~path.is_test],
        test=test,
        curves=curves_frame(fanuc),
        starts=starts_frame(fanuc),
        study=study_frame(),
        path_errors=pd.concat(frames, ignore_index=True),
        off_path=off_path_frame(fanuc, None),
        workspace=workspace_frame(),
        published=pd.DataFrame(
            {"joint": range(1, 7), "config1": empty, "config2": empty}, dtype=float
        ),
        times=pd.DataFrame(
            {
                "method": [WHOLE, "opw"],
                "microseconds_single": [40.0, 5.0],
                "microseconds_batched": [1.5, 9.0],
            }
        ),
        growth=pd.DataFrame(
            columns=[*tables.GROWTH_NAMES],
        ),
    )


def test_total_errors_are_shares_of_the_range(results):
    for name, percent in zip(results.networks, (1.0, 2.0, 0.1, 0.2), strict=True):
        assert results.error_percents[name] == pytest.approx(np.full(6, percent))
    table = tables.total_errors(results)
    assert table["config2 (%)"].tolist() == ["2 (1.6 to 2.4)"] * 7
    assert table["interpolated (%)"].tolist() == pytest.approx([0.15] * 7)
    assert table["joint"].tolist() == [1, 2, 3, 4, 5, 6, "mean"]


def test_what_is_not_published_is_marked_and_what_is_stands_beside(results):
    table = tables.total_errors(results)
    assert set(table["config1 published"]) == {tables.NOT_AVAILABLE}
    known = results.published.copy()
    known.loc[known["joint"] == 3, "config1"] = 4.5
    table = tables.total_errors(dataclasses.replace(results, published=known))
    assert table["config1 published"].tolist() == [
        *([tables.NOT_AVAILABLE] * 2),
        *(4.5, tables.NOT_AVAILABLE, tables.NOT_AVAILABLE, tables.NOT_AVAILABLE),
        # no mean of some
        tables.NOT_AVAILABLE,
    ]


@pytest.mark.parametrize("value", ["-1", "101"])
def test_published_values_must_be_percentages(tmp_path, monkeypatch, value):
    spec = importlib.util.spec_from_file_location("stage", ROOT / "stages/fanuc_report.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    path = tmp_path / "total_errors.csv"
    monkeypatch.setattr(module, "PUBLISHED", path)
    path.write_text("joint,config1,config2\n1,3.5,\n2,,0\n")
    assert module.published()["config1"].tolist()[0] == 3.5
    path.write_text(f"joint,config1,config2\n1,3.5,\n2,,{value}\n")
    with pytest.raises(DataError, match=rf"config2, joint 2: expected 0 to 100 %, got {value}"):
        module.published()


def test_metrics_have_the_names_others_look_for(results):
    found = metrics(results)
    for name in ("config1", "config2"):
        for joint in range(1, 7):
            value = found[f"{name}.joint{joint}_error_percent"]
            assert value == pytest.approx(1.0 if name == "config1" else 2.0)
        assert found[f"{name}.mean_position_error_mm"] > 0.0
        assert found[f"{name}.mean_orientation_error_deg"] > 0.0
    assert found[f"{WHOLE}_refined_1.mean_position_error_mm"] == pytest.approx(1.0)
    assert found[f"{WHOLE}.mean_orientation_error_deg"] == pytest.approx(5.7296)
    assert found[f"{EXACT}.success_percent"] == 100.0
    assert found["config1.least_mean_error_percent"] == pytest.approx(0.8)
    for name in results.of_path:
        assert found[f"path.{name}.mean_position_error_mm"] > 0.0
    assert found[f"path.{WHOLE}.mean_position_error_mm"] != found[f"{WHOLE}.mean_position_error_mm"]
    assert found[f"random_poses.{EXACT}.success_percent"] == 100.0
    assert found["off_path.n_targets"] == 38 and found["off_path.n_left_out"] == 2
    json.dumps(found, allow_nan=False)


def test_passes_are_counted_to_where_the_error_stays_below(results):
    table = tables.passes(results)
    assert table["config1 to 5 %"].tolist() == [3, 1, 1, 1, 1, 1]
    assert table["config1 to 2 %"].isna().all()
    assert "passes 3 to 3) the test error of a joint is 1.50 to 1.50" in notes.passes(results)[1]
    # one start of three never stays below: the median does; two of three: it does not
    for restarts, expected in (([2], 1), ([1, 2], None)):
        curves = results.curves.copy()
        last = (curves["iteration"] == 3) & (curves["joint"] == 4)
        curves.loc[last & curves["restart"].isin(restarts), "training_error"] = 0.9
        table = tables.passes(dataclasses.replace(results, curves=curves))
        assert table["config1 to 5 %"].tolist()[3] == expected


def test_the_study_shows_median_and_spread(results):
    table = tables.study(results, "n_hidden")
    assert table["hidden neurons"].tolist() == [2, 5]
    assert table["median total error (%)"].tolist() == [6.0, 2.0]
    assert table["largest (%)"].tolist() == [10.0, 3.0]
    text = " ".join(notes.study(results, "n_hidden"))
    assert "hidden neurons 5, the edge of what was tried" in text
    assert "hidden neurons 5: 1 of 2 trainings ended early (non_finite), weights kept of" in text
    text = " ".join(notes.study(results, "learning_factor"))
    assert "learning factor 0.3: 1 of 1 trainings ended early (error beyond all numbers)" in text


def test_notes_of_the_two_configurations_follow_the_errors(results):
    text = " ".join(notes.total_errors(results))
    assert "every start of config1 is the more precise." in text
    assert "config1 is the more precise for 6, every start of config2 for 0 of 6 joints" in text
    assert "the networks of config1 (1 % (0.8 to 1.2)) and another trainer" in text
    assert "to 5 % config1 needs fewer for 0, config2 for 0 of 6 joints" in text
    other = results.starts.copy()
    other["network"] = other["network"].replace({"config1": "config2", "config2": "config1"})
    text = " ".join(notes.total_errors(dataclasses.replace(results, starts=other)))
    assert "config1 2 % (1.6 to 2.4), config2 1 % (0.8 to 1.2): every start of config2" in text
    other = results.starts.copy()
    some = (other["network"] == "config2") & (other["restart"] == 1) & (other["joint"] < 4)
    other.loc[some, "error_percent"] = 0.01
    text = " ".join(notes.total_errors(dataclasses.replace(results, starts=other)))
    assert "the ranges overlap" in text and "config1 is the more precise for 3" in text


def test_targets_left_out_are_told(results):
    text = " ".join(notes.off_path(results))
    assert "2 targets at 20 mm are left out" in text
    assert "config1_refined_3: reaches all targets up to 20 mm" in text
    far = results.off_path.copy()
    far.loc[(far["distance"] > 0.0) & (far["method"] == "config1"), "within_limits"] = 0
    text = " ".join(notes.off_path(dataclasses.replace(results, off_path=far)))
    assert "config1_refined_3: reaches all targets up to 0 mm" in text
    success = tables.off_path_success(results).set_index("method")
    assert success.loc["config1"].tolist() == [0.0, 0.0]
    assert success.loc["config1_refined_3"].tolist() == [100.0, 100.0]


def test_networks_are_compared_with_what_needs_none(results):
    text = " ".join(notes.path_errors(results))
    assert "interpolated: mean position error" in text
    assert "better than 3 of 4 networks of the path (config1, config2, config2_lev" in text
    text = " ".join(notes.off_path(results))
    assert "config1 at 0 of 2 distances; config2 at 0 of 2" in text
    frame = results.off_path.copy()
    frame.loc[(frame["method"] == "config2") & (frame["distance"] == 0.0), "position_error"] = 0.0
    text = " ".join(notes.off_path(dataclasses.replace(results, off_path=frame)))
    assert "config2 at 1 of 2 distances (0 mm)" in text


def test_another_configuration_than_asked_for_does_not_count(results):
    frame = results.workspace.copy()
    frame.loc[(frame["configuration"] == 3) & (frame["n_steps"] == 3), "in_configuration"] = 0
    changed = dataclasses.replace(results, workspace=frame)
    assert changed.on_targets[f"{WHOLE}_refined_3"]["success_rate"] == 0.875
    text = " ".join(notes.whole_workspace(changed))
    assert "whole_workspace_refined_2 0.00 %, whole_workspace_refined_3 12.50 %" in text


def test_a_distance_without_targets_leaves_cells_empty(results, tmp_path):
    frame = results.off_path[results.off_path["distance"] == 0.0]
    alone = dataclasses.replace(results, off_path=frame)
    text = " ".join(notes.off_path(alone))
    assert "20 targets at 20 mm are left out" in text and "at 20 mm from the path" not in text
    tables.write_tables(alone, tmp_path)
    assert "20 mm" in (tmp_path / "off_path.md").read_text()
    figures._off_path(alone)
    assert tables.off_path_success(alone)["20 mm"].isna().all()


def test_every_number_of_steps_and_networks_has_a_line_of_its_own(results):
    names = [*results.networks, *LOOKED_UP, WHOLE, EXACT]
    assert len({tuple(figures._line(results, name).values()) for name in names}) == len(names)
    fanuc = results.fanuc
    more = fanuc.model_copy(
        update={"refinement": fanuc.refinement.model_copy(update={"n_steps": 7})}
    )
    steps = [results.workspace.assign(n_steps=k) for k in range(8)]
    frame = pd.concat(each[each["method"] == WHOLE] for each in steps)
    frame = pd.concat([frame, results.workspace[results.workspace["method"] == EXACT]])
    changed = dataclasses.replace(results, fanuc=more, workspace=frame)
    axes = figures._whole_workspace(changed).axes[0]
    lines = [line for line in axes.lines if line.get_label() != "counts as reached"]
    assert len(lines) == 9 and len({str(line.get_color()) for line in lines}) == 9


def test_times_stand_beside_the_methods_they_were_measured_for(results):
    table = tables.whole_workspace(results).set_index("method")
    assert table.loc[WHOLE, "single (us)"] == 40.0
    assert np.isnan(table.loc[EXACT, "single (us)"])
    assert table.loc["opw", "batched (us)"] == 9.0
    assert np.isnan(table.loc["opw", "mean position (mm)"])


def test_poses_are_counted_by_how_singular_they_are(results):
    frame = results.workspace.copy()
    frame.loc[(frame["singular_value"] < 0.01) & (frame["method"] == WHOLE), "within_limits"] = 0
    table = tables.conditioning(dataclasses.replace(results, workspace=frame))
    assert table["poses"].tolist() == [16, 8, 0, 8, 8]
    assert table["smallest singular value (m)"].iloc[[0, -1]].tolist() == ["0 to 0.01", "over 0.3"]
    after = table[f"{WHOLE}_refined_3"]
    assert after.iloc[[0, 1, 3, 4]].tolist() == [0.0, 100.0, 100.0, 100.0]
    assert np.isnan(after.iloc[2]) and table[EXACT].iloc[0] == 100.0


@pytest.mark.parametrize(
    ("value", "power"), [(0.0, 1e-9), (3e-16, 1e-9), (2e-5, 1e-4), (0.5, 1.0), (20.0, 100.0)]
)
def test_round_off_is_told_by_a_power_of_ten(value, power):
    assert notes._power_above(value) == pytest.approx(power)


def test_the_report_is_whole_linked_and_the_same_again(results, tmp_path):
    published = tmp_path / "total_errors.csv"
    published.write_text("joint,config1,config2\n")
    for folder in ("one", "other"):
        write_report(results, tmp_path / folder, [published])
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.*"))
    page = (tmp_path / "one/README.md").read_text()
    for file in files:
        one, other = (tmp_path / folder / file for folder in ("one", "other"))
        assert one.read_bytes() == other.read_bytes(), file
        if file.suffix in (".csv", ".png"):
            assert f"({file.as_posix()})" in page, file
    assert len([file for file in files if file.suffix == ".png"]) == 10
    assert "not available" in page and " nan " not in page
    assert JOINTS[0] not in page
