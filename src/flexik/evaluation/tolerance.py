"""Errors and iterations of an iterative method, as tolerance studies tell them.

As in Rouvinen 1999, chapters 4.2 and 4.3.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.tables import Field
from flexik.errors import DataError
from flexik.evaluation.errors import statistics

FIELDS = (
    Field("method", "1", "name of the method", "string"),
    Field("tolerance", "1", "half the sum of squared normalised errors at which a search ends"),
    Field("mean_error", "m", "over all test conditions"),
    Field("max_error", "m", "over all test conditions"),
    Field("mean_iterations", "1", "of the search"),
    Field("max_iterations", "1", "of the search", "int64"),
    Field("n_failed", "1", "searches that ended above their tolerance", "int64"),
)


def tolerance_row(
    method: str, tolerance: float, table: Mapping[str, NDArray]
) -> dict[str, NDArray]:
    """One row of FIELDS from the `table` of `evaluate`; failed conditions count in all of it.

    Raises DataError if the method has no diagnostics `n_iterations` of whole numbers.
    """
    iterations = table.get("n_iterations")
    if iterations is None or iterations.dtype.kind != "i":
        raise DataError(f"method {method} with {tolerance=}: expected whole n_iterations")
    found = statistics(pd.DataFrame(table))
    row = (
        method,
        tolerance,
        found["mean_error"],
        found["max_error"],
        float(iterations.mean()),
        int(iterations.max()),
        found["n_failed"],
    )
    return {field.name: np.array([value]) for field, value in zip(FIELDS, row, strict=True)}
