"""Correlation of targets and what was found."""

import numpy as np
import pytest

from flexik.errors import DataError
from flexik.evaluation.regression import correlation


def test_correlation_is_that_of_numpy_and_needs_variation():
    generator = np.random.default_rng(0)
    a = generator.normal(size=(50, 2))
    b = a + 0.1 * generator.normal(size=(50, 2))
    expected = [np.corrcoef(a[:, k], b[:, k])[0, 1] for k in (0, 1)]
    assert correlation(a, b) == pytest.approx(expected, rel=1e-12)
    assert correlation(a, -2.0 * a + 3.0) == pytest.approx([-1.0, -1.0])
    for wrong in (np.ones((50, 2)), np.full((50, 2), np.nan)):
        with pytest.raises(DataError, match="vary"):
            correlation(a, wrong)
    with pytest.raises(DataError, match="shape"):
        correlation(a, b[:-1])
