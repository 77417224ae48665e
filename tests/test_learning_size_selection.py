"""Choosing the number of hidden neurons."""

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.tables import read_table
from flexik.errors import DataError, TrainingError
from flexik.files import write_json
from flexik.learning.perceptron import Quantity
from flexik.learning.size_selection import (
    FAILED,
    FIELDS,
    Study,
    by_size,
    choose,
    choose_layers,
    read_choice,
    read_layers,
    run_study,
    study_fields,
)
from flexik.learning.training import Architecture, train_best, trainer_settings

SETTINGS = trainer_settings("levenberg_marquardt_accelerated", {"n_iterations": 8})
QUANTITIES = ([Quantity("x", "m"), Quantity("y", "m")], [Quantity("z", "m")])


def surface(n, seed):
    x = np.random.default_rng(seed).uniform(-1, 1, (n, 2))
    return x, np.sin(3 * x[:, :1]) * x[:, 1:]


@pytest.fixture(scope="module")
def study():
    return Study(
        *surface(120, 0),
        *surface(60, 1),
        Architecture(2),
        SETTINGS,
        5,
        QUANTITIES[0],
        QUANTITIES[1],
    )


def run(study, path, sizes, n_restarts, n_workers=1):
    reused = run_study(
        path, study, sizes, n_restarts, "made", "key", ParallelSettings(n_workers), ""
    )
    return reused, read_table(path, FIELDS, "made")


def test_runs_are_the_restarts_of_train_best(study, tmp_path):
    _, runs = run(study, tmp_path / "study.parquet", [2, 5], 3)
    assert runs[["n_hidden", "restart"]].to_numpy().tolist() == [
        [size, restart] for size in (2, 5) for restart in range(3)
    ]
    _, best, records = train_best(
        *(study.inputs, study.outputs, study.selection_inputs, study.selection_outputs),
        *(Architecture(5), SETTINGS, 5, 3, *QUANTITIES),
    )
    of_size = runs[runs["n_hidden"] == 5]
    assert of_size["selection_error"].tolist() == [record.selection_error for record in records]
    sizes = by_size(runs).set_index("n_hidden")
    assert sizes.loc[5, "best_restart"] == best.restart
    assert sizes.loc[5, "training_error"] == pytest.approx(np.sqrt(best.errors[best.kept]))
    assert sizes.loc[5, "selection_error"] < sizes.loc[2, "selection_error"]


def test_result_does_not_depend_on_workers(study, tmp_path):
    paths = [tmp_path / f"{n}.parquet" for n in (1, 2)]
    for n_workers, path in enumerate(paths, start=1):
        run(study, path, [2, 3], 2, n_workers)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_run_that_cannot_train_is_a_row(study, tmp_path):
    _, runs = run(study, tmp_path / "study.parquet", [3, 200], 2)
    assert runs["stop_reason"].tolist()[2:] == [FAILED, FAILED]
    sizes = by_size(runs)
    assert sizes["n_failed"].tolist() == [0, 2]
    assert choose(sizes) == 3


def table(errors, restarts=1):
    rows = [
        (n_hidden, restart, error, error, 1, "goal")
        for n_hidden, error in errors.items()
        for restart in range(restarts)
    ]
    return by_size(pd.DataFrame(rows, columns=[field.name for field in FIELDS]))


def test_choice_is_the_least_error_or_the_smallest_within_the_tolerance():
    sizes = table({4: 0.5, 8: 0.11, 12: 0.1, 16: 0.3})
    assert choose(sizes) == 12
    assert choose(sizes, 0.05) == 12
    assert choose(sizes, 0.1) == 8
    assert choose(sizes, 10.0) == 4


def test_best_median_and_worst_of_restarts():
    rows = [(6, k, 0.2, error, 1, "goal") for k, error in enumerate([0.3, 0.1, np.nan, 0.2])]
    sizes = by_size(pd.DataFrame(rows, columns=[field.name for field in FIELDS])).iloc[0]
    assert sizes["best_restart"] == 1 and sizes["n_failed"] == 1
    assert sizes["selection_error"] == 0.1
    assert sizes["median_selection_error"] == pytest.approx(0.2)
    assert sizes["worst_selection_error"] == 0.3


def test_no_choice_when_all_fail():
    with pytest.raises(TrainingError, match="every run failed"):
        choose(table({4: np.nan, 8: np.nan}))


def test_pairs_of_layers_are_searched_like_single_ones(study, tmp_path):
    pairs, path = [(2, 3), (4, 3), (5, 200)], tmp_path / "study.parquet"
    run_study(path, study, pairs, 2, "made", "key", ParallelSettings(1), "")
    runs = read_table(path, study_fields(2), "made")
    assert runs[["n_hidden_1", "n_hidden_2"]].to_numpy().tolist() == [
        [*pair] for pair in pairs for _ in range(2)
    ]
    _, best, _ = train_best(
        *(study.inputs, study.outputs, study.selection_inputs, study.selection_outputs),
        *(Architecture((4, 3)), SETTINGS, 5, 2, *QUANTITIES),
    )
    sizes = by_size(runs).set_index(["n_hidden_1", "n_hidden_2"])
    assert sizes.loc[(4, 3), "selection_error"] == best.selection_error
    assert sizes["n_failed"].tolist() == [0, 0, 2]
    assert choose_layers(by_size(runs)) == (4, 3)


def test_smallest_pair_has_the_fewest_neurons():
    sizes = pd.DataFrame(
        {"n_hidden_1": [2, 4, 3], "n_hidden_2": [9, 4, 5], "selection_error": [1.0, 1.05, 1.05]}
    )
    assert choose_layers(sizes) == (2, 9)
    assert choose_layers(sizes, 0.1) == (3, 5)


def test_sizes_of_one_study_have_as_many_layers(study, tmp_path):
    with pytest.raises(TrainingError, match="as many hidden layers"):
        run_study(tmp_path / "s.parquet", study, [3, (2, 3)], 1, "", "", ParallelSettings(1), "")


def test_choices_are_read_back(tmp_path):
    path = tmp_path / "choice.json"
    for chosen, layers in ((7, (7,)), ([15, 13], (15, 13))):
        write_json(path, {"n_hidden": chosen})
        assert read_layers(path) == layers
    with pytest.raises(DataError, match="one hidden layer"):
        read_choice(path)
    for wrong in ([], [0, 3], "7", None):
        write_json(path, {"n_hidden": wrong})
        with pytest.raises(DataError, match="positive integer n_hidden"):
            read_layers(path)
