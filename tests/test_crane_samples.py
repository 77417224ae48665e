"""Grid and random samples of the crane, and their statuses."""

import contextlib
import shutil

import crane_case
import numpy as np
import pandas as pd
import pytest
from crane_case import INPUTS, SAMPLE_FIELDS, TARGET_FIELDS
from hypothesis import given
from hypothesis import strategies as st

from flexik.cases.crane.section import SPRING
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import make
from flexik.datasets.tables import read_table
from flexik.errors import FlexikError, ParameterError, SolverError
from flexik.files import write_json
from flexik.kinematics.crane import forward
from flexik.multibody.planar import tips
from flexik.planar import samples as module
from flexik.planar import targets
from flexik.planar.fields import FAILED, KEPT, LEFT_OUT, deflection, kept
from flexik.planar.samples import (
    POSES_PER_PART,
    GridParts,
    Samples,
    axis,
    counts,
    failed_samples,
    random_samples,
    solve_samples,
    split,
)


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane()


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
    parts = GridParts(tuple(axes), (False, False, True))
    listed = [parts[i] for i in range(len(parts))]
    found = np.vstack([np.column_stack([p.values, p.payload]) for p in listed])
    lift, jib, extension, payload = axes
    # extension slowest, then lift, jib, payload fastest
    expected = [
        (a, b, c, m) for c in extension for a in lift for b in jib for m in payload
    ]  # fmt: skip
    assert np.array_equal(found, np.array(expected))
    assert parts.n_samples == len(expected)
    for part in listed:
        assert len(set(part.values[:, 2])) == 1
        assert 0 < len(part) <= POSES_PER_PART * n[3]
    assert [len(p) for p in parts] == [len(p) for p in listed]  # iteration ends
    for outside in (len(parts), -1):
        with pytest.raises(IndexError):
            parts[outside]


