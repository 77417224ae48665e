"""Evaluations, targets and the tolerance study on disk: names, units, round trips."""

import itertools

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.crane.evaluations import (
    CONDITION_FIELDS,
    TARGET_FIELDS,
    TOLERANCE_FIELDS,
    read_evaluation,
    write_evaluation,
)
from flexik.datasets.tables import read_table, stored_fields, write_table
from flexik.errors import DataError
from flexik.evaluation.conditions import random_conditions
from flexik.evaluation.errors import evaluate
from flexik.positioning.method import Command

CHECKSUM = "c0ffee"
STROKES = ["lift_stroke", "jib_stroke", "extension_stroke"]


def method(targets, payload, initial_strokes):
    """Some strokes, a count and a length a row."""
    n = len(targets)
    steps, residual = np.arange(n), np.linspace(0, 1e-3, n)
    status = np.zeros(n, dtype=np.int64)
    return Command(initial_strokes, status, {"n_steps": steps, "network_residual": residual})


@pytest.fixture(params=[5, 0])
def frame(request):
    """Errors at five targets, and at none."""
    n = request.param
    targets = np.column_stack([np.linspace(1, 6, n), np.linspace(-4, 7, n)])
    conditions = random_conditions(targets, np.linspace(30, 500, n))
    return evaluate(method, conditions, np.full((n, 3), 0.25), lambda s, m: s[:, :2])


def test_an_evaluation_comes_back_with_its_diagnostics(frame, tmp_path):
    path = tmp_path / "direct.parquet"
    write_evaluation(path, frame, CHECKSUM)
    pd.testing.assert_frame_equal(read_evaluation(path, CHECKSUM), frame)
    fields = {field.name: field for field in stored_fields(path)}
    assert (fields["n_steps"].dtype, fields["n_steps"].unit) == ("int64", "1")
    assert fields["network_residual"].unit == "m"


def test_an_evaluation_of_other_parameters_is_refused(frame, tmp_path):
    write_evaluation(tmp_path / "direct.parquet", frame, CHECKSUM)
    with pytest.raises(DataError, match="made with other parameters"):
        read_evaluation(tmp_path / "direct.parquet", "another")


def test_a_target_is_a_condition_and_the_strokes_that_reach_it():
    names = [field.name for field in TARGET_FIELDS]
    assert names == ["target_x", "target_y", "payload", *STROKES]
    assert [field.unit for field in TARGET_FIELDS] == ["m", "m", "kg", "m", "m", "m"]
    assert TARGET_FIELDS[:3] == CONDITION_FIELDS[1:4]


def test_the_tolerance_study_has_texts_counts_and_lengths(tmp_path):
    columns = {
        "method": np.array(["direct", "modular"], dtype=object),
        "tolerance": np.array([1e-5, 1e-7]),
        "mean_error": np.array([0.012, 0.011]),
        "max_error": np.array([0.03, 0.02]),
        "mean_iterations": np.array([20.5, 31.2]),
        "max_iterations": np.array([100, 5000]),
        "n_failed": np.array([0, 3]),
    }
    units = {"mean_error": "m", "max_error": "m"}
    assert [field.name for field in TOLERANCE_FIELDS] == list(columns)
    assert all(field.unit == units.get(field.name, "1") for field in TOLERANCE_FIELDS)
    path = tmp_path / "tolerance_study.parquet"
    write_table(path, columns, TOLERANCE_FIELDS, CHECKSUM)
    found = read_table(path, TOLERANCE_FIELDS, CHECKSUM)
    for name, values in columns.items():
        assert found[name].tolist() == values.tolist()


def test_every_column_says_what_it_is():
    for field in itertools.chain(CONDITION_FIELDS, TARGET_FIELDS, TOLERANCE_FIELDS):
        assert field.description and field.unit in {"1", "m", "kg"}
    for fields in (CONDITION_FIELDS, TARGET_FIELDS, TOLERANCE_FIELDS):
        names = [field.name for field in fields]
        assert len(set(names)) == len(names)
