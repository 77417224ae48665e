"""Choosing the number of hidden neurons."""

import numpy as np
import pandas as pd
import pytest
from learning_problems import written

from flexik.datasets.tables import read_table
from flexik.errors import DataError, TrainingError
from flexik.files import write_json
from flexik.learning.perceptron import Quantity
from flexik.learning.size_selection import (
    FAILED,
    FIELDS,
    by_size,
    choose_layers,
    read_layers,
    select,
)
from flexik.learning.training import Architecture, Lesson, train_best
from flexik.parameters.trainers import LevenbergMarquardtAccelerated

QUANTITIES = [Quantity("x", "m"), Quantity("y", "m")], [Quantity("z", "m")]


def surface(n, seed):
    x = np.random.default_rng(seed).uniform(-1, 1, (n, 2))
    return x, np.sin(3 * x[:, :1]) * x[:, 1:]


def lesson(n_hidden=2):
    settings = LevenbergMarquardtAccelerated(n_iterations=8)
    given = *surface(120, 0), *QUANTITIES, Architecture(n_hidden), settings, 5
    return Lesson(*given, selection=surface(60, 1))


@pytest.mark.parametrize("sizes", [[(2,), (5,), (200,)], [(2, 3), (4, 3), (5, 200)]])
def test_runs_are_the_restarts_of_a_network_of_that_size(sizes, tmp_path):
    files = written(select(lesson(), sizes, 3), tmp_path)
    runs, one_layer = read_table(files[".parquet"]), len(sizes[0]) == 1
    layers = ["n_hidden"] if one_layer else ["n_hidden_1", "n_hidden_2"]
    assert runs[[*layers, "restart"]].to_numpy().tolist() == [
        [*size, restart] for size in sizes for restart in range(3)
    ]
    _, best, records = train_best(lesson(sizes[1]), 3)
    of_size = runs[(runs[layers].to_numpy() == sizes[1]).all(axis=1)]
    assert of_size["selection_error"].tolist() == [record.selection_error for record in records]
    table = by_size(runs)
    assert table.loc[1, "best_restart"] == best.restart
    assert table.loc[1, "training_error"] == best.training_error
    assert table.loc[1, "selection_error"] < table.loc[0, "selection_error"]
    # more weights than numbers to fit
    assert set(runs["stop_reason"][6:]) == {FAILED}
    assert table["n_failed"].tolist() == [0, 0, 3]
    assert read_layers(files[".json"]) == sizes[1] == choose_layers(table)


def test_without_a_tolerance_nothing_is_chosen(tmp_path):
    assert list(written(select(lesson(), [(2,)], 1, None), tmp_path)) == [".parquet"]


def table(errors, restarts=1):
    rows = [
        (n_hidden, restart, error, error, 1, "goal")
        for n_hidden, error in errors.items()
        for restart in range(restarts)
    ]
    return by_size(pd.DataFrame(rows, columns=[field.name for field in FIELDS]))


def test_choice_is_the_least_error_or_the_smallest_within_the_tolerance():
    sizes = table({4: 0.5, 8: 0.11, 12: 0.1, 16: 0.3})
    assert choose_layers(sizes) == (12,)
    assert choose_layers(sizes, 0.05) == (12,)
    assert choose_layers(sizes, 0.1) == (8,)
    assert choose_layers(sizes, 10.0) == (4,)


def test_best_median_and_worst_of_restarts():
    rows = [(6, k, 0.2, error, 1, "goal") for k, error in enumerate([0.3, 0.1, np.nan, 0.2])]
    sizes = by_size(pd.DataFrame(rows, columns=[field.name for field in FIELDS])).iloc[0]
    assert sizes["best_restart"] == 1 and sizes["n_failed"] == 1
    assert sizes["selection_error"] == 0.1
    assert sizes["median_selection_error"] == pytest.approx(0.2)
    assert sizes["worst_selection_error"] == 0.3


def test_no_choice_when_all_fail():
    with pytest.raises(TrainingError, match="every run failed"):
        choose_layers(table({4: np.nan, 8: np.nan}))


def test_smallest_pair_has_the_fewest_neurons():
    sizes = pd.DataFrame(
        {"n_hidden_1": [2, 4, 3], "n_hidden_2": [9, 4, 5], "selection_error": [1.0, 1.05, 1.05]}
    )
    assert choose_layers(sizes) == (2, 9)
    assert choose_layers(sizes, 0.1) == (3, 5)


def test_sizes_of_one_study_have_as_many_layers():
    with pytest.raises(TrainingError, match="as many hidden layers"):
        select(lesson(), [(3,), (2, 3)], 1)


def test_choices_are_read_back(tmp_path):
    path = tmp_path / "choice.json"
    for chosen, layers in ((7, (7,)), ([15, 13], (15, 13))):
        write_json(path, {"n_hidden": chosen})
        assert read_layers(path) == layers
    for wrong in ([], [0, 3], "7", None):
        write_json(path, {"n_hidden": wrong})
        with pytest.raises(DataError, match="positive integer n_hidden"):
            read_layers(path)
