"""Codes of what a method or an inverse found, one a row; all machines share them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

REACHED, OUT_OF_REACH, ACTUATOR_LIMIT, NOT_CONVERGED, SINGULAR, OTHER_BRANCH = range(6)
STATUS_MEANING = {
    REACHED: "reached",
    OUT_OF_REACH: "farther or nearer than the links allow",
    ACTUATOR_LIMIT: "needs an actuator beyond its limit",
    NOT_CONVERGED: "search ended above its tolerance",
    SINGULAR: "search ended where its equations are singular",
    OTHER_BRANCH: "solved, but on another branch than asked for",
}


def limit_status(
    values: NDArray[np.float64], lower: ArrayLike, upper: ArrayLike
) -> NDArray[np.int64]:
    """Codes (n,) of answers (n, k) within, or not within, limits (k,); nan is not within."""
    inside = np.all((values >= np.asarray(lower)) & (values <= np.asarray(upper)), axis=1)
    return np.where(inside, REACHED, ACTUATOR_LIMIT)
