"""Method `lookup_table`: `combined` with a table of the deflection in place of a network.

The thesis' own competitor (Rouvinen 1999, chapter 1): the deflections of the training grid, and
interpolation between them, multilinear or by cubic splines.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
import pandas as pd

from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.combined import Combined
from flexik.positioning.method import Array, PositioningError

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

# Degrees of the splines
DEGREES = {"linear": 1, "cubic": 3}


class Settings(method.Settings):
    """See Combined; interpolation: between the samples of the grid."""

    reads: ClassVar[tuple[str, ...]] = ("grid",)
    method: Literal["lookup_table"] = "lookup_table"
    interpolation: Literal["linear", "cubic"] = "linear"
    n_corrections: Count = 1


@dataclass(frozen=True)
class DeflectionTable:
    """A spline of the deflection (2,) in m over coordinates and payload; a Network.

    Beyond the grid it extrapolates.
    """

    spline: "NdBSpline"

    @classmethod
    def of(cls, table: pd.DataFrame, interpolation: str) -> "DeflectionTable":
        """Table of the samples of a full grid.

        Where a sample was left out or failed stands the deflection of the nearest one that was
        solved, in steps of the grid. Raises PositioningError if the samples are no full grid.
        """
        # every stage imports this module, and few use it: these take most of a second
        from scipy.interpolate import NdBSpline, make_interp_spline
        from scipy.spatial import cKDTree

        names = [*table.columns[: list(table.columns).index("payload")], "payload"]
        points = table[names].to_numpy()
        axes, places = zip(*(np.unique(p, return_inverse=True) for p in points.T), strict=True)
        shape = tuple(len(axis) for axis in axes)
        index = np.column_stack(places)
        if len(table) != np.prod(shape) or len(np.unique(index, axis=0)) != len(table):
            raise PositioningError("lookup_table: expected samples of a full grid")
        degree = DEGREES[interpolation]
        if min(shape) <= degree:
            raise PositioningError(
                f"lookup_table: {interpolation} needs {degree + 1} values on every axis"
            )
        bent = table[["tip_x", "tip_y"]].to_numpy() - table[["rigid_x", "rigid_y"]].to_numpy()
        known = np.isfinite(bent).all(axis=1)
        bent[~known] = bent[known][cKDTree(index[known]).query(index[~known])[1]]
        values = np.empty((*shape, 2))
        values[tuple(index.T)] = bent
        knots = []
        for number, axis in enumerate(axes):
            along = make_interp_spline(axis, np.moveaxis(values, number, 0), degree)
            values = np.moveaxis(along.c, 0, number)
            knots.append(along.t)
        return cls(NdBSpline(tuple(knots), values, degree))

    def predict(self, values: Array) -> Array:
        """Deflection (n, 2) in m at `values` (n, k + 1): coordinates, and payload in kg."""
        return np.asarray(self.spline(values), dtype=float)


def build(settings: Settings, ingredients: method.Ingredients) -> Combined:
    """Method `lookup_table` with the grid of `ingredients`."""
    table = DeflectionTable.of(ingredients.samples["grid"], settings.interpolation)
    return Combined(ingredients.manipulator, table, settings.n_corrections)
