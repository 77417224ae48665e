"""Grid and random samples of the crane, and their statuses."""

import functools
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.datasets.crane.grid import (
    FAILED,
    FIELDS,
    INPUTS,
    KEPT,
    LEFT_OUT,
    POSES_PER_PART,
    GridParts,
    Samples,
    axis,
    counts,
    deflection,
    failed_samples,
    generate,
    kept,
    parallel_tips,
    random_samples,
    solve_samples,
    split,
)
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import forward
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import tips
from flexik.parameters import load_parameters

ROOT = Path(__file__).parents[1]
SPRING = 8e6  # N m/rad


@pytest.fixture(scope="module")
def parameters():
    return load_parameters(ROOT / "params.yaml")


@pytest.fixture(scope="module")
def crane(parameters):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)  # sections are named relative to the project
        return flexible_crane(parameters.crane, SPRING)


@pytest.mark.parametrize(
    ("given_", "expected"),
    [
        ((0.0, 0.535, 0.066875), np.arange(9) * 0.066875),
        ((0.0, 0.78, 0.0975), np.arange(9) * 0.0975),
        ((50.0, 500.0, 50.0), np.arange(1, 11) * 50.0),
        ((0.3, 0.3, 0.1), [0.3]),
    ],
)
def test_axes_have_both_ends(given_, expected):
    values = axis(*given_)
    assert values == pytest.approx(np.array(expected), abs=1e-15)
    assert (values[0], values[-1]) == given_[:2]


def lengths():
    return st.tuples(st.integers(1, 11), st.integers(1, 11), st.integers(1, 4), st.integers(1, 4))


@given(lengths())
def test_parts_are_the_full_factorial_once_in_order(n):
    rng = np.random.default_rng(n)
    axes = [np.sort(rng.uniform(0, 1, k)) for k in n]
    parts = GridParts(*axes)
    listed = [parts[i] for i in range(len(parts))]
    found = np.vstack([np.column_stack([p.strokes, p.payload]) for p in listed])
    lift, jib, extension, payload = axes
    # extension slowest, then lift, jib, payload fastest
    expected = [
        (a, b, c, m) for c in extension for a in lift for b in jib for m in payload
    ]  # fmt: skip
    assert np.array_equal(found, np.array(expected))
    assert parts.n_samples == len(expected)
    for part in listed:
        assert len(set(part.strokes[:, 2])) == 1
        assert 0 < len(part) <= POSES_PER_PART * n[3]
    assert [len(p) for p in parts] == [len(p) for p in listed]  # iteration ends
    for outside in (len(parts), -1):
        with pytest.raises(IndexError):
            parts[outside]


