"""The report of the SmartEE from errors of known size: every number follows from the data."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from smartee_case import small

from flexik.datasets.smartee.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    POSE_FIELDS,
    corner_poses,
    draw,
    geometry_of,
    inputs_of,
    path_name,
    path_poses,
)
from flexik.errors import DataError
from flexik.evaluation.smartee.errors import (
    CORNERS,
    OUTSIDE,
    error_table,
    newton_table,
    outside_poses,
)
from flexik.kinematics.smartee import closure_jacobian, elbow_circles, leg_tip_velocities, leg_tips
from flexik.kinematics.smartee_newton import newton_steps
from flexik.reporting.smartee import notes, start_study, tables
from flexik.reporting.smartee.draws import draws
from flexik.reporting.smartee.report import metrics, write_report
from flexik.reporting.smartee.results import Results, current

SMARTEE = small(
    path={"n_samples": [20]},
    starts={"n_starts": 2, "trainers": ["regularised_cg", "unpenalised_cg"]},
)
GEOMETRY = geometry_of(SMARTEE)
# every elbow of a network is off by this, rad
OFF = {"network": 1e-3, "best": 1e-4, "centre": 0.1, "previous": 1e-2}


def elbow_errors() -> pd.DataFrame:
    sets = {name: draw(SMARTEE, name) for name in ("validation", "random")}
    sets |= {
        OUTSIDE: outside_poses(SMARTEE)[:2],
        CORNERS: corner_poses(SMARTEE),
        path_name(20): path_poses(SMARTEE, 20),
    }
    frames = []
    for poses_name, (poses, joints) in sets.items():
        for method, off in OFF.items():
            if method == "previous" and poses_name != path_name(20):
                continue
            for n_steps in range(7 if method == "centre" else 3):
                start = joints[..., 2] + off
                elbows = newton_steps(GEOMETRY, joints[..., :2], start, n_steps)
                label = (method, n_steps, poses_name)
                frames.append(error_table(SMARTEE, label, poses, joints, elbows))
    return pd.concat(frames, ignore_index=True)


def start_rows() -> pd.DataFrame:
    rows = []
    for trainer, spread, error in (
        *(("regularised_cg", "near", 4e-6), ("regularised_cg", "far", 2e-6)),
        *(("unpenalised_cg", "near", 2e-6), ("unpenalised_cg", "far", 4e-5)),
    ):
        for start in range(2):
            success = 5 if error < 1e-5 else -1
            rows.append((trainer, spread, start, error, 60, success, 6e-3, "iterations"))
    names = ("trainer", "spread", "start", "error", "n_iterations", "success_iteration", "judged")
    return pd.DataFrame(rows, columns=[*names, "stop_reason"])


@pytest.fixture(scope="module")
def results() -> Results:
    poses, joints = draw(SMARTEE, "random")
    values = np.column_stack([poses, inputs_of(joints[..., :2]), joints[..., 2]])
    names = [field.name for field in (*POSE_FIELDS, *ACTUATED_FIELDS, *ELBOW_FIELDS)]
    validation = draw(SMARTEE, "validation")
    sizes = {"n_hidden": [10, 20], "training_error": [2e-3, 1e-3], "selection_error": [3e-3, 2e-3]}
    published = {
        "quantity": ["elbow", "position", "orientation"],
        "unit": ["rad", "mm", "rad"],
        "peak": [3e-3, 0.2, 5e-3],
    }
    training = {"network": ["network"], "restart": [0], "trainer": ["regularised_cg"]}
    training |= {"stop_reason": ["goal"]}
    times = {
        "trainer": ["regularised_cg"] * 2 + ["unpenalised_cg"] * 2,
        "spread": ["near", "far"] * 2,
        "n_starts": [4] * 4,
        "long_factor": [10] * 4,
        "seconds": [0.25] * 4,
        "long_seconds": [2.0] * 4,
        "long_error": [1e-6, 1e-6, 1e-6, 3e-5],
    }
    pairs = (
        start_rows()
        .query("spread == 'far'")
        .replace({"regularised_cg": "0.0001, 0.03", "unpenalised_cg": "0.001, 0.3"})
    )
    query = {
        "method": ["network", "centre", "centre"],
        "n_steps": [2, 1, -1],
        "microseconds_single": [120.0, 80.0, 400.0],
        "microseconds_batched": [1.5, 0.5, 4.0],
    }
    return Results(
        smartee=SMARTEE,
        errors=elbow_errors(),
        newton=pd.concat(
            [
                newton_table(SMARTEE, "validation", *validation),
                newton_table(SMARTEE, "random", poses, joints),
                newton_table(SMARTEE, OUTSIDE, *outside_poses(SMARTEE)[:2]),
            ]
        ),
        starts=start_rows(),
        sensitivity=pairs,
        linear_error=9e-4,
        sizes=pd.DataFrame(sizes | {"worst_selection_error": [4e-3, 3e-3]}),
        sizes_beside=pd.DataFrame(sizes | {"worst_selection_error": [5e-3, 4e-3]}),
        training=pd.DataFrame(training),
        random=pd.DataFrame(values, columns=names),
        published=pd.DataFrame(published).set_index("quantity"),
        query_times=pd.DataFrame(query),
        training_times=pd.DataFrame(times),
    )


def test_peaks_stand_beside_the_published_ones_in_their_units(results):
    table = tables.peaks(results).set_index("error")
    elbow = table.loc["elbow (mrad)"]
    assert elbow["published"] == pytest.approx(3.0)
    assert elbow["network"] == pytest.approx(np.sqrt(3.0), rel=1e-9)
    assert elbow["best mean"] == pytest.approx(0.1 * np.sqrt(3.0), rel=1e-9)
    position = results.of("network", 0, "validation")["position_error"]
    assert table.loc["position (mm)", "network"] == pytest.approx(1e3 * position.max())
    assert metrics(results)["network.peak_position_mm"] == pytest.approx(
        1e3 * position.max(), rel=1e-3
    )


def test_verdicts_follow_the_data(results):
    met, ten_times = notes.peak_notes(results)[:2]
    assert "`network` against the published peaks: meets all three" in met
    assert "`best` against the published peaks over 10: meets all three" in ten_times
    strict = results.published.assign(peak=[1e-3, 0.2, 5e-3])
    met, ten_times = notes.peak_notes(replace(results, published=strict))[:2]
    assert "misses elbow (1.73)" in met
    assert "misses elbow (0.17)" in ten_times


def test_what_newton_steps_come_to_is_told(results):
    text = " ".join(notes.direct_notes(results))
    two = results.peak("network", 2, "random", "elbow")
    assert f"{two:.1e} rad over the random ones; 1e-09 rad is reached" in text
    assert "120 us alone and 1.5 us in a batch" in text
    worse = results.errors.copy()
    rows = (worse["method"] == "network") & (worse["n_steps"] == 2)
    worse.loc[rows, "elbow_error"] = 1e-8
    no_times = results.query_times.iloc[:0]
    text = " ".join(notes.direct_notes(replace(results, errors=worse, query_times=no_times)))
    assert "1e-09 rad is missed" in text
    assert "No times: the benchmark was run with other parameters." in text


def test_the_claim_about_starts_is_told_as_it_came_out(results):
    text = " ".join(start_study.start_notes(results))
    assert "Starts near: the penalty raises the median error, 2.00 times that without" in text
    assert "Starts far: the penalty lowers the median error, 0.05 times that without" in text
    assert "100 % of the starts succeed with it, 0 % without" in text
    assert "All 8 runs ended at their number of iterations, which is a cap" in text
    assert "regularised_cg 1.0, unpenalised_cg 30.0" in text
    assert "medians of 4 starts, which are few" in text
    assert "settings that differ: penalty (0.0001 and 1e-30)." in text
    assert "`regularised_cg` were searched for" in text and "plateau" not in text.split("cap")[0]
    assert "these do not: unpenalised_cg (far)" in text
    stuck = results.starts.assign(stop_reason="stationary")
    assert "is a cap" not in " ".join(start_study.start_notes(replace(results, starts=stuck)))
    flat = replace(results, linear_error=2.1e-6)
    assert "unpenalised_cg (near) ends on a plateau" in " ".join(start_study.start_notes(flat))
    assert "regularised_cg (near) ends on" not in " ".join(start_study.start_notes(results))
    table = start_study.starts(results).set_index(["trainer", "start"])
    assert table.loc[("unpenalised_cg", "far"), "success (%)"] == 0.0
    assert table.loc[("unpenalised_cg", "far"), "to success"] == ""


def test_ways_to_the_elbows_have_errors_and_times(results):
    table = tables.direct_kinematics(results)
    known = table.set_index(["start", "Newton steps"])
    assert known.loc[("network", "0"), "validation"] == f"{1e-3 * np.sqrt(3):.2e}"
    assert known.loc[("network", "2"), "single (us)"] == 120.0
    assert np.isnan(known.loc[("network", "1"), "single (us)"])
    # a step from the previous pose costs one from the centre, and cannot be batched
    assert known.loc[("previous", "1"), "single (us)"] == 80.0
    assert np.isnan(known.loc[("previous", "1"), "batched (us)"])
    assert known.loc[("centre", "until converged"), "random"] == "< 1e-12"


def test_condition_numbers_are_those_of_the_jacobian(results):
    _, joints = draw(SMARTEE, "random")
    circles = elbow_circles(GEOMETRY, joints[..., :2])
    tips = leg_tips(circles, joints[..., 2])
    jacobian = closure_jacobian(tips, leg_tip_velocities(circles, joints[..., 2]))
    largest = max(np.linalg.cond(one) for one in jacobian)
    assert results.condition_numbers().max() == pytest.approx(largest, rel=1e-9)


def test_errors_outside_are_sorted_by_extent(results):
    table = tables.outside(results)
    assert table["extent"].tolist()[0] == "0 to 1"
    assert len(table) == 5
    # the same in every stretch, because every elbow is off by the same
    assert table["network median (mrad)"].to_numpy() == pytest.approx(np.sqrt(3.0), rel=1e-6)


def crafted(results):
    """Newton beyond the box: right, at wrong elbows, out of steps after many, of other branch."""
    rows = results.newton[results.newton["poses"] == OUTSIDE].iloc[:4].copy()
    rows["extent"], rows["status"], rows["n_steps"] = 0.5, [0, 0, 1, 3], [5, 7, 50, 60]
    rows["elbow_error"] = [1e-9, 0.2, 0.3, 3.0]
    return replace(results, newton=rows)


def test_what_newton_finds_is_right_when_its_elbows_are(results):
    own = crafted(results)
    assert tables.outside(own)["Newton from the centre right (%)"][0] == 25.0
    (row,) = tables.newton(own).to_dict("records")
    assert (row["converged"], row["not converged"], row["other branch"]) == (2, 1, 1)
    assert (row["to wrong elbows"], row["mean steps"], row["most steps"]) == (1, 6.0, 7)
    found = metrics(own)
    assert (found["newton.outside_n_failed"], found["newton.outside_n_wrong"]) == (3, 1)
    assert "Converged to wrong elbows: 1 of outside." in " ".join(notes.newton_notes(own))


def test_fixed_steps_that_go_wrong_are_counted(results):
    errors = results.errors.copy()
    table = results.of("network", 2, OUTSIDE)
    assert results.n_wrong(2, OUTSIDE) == (0, 0, 0)
    for k, (error, status) in enumerate(((0.2, 1), (0.2, 0), (1e-9, 1), (np.nan, 2))):
        errors.loc[table.index[k], ["elbow_error", "status"]] = error, status
    own = replace(results, errors=errors)
    assert own.n_wrong(2, OUTSIDE) == (3, 1, 1)
    found = metrics(own)
    assert (found["newton2.outside_n_failed"], found["newton2.outside_n_unnoticed"]) == (3, 1)
    assert "3 wrong, of which 2 are noticed" in " ".join(notes.outside_notes(own))


def test_draws_tell_how_often_the_goals_are_met(results):
    table = draws(results).set_index(["network", "error"])
    # every elbow is off by the same, so every draw has the same peak
    assert table.loc[("network", "elbow (mrad)"), "median"] == pytest.approx(np.sqrt(3.0))
    assert table.loc[("network", "elbow (mrad)"), "meets (%)"] == 100.0
    errors = results.errors.copy()
    row = results.of("network", 0, "random").index[0]
    errors.loc[row, "elbow_error"] = 1.0
    share = draws(replace(results, errors=errors)).set_index(["network", "error"])["meets (%)"]
    # 12 draws of 12 miss one with (11 / 12)^12
    assert share["network", "elbow (mrad)"] == pytest.approx(100 * (11 / 12) ** 12, abs=4.0)
    assert share["network", "all three"] == share["network", "elbow (mrad)"]


def test_success_is_counted_at_every_threshold(results):
    table = start_study.thresholds(results).set_index(["trainer", "start"])
    assert table.columns.tolist() == [f"{t} (%)" for t in ("2e-05", "1e-05", "5e-06", "2e-06")]
    assert table.loc[("regularised_cg", "near")].tolist() == [100.0, 100.0, 100.0, 0.0]
    assert table.loc[("unpenalised_cg", "far")].tolist() == [0.0] * 4
    text = " ".join(start_study.threshold_notes(results))
    assert "Starts near, with the penalty against without: 2e-05: 100 % against 100 %" in text
    assert "2e-06: 0 % against 100 %" in text


def test_other_constants_are_told(results):
    table = start_study.sensitivity(results)
    assert table["tau"].tolist() == ["0.03", "0.3"]
    assert table["success (%)"].tolist() == [100.0, 0.0]
    text = " ".join(start_study.sensitivity_notes(results))
    assert "0 to 100 %" in text and "1 of the 2 pairs come lower" in text


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("unit", ["rad", "cm", "rad"], "position has unit 'cm', expected mm"),
        ("peak", [3e-3, 0.0, 5e-3], "position is 0, expected a peak above 0"),
        ("peak", [3e-3, -0.2, 5e-3], "position is -0.2"),
        ("peak", [3e-3, np.nan, 5e-3], "position is nan"),
    ],
)
def test_published_peaks_that_cannot_be_are_named(results, column, values, message):
    with pytest.raises(DataError, match=f"published peaks: {message}"):
        replace(results, published=results.published.assign(**{column: values}))


@pytest.mark.parametrize(
    ("value", "text"), [(1.234e-5, "1.23e-05"), (3e-15, "< 1e-12"), (np.nan, "")]
)
def test_rounding_is_not_told_apart(value, text):
    assert tables.scientific(value) == text


def test_times_of_other_parameters_are_left_out():
    table = pd.DataFrame({"trainer": ["a", "b"], "settings": ["new", "old"]})
    assert current(table, {"a": "new", "b": "new"}, "trainer")["trainer"].tolist() == ["a"]
    assert current(table, "old")["trainer"].tolist() == ["b"]
    assert current(table, {}, "trainer").empty


def test_a_published_peak_that_is_missing_is_named(results):
    with pytest.raises(DataError, match="orientation"):
        replace(results, published=results.published.drop(index="orientation"))


def test_the_report_is_whole_and_the_same_again(results, tmp_path):
    for folder in ("one", "two"):
        write_report(results, tmp_path / folder, {"file.csv": "0" * 64})
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.*"))
    assert len([name for name in files if name.suffix == ".png"]) == 8
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    found = json.loads((tmp_path / "one/metrics.json").read_text())
    for network in ("network", "best"):
        for key in ("elbow_rad", "position_mm", "orientation_rad"):
            assert found[f"{network}.peak_{key}"] > 0.0
    assert 0.0 < found["newton2.peak_elbow_rad"] < 1e-9
    assert found["newton.random_n_failed"] == 0
    page = (tmp_path / "one/README.md").read_text()
    assert " nan " not in page and "after figure 6" in page
