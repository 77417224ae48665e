"""Results of the stages of the elastic arm, and what the report counts in them."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik import parameters
from flexik.datasets.elastic_arm.gauges import FREE_OF_NOISE
from flexik.datasets.elastic_arm.readings import ANGLES, HELD_OUT, TRAINING
from flexik.evaluation.regression import correlation

Array = NDArray[np.float64]

# Nearer than this to the payload of a reading, a target's payload was learnt from, kg
NEAR = 0.1


@dataclass(frozen=True)
class Fit:
    """How a network given gauges follows the readings of a part.

    r : (2,) correlation coefficients of both angles.
    mean_error, max_error : m, of the flexible model's tip at the network's angles from its tip in
        the reading.
    """

    r: Array
    mean_error: float
    max_error: float


@dataclass(frozen=True)
class Results:
    """Tables of the stages, SI units.

    readings : FIELDS of datasets.elastic_arm.readings.
    shown : FIELDS of datasets.elastic_arm.gauges by noise_free and noisy.
    fit : FIT_FIELDS of datasets.elastic_arm.learning.
    layers : neurons of every hidden layer by network.
    training : restarts of all networks, column `network` first.
    studies : errors by size, and the chosen layers, by selected network.
    errors : EVALUATION_FIELDS of datasets.elastic_arm.learning by method, `none` first.
    published : columns network, r_theta_1, r_theta_2.
    """

    arm: parameters.ElasticArm
    readings: pd.DataFrame
    shown: dict[str, pd.DataFrame]
    fit: pd.DataFrame
    layers: dict[str, tuple[int, ...]]
    training: pd.DataFrame
    studies: dict[str, tuple[pd.DataFrame, tuple[int, ...]]]
    errors: dict[str, pd.DataFrame]
    published: pd.DataFrame

    @property
    def gauge_networks(self) -> list[str]:
        """Names of the networks given gauges."""
        return list(dict.fromkeys(self.fit["network"]))

    def joined(self, name: str) -> pd.DataFrame:
        """Readings with what the gauges show and what network `name` says, a row each."""
        shown = self.shown[self.arm.all_networks[name].readings or FREE_OF_NOISE]
        fit = self.fit[self.fit["network"] == name].set_index("reading").sort_index()
        names = ["p_x", "p_y"]
        return pd.concat([self.readings, shown[names], fit.drop(columns="network")], axis=1)

    def fit_of(self, name: str, part: str) -> Fit:
        """Fit of network `name` to the readings of `part`."""
        table = self.joined(name)
        table = table[table["part"] == part]
        r = correlation(
            table[list(ANGLES)].to_numpy(), table[[f"network_{a}" for a in ANGLES]].to_numpy()
        )
        error = np.hypot(table["achieved_x"] - table["tip_x"], table["achieved_y"] - table["tip_y"])
        return Fit(r, float(error.mean()), float(error.max()))

    @property
    def fits(self) -> dict[str, tuple[Fit, Fit]]:
        """Fit to training and to held-out readings by network."""
        return {
            name: (self.fit_of(name, TRAINING), self.fit_of(name, HELD_OUT))
            for name in self.gauge_networks
        }

    def published_r(self, name: str) -> Array:
        """Published correlation coefficients (2,) of network `name`, NaN where there is none."""
        rows = self.published[self.published["network"] == name]
        return rows[["r_theta_1", "r_theta_2"]].to_numpy()[0] if len(rows) else np.full(2, np.nan)

    def gauge_difference(self, shown: str) -> Array:
        """Distance (n,) in m of the tip by equations 44 and 45 from the model's, all readings."""
        table = self.shown[shown]
        by_model = self.readings[["tip_x", "tip_y"]].to_numpy()
        return np.asarray(np.linalg.norm(table[["p_x", "p_y"]].to_numpy() - by_model, axis=1))

    def near_payloads(self, frame: pd.DataFrame) -> NDArray[np.bool_]:
        """Rows (n,) of `frame` whose payload is within NEAR of one of the readings'."""
        apart = np.abs(frame["payload"].to_numpy()[:, None] - self.arm.readings.payloads)
        return np.asarray(apart.min(axis=1) <= NEAR)
