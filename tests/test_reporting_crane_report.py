"""Notes and texts of the crane's report: they follow from parameters and results."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.errors import DataError
from flexik.evaluation import operations
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.kinematics.status import ACTUATOR_LIMIT
from flexik.parameters import load_parameters
from flexik.positioning.method import NOT_CONVERGED
from flexik.reporting.crane import learning_tables
from flexik.reporting.crane import notes as crane_notes
from flexik.reporting.crane import report as crane_report
from flexik.reporting.crane import results as crane_results
from flexik.reporting.crane import tables as crane_tables
from flexik.reporting.crane_measured import report as measured_report

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def crane():
    return load_parameters(ROOT / "params.yaml").crane


@pytest.fixture
def results(crane):
    """Make results with what the texts need and no more."""
    mesh = pd.DataFrame(
        {
            "element": ["ancf", "ancf"],
            "refinement": [1, 2],
            "n_samples": [37, 37],
            "mean_difference": [1e-4, 0.0],
            "max_difference": [2e-4, 0.0],
            "mean_relative": [0.005, 0.0],
            "max_relative": [0.01, 0.0],
        }
    )
    published = crane_results.Published(
        errors=pd.DataFrame({"statistic": ["mean_error"], "none": [31.9], "combined": [4.1]}),
        sizes={"deflection": 14},
        without_worst=pd.DataFrame(
            {
                "method": ["direct"] * 2,
                "x": [1.0, 2.0],
                "y": [7.0, 7.0],
                "max_error": [33.9] * 2,
                "mean_error": [14.7] * 2,
            }
        ),
        tolerances=pd.DataFrame(
            {
                "method": ["direct"],
                "tolerance": [1e-5],
                "mean_iterations": [114],
                "max_iterations": [155],
                "error_ratio": [1.75],
            }
        ),
        operations={"inverse": 395.0},
    )
    nothing = pd.DataFrame()
    measured = measured_report.Measured(crane.measured, *[nothing] * 6, {})
    return crane_results.Results(
        crane=crane,
        spring_stiffness=8e6,
        grid=nothing,
        selection=nothing,
        errors={},
        workspace={},
        published=published,
        mesh_study=mesh,
        training=nothing,
        studies={},
        networks={},
        tolerances=nothing,
        fitting=nothing,
        query_times=pd.DataFrame(
            {
                "method": ["none", "direct"],
                "microseconds_single": [1.0, 20.0],
                "microseconds_batched": [0.5, 2.0],
            }
        ),
        training_curves=nothing,
        measured=measured,
        shape={},
    )


def frame(errors, status=0, **columns):
    return pd.DataFrame({"error": errors, "status": status} | columns)


def test_methods_are_those_there_are(crane):
    methods = {
        label: crane.methods[label].model_copy(update={"network": f"of_{label}"})
        for label in ("combined", "combined_ga")
    }
    lines = crane_notes.methods_text(methods).splitlines()
    assert [line.split("`")[1] for line in lines[:3]] == ["none", "combined", "combined_ga"]
    assert "`of_combined`" in lines[1] and lines[1].endswith("in closed form.")
    assert "`of_combined_ga`" in lines[2] and "genetic" in lines[2]
    assert "(`combined_ga`: 5 mm)" in lines[-1]

    coarse = methods["combined_ga"].genetic.model_copy(update={"tolerance": 0.0025})
    methods = {"coarse": methods["combined_ga"].model_copy(update={"genetic": coarse})}
    assert "(`coarse`: 2.5 mm)" in crane_notes.methods_text(methods)


def test_without_a_genetic_method_none_is_spoken_of(crane):
    text = crane_notes.methods_text({"combined": crane.methods["combined"]})
    assert "genetic" not in text and "combined_ga" not in text
    assert len(text.splitlines()) == 2


def test_notes_on_points_only_where_they_hold(crane):
    points = list(crane.evaluation.points)
    assert len(crane_notes.point_notes(points)) == 2
    (stand_in,) = crane_notes.point_notes(points[:-1])
    assert stand_in.startswith("(2, -3.95)")
    assert crane_notes.point_notes([(4.0, 1.0)]) == []


def test_conditions_that_a_method_worsens_are_counted():
    frames = {
        "none": frame([0.010, 0.002, 0.003, 0.004]),
        "good": frame([0.001, 0.002, 0.003, 0.004]),
        "mixed": frame([0.001, 0.0025, 0.0042, 0.001]),
    }
    assert crane_notes.worse_notes(frames) == [
        "good: worse than no compensation in 0 of 4 conditions.",
        "mixed: worse than no compensation in 2 of 4 conditions, by at most 1.2 mm.",
    ]


def test_payloads_beyond_the_trained_ones_are_counted():
    trained = pd.Series([50.0, 200.0, 500.0])
    (note,) = crane_notes.extrapolation_notes(pd.Series([30.0, 50, 500, 501, 120]), trained)
    assert "50 to 500 kg" in note and note.endswith(": 2 of 5 conditions.")
    assert crane_notes.extrapolation_notes(pd.Series([50.0, 500.0]), trained) == []


def test_failures_are_told_with_their_reasons():
    status = [0, NOT_CONVERGED, ACTUATOR_LIMIT, NOT_CONVERGED]
    frames = {"none": frame([0.1] * 4), "new": frame([0.1] * 4, status)}
    assert crane_notes.failure_notes(frames) == [
        "new: failed conditions: 3 (needs an actuator beyond its limit: 1; search ended above its "
        "tolerance: 2); their errors are at the strokes where the method stopped and are included."
    ]


def test_generations_are_told_of_methods_that_have_them():
    frames = {"none": frame([0.1, 0.1]), "ga": frame([0.1, 0.1], corrected_n_generations=[7, 12])}
    (note,) = crane_notes.genetic_notes(frames)
    assert note.startswith("ga: ") and "12 at most" in note


def test_calibration_entries_beyond_the_target_are_listed():
    table = pd.DataFrame(
        {"statistic": ["max R (mm)", "mean R (mm)", "a"], "difference (%)": [10.5, 10.0, -30.0]}
    )
    (note,) = crane_notes.calibration_notes(table)
    assert note == "More than 10 % from the published one: max R (mm) by +10.5 %, a by -30.0 %."
    (note,) = crane_notes.calibration_notes(table[1:2])
    assert note.startswith("No entry")


def test_the_worst_point_is_named_where_there_are_others():
    errors = pd.DataFrame(
        {
            "point": [0, 0, 1],
            "target_x": [1.0, 1.0, 4.0],
            "target_y": [2.0, 2.0, -1.5],
            "payload": [30.0, 470.0, 30.0],
            "error_x": [0.0, 0.003, -0.03],
            "error_y": [0.001, 0.0, 0.04],
            "error": [0.001, 0.003, 0.05],
        }
    )
    (note,) = crane_notes.worst_point_notes(errors)
    assert "(4, \N{MINUS SIGN}1.5) with 30 kg, |dX| 30.0 mm and |dY| 40.0 mm" in note
    assert note.endswith("stay below 3.0 mm.")
    assert crane_notes.worst_point_notes(errors[:2]) == []


def test_the_mesh_table_takes_its_samples_from_the_study(results, tmp_path):
    crane_tables._write_mesh_study(results, tmp_path)
    text = (tmp_path / "mesh_study.md").read_text()
    assert "refinement 2" in text and "37 random samples" in text
    table = pd.read_csv(tmp_path / "mesh_study.csv")
    assert "n_samples" not in table
    assert table["mean (% of deflection)"].tolist() == [0.5, 0.0]
    less = dataclasses.replace(results, mesh_study=results.mesh_study.drop(columns="n_samples"))
    with pytest.raises(DataError, match=r"mesh study.*n_samples"):
        crane_tables._write_mesh_study(less, tmp_path)


def test_a_method_that_is_not_published_has_no_column(results):
    columns = results.published_columns
    assert {columns[label] for label in ("combined", "combined_selected")} == {"combined"}
    assert {columns[label] for label in ("direct", "modular", "inverse_selected")} == {None}
    errors = results.published.errors.drop(columns="combined")
    published = dataclasses.replace(results.published, errors=errors)
    less = dataclasses.replace(results, published=published)
    assert less.published_columns == dict.fromkeys(results.crane.methods)


def test_methods_are_grouped_by_their_names(results, crane):
    methods = {
        "modular": crane.methods["modular"],
        "combined_selected": crane.methods["combined_selected"],
        "direct_selected_too": crane.methods["direct_selected"],
        "combined": crane.methods["combined"],
    }
    chosen = crane.model_copy(update={"methods": methods})
    assert dataclasses.replace(results, crane=chosen).groups == {
        "published": ["modular", "combined"],
        "selected": ["combined_selected"],
        "variants": ["direct_selected_too"],
    }


def network(n_hidden, inputs=4, outputs=2):
    """Zero weights: only sizes count."""
    limits = [Normalisation(-np.ones(n), np.ones(n)) for n in (inputs, outputs)]
    weights = np.zeros((n_hidden, inputs + 1)), np.zeros((outputs, n_hidden + 1))
    columns = [tuple(Quantity(f"c{k}", "m") for k in range(n)) for n in (inputs, outputs)]
    return Network(weights, "tanh", *limits, *columns)


def test_operations_of_a_query_follow_from_method_and_network(results, crane):
    names = ("combined", "inverse", "direct", "direct_gauss_newton")
    sizes = {crane.methods[label].network: network(14) for label in names}
    steps = pd.DataFrame({"n_iterations": [10, 30]})
    results = dataclasses.replace(results, networks=sizes, errors=dict.fromkeys(names[2:], steps))
    forward = 14 * 4 * 2 + 14 + 2 * 14 * 2 + 2 * (4 + 2)
    assert results.query_operations("combined") == forward
    assert results.query_operations("inverse") == forward
    normalisation = operations.normalisation_operations(network(14))
    for label, step in [
        ("direct", operations.inversion_step_operations),
        ("direct_gauss_newton", operations.gauss_newton_step_operations),
    ]:
        expected = normalisation + 20.0 * step(network(14), 3)
        assert results.query_operations(label) == expected
    twice = crane.methods["combined"].model_copy(update={"n_corrections": 2})
    chosen = crane.model_copy(update={"methods": {"combined": twice}})
    results = dataclasses.replace(results, crane=chosen)
    assert results.query_operations("combined") == 2 * forward


def test_points_that_the_thesis_leaves_out_and_our_worst(results, crane, tmp_path):
    rows = [(1, 7, 0.03), (2, 7, 0.05), (3, 1, 0.04), (4, 1, 0.01), (5, 1, 0.02)]
    errors = pd.DataFrame(rows, columns=["target_x", "target_y", "error"]).astype(float)
    errors = errors.assign(error_x=errors["error"], error_y=0.0, status=0)
    chosen = crane.model_copy(update={"methods": {"direct": crane.methods["direct"]}})
    results = dataclasses.replace(results, crane=chosen, errors={"direct": errors})
    crane_tables._write_without_worst(results, tmp_path)
    table = pd.read_csv(tmp_path / "without_worst_points.csv")
    assert table["without"].tolist() == ["(1, 7) and (2, 7)", "(2, 7) and (3, 1)"]
    assert table["max R (mm)"].tolist() == [40.0, 30.0]
    np.testing.assert_allclose(table["mean R (mm)"], [70 / 3, 20.0], atol=1e-3)
    assert table["max R published (mm)"].fillna(0).tolist() == [33.9, 0.0]


def test_tolerances_stand_beside_the_published(results, tmp_path):
    study = pd.DataFrame(
        {
            "method": ["direct", "direct"],
            "tolerance": [1e-5, 1e-7],
            "mean_error": [0.03, 0.02],
            "max_error": [0.05, 0.06],
            "mean_iterations": [10.5, 20.25],
            "max_iterations": [11, 40],
            "n_failed": [0, 1],
        }
    )
    crane_tables._write_tolerances(dataclasses.replace(results, tolerances=study), tmp_path)
    table = pd.read_csv(tmp_path / "tolerance_study.csv")
    assert table["tolerance"].tolist() == [1e-5, 1e-7]
    assert table["mean R over that at 1e-07"].tolist() == [1.5, 1.0]
    assert table["published mean"].fillna(0).tolist() == [114.0, 0.0]
    assert table["published ratio"].fillna(0).tolist() == [1.75, 0.0]
    assert table["failed"].tolist() == [0, 1]


def test_errors_of_trainers_after_some_times(results, tmp_path):
    curves = pd.DataFrame(
        {
            "trainer": ["fast"] * 3 + ["slow"] * 2,
            "seconds": [0.05, 0.5, 2.0, 0.2, 50.0],
            "error": [0.3, 0.2, 0.1, 0.9, 0.4],
        }
    )
    results = dataclasses.replace(results, training_curves=curves)
    learning_tables._write_training_race(results, tmp_path)
    table = pd.read_csv(tmp_path / "training_race.csv").set_index("trainer")
    times = ["after 0.1 s", "after 1 s", "after 10 s", "after 60 s"]
    assert table.loc["fast", times].tolist() == [0.3, 0.2, 0.1, 0.1]
    assert table.loc["slow", times].fillna(0).tolist() == [0.0, 0.9, 0.9, 0.4]
    assert table["ended after (s)"].tolist() == [2.0, 50.0]


def test_metrics_tell_conditions_and_workspace(results, monkeypatch):
    monkeypatch.setattr(measured_report, "metrics", lambda measured: {"measured.x": 1.0})
    errors = pd.DataFrame({"error_x": [0.003, 0.0], "error_y": [0.004, 0.001], "status": [0, 3]})
    errors["error"] = np.hypot(errors["error_x"], errors["error_y"])
    table = pd.DataFrame({"status": [0, 1, 0]})
    results = dataclasses.replace(
        results,
        errors={"none": errors, "new": errors},
        workspace={"none": errors, "new": errors[:0]},
        grid=table,
        selection=table,
    )
    found = crane_report.metrics(results)
    assert found["none.mean_error_mm"] == found["new.mean_error_mm"] == 3.0
    assert found["none.max_abs_dy_mm"] == 4.0 and found["none.n_failed"] == 1
    assert found["none.workspace_mean_error_mm"] == 3.0
    assert found["none.workspace_p99_error_mm"] == pytest.approx(4.96)
    assert found["none.workspace_n_failed"] == 1
    assert not any(name.startswith("new.workspace") for name in found)
    assert found["measured.x"] == 1.0
    assert found["grid.n_samples"] == 3 and found["grid.n_left_out"] == 1


def test_what_each_kind_of_method_does_is_told(crane):
    lines = crane_notes.methods_text(crane.methods).splitlines()
    text = {line.split("`")[1]: line for line in lines if line.startswith("- ")}
    assert "inverted by gradient descent" in text["direct"] and "1e-07" in text["direct"]
    assert "joined" in text["modular"] and "joined" not in text["direct"]
    assert "Gauss-Newton" in text["direct_gauss_newton"]
    assert "appendix B" in text["inverse"] and "`inverse`" in text["inverse"]


@pytest.mark.parametrize(("chosen", "at_the_end"), [(4, True), (5, False), (6, True)])
def test_the_size_table_tells_the_choice(results, tmp_path, chosen, at_the_end):
    (name, selected), *_ = results.crane.selected_networks.items()
    sizes = pd.DataFrame(
        {column: np.array([0.3, 0.2, 0.1]) for column in learning_tables.SIZE_TABLE}
        | {"n_hidden": [4, 5, 6], "best_restart": [0, 2, 1], "n_failed": 0, "unused": 1.0}
    )
    results = dataclasses.replace(results, studies={name: (sizes, chosen)})
    learning_tables._write_sizes(results, name, tmp_path)
    text = (tmp_path / "size_selection" / f"{name}.md").read_text()
    assert text.startswith(f"{name}: ") and f"of {selected.select.n_restarts} by" in text
    published = results.crane.networks["deflection"].n_hidden
    assert f"- chosen: {chosen}, published: {published}\n" in text
    assert ("end of the range" in text) == at_the_end
    table = pd.read_csv(tmp_path / "size_selection" / f"{name}.csv")
    assert list(table) == [column.replace("_", " ") for column in learning_tables.SIZE_TABLE]
    assert table["selection error"].tolist() == [0.3, 0.2, 0.1]
    assert table["n hidden"].tolist() == [4, 5, 6]
