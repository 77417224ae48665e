"""Rules of thumb for the number of hidden neurons (Rouvinen 1999, chapter 2.4.5)."""

import bisect
import math

from flexik.errors import ParameterError


def oja(n_samples: int, n_inputs: int, n_outputs: int) -> float:
    """Number of hidden neurons for `n_samples` training samples (equation 57).

    Raises ParameterError unless every number is positive.
    """
    _check_positive(n_samples=n_samples, n_inputs=n_inputs, n_outputs=n_outputs)
    return n_samples / (5 * (n_inputs + n_outputs))


def haykin_samples(n_inputs: int, n_hidden: int, n_outputs: int, error_fraction: float) -> float:
    """Training samples that `n_hidden` neurons need (right side of equation 58).

    Parameters
    ----------
    n_inputs, n_hidden, n_outputs
        Sizes of a network with one hidden layer; its weights include the biases.
    error_fraction
        Fraction of errors permitted in the test, in (0, 1].

    Raises
    ------
    ParameterError
        Unless every number is positive and the fraction at most 1.
    """
    _check_positive(n_inputs=n_inputs, n_hidden=n_hidden, n_outputs=n_outputs)
    if not 0.0 < error_fraction <= 1.0:
        raise ParameterError(f"{error_fraction=}, expected a fraction in (0, 1]")
    n_weights = n_hidden * (n_inputs + 1) + n_outputs * (n_hidden + 1)
    return 32 * n_weights / error_fraction * math.log(32 * n_hidden / error_fraction)


def haykin(n_samples: int, n_inputs: int, n_outputs: int, error_fraction: float) -> int:
    """Most hidden neurons for which `n_samples` suffice (equation 58); 0 if one needs more.

    Raises ParameterError as `haykin_samples` does.
    """
    _check_positive(n_samples=n_samples)

    def need(n_hidden: int) -> float:
        return haykin_samples(n_inputs, n_hidden, n_outputs, error_fraction)

    # a neuron needs more than one sample, and the need grows with every neuron
    return bisect.bisect_right(range(1, n_samples + 1), float(n_samples), key=need)


def _check_positive(**numbers: int) -> None:
    for name, number in numbers.items():
        if number < 1:
            raise ParameterError(f"{name}={number}, expected 1 or more")
