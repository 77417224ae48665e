"""Back-propagation of several networks side by side."""

import numpy as np

from flexik.learning.back_propagation import BackPropagation, minimise, minimise_together
from flexik.learning.problem import problem
from flexik.learning.weights import flatten, initial_weights


def test_networks_together_become_what_they_are_alone():
    rng = np.random.default_rng(3)
    inputs = rng.uniform(-1.0, 1.0, (30, 2))
    problems = [problem("logistic", inputs, np.sin(inputs[:, [0]] + k)) for k in range(4)]
    starts = [
        initial_weights(2, (3,), 1, "logistic", np.random.default_rng((1, k))) for k in range(4)
    ]
    # the first stops early, the second beyond all numbers, the last takes passes back
    settings = [
        BackPropagation(n_iterations=20, mode="pattern", **each)
        for each in (
            {"goal": 0.1},
            {"learning_rate": 50.0, "error_increase": 1e300, "minimum_rate": 50.0},
            {"learning_rate": 0.05, "momentum": 0.5},
            {"learning_rate": 0.4, "error_increase": 1.0},
        )
    ]
    alone = [
        minimise(*each, np.random.default_rng(k))
        for k, each in enumerate(zip(starts, problems, settings, strict=True))
    ]
    generators = [np.random.default_rng(k) for k in range(4)]
    together = minimise_together(starts, problems, settings, generators)
    assert len({len(each.errors) for each in alone}) > 1
    for one, other in zip(alone, together, strict=True):
        assert one.errors == other.errors and one.kept == other.kept
        assert one.stop_reason == other.stop_reason
        assert np.array_equal(flatten(one.weights), flatten(other.weights))
