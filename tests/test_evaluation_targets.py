"""Random targets of the loaded crane and the strokes that reach them."""

import functools

import crane_case
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.errors import ParameterError
from flexik.evaluation.targets import (
    Targets,
    draw_candidates,
    reachable_targets,
    solve_targets,
)
from flexik.kinematics.crane import forward
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.manipulator import RigidSolution
from flexik.kinematics.status import ACTUATOR_LIMIT
from flexik.multibody.planar import solve, tips
from flexik.positioning.method import PositioningError

LOWER, UPPER, PAYLOAD = (0.0, -4.5), (6.5, 8.0), (30.0, 500.0)


def candidates(n, seed=1):
    return draw_candidates(n, LOWER, UPPER, PAYLOAD, np.random.default_rng(seed))


class Gantry:
    """The first two coordinates are those of the rigid tip, in a square of one metre."""

    lower, upper = np.zeros(3), np.ones(3)

    def forward(self, values):
        """Tip."""
        return values[:, :2]

    def inverse(self, targets, current, original_targets=None):
        """Coordinates."""
        inside = ((targets >= 0.0) & (targets <= 1.0)).all(axis=1)
        values = np.column_stack([targets, np.zeros(len(targets))])
        values = np.where(inside[:, None], values, current)
        return RigidSolution(values, np.where(inside, 0, ACTUATOR_LIMIT), {})


def growing(share, strokes, payload):
    """Tip of a gantry that bends by `share` of its coordinates a kilogram."""
    return strokes[:, :2] * (1.0 + share * payload[:, None])


def solve_gantry(targets, payload, flexible_tip, **limits):
    return solve_targets(np.array(targets), np.array(payload), Gantry(), flexible_tip, **limits)


@pytest.mark.parametrize("n_iterations", [1, 2, 3, 4])
def test_each_pass_shrinks_the_residual_as_the_series_does(n_iterations):
    # t - c t + c^2 t - ...: after k passes c^k |t| is left
    target, c = np.array([[0.3, 0.4]]), 0.1
    flexible_tip = functools.partial(growing, c)
    found = solve_gantry(target, [1.0], flexible_tip, tolerance=1e-12, n_iterations=n_iterations)
    assert found.residual == pytest.approx([0.5 * c**n_iterations])
    assert not found.reached[0]
    terms = (-c) ** np.arange(n_iterations)
    assert found.values[0] == pytest.approx([0.3 * terms.sum(), 0.4 * terms.sum(), 0.0])


def test_iteration_ends_below_the_tolerance():
    target, flexible_tip = [[0.3, 0.4]], functools.partial(growing, 0.1)
    found = solve_gantry(target, [1.0], flexible_tip, tolerance=1e-4, n_iterations=20)
    assert found.reached[0]
    assert found.residual == pytest.approx([0.5e-4])
    assert solve_gantry(target, [1.0], flexible_tip, n_iterations=20).values[0] == pytest.approx(
        [0.3 / 1.1, 0.4 / 1.1, 0.0], abs=1e-6
    )


def test_each_kind_of_failure():
    def flexible_tip(strokes, payload):
        tip = growing(0.1, strokes, payload)
        tip[strokes[:, 0] > 0.9] = np.nan
        return tip

    targets = [
        [0.3, 0.4],  # reached
        [1.2, 0.4],  # rigidly out of reach, though the loaded gantry could
        [0.5, 0.9],  # needs a stroke of 0.9 / 0.5 when loaded
        [0.95, 0.4],  # no equilibrium
    ]
    found = solve_gantry(targets, [1.0, 3.0, -5.0, 1.0], flexible_tip)
    assert found.reached.tolist() == [True, False, False, False]
    assert np.isnan(found.residual).tolist() == [False, True, True, True]
    assert found.residual[0] < 1e-6
    # or too slow, which leaves a residual
    slow = solve_gantry(targets[:1], [8.0], flexible_tip, n_iterations=10)
    assert not slow.reached[0]
    assert slow.residual[0] == pytest.approx(0.5 * 0.8**10)


def test_every_pass_tells_the_inverse_the_targets_and_the_last_strokes():
    asked = []

    class Spy(Gantry):
        def inverse(self, *arrays):
            asked.append(arrays)
            return super().inverse(*arrays)

    target, flexible_tip = np.array([[0.3, 0.4]]), functools.partial(growing, 0.1)
    solve_targets(target, np.ones(1), Spy(), flexible_tip, n_iterations=2)
    (first, _, original), (second, strokes, original_again) = asked
    assert first.tolist() == original.tolist() == original_again.tolist() == target.tolist()
    assert second == pytest.approx(0.9 * target)
    assert strokes[0].tolist() == [0.3, 0.4, 0.0]


def test_nothing_reachable_ends_quietly():
    found = solve_gantry([[2.0, 0.0]], [1.0], functools.partial(growing, 0.1))
    assert not found.reached.any()


def sagging_tip(geometry, strokes, payload):
    """Smooth stand-in of the flexible crane: about 0.1 m at full reach and payload."""
    x, y = forward(geometry, strokes).T
    sag = np.column_stack([0.01 * y + 0.01 * strokes[:, 2], -0.015 * x - 0.01 * np.cos(x - y)])
    return np.column_stack([x, y]) + sag * (payload / 470.0)[:, None]


