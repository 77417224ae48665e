"""How well found values follow their targets."""

import numpy as np
from numpy.typing import NDArray

from flexik.errors import DataError

Array = NDArray[np.float64]


def correlation(targets: Array, found: Array) -> Array:
    """Correlation coefficient R (q,) of every column of `targets` and `found`, both (n, q).

    What MATLAB calls the regression value of a network. Raises DataError if the shapes differ, a
    value is not finite, or a column does not vary.
    """
    if targets.shape != found.shape or targets.ndim != 2:
        raise DataError(f"{targets.shape=}, {found.shape=}, expected both (n, q)")
    a, b = (values - values.mean(axis=0) for values in (targets, found))
    lengths = np.sqrt(np.sum(a**2, axis=0) * np.sum(b**2, axis=0))
    if not (np.isfinite(lengths).all() and (lengths > 0.0).all()):
        raise DataError("a correlation needs finite values that vary")
    return np.asarray(np.sum(a * b, axis=0) / lengths)
