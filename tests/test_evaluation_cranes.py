"""Statistics over many cranes as built."""

import itertools

import numpy as np
import pandas as pd
import pytest

from flexik.errors import DataError
from flexik.evaluation.crane_measured.statistics import (
    adaptation_statistics,
    budget_statistics,
    worse_shares,
)


def test_adaptation_statistics_are_by_method_and_twin():
    errors = pd.DataFrame(
        {
            "method": np.repeat(["unadapted", "adapted"], 42),
            "n_measurements": np.repeat([0, 9], 42),
            "twin": np.tile(np.repeat([5, 3], 21), 2),
            "error": np.concatenate([k * np.arange(21.0) for k in (4, 3, 2, 1)]),
        }
    )
    table = adaptation_statistics(errors)
    assert table["method"].tolist() == ["unadapted"] * 2 + ["adapted"] * 2
    assert table["n_measurements"].tolist() == [0, 0, 9, 9]
    assert table["twin"].tolist() == [3, 5, 3, 5]
    np.testing.assert_allclose(table["mean_error"], [30, 40, 10, 20])
    np.testing.assert_allclose(table["p95_error"], [57, 76, 19, 38])
    np.testing.assert_allclose(table["max_error"], [60, 80, 20, 40])
    with pytest.raises(DataError, match="every number of every twin"):
        adaptation_statistics(errors.iloc[:63])
    with pytest.raises(DataError, match="every number of every twin"):
        adaptation_statistics(errors.iloc[:0])


@pytest.fixture
def budget():
    """Two points, two payloads, three cranes; compensation spoils the second point of crane 2."""
    rows = []
    for (deviation, factor), twin, method, x, payload in itertools.product(
        [("all", 1.0), ("play", 0.0)], range(3), ["none", "combined"], [2.0, 3.0], [0.0, 172.0]
    ):
        error = {"none": 8.0, "combined": 4.0}[method] + twin + payload / 172.0
        if (twin, method, x) == (2, "combined", 3.0):
            error += 6.0
        reference = 0.0 if (method, payload) == ("combined", 0.0) else error - 3.0
        rows.append([deviation, factor, twin, method, x, 1.0, payload, error, reference])
    columns = ["deviation", "factor", "twin", "method", "target_x", "target_y", "payload"]
    return pd.DataFrame(rows, columns=[*columns, "error", "reference_error"])


def test_budget_statistics_are_means_of_a_crane(budget):
    table = budget_statistics(budget)
    assert table["deviation"].tolist() == ["all"] * 3 + ["play"] * 3
    assert table["twin"].tolist() == [0, 1, 2] * 2
    np.testing.assert_allclose(table["none"], [8.5, 9.5, 10.5] * 2)
    np.testing.assert_allclose(table["combined"], [4.5, 5.5, 9.5] * 2)
    np.testing.assert_allclose(table["none_reference"], [5.5, 6.5, 7.5] * 2)
    # 0 without load; with it 2, 3 and, of the two points of the third crane, 4 and 10
    np.testing.assert_allclose(table["combined_reference"], [1.0, 1.5, 3.5] * 2)


def test_shares_count_the_cranes_that_compensation_makes_worse(budget):
    table = worse_shares(budget, "all")
    assert table[["target_x", "target_y"]].to_numpy().tolist() == [[2.0, 1.0], [3.0, 1.0]]
    np.testing.assert_allclose(table["error"], [0.0, 1 / 3])
    np.testing.assert_allclose(table["reference_error"], [0.0, 1 / 3])
    assert worse_shares(budget, "none").empty
