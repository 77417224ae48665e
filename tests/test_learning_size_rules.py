"""Rules of thumb for the number of hidden neurons."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.errors import ParameterError
from flexik.learning.size_rules import haykin, haykin_samples, oja

sizes = st.integers(1, 20)


def test_oja_by_hand():
    assert oja(600, 4, 2) == 20.0
    assert oja(50, 1, 1) == 5.0
    assert oja(7, 3, 2) == pytest.approx(0.28)


def test_haykin_samples_by_hand():
    # two weights and two biases: 32 * 4 ln 32
    assert haykin_samples(1, 1, 1, 1.0) == pytest.approx(443.6142, abs=1e-4)
    # 14 * 5 + 2 * 15 = 100 weights: 32 000 ln 4480
    assert haykin_samples(4, 14, 2, 0.1) == pytest.approx(269_036.1, abs=0.1)


def test_haykin_at_the_border():
    assert haykin(443, 1, 1, 1.0) == 0
    assert haykin(444, 1, 1, 1.0) == 1
    assert haykin(269_036, 4, 2, 0.1) == 13
    assert haykin(269_037, 4, 2, 0.1) == 14


@given(st.integers(1, 10**9), sizes, sizes, st.floats(1e-6, 1.0))
def test_haykin_is_the_largest_whose_need_is_met(n_samples, n_inputs, n_outputs, error_fraction):
    n_hidden = haykin(n_samples, n_inputs, n_outputs, error_fraction)
    assert haykin_samples(n_inputs, n_hidden + 1, n_outputs, error_fraction) > n_samples
    if n_hidden:
        assert haykin_samples(n_inputs, n_hidden, n_outputs, error_fraction) <= n_samples


@given(sizes, sizes, sizes, st.floats(1e-3, 0.5))
def test_fewer_errors_need_more_samples(n_inputs, n_hidden, n_outputs, error_fraction):
    half, whole = (
        haykin_samples(n_inputs, n_hidden, n_outputs, fraction)
        for fraction in (error_fraction / 2, error_fraction)
    )
    n_weights = (n_inputs + 1) * n_hidden + (n_hidden + 1) * n_outputs
    # twice the need, and the logarithm of two more of it
    assert half == pytest.approx(2 * (whole + 32 * n_weights / error_fraction * math.log(2)))


@pytest.mark.parametrize("error_fraction", [0.0, -0.1, 1.1, math.nan])
def test_a_wrong_fraction_is_told(error_fraction):
    for rule in (haykin_samples, haykin):
        with pytest.raises(ParameterError, match="error_fraction"):
            rule(100, 4, 2, error_fraction)


def test_wrong_numbers_are_told():
    with pytest.raises(ParameterError, match="n_samples=0"):
        oja(0, 4, 2)
    with pytest.raises(ParameterError, match="n_samples=0"):
        haykin(0, 4, 2, 0.1)
    with pytest.raises(ParameterError, match="n_hidden=0"):
        haykin_samples(4, 0, 2, 0.1)
