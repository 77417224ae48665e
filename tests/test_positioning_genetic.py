"""Rigid inverse by the genetic algorithm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.kinematics.crane import forward
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import NOT_CONVERGED, REACHED
from flexik.positioning import genetic as module
from flexik.positioning.genetic import Genetic, GeneticManipulator, first_generation


def distance(geometry, strokes, targets):
    return np.linalg.norm(forward(geometry, strokes) - targets, axis=1)


@pytest.fixture(scope="module")
def solved(geometry, points):
    current = CraneManipulator(geometry).initial_positions(points)
    return current, GeneticManipulator(CraneManipulator(geometry), Genetic(seed=3)).inverse(
        points, current
    )


def test_reaches_the_test_points(geometry, points, solved):
    _, (strokes, status, diagnostics) = solved
    reached = distance(geometry, strokes, points)
    assert (status == REACHED).all()
    assert (reached < 5e-3).all()
    assert reached == pytest.approx(diagnostics["rigid_distance"], abs=1e-12)
    assert diagnostics["n_generations"].min() > 1  # the rounded strokes themselves are too far
    assert diagnostics["n_generations"].max() <= 1000
    assert (strokes >= 0).all() and (strokes <= geometry.stroke_maximum).all()


def test_rows_do_not_depend_on_order_grouping_or_numpys_global_state(geometry, points, solved):
    current, (strokes, _, diagnostics) = solved
    rows = np.array([7, 2, 7, 20])
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    again = GeneticManipulator(CraneManipulator(geometry), Genetic(seed=3)).inverse(
        points[rows], current[rows]
    )
    assert np.array_equal(again.values, strokes[rows])
    generations = diagnostics["n_generations"]
    assert np.array_equal(again.diagnostics["n_generations"], generations[rows])
    assert np.array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_another_seed_gives_another_search(geometry, points, solved):
    current, (strokes, _, _) = solved
    other = GeneticManipulator(CraneManipulator(geometry), Genetic(seed=4)).inverse(
        points[:3], current[:3]
    )
    assert (other.values != strokes[:3]).any(axis=1).all()


def test_first_generation_holds_the_current_strokes_twice(geometry, points, monkeypatch):
    current = np.array([0.2, 0.3, 0.4])
    seen = []

    class Spy(module._Distance):
        def _evaluate(self, x, out, *args, **kwargs):
            seen.append(x.copy())
            super()._evaluate(x, out, *args, **kwargs)

    monkeypatch.setattr(module, "_Distance", Spy)
    chosen = Genetic(n_generations=4, tolerance=1e-9)
    GeneticManipulator(CraneManipulator(geometry), chosen).inverse(
        points[:2], np.tile(current, (2, 1))
    )
    assert [x.shape for x in seen] == [(15, 3)] * 8  # a whole generation at once
    assert (seen[0] != seen[4]).all(axis=1).sum() == 13  # each row has its own random numbers
    assert (seen[0] == current).all(axis=1).sum() == 2
    assert len(np.unique(seen[0], axis=0)) == 14
    every = np.vstack(seen)
    assert (every >= 0).all() and (every <= geometry.stroke_maximum).all()


@settings(deadline=None)
@given(
    current=st.tuples(*[st.floats(-0.1, 2.0)] * 3).map(np.array),
    n=st.integers(2, 20),
    n_current=st.integers(0, 2),
)
def test_first_generation_lies_within_the_strokes(geometry, current, n, n_current):
    chosen = Genetic(n_individuals=n, n_current=n_current)
    population = first_generation(
        CraneManipulator(geometry), chosen, current, np.random.default_rng(0)
    )
    assert population.shape == (n, 3)
    assert (population >= 0).all() and (population <= geometry.stroke_maximum).all()
    clipped = np.clip(current, 0.0, geometry.stroke_maximum)
    assert (population[:n_current] == clipped).all()


@settings(max_examples=10, deadline=None)
@given(fraction=st.tuples(*[st.floats(0.0, 1.0)] * 3).map(np.array))
def test_current_strokes_on_the_target_are_kept(geometry, fraction):
    current = (fraction * geometry.stroke_maximum)[None]
    target = forward(geometry, current) + 3e-3
    strokes, status, diagnostics = GeneticManipulator(
        CraneManipulator(geometry), Genetic()
    ).inverse(target, current)
    assert status[0] == REACHED
    assert diagnostics["n_generations"][0] == 1
    assert distance(geometry, strokes, target)[0] < 5e-3


def test_unreachable_target_is_counted_and_stays(geometry):
    current = np.array([[0.1, 0.2, 0.3]])
    chosen = Genetic(n_generations=5)
    strokes, status, diagnostics = GeneticManipulator(CraneManipulator(geometry), chosen).inverse(
        np.array([[9.0, 9.0]]), current
    )
    assert status.tolist() == [NOT_CONVERGED]
    assert np.array_equal(strokes, current)
    assert diagnostics["n_generations"].tolist() == [5]
    assert diagnostics["rigid_distance"][0] > 1.0


def test_no_rows(geometry):
    strokes, status, _ = GeneticManipulator(CraneManipulator(geometry), Genetic()).inverse(
        np.empty((0, 2)), np.empty((0, 3))
    )
    assert strokes.shape == (0, 3) and status.shape == (0,)


@pytest.mark.parametrize(
    "wrong",
    [
        {"n_current": 16},
        {"n_individuals": 1},
        {"tolerance": 0.0},
        {"n_generations": 0},
        {"seed": -1},
    ],
)
def test_settings_are_checked(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Genetic(**wrong)