def test_strokes_put_the_loaded_tip_on_the_targets(geometry):
    targets, payload = candidates(2000)
    flexible_tip = functools.partial(sagging_tip, geometry)
    manipulator = CraneManipulator(geometry)
    found = solve_targets(targets, payload, manipulator, flexible_tip)
    distance = np.linalg.norm(flexible_tip(found.values, payload) - targets, axis=1)
    assert (distance[found.reached] < 1e-6).all()
    assert distance[found.reached] == pytest.approx(found.residual[found.reached], abs=1e-12)
    assert (found.values >= 0.0).all()
    assert (found.values <= geometry.stroke_maximum).all()
    assert 0.5 < found.reached.mean() < 1.0
    # an uncompensated command is far off
    rigid = manipulator.inverse(targets, np.zeros((2000, 3)))
    assert rigid.status[found.reached].max() == 0
    off = np.linalg.norm(flexible_tip(rigid.values, payload) - targets, axis=1)
    assert np.median(off[found.reached]) > 0.01


def test_rows_do_not_depend_on_their_neighbours(geometry):
    targets, payload = candidates(100)
    others = CraneManipulator(geometry), functools.partial(sagging_tip, geometry)
    whole = solve_targets(targets, payload, *others)
    for n in (1, 7, 50):
        cuts = [slice(k, k + n) for k in range(0, len(targets), n)]
        parts = [solve_targets(targets[cut], payload[cut], *others) for cut in cuts]
        for name, values in whole._asdict().items():
            np.testing.assert_array_equal(
                np.concatenate([getattr(part, name) for part in parts]), values
            )


def test_reachable_targets_are_those_reached_in_order(geometry):
    targets, payload = candidates(100)
    others = CraneManipulator(geometry), functools.partial(sagging_tip, geometry)
    strokes, reached, _ = solve_targets(targets, payload, *others)
    found = reachable_targets(targets, payload, *others)
    assert len(found) == reached.sum() > 0
    assert np.array_equal(found.targets, targets[reached])
    assert np.array_equal(found.payload, payload[reached])
    assert np.array_equal(found.values, strokes[reached])


def test_the_flexible_crane_reaches_its_targets():
    model = crane_case.crane()
    targets, payload = candidates(30, seed=2)
    found = reachable_targets(
        targets,
        payload,
        CraneManipulator(model.geometry),
        lambda strokes, mass: solve(model, strokes, mass)[0],
    )
    assert 15 <= len(found) <= 30
    # alone, in another order
    order = np.random.default_rng(0).permutation(len(found))
    tip = tips(model, found.values[order], found.payload[order])
    assert np.linalg.norm(tip - found.targets[order], axis=1).max() < 1e-6
    # the strokes of the rigid crane are not these
    off = forward(model.geometry, found.values) - found.targets
    assert np.linalg.norm(off, axis=1).max() > 0.01


@given(st.integers(0, 30), st.integers(0, 30), st.integers(0, 2**32))
def test_candidates_are_drawn_one_after_the_other(n, m, seed):
    whole = candidates(n + m, seed)
    generator = np.random.default_rng(seed)
    parts = [draw_candidates(k, LOWER, UPPER, PAYLOAD, generator) for k in (n, m)]
    for values, *blocks in zip(whole, *parts, strict=True):
        assert np.array_equal(np.concatenate(blocks), values)


def test_candidates_fill_their_box_evenly():
    columns = np.column_stack(candidates(20_000))
    assert columns.shape == (20_000, 3)
    unit = (columns - [*LOWER, PAYLOAD[0]]) / (np.subtract((*UPPER, PAYLOAD[1]), (*LOWER, 30.0)))
    assert unit.min() >= 0.0
    assert unit.max() <= 1.0
    assert unit.mean(axis=0) == pytest.approx([0.5] * 3, abs=0.01)
    assert np.cov(unit.T) == pytest.approx(np.eye(3) / 12, abs=0.002)


def test_one_payload_is_a_range_too():
    _, payload = draw_candidates(3, LOWER, UPPER, (100.0, 100.0), np.random.default_rng(0))
    assert payload.tolist() == [100.0] * 3


@pytest.mark.parametrize(
    ("lower", "upper", "payload"),
    [
        ((0.0, 9.0), UPPER, PAYLOAD),
        (LOWER, UPPER, (500.0, 30.0)),
        (LOWER, UPPER, (30.0, np.inf)),
    ],
)
def test_wrong_bounds_are_told(lower, upper, payload):
    with pytest.raises(ParameterError, match="expected lower <= upper"):
        draw_candidates(3, lower, upper, payload, np.random.default_rng(0))


def test_misfits_are_told():
    with pytest.raises(PositioningError, match="upper: expected shape"):
        draw_candidates(3, LOWER, (1.0, 2.0, 3.0), PAYLOAD, np.random.default_rng(0))
    with pytest.raises(PositioningError, match="payload: expected shape"):
        solve_gantry([[0.1, 0.2]], [1.0, 2.0], functools.partial(growing, 0.1))
    with pytest.raises(PositioningError, match="values: expected shape"):
        Targets(np.zeros((2, 2)), np.zeros(2), np.zeros((1, 3)))