def test_a_grid_too_large_for_memory_is_cheap_until_asked_for():
    long = np.linspace(0, 1, 4000)
    parts = GridParts((long, long, long, long), (False, False, True))  # 2.6e14 samples
    assert parts.n_samples == 4000**4
    assert len(parts) == 4000 * -(-(4000**2) // POSES_PER_PART)
    last = parts[len(parts) - 1]
    assert last.values[-1].tolist() == [1, 1, 1]
    assert last.payload[-1] == 1


def test_grid_of_the_thesis(geometry):
    grid = crane_case.section().samples.grid
    parts = GridParts.of(crane_case.MACHINE, grid)
    assert parts.n_samples == 4050
    tip = np.vstack([forward(geometry, part.values) for part in parts])
    assert (tip[:, 0] >= 0.0).sum() == 3670


def test_random_samples_fill_their_ranges(geometry):
    samples = random_samples(crane_case.MACHINE, 2000, (30.0, 500.0), 0.0, seed=1)
    assert samples.values.shape == (2000, 3)
    assert len(samples) == 2000
    assert (samples.values >= 0).all() and (samples.values <= geometry.stroke_maximum).all()
    assert (forward(geometry, samples.values)[:, 0] >= 0).all()
    assert samples.payload.min() == pytest.approx(30, abs=2)
    assert samples.payload.max() == pytest.approx(500, abs=2)
    # uniform where every tip is in front: the payload's mean within five standard errors
    assert samples.payload.mean() == pytest.approx(265, abs=5 * 470 / np.sqrt(12 * 2000))
    assert np.abs(np.corrcoef(samples.values[:, 2], samples.payload)[0, 1]) < 0.12


def test_random_samples_follow_their_seed(geometry):
    first, again, other = (
        random_samples(crane_case.MACHINE, 50, (1.0, 2.0), 0.0, s) for s in (1, 1, 2)
    )
    assert np.array_equal(first.values, again.values)
    assert np.array_equal(first.payload, again.payload)
    assert not np.array_equal(first.values, other.values)


def test_a_limit_that_few_poses_keep_is_met_by_drawing_again(geometry):
    samples = random_samples(crane_case.MACHINE, 40, (1.0, 2.0), 6.0, seed=1)
    assert len(samples.values) == len(samples.payload) == 40
    assert (forward(geometry, samples.values)[:, 0] >= 6.0).all()


def test_a_limit_that_no_pose_keeps_is_told(geometry):
    with pytest.raises(ParameterError, match=r"minimum_tip_x: .*9\.0 m"):
        random_samples(crane_case.MACHINE, 5, (1.0, 2.0), 9.0, seed=1)


@given(st.integers(0, 25), st.integers(1, 12))
def test_split_keeps_all_rows_in_order(n, n_rows):
    samples = Samples(np.arange(3.0 * n).reshape(n, 3), np.arange(float(n)))
    parts = split(samples, n_rows)
    assert all(0 < len(part) <= n_rows for part in parts)
    assert np.array_equal(np.vstack([np.empty((0, 3)), *(p.values for p in parts)]), samples.values)
    assert np.array_equal(np.concatenate([[], *(p.payload for p in parts)]), samples.payload)


@pytest.fixture(scope="module")
def mixed():
    """Kept, behind the slew axis, and one with a payload no crane holds, between two kept."""
    strokes = np.array(
        [[0.2, 0.1, 0.4], [0.535, 0.78, 0.4], [0.2, 0.1, 0.4], [0.3, 0.2, 0.4], [0.3, 0.2, 0.8]]
    )
    return Samples(strokes, np.array([100.0, 100.0, 1e9, 200.0, 200.0]))


def test_every_sample_is_a_row_with_its_status(crane, mixed):
    columns = solve_samples(crane, 0.0, mixed)
    assert list(columns) == [field.name for field in SAMPLE_FIELDS]
    table = pd.DataFrame(columns)
    assert table["status"].tolist() == [KEPT, LEFT_OUT, FAILED, KEPT, KEPT]
    assert np.array_equal(table[list(INPUTS)], np.column_stack([mixed.values, mixed.payload]))
    rigid = forward(crane.geometry, mixed.values)
    assert np.array_equal(table[["rigid_x", "rigid_y"]], rigid)
    assert rigid[1, 0] < 0
    solved = table["status"] == KEPT
    found = table.loc[solved, ["tip_x", "tip_y"]].to_numpy()
    alone = [tips(crane, mixed.values[[i]], mixed.payload[[i]])[0] for i in (0, 3, 4)]
    assert found == pytest.approx(np.array(alone), abs=2e-7)
    assert table.loc[~solved, ["tip_x", "tip_y"]].isna().all(axis=None)
    assert table.drop(columns=["tip_x", "tip_y"]).notna().all(axis=None)
    assert counts(table) == {"n_samples": 5, "n_kept": 3, "n_left_out": 1, "n_failed": 1}
    assert failed_samples(crane_case.MACHINE, table) == [
        "lift_stroke 0.2, jib_stroke 0.1, extension_stroke 0.4, payload 1e+09"
    ]
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
    table = pd.DataFrame({name: [0.0] for name in INPUTS} | {"status": [0]})
    assert failed_samples(crane_case.MACHINE, table) == []


@pytest.fixture(scope="module")
def commanded(geometry):
    """Three extensions and one kept by chance, in no order, a sample twice."""
    samples = random_samples(crane_case.MACHINE, 7, (30.0, 500.0), 0.0, seed=3)
    strokes, payload = samples.values.copy(), samples.payload.copy()
    strokes[[0, 3, 5], 2], strokes[[1, 4], 2], strokes[[2], 2] = 0.8, 0.0, 1.6
    return np.vstack([strokes, strokes[3:4]]), np.append(payload, payload[3])


def test_tips_of_one_extension_together_are_the_tips_in_their_order(crane, commanded):
    strokes, payload = commanded
    found = tips(crane, strokes, payload)
    alone = [tips(crane, strokes[[i]], payload[[i]])[0] for i in range(len(payload))]
    assert found == pytest.approx(np.array(alone), abs=2e-7)
    assert found[3] == pytest.approx(found[-1], abs=2e-7)
    order = np.random.default_rng(5).permutation(len(payload))
    again = tips(crane, strokes[order], payload[order])
    assert again == pytest.approx(found[order], abs=2e-7)
    assert tips(crane, np.empty((0, 3)), np.empty(0)).shape == (0, 2)
    with pytest.raises(SolverError):
        tips(crane, strokes, np.where(np.arange(len(payload)) == 2, 1e9, payload))


def test_strokes_that_do_not_assemble_fail_and_are_not_left_out(crane):
    samples = Samples(np.array([[0.1, 3.0, 1.0], [0.1, 0.1, 1.0]]), np.full(2, 100.0))
    columns = solve_samples(crane, 0.0, samples)
    assert columns["status"].tolist() == [FAILED, KEPT]


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Folder with little more than a calibrated crane."""
    shutil.copytree(crane_case.ROOT / "data/reference/crane", tmp_path / "data/reference/crane")
    write_json(tmp_path / "data/crane/constants/constants.json", {"constants": {SPRING: 8e6}})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def small(**changes):
    """Section with a small grid, and few targets with `changes`."""
    section = crane_case.section()
    axes = {
        name: section.samples.grid[name].model_copy(update={"increment": step})
        for name, step in (("lift", 0.535), ("jib", 0.39), ("extension", 0.8), ("payload", 225.0))
    }
    grid = section.samples.grid | axes
    selection = section.samples.selection.model_copy(update={"n_samples": 9})
    samples = section.samples.model_copy(update={"grid": grid, "selection": selection})
    random = section.conditions["workspace"].model_copy(update={"n_targets": 20, **changes})
    conditions = {**section.conditions, "workspace": random}
    return section.model_copy(update={"samples": samples, "conditions": conditions})


def test_tables_do_not_depend_on_the_workers(project, monkeypatch):
    monkeypatch.setattr(targets, "ROWS", 7)
    section = small()
    for folder, n_workers in (("one", 1), ("two", 2)):
        parts = [*module.parts(section), *targets.parts(section)]
        make(folder, parts, ParallelSettings(n_workers=n_workers))
    for name in ("grid", "selection", "workspace"):
        one, two = (project / folder / f"{name}.parquet" for folder in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
    grid = read_table(project / "one/grid.parquet", SAMPLE_FIELDS)
    assert len(grid) == 2 * 3 * 3 * 3
    assert set(grid["status"]) == {KEPT, LEFT_OUT}
    table, random = read_table(project / "one/workspace.parquet"), section.conditions["workspace"]
    assert len(table) == 20
    for name, (least, most) in zip(
        ("target_x", "target_y", "payload"), (random.x, random.y, random.payload), strict=True
    ):
        assert table[name].between(least, most).all()
    assert (table["target_x"] >= section.samples.minimum_tip_x).all()
    strokes = table[["lift_stroke", "jib_stroke", "extension_stroke"]].to_numpy()
    assert (strokes >= 0).all() and (strokes <= section.geometry.stroke_maximum).all()
    tip = tips(crane_case.crane(), strokes, table["payload"].to_numpy())
    off = np.linalg.norm(tip - table[["target_x", "target_y"]].to_numpy(), axis=1)
    assert (off < 1.01 * random.tolerance).all()


def drawn(section):
    """Targets and payloads of set `workspace`."""
    (part,) = targets.parts(section)
    with contextlib.redirect_stdout(None):
        work = part.prepare(**part.settings, constants=part.inputs["constants"], sections={})
    results = [work.function(item) for item in work.items]
    writers = work.finish(results)
    writers[".parquet"]("targets.parquet")
    names = [field.name for field in TARGET_FIELDS[:3]]
    return read_table("targets.parquet")[names].to_numpy()


def test_fewer_targets_are_the_first_of_more_and_another_seed_gives_others(project):
    more = drawn(small())
    assert np.array_equal(drawn(small(n_targets=6)), more[:6])
    assert not np.isin(drawn(small(seed=22)), more).any()


def test_targets_are_sought_on_where_the_first_do_not_do(project, monkeypatch):
    all_at_once = drawn(small())
    monkeypatch.setattr(targets, "TRIED", 0.3)
    monkeypatch.setattr(targets, "ROWS", 4)
    assert np.array_equal(drawn(small()), all_at_once)
    with pytest.raises(ParameterError, match=r"crane.conditions.workspace: of 60 .* only 0 are"):
        drawn(small(x=(9.0, 10.0), n_targets=3))


def test_too_many_failures_are_an_error_that_names_the_first(project, monkeypatch):
    heavy = {
        "payload": small()
        .samples.grid["payload"]
        .model_copy(update={"maximum": 1e8, "increment": 1e8 - 50.0})
    }
    section = small()
    grid = section.samples.grid | heavy
    samples = section.samples.model_copy(update={"grid": grid, "maximum_failed_share": 0.1})
    parts = module.parts(section.model_copy(update={"samples": samples}))[:1]
    with pytest.raises(FlexikError, match=r"grid: .* of 36 samples failed.*0\.1; first: lift"):
        make("grid", parts, ParallelSettings(n_workers=1))
    assert not (project / "grid/grid.parquet").exists()