def test_a_grid_too_large_for_memory_is_cheap_until_asked_for():
    long = np.linspace(0, 1, 4000)
    parts = GridParts(long, long, long, long)  # 2.6e14 samples
    assert parts.n_samples == 4000**4
    assert len(parts) == 4000 * -(-(4000**2) // POSES_PER_PART)
    last = parts[len(parts) - 1]
    assert last.strokes[-1].tolist() == [1, 1, 1]
    assert last.payload[-1] == 1


def test_grid_of_the_thesis(geometry, parameters):
    grid = parameters.crane.grid
    parts = GridParts(**{n: axis(**getattr(grid, n).model_dump()) for n in GridParts.AXES})
    assert parts.n_samples == 4050
    tip = np.vstack([forward(geometry, part.strokes) for part in parts])
    assert (tip[:, 0] >= grid.minimum_tip_x).sum() == 3670


def test_random_samples_fill_their_ranges(geometry):
    samples = random_samples(geometry, 2000, (30.0, 500.0), 0.0, seed=1)
    assert samples.strokes.shape == (2000, 3)
    assert len(samples) == 2000
    assert (samples.strokes >= 0).all() and (samples.strokes <= geometry.stroke_maximum).all()
    assert (forward(geometry, samples.strokes)[:, 0] >= 0).all()
    assert samples.payload.min() == pytest.approx(30, abs=2)
    assert samples.payload.max() == pytest.approx(500, abs=2)
    # uniform where every tip is in front: the payload's mean within five standard errors
    assert samples.payload.mean() == pytest.approx(265, abs=5 * 470 / np.sqrt(12 * 2000))
    assert np.abs(np.corrcoef(samples.strokes[:, 2], samples.payload)[0, 1]) < 0.12


def test_random_samples_follow_their_seed(geometry):
    first, again, other = (random_samples(geometry, 50, (1.0, 2.0), 0.0, s) for s in (1, 1, 2))
    assert np.array_equal(first.strokes, again.strokes)
    assert np.array_equal(first.payload, again.payload)
    assert not np.array_equal(first.strokes, other.strokes)


def test_a_limit_that_few_poses_keep_is_met_by_drawing_again(geometry):
    samples = random_samples(geometry, 40, (1.0, 2.0), 6.0, seed=1)
    assert len(samples.strokes) == len(samples.payload) == 40
    assert (forward(geometry, samples.strokes)[:, 0] >= 6.0).all()


def test_a_limit_that_no_pose_keeps_is_told(geometry):
    with pytest.raises(ParameterError, match=r"minimum_tip_x: .*9\.0 m"):
        random_samples(geometry, 5, (1.0, 2.0), 9.0, seed=1)


@given(st.integers(0, 25), st.integers(1, 12))
def test_split_keeps_all_rows_in_order(n, n_rows):
    samples = Samples(np.arange(3.0 * n).reshape(n, 3), np.arange(float(n)))
    parts = split(samples, n_rows)
    assert all(0 < len(part) <= n_rows for part in parts)
    assert np.array_equal(
        np.vstack([np.empty((0, 3)), *(p.strokes for p in parts)]), samples.strokes
    )
    assert np.array_equal(np.concatenate([[], *(p.payload for p in parts)]), samples.payload)


@pytest.fixture(scope="module")
def mixed():
    """Kept, behind the slew axis, and one with a payload no crane holds, between two kept."""
    strokes = np.array(
        [[0.2, 0.1, 0.4], [0.535, 0.78, 0.4], [0.2, 0.1, 0.4], [0.3, 0.2, 0.4], [0.3, 0.2, 0.8]]
    )
    return Samples(strokes, np.array([100.0, 100.0, 1e7, 200.0, 200.0]))


def test_every_sample_is_a_row_with_its_status(crane, mixed):
    columns = solve_samples(crane, 0.0, mixed)
    assert list(columns) == [field.name for field in FIELDS]
    table = pd.DataFrame(columns)
    assert table["status"].tolist() == [KEPT, LEFT_OUT, FAILED, KEPT, KEPT]
    assert np.array_equal(table[list(INPUTS)], np.column_stack([mixed.strokes, mixed.payload]))
    rigid = forward(crane.geometry, mixed.strokes)
    assert np.array_equal(table[["rigid_x", "rigid_y"]], rigid)
    assert rigid[1, 0] < 0
    solved = table["status"] == KEPT
    found = table.loc[solved, ["tip_x", "tip_y"]].to_numpy()
    alone = [tips(crane, mixed.strokes[[i]], mixed.payload[[i]])[0] for i in (0, 3, 4)]
    assert found == pytest.approx(np.array(alone), abs=2e-7)
    assert table.loc[~solved, ["tip_x", "tip_y"]].isna().all(axis=None)
    assert table.drop(columns=["tip_x", "tip_y"]).notna().all(axis=None)
    assert counts(table) == {"n_samples": 5, "n_kept": 3, "n_left_out": 1, "n_failed": 1}
    assert failed_samples(table) == ["strokes (0.2, 0.1, 0.4) m with 1e+07 kg"]
    usable = kept(table)
    assert usable.index.tolist() == [0, 1, 2]
    assert usable["payload"].tolist() == [100, 200, 200]
    assert np.array_equal(deflection(usable), found - rigid[[0, 3, 4]])
    assert (deflection(usable)[:, 1] < 0).all()  # it sags


def test_limit_of_the_tip_is_inclusive(crane):
    strokes = np.array([[0.2, 0.1, 0.4]])
    x = forward(crane.geometry, strokes)[0, 0]
    for limit, status in ((x, KEPT), (np.nextafter(x, np.inf), LEFT_OUT)):
        found = solve_samples(crane, limit, Samples(strokes, np.array([100.0])))
        assert found["status"].tolist() == [status]


def test_no_failure_no_text():
    assert failed_samples(pd.DataFrame({name: [0.0] for name in INPUTS} | {"status": [0]})) == []


def test_generated_tables_are_the_same_for_one_and_two_workers(crane, mixed, tmp_path):
    parts = split(mixed, 2)
    for n_workers in (1, 2):
        path = tmp_path / str(n_workers) / "grid.parquet"
        settings = ParallelSettings(n_workers)
        assert generate(path, crane, parts, 0.0, "made with", "key", settings, "") == 0
        assert [child.name for child in path.parent.iterdir()] == ["grid.parquet"]
    first, second = ((tmp_path / n / "grid.parquet").read_bytes() for n in "12")
    assert first == second
    table = read_table(tmp_path / "1" / "grid.parquet", FIELDS, "made with")
    assert table["status"].tolist() == [KEPT, LEFT_OUT, FAILED, KEPT, KEPT]


@pytest.fixture(scope="module")
def commanded(geometry):
    """Three extensions and one kept by chance, in no order, a sample twice."""
    samples = random_samples(geometry, 7, (30.0, 500.0), 0.0, seed=3)
    strokes, payload = samples.strokes.copy(), samples.payload.copy()
    strokes[[0, 3, 5], 2], strokes[[1, 4], 2], strokes[[2], 2] = 0.8, 0.0, 1.6
    return np.vstack([strokes, strokes[3:4]]), np.append(payload, payload[3])


@pytest.mark.parametrize("n_workers", [1, 2])
def test_parallel_tips_are_the_tips_in_their_order(crane, commanded, n_workers, monkeypatch):
    monkeypatch.setattr("flexik.datasets.crane.grid.split", functools.partial(split, n_rows=3))
    strokes, payload = commanded
    found = parallel_tips(crane, strokes, payload, ParallelSettings(n_workers))
    alone = [tips(crane, strokes[[i]], payload[[i]])[0] for i in range(len(payload))]
    assert found == pytest.approx(np.array(alone), abs=2e-7)
    assert np.array_equal(found[3], found[-1])
    order = np.random.default_rng(5).permutation(len(payload))
    again = parallel_tips(crane, strokes[order], payload[order], ParallelSettings(n_workers))
    assert np.array_equal(again, found[order])


def test_parallel_tips_of_nothing_are_none(crane):
    found = parallel_tips(crane, np.empty((0, 3)), np.empty(0), ParallelSettings(1))
    assert found.shape == (0, 2)


def test_parallel_tips_tell_a_row_without_equilibrium(crane, commanded):
    strokes, payload = commanded
    heavy = np.where(np.arange(len(payload)) == 2, 1e7, payload)
    with pytest.raises(SolverError):
        parallel_tips(crane, strokes, heavy, ParallelSettings(1))


def test_strokes_that_do_not_assemble_fail_and_are_not_left_out(crane):
    samples = Samples(np.array([[0.1, 3.0, 1.0], [0.1, 0.1, 1.0]]), np.full(2, 100.0))
    columns = solve_samples(crane, 0.0, samples)
    assert columns["status"].tolist() == [FAILED, KEPT]
