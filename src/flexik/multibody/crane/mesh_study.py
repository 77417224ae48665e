"""How far tip deflections depend on mesh and element."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from flexik.kinematics.crane import forward
from flexik.multibody.beams import Array
from flexik.multibody.crane.model import FlexibleCrane, tips
from flexik.multibody.elements import ELEMENTS


def mesh_study(
    crane: FlexibleCrane, strokes: Array, payload: Array, refinements: Sequence[int]
) -> pd.DataFrame:
    """Compare the tips of both elements on all `refinements` with the finest mesh of `crane`.

    Returns a row per element and refinement: mean_difference and max_difference of the tip in m,
    and mean_relative and max_relative to the length of the deflection of that sample.
    """
    rigid = forward(crane.geometry, strokes)
    reference = tips(replace(crane, refinement=refinements[-1]), strokes, payload)
    deflection = np.linalg.norm(reference - rigid, axis=1)
    rows = []
    for element in ELEMENTS:
        for refinement in refinements:
            variant = replace(crane, element=element, refinement=refinement)
            difference = np.linalg.norm(tips(variant, strokes, payload) - reference, axis=1)
            rows.append(
                {
                    "element": element,
                    "refinement": refinement,
                    "mean_difference": difference.mean(),
                    "max_difference": difference.max(),
                    "mean_relative": (difference / deflection).mean(),
                    "max_relative": (difference / deflection).max(),
                }
            )
    return pd.DataFrame(rows)
