"""Inverse of networks by gradient descent and by Gauss-Newton, and the methods built on it."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from flexik.learning.perceptron import ACTIVATIONS, Network, Normalisation, Quantity
from flexik.positioning.inversion import GaussNewton, GradientDescent, invert
from flexik.positioning.method import PositioningError

STROKES = tuple(Quantity(name, "m") for name in ("lift", "jib", "extension"))
INPUTS = (*STROKES, Quantity("payload", "kg"))
OUTPUTS = (Quantity("x", "m"), Quantity("y", "m"))
UPPER = np.array([0.5, 0.8, 1.6])
LIMITS = np.stack([np.zeros(3), UPPER])


def descent(learning_rate, tolerance, n_iterations):
    return GradientDescent(
        learning_rate=learning_rate, tolerance=tolerance, n_iterations=n_iterations
    )


def newton(damping, tolerance, n_iterations):
    return GaussNewton(damping=damping, tolerance=tolerance, n_iterations=n_iterations)


DESCENT = descent(0.1, 1e-10, 20_000)
NEWTON = newton(1.0, 1e-10, 100)
BOTH = pytest.mark.parametrize("chosen", [DESCENT, NEWTON], ids=["descent", "newton"])


def network_of(weights, activation="tanh", inputs=INPUTS):
    """Strokes 0 to UPPER and 50 to 500 kg on [-1, 1], outputs several m wide."""
    columns = [INPUTS.index(quantity) for quantity in inputs]
    low, high = np.array([0.0, 0.0, 0.0, 50.0])[columns], np.append(UPPER, 500.0)[columns]
    outputs = Normalisation(np.array([0.0, -4.0]), np.array([6.0, 7.0]))
    return Network(tuple(weights), activation, Normalisation(low, high), outputs, inputs, OUTPUTS)


def some_network(seed=0, hidden=(7,), activation="tanh", inputs=INPUTS):
    """Random units, bent gently about a linear map of which every seed has the same."""
    generator = np.random.default_rng(seed)
    gain, middle = (1.0, 0.0) if activation == "tanh" else (0.25, 0.5)
    chain, weights = np.eye(len(inputs)), []
    for n_units in hidden:
        matrix = generator.normal(size=(n_units, len(chain))) * 0.5 / gain / np.sqrt(len(chain))
        # the units are not far from the middle of their activation
        bias = generator.normal(size=n_units) / 5 / gain - (
            middle * matrix.sum(axis=1) if weights else 0
        )
        weights.append(np.column_stack([matrix, bias]))
        chain = gain * matrix @ chain
    slopes = np.array([[1.0, 0.3, 0.4, -0.1], [-0.4, 1.0, 0.5, -0.2]])
    last = slopes[:, [INPUTS.index(quantity) for quantity in inputs]] @ np.linalg.pinv(chain)
    weights.append(np.column_stack([last, -middle * last.sum(axis=1)]))
    return network_of(weights, activation, inputs)


def problem(network, n=30, seed=1, spread=0.05):
    """Targets that some strokes within the limits reach, payloads, and strokes near by."""
    generator = np.random.default_rng(seed)
    longest = network.input_normalisation.maximum[:-1]
    strokes = generator.uniform(0.1, 0.9, (n, len(longest))) * longest
    held = generator.uniform(50.0, 500.0, (n, 1))
    start = strokes + spread * generator.uniform(-1.0, 1.0, strokes.shape) * longest
    return network.predict(np.hstack([strokes, held])), held, start


def half_square(network, strokes, held, targets):
    """E_s of equation 59 from physical predictions."""
    miss = network.predict(np.hstack([strokes, held])) - targets
    return 0.5 * np.sum((miss / network.output_normalisation.half_range) ** 2, axis=1)


def test_one_step_of_equations_60_to_63_written_out():
    network = some_network(3, (4,))
    strokes, payload, target, rate = [0.2, 0.5, 0.7], 260.0, [2.0, 1.5], 0.03
    found = invert(
        network,
        np.array([target]),
        np.array([[payload]]),
        np.array([strokes]),
        LIMITS,
        descent(rate, 1e-9, 1),
    )
    x = [2 * s / u - 1 for s, u in zip(strokes, UPPER, strict=True)]
    x.append((payload - 50) / 225 - 1)
    d = [target[0] / 3 - 1, (target[1] + 4) / 5.5 - 1]
    w1, w2 = network.weights
    h = [math.tanh(sum(w1[j, k] * x[k] for k in range(4)) + w1[j, 4]) for j in range(4)]
    y = [sum(w2[i, j] * h[j] for j in range(4)) + w2[i, 4] for i in range(2)]
    delta2 = [d[i] - y[i] for i in range(2)]
    delta1 = [(1 - h[j] ** 2) * sum(w2[i, j] * delta2[i] for i in range(2)) for j in range(4)]
    for k in range(3):
        gradient = -sum(w1[j, k] * delta1[j] for j in range(4))
        expected = (x[k] - rate * gradient + 1) * UPPER[k] / 2
        assert found.values[0, k] == pytest.approx(expected, rel=1e-13)
    assert found.n_iterations.tolist() == [1]
    assert found.converged.tolist() == [False]


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("hidden", [(7,), (5, 4), (3, 2, 4)])
def test_descent_follows_the_slope_of_finite_differences(activation, hidden):
    network = some_network(5, hidden, activation)
    targets, held, start = problem(network, 6, spread=0.1)
    half, rate = network.input_normalisation.half_range[:3], 1e-2
    found = invert(network, targets, held, start, LIMITS, descent(rate, 1e-300, 1))
    slope = np.empty_like(start)
    for k, shift in enumerate(1e-6 * np.diag(half)):
        above, below = (half_square(network, start + s, held, targets) for s in (shift, -shift))
        slope[:, k] = (above - below) / 2e-6
    np.testing.assert_allclose((start - found.values) / half / rate, slope, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("hidden", [(7,), (5, 4)])
def test_a_hardly_damped_step_is_the_gauss_newton_step(activation, hidden):
    network = some_network(6, hidden, activation)
    targets, held, start = problem(network, 6, spread=1e-3)
    found = invert(network, targets, held, start, LIMITS, newton(1e-9, 1e-300, 1))
    inputs = np.hstack([start, held])
    half_in = network.input_normalisation.half_range[:3]
    half_out = network.output_normalisation.half_range
    jacobian = network.jacobian(inputs)[:, :, :3] * half_in / half_out[:, None]
    errors = (targets - network.predict(inputs)) / half_out
    for row in range(len(start)):
        expected = np.linalg.lstsq(jacobian[row], errors[row], rcond=None)[0] * half_in
        assert found.values[row] - start[row] == pytest.approx(expected, rel=1e-4, abs=1e-9)


@BOTH
def test_nearly_linear_network_has_the_least_squares_solution(chosen):
    # tanh(small) is as good as linear: the nearest solution is that of the pseudo-inverse
    generator = np.random.default_rng(2)
    small = 1e-5
    first = np.column_stack([generator.normal(size=(3, 4)), np.zeros(3)])
    last = np.column_stack([generator.normal(size=(2, 3)), [0.1, -0.2]])
    network = network_of([small * first, last / np.array([small] * 3 + [1.0])])
    held, start = np.array([[120.0]]), np.array([[0.25, 0.4, 0.8]])
    A = last[:, :3] @ first[:, :4]
    unit = np.append(2 * start[0] / UPPER - 1, (120 - 50) / 225 - 1)
    wanted = A @ unit + last[:, 3] + np.array([0.05, -0.03])
    targets = network.output_normalisation.from_unit(wanted[None])
    largest = np.linalg.norm(A[:, :3], 2)
    if isinstance(chosen, GradientDescent):
        chosen = descent(1.0 / largest**2, 1e-20, 10_000)
    else:
        chosen = newton(1e-8, 1e-20, 50)
    found = invert(network, targets, held, start, LIMITS, chosen)
    step = np.linalg.pinv(A[:, :3]) @ np.array([0.05, -0.03])
    assert found.converged.all()
    assert found.values[0] == pytest.approx(start[0] + step * UPPER / 2, abs=1e-8)


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("hidden", [(7,), (6, 5)])
def test_both_searches_agree_where_the_solution_is_unique(activation, hidden):
    network = some_network(8, hidden, activation, INPUTS[1:])
    targets, held, start = problem(network, spread=0.02)
    slowly = descent(0.1, 1e-16, 50_000)
    by = [
        invert(network, targets, held, start, LIMITS[:, 1:], chosen)
        for chosen in (slowly, newton(1e-2, 1e-16, 100))
    ]
    converged = by[0].converged & by[1].converged
    assert converged.mean() > 0.8
    difference = np.abs(by[0].values - by[1].values)[converged]
    assert difference.max() < 1e-5
    assert by[1].n_iterations.max() < 20 < by[0].n_iterations.mean()


@BOTH
def test_tolerance_and_counts(chosen):
    network = some_network()
    targets, held, start = problem(network)
    mean = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        options = {**vars(chosen), "tolerance": tolerance}
        found = invert(network, targets, held, start, LIMITS, type(chosen)(**options))
        error = half_square(network, found.values, held, targets)
        assert found.converged.all()
        assert (error < tolerance).all()
        miss = network.predict(np.hstack([found.values, held])) - targets
        assert found.residual == pytest.approx(np.hypot(*miss.T), rel=1e-12)
        # one step fewer does not do
        row = int(np.argmax(found.n_iterations))
        options["n_iterations"] = int(found.n_iterations[row]) - 1
        short = invert(network, targets, held, start, LIMITS, type(chosen)(**options))
        assert not short.converged[row]
        assert half_square(network, short.values, held, targets)[row] >= tolerance
        assert short.n_iterations[row] == options["n_iterations"]
        mean.append(found.n_iterations.mean())
    assert mean[0] < mean[1] < mean[2]


@BOTH
def test_rows_do_not_influence_each_other(chosen):
    network = some_network(1)
    parts = [problem(network, 8, seed, spread) for seed, spread in enumerate((0.0, 1e-4, 0.05, 2))]
    targets, held, start = (np.vstack(values) for values in zip(*parts, strict=True))
    together = invert(network, targets, held, start, LIMITS, chosen)
    assert len(np.unique(together.n_iterations)) > 3
    backwards = invert(network, targets[::-1], held[::-1], start[::-1], LIMITS, chosen)
    for row in range(len(targets)):
        only = slice(row, row + 1)
        alone = invert(network, targets[only], held[only], start[only], LIMITS, chosen)
        for values in (together.values[row], backwards.values[-1 - row]):
            assert alone.values[0] == pytest.approx(values, abs=1e-10)
        for name in ("n_iterations", "n_clipped", "converged"):
            assert getattr(alone, name)[0] == getattr(together, name)[row]


@BOTH
def test_start_on_the_target_stays(chosen):
    network = some_network()
    targets, held, start = problem(network, spread=0.0)
    found = invert(network, targets, held, start, LIMITS, chosen)
    assert np.array_equal(found.values, start)
    assert (found.n_iterations == 0).all() and found.converged.all()
    assert (found.n_clipped == 0).all()


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6), chosen=st.sampled_from([NEWTON, descent(0.1, 1e-8, 300)]))
def test_strokes_stay_within_the_limits_whatever_the_targets(seed, chosen):
    generator = np.random.default_rng(seed)
    network = some_network(seed)
    targets = generator.uniform(-10.0, 10.0, (20, 2))
    held, start = (
        generator.uniform(0.0, 900.0, (20, 1)),
        generator.uniform(-0.2, 1.2, (20, 3)) * UPPER,
    )
    before = [values.copy() for values in (targets, held, start)]
    found = invert(network, targets, held, start, LIMITS, chosen)
    assert (found.values >= 0.0).all() and (found.values <= UPPER).all()
    # nothing handed in is changed, and the target is judged at the payload handed in
    for values, old in zip((targets, held, start), before, strict=True):
        assert np.array_equal(values, old)
    error = half_square(network, found.values, held, targets)
    assert (error[found.converged] < chosen.tolerance * (1 + 1e-5)).all()
    on_limit = (found.values < 1e-12) | (found.values > UPPER - 1e-12)
    assert (found.n_clipped <= on_limit.sum(axis=1)).all()


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_gauss_newton_ends_where_scipy_does_under_limits(seed):
    network = some_network(seed)
    targets, held, start = problem(network, 5, seed, spread=0.1)
    targets = targets + np.random.default_rng(seed).normal(scale=1.0, size=targets.shape)
    start = np.clip(start, 0.0, UPPER)
    # targets out of reach are approached slowly along a limit
    found = invert(network, targets, held, start, LIMITS, newton(1e-2, 1e-14, 10_000))
    half = network.output_normalisation.half_range
    for row in range(5):

        def errors(strokes, row=row):
            values = np.append(strokes, held[row])[None]
            return ((network.predict(values) - targets[row]) / half)[0]

        # scipy does not leave our end: nothing near by is better
        inside = np.clip(found.values[row], 1e-12, UPPER - 1e-12)
        theirs = least_squares(errors, inside, bounds=(0.0, UPPER), xtol=1e-14, ftol=1e-14)
        ours = 0.5 * np.sum(errors(found.values[row]) ** 2)
        assert ours <= theirs.cost * (1 + 1e-5) + 1e-10


def test_a_limit_is_no_obstacle():
    # the shortest way to the target leads beyond a limit; another leads along it
    generator = np.random.default_rng(4)
    network = some_network(9)
    held = generator.uniform(50.0, 500.0, (40, 1))
    start = np.column_stack([generator.uniform(0.2, 0.8, (40, 2)) * UPPER[:2], np.zeros(40)])
    reach = np.array([0.03, 0.05, 0.0]) * generator.uniform(-1.0, 1.0, (40, 3))
    targets = network.predict(np.hstack([start + reach, held]))
    descent = invert(network, targets, held, start, LIMITS, DESCENT)
    newton = invert(network, targets, held, start, LIMITS, NEWTON)
    clipped = descent.n_clipped > 0
    assert 5 < clipped.sum() < 40
    assert (descent.values[clipped, 2] == 0.0).all()
    assert descent.converged.all()
    assert (newton.n_clipped[clipped] == 1).any()


def test_a_step_that_meets_a_limit_is_solved_for_again():
    # one hardly damped step: what the limit takes away, the other strokes make up for
    gentle = some_network(9)
    # nearly linear, so that one step arrives
    network = replace(gentle, weights=(gentle.weights[0] / 30.0, gentle.weights[1] * 30.0))
    _, held, start = problem(network, 30, spread=0.0)
    start[:, 2] = 0.05
    targets = network.predict(np.hstack([start, held])) - np.array([0.6, 1.0])
    found = invert(network, targets, held, start, LIMITS, newton(1e-9, 1e-300, 1))
    met = found.n_clipped == 1
    assert met.mean() > 0.5
    before = half_square(network, start, held, targets)
    after = half_square(network, found.values, held, targets)
    assert (found.values[met, 2] < 1e-12).all()
    assert (after[met] < 1e-4 * before[met]).all()


def test_gauss_newton_keeps_no_step_that_is_worse():
    gentle = some_network(3)
    # units that saturate: a full step goes far astray
    network = replace(gentle, weights=(gentle.weights[0] * 6.0, gentle.weights[1]))
    targets, held, start = problem(network, 40, spread=0.4)
    start = np.clip(start, 0.0, UPPER)
    strokes, errors = [start], [half_square(network, start, held, targets)]
    for n_iterations in range(1, 9):
        chosen = newton(1e-4, 1e-12, n_iterations)
        strokes.append(invert(network, targets, held, start, LIMITS, chosen).values)
        errors.append(half_square(network, strokes[-1], held, targets))
    rejected = [np.isclose(a, b, atol=1e-12).all(axis=1) for a, b in pairwise(strokes)]
    assert all((b <= a * (1 + 1e-9) + 1e-14).all() for a, b in pairwise(errors))
    # some rows refused their first step and then moved
    assert (rejected[0] & ~np.isclose(strokes[-1], start, atol=1e-6).all(axis=1)).any()


@BOTH
def test_the_payload_held_is_the_one_searched_for(chosen):
    network = some_network(2)
    targets, _, start = problem(network, 8)
    strokes = [
        invert(network, targets, np.full((8, 1), kg), start, LIMITS, chosen).values
        for kg in (240.0, 250.0)
    ]
    assert (np.abs(strokes[0] - strokes[1]).max(axis=1) > 1e-4).all()


@BOTH
def test_a_stroke_that_was_constant_is_not_moved(chosen):
    network = some_network(2)
    constant = Normalisation(np.array([0.0, 0.3, 0.0, 50.0]), np.array([0.5, 0.3, 1.6, 500.0]))
    network = replace(network, input_normalisation=constant)
    targets, held, start = problem(network, 10)
    found = invert(network, targets, held, start, LIMITS, chosen)
    assert np.array_equal(found.values[:, 1], start[:, 1])
    assert found.converged.any()


def test_too_large_a_rate_is_flagged():
    network = some_network()
    targets, held, start = problem(network, spread=0.2)
    slow = invert(network, targets, held, start, LIMITS, descent(0.1, 1e-8, 2000))
    fast = invert(network, targets, held, start, LIMITS, descent(20.0, 1e-8, 2000))
    assert slow.converged.sum() > 2 * fast.converged.sum()
    lost = ~fast.converged
    assert lost.mean() > 0.3
    assert (half_square(network, fast.values, held, targets)[lost] >= 1e-8).all()
    assert np.isfinite(fast.values).all() and np.isfinite(fast.residual).all()


def test_a_row_that_overflows_ends_with_its_last_finite_strokes():
    network = some_network()
    targets, held, start = problem(network, 4)
    targets[1] += 1e3
    found = invert(network, targets, held, start, LIMITS, descent(1e307, 1e-8, 50))
    assert np.array_equal(found.values[1], start[1])
    assert found.n_iterations[1] == 0
    assert not found.converged[1]
    assert np.isfinite(found.values).all()
    far = invert(network, targets * 1e200, held, start, LIMITS, NEWTON)
    assert np.isfinite(far.values).all() and not far.converged.any()


@BOTH
def test_no_rows(chosen):
    found = invert(
        some_network(), np.empty((0, 2)), np.empty((0, 1)), np.empty((0, 3)), LIMITS, chosen
    )
    assert [values.shape for values in found] == [(0, 3), (0,), (0,), (0,), (0,)]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"targets": np.zeros((3, 3))}, "targets: expected shape"),
        ({"held": np.zeros((2, 1))}, "held inputs: expected shape"),
        ({"held": np.zeros((3, 2))}, r"3 coordinates and 2 held inputs.*4 inputs \(lift, jib"),
        ({"initial": np.full((3, 3), np.nan)}, "current coordinates: sample 0 is not finite"),
        ({"limits": LIMITS[:, :2]}, "limits: expected shape"),
    ],
)
def test_arrays_that_do_not_fit_are_named(wrong, message):
    good = {
        "targets": np.zeros((3, 2)),
        "held": np.zeros((3, 1)),
        "initial": np.zeros((3, 3)),
        "limits": LIMITS,
    }
    with pytest.raises(PositioningError, match=message):
        invert(some_network(), **{**good, **wrong}, settings=NEWTON)
