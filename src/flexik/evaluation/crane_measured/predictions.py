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
    identify,
)
from flexik.positioning.crane_measured.prediction import predicted_tip, surprise
from flexik.positioning.method import Array, Network

# Standard deviations beyond which a measurement is left out
OUTLIER = 5.0
# Measurements that are dropped, one after the other, to see whether the others agree
ROUNDS = 8
# Median square of a distance in the plane, in standard deviations
MEDIAN_SQUARE = 2 * np.log(2)


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
        the rows of all other targets (where no targets are known, of all other strokes) but those
        that stand out: the worst is dropped as long as there is one, so that a slip does not spoil
        the predictions of the others.
    """
    everything = measurements(campaign)
    keys = TARGET if campaign[TARGET].notna().all(axis=None) else list(STROKES)
    group = campaign.groupby(keys, sort=False).ngroup().to_numpy()
    nominal = predicted_tip(crane, network, None, everything.strokes, everything.payload)
    before = surprise(crane, network, everything, settings)
    used = ~outliers(before, before)
    for n_dropped in range(ROUNDS + 1):
        adapted, distance = np.full((2, len(campaign)), np.nan)
        for number in range(group.max() + 1):
            rows = group == number
            if np.sum(used & ~rows) >= FEWEST:
                others = measurements(campaign[used & ~rows])
                offsets = identify(crane, network, others, settings)
                tip = predicted_tip(crane, network, offsets, everything.strokes, everything.payload)
                adapted[rows] = np.linalg.norm(everything.tip - tip, axis=1)[rows]
                distance[rows] = surprise(crane, network, everything, settings, offsets)[rows]
        known = np.where(np.isnan(distance), before, distance)
        worst = int(np.argmax(np.where(used, known, 0.0)))
        if n_dropped == ROUNDS or known[worst] <= OUTLIER:
            break
        used[worst] = False
    used = ~outliers(known, known[used])
    return campaign[["line", "payload", "measured_x", "measured_y"]].assign(
        nominal_error=np.linalg.norm(everything.tip - nominal, axis=1),
        adapted_error=adapted,
        surprise=before,
        left_out_surprise=distance,
        used=used.astype(np.int64),
    )


def misfit(distance: Array) -> float:
    """How much larger `distance` (n,) is than it should be, in the median: 1 or more."""
    return max(1.0, float(np.sqrt(np.median(distance**2) / MEDIAN_SQUARE)))


def outliers(distance: Array, others: Array) -> NDArray[np.bool_]:
    """Which of `distance` (n,), in standard deviations, stand out from what `others` (m,) show."""
    return distance > OUTLIER * misfit(others)
