"""Notes and texts of the crane's report: they follow from parameters and results."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flexik.errors import DataError
from flexik.mechanisms.crane import STROKE_LIMIT
from flexik.parameters import load_parameters
from flexik.positioning.method import NOT_CONVERGED
from flexik.reporting import crane_notes, crane_report

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
    published = pd.DataFrame({"statistic": ["mean_error"], "none": [31.9], "combined": [4.1]})
    nothing = pd.DataFrame()
    return crane_report.Results(
        crane=crane,
        spring_stiffness=8e6,
        grid=nothing,
        selection=nothing,
        errors={},
        published=published,
        published_sizes={"deflection": 14},
        mesh_study=mesh,
        training=nothing,
        studies={},
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
    status = [0, NOT_CONVERGED, STROKE_LIMIT, NOT_CONVERGED]
    frames = {"none": frame([0.1] * 4), "new": frame([0.1] * 4, status)}
    assert crane_notes.failure_notes(frames) == [
        "new: failed conditions: 3 (needs a stroke outside the cylinder: 1; search ended above its "
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
    crane_report._write_mesh_table(results, tmp_path)
    text = (tmp_path / "mesh_study.md").read_text()
    assert "refinement 2" in text and "37 random samples" in text
    table = pd.read_csv(tmp_path / "mesh_study.csv")
    assert "n_samples" not in table
    assert table["mean (% of deflection)"].tolist() == [0.5, 0.0]
    less = dataclasses.replace(results, mesh_study=results.mesh_study.drop(columns="n_samples"))
    with pytest.raises(DataError, match=r"mesh study.*n_samples"):
        crane_report._write_mesh_table(less, tmp_path)


def test_a_method_that_is_not_published_has_no_column(results):
    assert set(results.published_columns.values()) == {"combined"}
    less = dataclasses.replace(results, published=results.published.drop(columns="combined"))
    assert less.published_columns == dict.fromkeys(results.crane.methods)


@pytest.mark.parametrize(("chosen", "at_the_end"), [(4, True), (5, False), (6, True)])
def test_the_size_table_tells_the_choice(results, tmp_path, chosen, at_the_end):
    (name, selected), *_ = results.crane.selected_networks.items()
    sizes = pd.DataFrame(
        {column: np.array([0.3, 0.2, 0.1]) for column in crane_report.SIZE_TABLE}
        | {"n_hidden": [4, 5, 6], "best_restart": [0, 2, 1], "n_failed": 0, "unused": 1.0}
    )
    results = dataclasses.replace(results, studies={name: (sizes, chosen)})
    crane_report._write_sizes_table(results, name, sizes, tmp_path)
    text = (tmp_path / "size_selection" / f"{name}.md").read_text()
    assert text.startswith(f"{name}: ") and f"of {selected.select.n_restarts} by" in text
    published = results.crane.networks["deflection"].n_hidden
    assert f"- chosen: {chosen}, published: {published}\n" in text
    assert ("end of the range" in text) == at_the_end
    table = pd.read_csv(tmp_path / "size_selection" / f"{name}.csv")
    assert list(table) == [column.replace("_", " ") for column in crane_report.SIZE_TABLE]
    assert table["selection error"].tolist() == [0.3, 0.2, 0.1]
    assert table["n hidden"].tolist() == [4, 5, 6]
