"""How well a machine adapted to some measurements predicts the others."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.planar.measured.adapted import (
    FEWEST,
    Measurements,
    Nominal,
    identify,
    predicted_tip,
    surprise,
)
from flexik.planar.measured.fields import MEASURED, TARGET, values_of
from flexik.positioning.method import Array

# Standard deviations beyond which a measurement is left out
OUTLIER = 5.0
# Measurements that are dropped, one after the other, to see whether the others agree
ROUNDS = 8
# Median square of a distance in the plane, in standard deviations
MEDIAN_SQUARE = 2 * np.log(2)


def measurements(nominal: Nominal, rows: pd.DataFrame) -> Measurements:
    """What `rows` of the campaign measured."""
    return Measurements(
        rows[values_of(nominal.machine)].to_numpy(),
        rows["payload"].to_numpy(),
        rows[MEASURED].to_numpy(),
    )


def predictions(nominal: Nominal, campaign: pd.DataFrame) -> pd.DataFrame:
    """Measured points beside their predictions.

    Parameters
    ----------
    nominal
        As `identify` takes it.
    campaign
        Frame with the columns `campaign_fields`, all coordinates known.

    Returns
    -------
    DataFrame
        fields.PREDICTIONS, a row for each of `campaign`. A row is predicted by a machine adapted to
        the rows of all other targets (where no targets are known, of all other coordinates) but
        those that stand out: the worst is dropped as long as there is one, so that a slip does not
        spoil the predictions of the others.
    """
    everything = measurements(nominal, campaign)
    known_targets = campaign[TARGET].notna().all(axis=None)
    keys = TARGET if known_targets else values_of(nominal.machine)
    group = campaign.groupby(keys, sort=False).ngroup().to_numpy()
    unadapted = predicted_tip(nominal, None, everything.values, everything.payload)
    before = surprise(nominal, everything)
    used = ~outliers(before, before)
    for n_dropped in range(ROUNDS + 1):
        adapted, distance = np.full((2, len(campaign)), np.nan)
        for number in range(group.max() + 1):
            rows = group == number
            if np.sum(used & ~rows) >= FEWEST:
                offsets = identify(nominal, everything[used & ~rows])
                left = everything[rows]
                tip = predicted_tip(nominal, offsets, left.values, left.payload)
                adapted[rows] = np.linalg.norm(left.tip - tip, axis=1)
                distance[rows] = surprise(nominal, left, offsets)
        known = np.where(np.isnan(distance), before, distance)
        worst = int(np.argmax(np.where(used, known, 0.0)))
        if n_dropped == ROUNDS or known[worst] <= OUTLIER:
            break
        used[worst] = False
    used = ~outliers(known, known[used])
    return campaign[["line", "payload", *MEASURED]].assign(
        nominal_error=np.linalg.norm(everything.tip - unadapted, axis=1),
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
