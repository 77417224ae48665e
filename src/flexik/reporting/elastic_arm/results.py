"""Results of the stages of the elastic arm, and what the report counts in them."""

from dataclasses import dataclass
from typing import NamedTuple

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
_R = [f"r_{name}" for name in ANGLES]


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


class SizeStudy(NamedTuple):
    """Errors by size, the chosen layers, and how many of all runs stopped at the trainer's goal."""

    sizes: pd.DataFrame
    chosen: tuple[int, ...]
    n_goal: int
    n_runs: int


@dataclass(frozen=True)
class Results:
    """Tables of the stages, SI units.

    readings : FIELDS of datasets.elastic_arm.readings.
    shown : FIELDS of datasets.elastic_arm.gauges by noise_free and noisy.
    fit : FIT_FIELDS of datasets.elastic_arm.learning.
    layers : neurons of every hidden layer by network.
    training : restarts of all networks, column `network` first.
    studies : by selected network.
    errors : EVALUATION_FIELDS of datasets.elastic_arm.learning by method, `none` first.
    targets : TARGET_FIELDS, in the order of `errors`; target_counts: drawn, reached and kept.
    sensitivity, payload_error, splits : SENSITIVITY_FIELDS, PAYLOAD_ERROR_FIELDS and SPLIT_FIELDS.
    published : columns network, r_theta_1, r_theta_2.
    """

    arm: parameters.ElasticArm
    readings: pd.DataFrame
    shown: dict[str, pd.DataFrame]
    fit: pd.DataFrame
    layers: dict[str, tuple[int, ...]]
    training: pd.DataFrame
    studies: dict[str, SizeStudy]
    errors: dict[str, pd.DataFrame]
    targets: pd.DataFrame
    target_counts: dict[str, int]
    sensitivity: pd.DataFrame
    payload_error: pd.DataFrame
    splits: pd.DataFrame
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

    def target_r(self, name: str) -> Array:
        """R (2,) of both angles at the random targets by the method of gauge network `name`.

        NaN where no method takes the network, or its angles do not vary.
        """
        for label, method in self.arm.methods.items():
            if method.network == name and method.method == "gauges":
                columns = list(ANGLES)
                commanded = self.errors[label][columns].to_numpy()
                if np.ptp(commanded, axis=0).all():
                    return correlation(self.targets[columns].to_numpy(), commanded)
        return np.full(2, np.nan)

    def on_border(self) -> tuple[int, int]:
        """Held-out readings on the border of the grid of angles, and all held-out ones."""
        angles = self.readings[list(ANGLES)].to_numpy()
        ends = np.isclose(angles, angles.min(axis=0)) | np.isclose(angles, angles.max(axis=0))
        held_out = (self.readings["part"] == HELD_OUT).to_numpy()
        return int(ends.any(axis=1)[held_out].sum()), int(held_out.sum())

    def all_splits(self) -> pd.DataFrame:
        """R of the network of `splits` by every division, the main one first."""
        main = self.fit_of(self.arm.splits.network, HELD_OUT).r
        first = pd.DataFrame({"seed": [self.arm.readings.seed], **dict(zip(_R, main, strict=True))})
        return pd.concat([first, self.splits], ignore_index=True)

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
