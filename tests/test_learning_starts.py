"""The study of initial weights: same starts for all, results of any number of workers."""

import numpy as np
import pandas as pd
import pytest

from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.tables import read_table
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.starts import FIELDS, NO_SUCCESS, StartStudy, by_trainer, run_starts
from flexik.learning.training import Architecture, train, trainer_settings

X, Y = [Quantity("x", "m"), Quantity("u", "m")], [Quantity("y", "m")]


def largest_weight(network: Network) -> float:
    return float(max(np.abs(matrix).max() for matrix in network.weights))


def study(**changes) -> StartStudy:
    inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))
    outputs = np.sin(2.0 * inputs[:, :1]) * inputs[:, 1:]
    options = {"lbfgs": 30, "regularised_cg": 10}
    given = {
        "inputs": inputs,
        "outputs": outputs,
        "architecture": Architecture(6),
        "trainers": {
            name: trainer_settings(name, {"n_iterations": n}) for name, n in options.items()
        },
        "spreads": {"near": 0.1, "far": 5.0},
        "success": 0.02,
        "seed": 4,
        "input_quantities": X,
        "output_quantities": Y,
        "judge": largest_weight,
    }
    return StartStudy(**(given | changes))


def run(path, chosen: StartStudy, n_workers: int = 1) -> pd.DataFrame:
    run_starts(path, chosen, 3, "made", "starts", ParallelSettings(n_workers), "")
    return read_table(path, FIELDS, "made")


def test_rows_are_the_runs_of_train(tmp_path):
    chosen = study()
    table = run(tmp_path / "starts.parquet", chosen)
    keys = list(table[["trainer", "spread", "start"]].itertuples(index=False, name=None))
    assert keys == [
        (trainer, spread, start)
        for trainer in chosen.trainers
        for spread in chosen.spreads
        for start in range(3)
    ]
    row = table.iloc[4]
    _, record = train(
        *(chosen.inputs, chosen.outputs, chosen.architecture, chosen.trainers["lbfgs"], 4, X, Y),
        restart=1,
        judge=largest_weight,
        spread=5.0,
    )
    assert row["error"] == min(record.errors)
    assert row["n_iterations"] == len(record.errors) - 1
    assert row["judged"] == record.selection_error
    assert row["stop_reason"] == record.stop_reason
    below = [k for k, error in enumerate(record.errors) if error <= chosen.success]
    assert row["success_iteration"] == (below[0] if below else NO_SUCCESS)


def test_any_number_of_workers_gives_the_same_file(tmp_path):
    for n_workers in (1, 2):
        run(tmp_path / f"{n_workers}.parquet", study(), n_workers)
    assert (tmp_path / "1.parquet").read_bytes() == (tmp_path / "2.parquet").read_bytes()


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
    table = run(tmp_path / "starts.parquet", study(spreads={"huge": 1e200}))
    assert set(table["stop_reason"]) == {"failed"}
    assert table["error"].isna().all()
    summary = by_trainer(table)
    assert (summary["n_failed"] == 3).all()
    assert summary["median_error"].isna().all()


def test_the_spread_is_that_of_the_name(tmp_path):
    still = {"lbfgs": trainer_settings("lbfgs", {"n_iterations": 1, "goal": 1e9})}
    table = run(tmp_path / "starts.parquet", study(trainers=still))
    assert table.loc[table["spread"] == "near", "judged"].to_numpy() == pytest.approx(0.1, rel=0.1)
    assert table.loc[table["spread"] == "far", "judged"].to_numpy() == pytest.approx(5.0, rel=0.1)
