"""The study of initial weights: same starts for all trainers."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from learning_problems import written

from flexik.datasets.tables import read_table
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.starts import NO_SUCCESS, by_trainer, from_starts
from flexik.learning.training import Architecture, Lesson, train
from flexik.parameters.trainers import Lbfgs, RegularisedCg

TRAINERS = {"lbfgs": Lbfgs(n_iterations=30), "penalised": RegularisedCg(n_iterations=10)}
SPREADS, SUCCESS = {"near": 0.1, "far": 5.0}, 0.02


def largest_weight(network: Network) -> float:
    return float(max(np.abs(matrix).max() for matrix in network.weights))


def lesson() -> Lesson:
    inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))
    outputs = np.sin(2.0 * inputs[:, :1]) * inputs[:, 1:]
    names = [Quantity("x", "m"), Quantity("u", "m")], [Quantity("y", "m")]
    return Lesson(
        inputs, outputs, *names, Architecture(6), TRAINERS["lbfgs"], 4, judge=largest_weight
    )


def run(folder, trainers=TRAINERS, spreads=SPREADS) -> pd.DataFrame:
    files = written(from_starts(lesson(), trainers, spreads, 3, SUCCESS), folder)
    return read_table(files[".parquet"])


def test_rows_are_the_runs_of_train(tmp_path):
    table = run(tmp_path)
    keys = list(table[["trainer", "spread", "start"]].itertuples(index=False, name=None))
    assert keys == [(t, spread, k) for t in TRAINERS for spread in SPREADS for k in range(3)]
    row, (_, record) = table.iloc[4], train(replace(lesson(), spread=5.0), 1)
    assert row["error"] == min(record.errors)
    assert row["n_iterations"] == len(record.errors) - 1
    assert row["judged"] == record.selection_error
    assert row["stop_reason"] == record.stop_reason
    below = [k for k, error in enumerate(record.errors) if error <= SUCCESS]
    assert row["success_iteration"] == (below[0] if below else NO_SUCCESS)


def test_a_summary_counts_successes_and_failures():
    columns = {
        "trainer": ["a"] * 4 + ["b"],
        "spread": ["near"] * 5,
        "start": [0, 1, 2, 3, 0],
        "error": [1.0, 3.0, 2.0, np.nan, 4.0],
        "n_iterations": [9, 9, 9, 0, 9],
        "success_iteration": [5, NO_SUCCESS, 7, NO_SUCCESS, NO_SUCCESS],
        "judged": [1.0, 2.0, 6.0, np.nan, 1.0],
        "stop_reason": ["goal", "iterations", "goal", "failed", "iterations"],
    }
    first, second = by_trainer(pd.DataFrame(columns)).to_dict("records")
    assert (first["success_share"], first["n_failed"], first["n_starts"]) == (0.5, 1, 4)
    assert [first[f"{k}_error"] for k in ("least", "median", "largest")] == [1.0, 2.0, 3.0]
    assert (first["median_success_iteration"], first["median_judged"]) == (6.0, 2.0)
    assert second["success_share"] == 0.0
    assert np.isnan(second["median_success_iteration"])


def test_a_run_without_a_network_is_a_failed_row(tmp_path):
    # weights so large that the outputs overflow
    table = run(tmp_path, spreads={"huge": 1e200})
    assert set(table["stop_reason"]) == {"failed"}
    assert table["error"].isna().all()
    summary = by_trainer(table)
    assert (summary["n_failed"] == 3).all()
    assert summary["median_error"].isna().all()


def test_the_spread_is_that_of_the_name(tmp_path):
    table = run(tmp_path, {"lbfgs": Lbfgs(n_iterations=1, goal=1e9)})
    assert table.loc[table["spread"] == "near", "judged"].to_numpy() == pytest.approx(0.1, rel=0.1)
    assert table.loc[table["spread"] == "far", "judged"].to_numpy() == pytest.approx(5.0, rel=0.1)
