"""What the benchmarks of positioning and training methods compute beside their timings."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from flexik.errors import DataError

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def curve(n):
    """Error 1 / (1 + k) after k / 10 s."""
    from training_methods import Curve

    k = np.arange(n)
    return Curve("trainer", 3, k / 10, 1.0 / (1 + k), "time")


def test_a_short_curve_is_kept_whole():
    rows = curve(200).thinned(200)
    assert rows["seconds"].tolist() == curve(200).seconds.tolist()
    assert set(rows["trainer"]) == {"trainer"} and set(rows["start"]) == {3}


@pytest.mark.parametrize("n", [201, 5000])
def test_a_long_curve_keeps_its_ends_and_points_of_its_own(n):
    whole, rows = curve(n), curve(n).thinned(200)
    assert 100 < len(rows) <= 200
    assert rows["seconds"].iloc[[0, 1, -1]].tolist() == [0.0, 0.1, whole.seconds[-1]]
    assert rows["seconds"].is_monotonic_increasing and rows["seconds"].is_unique
    steps = (10 * rows["seconds"]).round().astype(int)
    np.testing.assert_array_equal(rows["error"], whole.errors[steps])


def test_rows_of_a_long_curve_are_spread_in_equal_ratios():
    seconds = curve(100_000).thinned(200)["seconds"].to_numpy()
    ratios = seconds[101:] / seconds[100:-1]  # before them iterations are farther apart
    np.testing.assert_allclose(ratios, 99_999 ** (1 / 198), rtol=0.05)


def test_error_at_a_time_and_time_of_an_error():
    own = curve(4)
    assert [own.at(seconds) for seconds in (0.0, 0.15, 0.2, 9.0)] == [1.0, 1 / 2, 1 / 3, 1 / 4]
    assert own.seconds_to(0.4) == 0.2
    assert own.seconds_to(0.25) == pytest.approx(0.3)
    assert own.seconds_to(0.2) is None


def test_missing_data_are_an_error_that_says_what_makes_them(tmp_path, monkeypatch):
    from positioning import cases

    shutil.copy(ROOT / "params.yaml", tmp_path)
    shutil.copytree(ROOT / "data/machines", tmp_path / "data/machines")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DataError, match=r"run `make repro` first: .*workspace\.parquet"):
        cases()
