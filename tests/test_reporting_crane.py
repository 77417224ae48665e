"""The crane's report from results that are made up: what it says follows from them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from crane_case import MANIPULATOR, ROOT, section

from flexik.cases.crane import report, report_results
from flexik.cases.crane.parts.fields import STROKES
from flexik.cases.crane.report_mechanism import _carry, crane, links
from flexik.cases.crane.report_results import Results
from flexik.cases.crane.report_tables import RACE_TIMES
from flexik.evaluation import operations
from flexik.kinematics.crane import forward, pose
from flexik.kinematics.status import ACTUATOR_LIMIT, NOT_CONVERGED
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.positioning.combined import Settings as Combined
from flexik.reporting import style
from flexik.reporting.page import render

GEOMETRY = MANIPULATOR.geometry
POINTS = [(1.0, 7.0), (2.0, 7.0), (1.0, 6.0), (4.0, 3.0)]
PAYLOADS = [30.0, 470.0]
TEMPLATE = Path(report.__file__).with_name("page.md.j2")


def samples(n=60):
    strokes = np.random.default_rng(0).uniform(0, GEOMETRY.stroke_maximum, (n, 3))
    rigid, payload = forward(GEOMETRY, strokes), np.tile([50.0, 200.0, 500.0], n // 3)
    tip = rigid - np.outer(payload, [1e-5, 2e-4])
    names = [*STROKES, "payload", "rigid_x", "rigid_y", "tip_x", "tip_y"]
    frame = pd.DataFrame(np.column_stack([strokes, payload, rigid, tip]), columns=names)
    return frame.assign(status=np.where(np.arange(n) < 55, 0, 1))


def errors(scale, seed=0, **columns):
    target = np.repeat(POINTS, len(PAYLOADS), axis=0)
    off = np.random.default_rng(seed).normal(0, scale, target.shape)
    named = {"target": target, "achieved": target - off, "error": off}
    found = {f"{name}_{axis}": v[:, k] for name, v in named.items() for k, axis in enumerate("xy")}
    found |= dict.fromkeys(STROKES, 0.1)
    found |= {"point": np.repeat(range(len(POINTS)), 2), "payload": np.tile(PAYLOADS, len(POINTS))}
    found |= {"error": np.hypot(*off.T), "status": 0, "n_iterations": 5, "n_clipped": 0}
    return pd.DataFrame(found).assign(**columns)


def network(n_inputs, n_hidden):
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(n_hidden, n_inputs + 1)), rng.normal(size=(2, n_hidden + 1))
    scale = (Normalisation(np.zeros(n), np.ones(n)) for n in (n_inputs, 2))
    columns = (tuple(Quantity(f"q{k}", "m") for k in range(n)) for n in (n_inputs, 2))
    return Network(weights, "tanh", *scale, *columns)


@pytest.fixture(scope="module")
def results():
    given, names = section(), list(section().methods)
    points = given.conditions["published"].model_copy(
        update={"points": POINTS, "payloads": PAYLOADS}
    )
    given = given.model_copy(update={"conditions": given.conditions | {"published": points}})
    sizes = pd.DataFrame({"n_hidden": [10, 20, 30], "best_restart": 0, "n_failed": 0})
    for name in ("training", "selection", "median_selection", "worst_selection"):
        sizes[f"{name}_error"] = [0.3, 0.1, 0.2]
    beams = {name: np.linspace([0, k], [1, k], 4).tolist() for k, name in enumerate("plje")}
    beams = dict(zip(("pillar", "lift", "jib", "extension"), beams.values(), strict=True))
    tolerance = {"tolerance": [1e-5, 1e-7], "mean_error": [3e-3, 2e-3], "max_error": 1e-2}
    study = pd.DataFrame(tolerance).assign(mean_iterations=9.0, max_iterations=20, n_failed=0)
    fitting = pd.DataFrame({"lift_stroke": [0.0, 0.5], "model_y": 0.1, "network_y": [0.2, 9.0]})
    line = given.studies.fitting
    grid = samples()
    grid.loc[:4, ["jib_stroke", "extension_stroke", "payload"]] = (
        *(line.jib, line.extension, line.payload),
    )
    mesh = {"element": "ancf", "n_samples": 7, "refinement": [1, 2], "mean_relative": 0.01}
    mesh = pd.DataFrame(mesh | {"max_relative": 0.02, "mean_difference": 1e-4})
    training = pd.DataFrame({"network": list(given.networks), "selection_error": 0.1})
    spread = pd.DataFrame({"restart": [0, 1, 2], "mean_error": [1e-3, 2e-3, 6e-3]})
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        published = report_results.published()
    return Results(
        section=given,
        spring_stiffness=8e6,
        grid=grid,
        selection=samples(30),
        errors={name: errors(0.03, 0) if name == "none" else errors(0.01, 1) for name in names},
        workspace={name: errors(0.02, 2) for name in names},
        spread={"combined": spread.assign(max_error=2 * spread["mean_error"])},
        published=published,
        mesh=mesh.assign(max_difference=2e-4),
        training=training.assign(restart=0, training_error=0.1),
        studies={k: (sizes, 20) for k, n in given.networks.items() if n.is_selected},
        trained={
            name: network(3 if n.learns == "rigid_tip" else 4, 5)
            for name, n in given.networks.items()
        },
        tolerances=pd.concat([study.assign(method=name) for name in ("direct", "modular")]),
        fitting=pd.concat([fitting.assign(n_hidden=n) for n in (2, 30)]),
        by_corrections=pd.DataFrame(
            {"method": "combined", "n_corrections": [1, 2], "n_failed": 0}
            | {f"{what}_error": [0.002, 0.001] for what in ("mean", "p99", "max")}
        ),
        draws=pd.DataFrame(
            {"draw": [0, 1], "method": "none", "spring_stiffness": [8e6, 9e6]}
            | {f"{what}_error": [0.03, 0.031] for what in ("mean", "max")}
        ),
        curves=pd.DataFrame(),
        physics=pd.DataFrame(),
        query_times=pd.DataFrame(
            {"method": names, "microseconds_single": 20.0, "microseconds_batched": 2.0}
        ),
        training_curves=pd.DataFrame(
            {"trainer": ["a"] * 3, "seconds": [0.0, 0.5, 30.0], "error": [1.0, 0.5, 0.1]}
        ),
        shape={
            "values": [0.13, 0.1, 1.2],
            "payload": 470.0,
            "exaggeration": 5.0,
            "beams": beams,
            "reference": beams,
            "tip": [5.0, 0.0],
            "rigid_tip": [5.003, 0.004],
        },
    )


@pytest.fixture
def text(tmp_path):
    """Give the page, or the Markdown of one table, without the measured part."""
    whole = TEMPLATE.read_text().replace('{% include "measured.md.j2" %}', "")
    (tmp_path / "page.md.j2").write_text(whole)

    def write(results, name=None):
        given = report.content(results)
        found = render(tmp_path / "page.md.j2", given.tables, given.figures, given.values)
        return found.tables[name] if name else found.text

    return write


def changed(results, label, **columns):
    frames = dict(results.errors)
    return replace(results, errors=frames | {label: frames[label].assign(**columns)})


def test_the_page_tells_what_each_method_does(results, text):
    page = text(results)
    for line in (
        "- `none`: the rigid inverse alone; the deflection stays as the error.",
        "corrections: 1 at most; inverses by the thesis' genetic algorithm.",
        "- `direct`: inverse of a network that learnt the tip of the flexible manipulator; network "
        "`direct`; inverted by gradient descent on its inputs to a tolerance of 1e-07, within the "
        "stroke limits.",
        "- `modular_gauss_newton`: inverse of two networks that add up",
        "inverted by gauss newton on its inputs",
        "- `inverse`: a network that learnt actuator coordinates for a tip, payload and branch;",
        "- `beam_model`: `combined` with beam theory in place of a network, without training;",
        "passes over the deformed pose: 0",
        "so sets its own floor.",
        "60 vectors, 55 kept, 5 left out (rigid tip behind x = 0 m), 0 failed.",
        "Ground spring 8.000 MN m/rad",
    ):
        assert line in page, line
    assert "(`combined_ga`: 5 mm) and" in page
    assert "  " not in re.sub(r"(?m)^\|.*$", "", page)


def test_without_a_genetic_method_none_is_spoken_of(results, text):
    given = {k: m for k, m in results.section.methods.items() if k != "combined_ga"}
    fewer = {
        name: {k: frame for k, frame in getattr(results, name).items() if k in given}
        for name in ("errors", "workspace")
    }
    given = results.section.model_copy(update={"methods": given})
    page = text(replace(results, section=given, **fewer))
    assert "genetic" not in page.split("## Cost")[0]


def test_notes_on_points_and_payloads_only_where_they_hold(results, text):
    table = text(results, "positioning_errors")
    assert "The thesis' figure" not in table and "stands in" not in table
    assert "outside the training grid's 50 to 500 kg, extrapolated by the networks: 4 of 8" in table
    table = text(replace(results, section=section()), "positioning_errors")
    assert "The thesis' figure with its 25 points is lost" in table
    assert "- (2, -3.95) stands in for the thesis' point (2, -4), which the loaded" in table


def test_conditions_that_a_method_worsens_are_counted(results, text):
    none = results.errors["none"]["error"]
    given = changed(results, "combined", error=none + np.r_[0.0024, [-1e-3] * 6, 0.0])
    line = "- combined: worse than no compensation in 1 of 8 conditions, by at most 2.4 mm."
    assert line in text(given, "positioning_errors")
    given = changed(results, "combined", error=none / 2)
    assert "in 0 of 8 conditions.\n" in text(given, "positioning_errors")


def test_failures_are_told_with_their_reasons(results, text):
    status = [ACTUATOR_LIMIT, ACTUATOR_LIMIT, NOT_CONVERGED, *[0] * 5]
    given = changed(results, "direct", status=status)
    assert "- direct: failed conditions: 3 (needs an actuator beyond its limit: 2; " in text(
        given, "positioning_errors"
    )
    generations = [30, *[10] * 7]
    given = changed(results, "combined_ga", corrected_n_generations=generations)
    assert "took 12 generations on average, 30 at most." in text(
        given, "positioning_errors_variants"
    )


def test_a_selected_size_that_is_no_better_is_told(results, text):
    line = "- direct_selected: no better than direct; selection errors of the networks: 0.1000 and"
    assert line not in text(results, "positioning_errors_selected")
    worse = results.errors["direct"] * 2
    given = replace(results, errors=dict(results.errors) | {"direct_selected": worse})
    assert line in text(given, "positioning_errors_selected")


def test_the_calibration_names_what_misses_and_the_worst_point(results, text):
    error = [0.1, *[0.01] * 7]
    given = changed(results, "none", error=error, error_x=0.06, error_y=-0.08)
    notes = text(given, "calibration")
    assert "max R is that of the point (1, 7) with 30 kg, |dX| 60.0 mm and |dY| 80.0 mm" in notes
    assert "stay below 10.0 mm." in notes
    assert re.search(r"More than 10 % .*mean \|dX\| \(mm\) by \+307\.\d %", notes)


def test_a_ground_spring_that_is_given_was_not_fitted(results, text):
    fitted = text(results)
    assert "the one constant that is fitted." in fitted and "mean R is what was fitted." in fitted
    known = results.section.calibration.model_copy(update={"ranges": {}})
    given = results.section.model_copy(update={"calibration": known})
    page = text(replace(results, section=given))
    assert "Ground spring 8.000 MN m/rad, as given, not fitted." in page
    assert "with the ground spring as given; nothing was fitted." in page
    assert "constant that is fitted" not in page and "what was fitted" not in page


def test_errors_at_random_targets_refer_to_the_restarts(results, text):
    assert "under the published conditions: [restarts.csv](restarts.csv)." in text(
        results, "workspace"
    )
    alone = text(replace(results, spread={}), "workspace")
    assert "single targets" in alone and "restarts.csv" not in alone


def test_the_choice_of_a_size_is_told(results, text):
    name = "size_selection/direct_selected"
    assert text(results, name).endswith("- chosen: 20, published: 18\n")
    sizes, _ = results.studies["direct_selected"]
    given = replace(results, studies=dict(results.studies) | {"direct_selected": (sizes, 30)})
    assert "lies at the end of the range" in text(given, name)


def test_errors_stand_beside_the_published(results):
    frame = report.content(results).tables["positioning_errors"].frame
    assert list(frame)[:3] == ["statistic", "none", "none published"]
    mean = frame[frame["statistic"] == "mean R (mm)"].iloc[0]
    assert mean["none"] == pytest.approx(1e3 * results.errors["none"]["error"].mean())
    assert mean["combined published"] == 4.1405
    assert frame.iloc[-2:]["none"].tolist() == [8, 0]


def test_methods_are_grouped_by_their_names(results):
    groups = results.groups
    assert groups["published"] == ["combined", "direct", "modular", "inverse"]
    assert groups["selected"] == [f"{name}_selected" for name in groups["published"]]
    assert groups["variants"] == ["combined_ga", "direct_gauss_newton", "modular_gauss_newton"]
    beyond = {"table_cubic", "beam_network_14", "target_correction", "exact", "polynomial"}
    assert beyond <= set(groups["beyond"])


def test_operations_of_a_query_follow_from_method_and_network(results):
    net, step = results.trained["direct"], operations.inversion_step_operations
    once = operations.forward_operations(results.trained["deflection"])
    assert results.query_operations("combined") == once
    expected = operations.normalisation_operations(net) + 5 * step(net, 3)
    assert results.query_operations("direct") == expected
    assert results.query_operations("inverse") == operations.forward_operations(net)
    methods = dict(results.section.methods)
    methods["twice"] = Combined(method="combined", network="deflection", n_corrections=2)
    given = replace(results, section=results.section.model_copy(update={"methods": methods}))
    assert given.query_operations("twice") == 2 * once


def test_points_that_the_thesis_leaves_out_and_our_worst(results):
    frame = report.content(results).tables["without_worst_points"].frame.set_index("method")
    rows = frame.loc["direct"]
    assert rows["without"].iloc[0] == "(1, 7) and (2, 7)" and len(rows) == 2
    left = results.errors["direct"][4:]
    assert rows["mean R (mm)"].iloc[0] == pytest.approx(1e3 * left["error"].mean())
    assert rows["mean R published (mm)"].tolist()[0] == 14.7


def test_tolerances_stand_beside_the_published(results):
    frame = report.content(results).tables["tolerance_study"].frame
    row = frame.iloc[0]
    assert (row["tolerance"], row["published ratio"], row["published mean"]) == (
        "1e-05",
        1.754,
        114,
    )
    assert row["mean R over that at 1e-07"] == pytest.approx(1.5)


def test_errors_of_trainers_after_some_times(results):
    row = report.content(results).tables["training_race"].frame.iloc[0]
    found = [row[f"after {seconds:g} s"] for seconds in RACE_TIMES]
    assert found == [1.0, 0.5, 0.5, 0.1] and row["ended after (s)"] == 30.0


def test_metrics_tell_conditions_restarts_and_workspace(results):
    found = report.metrics(results)
    assert found["none.mean_error_mm"] == round(1e3 * results.errors["none"]["error"].mean(), 4)
    assert found["combined.restarts.max_max_error_mm"] == 12.0
    assert found["grid.n_kept"] == 55 and found["select.direct_selected.n_hidden"] == 20
    assert (
        "direct.workspace_p95_error_mm" in found and "none.restarts.min_mean_error_mm" not in found
    )
    empty = replace(results, workspace=dict.fromkeys(results.workspace, errors(1.0)[:0]))
    assert "none.workspace_mean_error_mm" not in report.metrics(empty)


def test_figures_are_drawn(results, tmp_path):
    drawn = report.content(results).figures
    for name in ("crane", "training_points", "initial_positions", "under_and_overfitting"):
        with style.house_style():
            figure = drawn[name]()
            figure.draw_without_rendering()
        assert all(axes.has_data() for axes in figure.axes if axes.axison), name
    failed = changed(results, "direct", status=[NOT_CONVERGED, *[0] * 7])
    figure = report.content(failed).figures["positioning_errors_direct"]
    marks = {layer.mark for layer in figure.args}
    assert marks == {"o", "x"}


def test_links_end_at_the_tip_of_their_strokes():
    strokes = np.array([[0.1, 0.2, 0.3], [0.5, 0.7, 1.6]])
    parts = links(GEOMETRY, strokes)
    ends = parts[parts["link"] == "extension"].groupby("crane")[["x", "y"]].last()
    np.testing.assert_allclose(ends, forward(GEOMETRY, strokes))


def test_the_title_of_the_crane_states_its_deflection(results):
    title = crane(GEOMETRY, results.shape).keywords["titles"]
    assert "470 kg" in title and "Tip deflection 5.0 mm (3.0 mm back, 4.0 mm down)" in title


def test_a_pin_moves_with_its_beam_as_a_rigid_body():
    axis = np.linspace([0.0, 0.0], [2.0, 0.0], 5)
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, -s], [s, c]])
    pins = pose(GEOMETRY, np.array([[0.1, 0.1, 0.1]])).tip
    for pin in ([0.5, 0.4], [1.1, -0.2], pins[0]):
        moved = _carry(axis, axis @ turn.T + [1.0, 2.0], np.array(pin))
        np.testing.assert_allclose(moved, turn @ pin + [1.0, 2.0], atol=1e-12)
