"""How well a crane adapted to some measurements predicts the others."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.crane.grid import STROKES
from flexik.datasets.crane_measured.campaign import TARGET
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.crane_measured.adapted import (
    FEWEST,
    AdaptationSettings,
    Measurements,
    Offsets,
    identify,
    predicted_tip,
    surprise,
)
from flexik.positioning.method import Array, Network


def measurements(rows: pd.DataFrame) -> Measurements:
    """What `rows` of the campaign measured."""
    return Measurements(
        rows[list(STROKES)].to_numpy(),
        rows["payload"].to_numpy(),
        rows[["measured_x", "measured_y"]].to_numpy(),
    )


def predictions(
    crane: FlexibleCrane, network: Network, campaign: pd.DataFrame, settings: AdaptationSettings
) -> pd.DataFrame:
    """Measured points beside their predictions.

    Parameters
    ----------
    crane, network, settings
        As `identify` takes them.
    campaign
        Frame with MEASURED_FIELDS of datasets.crane_measured.fields, all strokes known.

    Returns
    -------
    DataFrame
        PREDICTION_FIELDS, a row for each of `campaign`. A row is predicted by a crane adapted to
        the rows of all other targets (where no targets are known, of all other strokes).
    """
    everything = measurements(campaign)
    keys = TARGET if campaign[TARGET].notna().all(axis=None) else list(STROKES)
    group = campaign.groupby(keys, sort=False).ngroup().to_numpy()

    def error(offsets: Offsets | None, rows: NDArray[np.bool_]) -> Array:
        tip = predicted_tip(
            crane, network, offsets, everything.strokes[rows], everything.payload[rows]
        )
        return np.linalg.norm(everything.tip[rows] - tip, axis=1)

    adapted = np.full(len(campaign), np.nan)
    for number in range(group.max() + 1):
        others = campaign[group != number]
        if len(others) >= FEWEST:
            rows = group == number
            adapted[rows] = error(identify(crane, network, measurements(others), settings), rows)
    return campaign[["payload", "measured_x", "measured_y"]].assign(
        measurement=np.arange(1, len(campaign) + 1),
        surprise=surprise(crane, network, everything, settings),
        nominal_error=error(None, np.full(len(campaign), True)),
        adapted_error=adapted,
    )
