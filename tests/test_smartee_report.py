"""The report of the SmartEE from errors of known size: every number follows from the data."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from smartee_case import small
from test_smartee_poses import draw, rows

from flexik.cases.smartee import report, report_starts
from flexik.cases.smartee.parts.errors import COLUMNS, conditions_of, judge_of
from flexik.cases.smartee.parts.methods import DirectKinematics
from flexik.cases.smartee.parts.poses import POSE_FIELDS, extent_of, geometry_of, values
from flexik.cases.smartee.report import TEMPLATE, content
from flexik.cases.smartee.report_results import Results, current, published_peaks, scientific
from flexik.errors import DataError
from flexik.evaluation.errors import evaluate
from flexik.reporting.page import render

PAIR = ["regularised_cg", "unpenalised_cg"]
SMARTEE = small(
    conditions={"path_100": {"n_samples": 20}, "path_1000": {"n_samples": 30}},
    studies={"starts": {"n_starts": 2, "trainers": PAIR, "success": 1e-5, "thresholds": [2e-6]}},
)
GEOMETRY = geometry_of(SMARTEE.machine)
# every elbow of a start is off by this, rad
OFF = {"network": 1e-3, "best": 1e-4, "centre": 0.1, "previous": 1e-2, "newton": 0.1}
# as many shares of starts as there are restarts: twice and three times the errors of the chosen one
RESTARTS = (1.0, 2.0, 3.0)


def errors() -> pd.DataFrame:
    """Of starts that are off by OFF, instead of those of methods."""
    frames = []
    for name, method in SMARTEE.methods.items():
        for conditions_name in method.conditions or SMARTEE.conditions:
            poses = rows(SMARTEE, conditions_name)
            right = draw(SMARTEE, conditions_name)[1][..., 2]
            asked = replace(conditions_of(poses, right[0]), current=right + OFF[name])
            judge = judge_of(GEOMETRY, poses)
            extent = extent_of(SMARTEE.samples.box, values(poses, POSE_FIELDS))
            for n_steps in method.n_steps:
                direct = DirectKinematics(GEOMETRY, "centre", n_steps, method.tolerance)
                table = pd.DataFrame(evaluate(direct, asked, judge, COLUMNS))
                label = {"method": name, "conditions": conditions_name, "n_steps": n_steps}
                frames.append(table.assign(extent=extent, **label))
    return pd.concat(frames, ignore_index=True)


def start_rows() -> pd.DataFrame:
    found = []
    for trainer, spread, error in (
        *(("regularised_cg", "near", 4e-6), ("regularised_cg", "far", 2e-6)),
        *(("unpenalised_cg", "near", 2e-6), ("unpenalised_cg", "far", 4e-5)),
    ):
        for start in range(2):
            success = 5 if error < 1e-5 else -1
            found.append((trainer, spread, start, error, 60, success, 6e-3, "iterations"))
    names = ("trainer", "spread", "start", "error", "n_iterations", "success_iteration", "judged")
    return pd.DataFrame(found, columns=[*names, "stop_reason"])


def restart_rows(found: pd.DataFrame) -> pd.DataFrame:
    """Peaks of RESTARTS: those of `found`, times so much."""
    columns = [field.name for field in COLUMNS.errors]
    chosen = found[(found["n_steps"] == 0) & found["method"].isin(["network", "best"])]
    peaks = chosen.groupby(["method", "conditions"])[columns].max().reset_index()
    peaks = peaks.rename(columns={"method": "network"})
    return pd.concat(
        peaks.assign(restart=k, **{c: factor * peaks[c] for c in columns})
        for k, factor in enumerate(RESTARTS)
    )


@pytest.fixture(scope="module")
def results() -> Results:
    found = errors()
    times = pd.DataFrame(
        [(t, s) for t in PAIR for s in ("near", "far")], columns=["trainer", "spread"]
    )
    times = times.assign(n_starts=4, long_factor=10, seconds=0.25, long_seconds=2.0)
    times["long_error"] = [1e-6, 1e-6, 1e-6, 3e-5]
    sizes = {"n_hidden": [10, 20], "training_error": [2e-3, 1e-3], "selection_error": [3e-3, 2e-3]}
    sizes |= {key: [0.004, 0.003] for key in ("median_selection_error", "worst_selection_error")}
    return Results(
        section=SMARTEE,
        errors=found,
        restarts=restart_rows(found),
        training=pd.DataFrame(
            {"network": ["network"], "restart": [0], "stop_reason": ["goal"], "trainer": ["x"]}
        ),
        starts=start_rows(),
        sensitivity=start_rows()
        .query("spread == 'far'")
        .replace({PAIR[0]: "0.0001, 0.03", PAIR[1]: "0.001, 0.3"}),
        linear_error=9e-4,
        sizes=pd.concat(pd.DataFrame(sizes).assign(poses=name) for name in ("dense", "training")),
        geometries=pd.DataFrame(
            {
                "name": ["assumed here", "low"],
                **dict.fromkeys(("base_radius", "plate_radius", "height"), 0.05),
                "reached_share": [1.0, 0.0],
                "median_condition": [2.1, np.nan],
                "largest_condition": [2.45, np.nan],
            }
        ),
        published={"elbow": 3e-3, "position": 2e-4, "orientation": 5e-3},
        query_times=pd.DataFrame(
            {
                "method": ["network", "centre", "newton"],
                "n_steps": [2, 1, 50],
                "microseconds_single": [120.0, 80.0, 400.0],
                "microseconds_batched": [1.5, 0.5, 4.0],
            }
        ),
        training_times=times,
    )


def page_of(results) -> str:
    found = content(results)
    return render(TEMPLATE, found.tables, found.figures, found.values).text


def test_peaks_stand_beside_the_published_ones_in_their_units(results):
    table = report.peaks(results).set_index("error")
    elbow = table.loc["elbow (mrad)"]
    assert elbow["published"] == pytest.approx(3.0)
    assert elbow["network"] == pytest.approx(np.sqrt(3.0), rel=1e-9)
    assert elbow["best mean"] == pytest.approx(0.1 * np.sqrt(3.0), rel=1e-9)
    position = results.groups["network", 0, "validation"]["position_error"].max()
    assert table.loc["position (mm)", "network"] == pytest.approx(1e3 * position)
    found = report.metrics(results)
    assert found["network.peak_position_mm"] == pytest.approx(1e3 * position, rel=1e-3)


def test_peaks_have_their_spread_over_the_restarts(results):
    row = report.restarts(results).set_index(["network", "error"]).loc["best", :]
    elbow = row.loc["elbow (mrad)"]
    assert elbow[["goal", "chosen", "median", "largest, random"]].tolist() == pytest.approx(
        [0.3, *(0.1 * np.sqrt(3.0) * np.array([1.0, 2.0, 3.0]))]
    )
    found = report.metrics(results)
    assert found["network.peak_elbow_rad_median"] == pytest.approx(2e-3 * np.sqrt(3), rel=1e-3)
    assert found["network.peak_elbow_rad_largest"] == pytest.approx(3e-3 * np.sqrt(3), rel=1e-3)


def test_verdicts_are_those_of_the_chosen_and_of_the_median_restart(results):
    network, best = report.values(results)["goals"]
    assert network["missed"] == {"chosen": [], "median": ["elbow"]}
    assert best["missed"] == {"chosen": [], "median": ["elbow"]}
    strict = replace(results, published={"elbow": 1e-3, "position": 1.0, "orientation": 1.0})
    network, best = report.values(strict)["goals"]
    assert network["missed"]["chosen"] == best["missed"]["chosen"] == ["elbow"]
    assert network["chosen"]["elbow"] == pytest.approx(np.sqrt(3.0))
    assert (network["n_met"], network["n_restarts"]) == (0, 3)


def test_the_page_tells_what_came_out(results):
    text = page_of(results)
    two = results.peak("network", 2, "random")
    for sentence in (
        "`network` against the published peaks: meets all three. All three are met by 1 of its 3 "
        "restarts; in the median of its restarts it misses elbow.",
        "`best` against the published peaks over 10: meets all three",
        f"{two:.1e} rad over the random ones; 1e-09 rad is reached",
        "120 us alone and 1.5 us in a batch",
        "Starts near: the penalty raises the median error, 2.00 times that without, and lowers the "
        "error of 0 of the 2 starts",
        "Starts far: the penalty lowers the median error, 0.05 times that without, and lowers the "
        "error of 2 of the 2 starts; 100 % of the starts succeed with it, 0 % without",
        "All 8 runs ended at their number of iterations, which is a cap",
        "regularised_cg 1.0, unpenalised_cg 30.0",
        "medians of 4 starts, which are few",
        "settings that differ: penalty (0.0001 and 1e-30).",
        "these do not: unpenalised_cg (far)",
        "Success with the other pairs: 0 to 0 %.",
        "1 of the 2 pairs come lower",
        "Starts near, with the penalty against without: 1e-05: 100 % against 100 %; "
        "2e-06: 0 % against 100 %",
        "after figure 6",
    ):
        assert sentence in text, sentence
    prose = "".join(line for line in text.splitlines() if not line.startswith("|"))
    assert " nan " not in text and "plateau: its" not in prose and "  " not in prose
    slow = results.errors.copy()
    slow.loc[(slow["method"] == "network") & (slow["n_steps"] == 2), "error"] = 1e-8
    other = replace(
        results,
        errors=slow,
        query_times=results.query_times[:0],
        training_times=results.training_times[:0],
        starts=results.starts.assign(stop_reason="stationary"),
        linear_error=2.1e-6,
    )
    text = page_of(other)
    assert "1e-09 rad is missed" in text and "is a cap" not in text
    assert text.count("No times: the benchmark was run with other parameters.") == 2
    assert "unpenalised_cg (near) ends on a plateau" in text
    assert "regularised_cg (near) ends on" not in text


def test_ways_to_the_elbows_have_errors_and_times(results):
    known = report.direct_kinematics(results).set_index(["start", "Newton steps"])
    assert known.loc[("network", "0"), "validation"] == f"{1e-3 * np.sqrt(3):.2e}"
    assert known.loc[("network", "2"), "single (us)"] == 120.0
    assert np.isnan(known.loc[("network", "1"), "single (us)"])
    # a step from the previous pose costs one from the centre, and cannot be batched
    assert known.loc[("previous", "1"), "single (us)"] == 80.0
    assert np.isnan(known.loc[("previous", "1"), "batched (us)"])
    assert known.loc[("centre", "until converged"), ["random", "path_100"]].tolist() == [
        *("< 1e-12", "")
    ]
    assert ("centre", "0") not in known.index


def test_errors_outside_are_sorted_by_extent(results):
    table = report.outside(results)
    assert table["extent"].tolist()[0] == "0 to 1" and len(table) == 5
    # the same in every stretch, because every elbow is off by the same
    assert table["network median (mrad)"].to_numpy() == pytest.approx(np.sqrt(3.0), rel=1e-6)


def test_what_newton_finds_is_right_when_its_elbows_are(results):
    """Newton beyond the box: right, at wrong elbows, out of steps after many, of other branch."""
    found = results.errors
    beyond = (found["method"] == "newton") & (found["conditions"] == "outside")
    crafted = (
        found[beyond]
        .iloc[:4]
        .assign(extent=0.5, status=[0, 0, 3, 5], steps=[5, 7, 50, 60], error=[1e-9, 0.2, 0.3, 3.0])
    )
    own = replace(results, errors=pd.concat([found[~beyond], crafted], ignore_index=True))
    assert report.outside(own)["Newton from the centre right (%)"][0] == 25.0
    row = report.newton(own).set_index("poses").loc["outside"]
    assert (row["converged"], row["not converged"], row["other branch"]) == (2, 1, 1)
    assert (row["to wrong elbows"], row["mean steps"], row["most steps"]) == (1, 6.0, 7)
    metrics = report.metrics(own)
    assert (metrics["newton.outside_n_failed"], metrics["newton.outside_n_wrong"]) == (3, 1)
    assert report.values(own)["wrong_newton"] == {"outside": 1}


def test_fixed_steps_that_go_wrong_are_counted(results):
    assert report.n_wrong(results, 2) == {"all": 0, "hidden": 0, "alarms": 0}
    table, found = results.groups["network", 2, "outside"], results.errors.copy()
    for k, (error, status) in enumerate(((0.2, 3), (0.2, 0), (1e-9, 3), (np.nan, 4))):
        found.loc[table.index[k], ["error", "status"]] = error, status
    own = replace(results, errors=found)
    assert report.n_wrong(own, 2) == {"all": 3, "hidden": 1, "alarms": 1}
    metrics = report.metrics(own)
    assert (metrics["newton2.outside_n_failed"], metrics["newton2.outside_n_unnoticed"]) == (3, 1)
    assert np.isnan(own.peak("network", 2, "outside"))


def test_draws_tell_how_often_the_goals_are_met(results):
    table = report.draws(results).set_index(["network", "error"])
    # every elbow is off by the same, so every draw has the same peak
    assert table.loc[("network", "elbow (mrad)"), "median"] == pytest.approx(np.sqrt(3.0))
    assert table.loc[("network", "elbow (mrad)"), "meets (%)"] == 100.0
    found = results.errors.copy()
    found.loc[results.groups["network", 0, "random"].index[0], "error"] = 1.0
    other = report.draws(replace(results, errors=found))
    share = other.set_index(["network", "error"])["meets (%)"]
    # 12 draws of 12 miss one with (11 / 12)^12
    assert share["network", "elbow (mrad)"] == pytest.approx(100 * (11 / 12) ** 12, abs=4.0)
    assert share["network", "all three"] == share["network", "elbow (mrad)"]


def test_pairs_beside_the_setting_itself_are_the_others(results):
    own = results.sensitivity.query("trainer == '0.0001, 0.03'")
    others = report_starts.values(results)["other_constants"]["shares"]
    assert others == [0.0, 0.0]
    alone = replace(results, sensitivity=own)
    assert report_starts.values(alone)["other_constants"]["shares"] == []
    assert "the other pairs" not in page_of(alone)


def test_success_is_counted_at_every_threshold(results):
    table = report_starts.thresholds(results).set_index(["trainer", "start"])
    assert table.columns.tolist() == ["1e-05 (%)", "2e-06 (%)"]
    assert table.loc[("regularised_cg", "near")].tolist() == [100.0, 0.0]
    assert table.loc[("unpenalised_cg", "far")].tolist() == [0.0] * 2
    row = report_starts.starts(results).frame.set_index(["trainer", "start"]).loc[PAIR[1], "far"]
    assert row[["success (%)", "to success", "seconds a run"]].tolist() == [0.0, "", 0.25]
    found = report.metrics(results)
    assert found["starts.unpenalised_cg.far.median_error"] == 4e-5
    table = report_starts.sensitivity(results)
    assert table[["tau", "success (%)"]].to_numpy().tolist() == [["0.03", 100.0], ["0.3", 0.0]]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unit": ["rad", "cm", "rad"]}, "position is 0.2 cm, expected above 0 in mm"),
        ({"peak": [3e-3, 0.0, 5e-3]}, "position is 0 mm, expected"),
        ({"peak": [3e-3, np.nan, 5e-3]}, "position is nan mm"),
        ({"quantity": ["elbow", "position", "x"]}, "orientation"),
    ],
)
def test_published_peaks_that_cannot_be_are_named(changes, message):
    table = pd.DataFrame(
        {
            "quantity": ["elbow", "position", "orientation"],
            "unit": ["rad", "mm", "rad"],
            "peak": [3e-3, 0.2, 5e-3],
        }
    )
    assert published_peaks(table)["position"] == pytest.approx(2e-4)
    with pytest.raises(DataError, match=f"published peaks: .*{message}"):
        published_peaks(table.assign(**changes))


@pytest.mark.parametrize(
    ("value", "text"), [(1.234e-5, "1.23e-05"), (3e-15, "< 1e-12"), (np.nan, "")]
)
def test_rounding_is_not_told_apart(value, text):
    assert scientific(value) == text


def test_times_of_other_parameters_are_left_out():
    table = pd.DataFrame({"trainer": ["a", "b"], "settings": ["new", "old"]})
    assert current(table, lambda row: "new")["trainer"].tolist() == ["a"]
    assert current(table, lambda row: {"b": "old"}.get(row["trainer"]))["trainer"].tolist() == ["b"]


def test_every_figure_is_drawn_and_every_metric_is_a_number(results):
    found = content(results)
    for name, drawing in found.figures.items():
        assert drawing().axes, name
    assert len(found.figures) == 8
    assert all(value is not None for value in found.metrics.values())
    assert 0.0 < found.metrics["newton2.peak_elbow_rad"] < 1e-9
    assert found.metrics["newton.random_n_failed"] == 0
