"""What the stages of the elastic arm left, and what the report counts in it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts.gauges import SHOWN
from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT
from flexik.cases.elastic_arm.section import Section
from flexik.datasets.tables import read_csv, read_table
from flexik.evaluation.regression import correlation
from flexik.files import read_json
from flexik.learning.size_selection import by_size, read_layers

Array = NDArray[np.float64]

DATA = Path("data/elastic_arm")
PUBLISHED = Path("data/reference/elastic_arm/fit.csv")
# Nearer than this to the payload of a reading, a target's payload was learnt from, kg
NEAR = 0.1
R = [f"r_{name}" for name in ANGLES]


@dataclass(frozen=True)
class SizeStudy:
    """Errors by size, the chosen layers, and how many of all runs stopped at the trainer's goal."""

    sizes: pd.DataFrame
    chosen: tuple[int, ...]
    n_goal: int
    n_runs: int


@dataclass(frozen=True)
class Results:
    """Tables of the stages, SI units.

    shown : what gauges show in the readings, by noise.
    targets, counts : random targets, and how many were drawn, reached and kept.
    errors : long table of the methods at the targets, by method; n_clipped among its columns.
    restarts : mean_error and max_error of every restart, by method with a network.
    fit, fit_restarts, sensitivity, payload_error, splits : of the studies.
    training : restarts of all networks, column `network` first.
    published : R by network.
    """

    section: Section
    readings: pd.DataFrame
    shown: dict[str, pd.DataFrame]
    targets: pd.DataFrame
    counts: dict[str, int]
    errors: dict[str, pd.DataFrame]
    restarts: dict[str, pd.DataFrame]
    fit: pd.DataFrame
    fit_restarts: pd.DataFrame
    sensitivity: pd.DataFrame
    payload_error: pd.DataFrame
    splits: pd.DataFrame
    layers: dict[str, tuple[int, ...]]
    training: pd.DataFrame
    studies: dict[str, SizeStudy]
    published: pd.DataFrame

    @property
    def main(self) -> str:
        """Name of the network as published."""
        return self.section.studies.splits.network

    def hidden(self, name: str) -> str:
        """Layers of a network as the paper writes them, 12-40."""
        return "-".join(str(n) for n in self.layers[name])

    def joined(self, name: str) -> pd.DataFrame:
        """Readings with what the gauges show and what network `name` says, a row each."""
        shown = self.shown[self.section.networks[name].readings]
        fit = self.fit[self.fit["network"] == name].set_index("reading").sort_index()
        return pd.concat(
            [self.readings, shown[["p_x", "p_y"]], fit.drop(columns="network")], axis=1
        )

    def target_r(self, name: str) -> Array:
        """R (2,) of both angles at the random targets by the method of gauge network `name`.

        NaN where no method takes the network, or its angles do not vary.
        """
        for label, method in self.section.methods.items():
            if method.network == name and method.method == "gauges":
                commanded = self.errors[label][list(ANGLES)].to_numpy()
                if np.ptp(commanded, axis=0).all():
                    return correlation(self.targets[list(ANGLES)].to_numpy(), commanded)
        return np.full(2, np.nan)

    def published_r(self, name: str) -> Array:
        """Published R (2,) of network `name`, NaN where there is none."""
        return self.published.reindex([name])[R].to_numpy(dtype=float)[0]

    @property
    def fits(self) -> pd.DataFrame:
        """Fit of the chosen network by name of those given gauges, in their order."""
        chosen = self.fit_restarts[self.fit_restarts["chosen"] == 1].set_index("network")
        return chosen.loc[list(self.section.gauge_networks)]

    def all_splits(self) -> pd.DataFrame:
        """R of the published network by every division, the main one first."""
        first = {"seed": self.section.samples.seed, **self.fits.loc[self.main, R]}
        return pd.concat([pd.DataFrame([first]), self.splits], ignore_index=True)

    def on_border(self) -> tuple[int, int]:
        """Held-out readings on the border of the grid of angles, and all held-out ones."""
        angles = self.readings[list(ANGLES)].to_numpy()
        ends = np.isclose(angles, angles.min(axis=0)) | np.isclose(angles, angles.max(axis=0))
        held_out = (self.readings["part"] == HELD_OUT).to_numpy()
        return int(ends.any(axis=1)[held_out].sum()), int(held_out.sum())

    def near_payloads(self, frame: pd.DataFrame) -> NDArray[np.bool_]:
        """Rows (n,) of `frame` whose payload is within NEAR of one of the readings'."""
        apart = np.abs(frame["payload"].to_numpy()[:, None] - self.section.samples.payloads)
        return np.asarray(apart.min(axis=1) <= NEAR)

    def gauge_difference(self, shown: str) -> Array:
        """Distance (n,) in m of the tip by equations 44 and 45 from the model's, all readings."""
        by_model = self.readings[["tip_x", "tip_y"]].to_numpy()
        by_gauges = self.shown[shown][["p_x", "p_y"]].to_numpy()
        return np.asarray(np.linalg.norm(by_gauges - by_model, axis=1))


def read(section: Section) -> Results:
    """Results of all stages; raises DataError if a file is missing or damaged."""
    samples, networks, studies = DATA / "samples", DATA / "networks", DATA / "studies"
    (conditions,) = section.conditions
    errors = DATA / "errors" / conditions
    training = {name: pd.read_csv(networks / f"{name}.restarts.csv") for name in section.networks}
    fields: dict[str, Any] = {
        name: read_table(studies / f"{name}.parquet")
        for name in ("fit", "sensitivity", "payload_error", "splits")
    }
    return Results(
        section=section,
        readings=read_table(samples / "readings.parquet"),
        shown={shown: read_table(samples / f"readings.{shown}.parquet") for shown in SHOWN},
        targets=read_table(samples / f"{conditions}.parquet"),
        counts=read_json(samples / f"{conditions}.json"),
        errors={
            label: pd.DataFrame({"n_clipped": 0, **read_table(errors / f"{label}.parquet")})
            for label in section.methods
        },
        restarts={
            label: read_table(errors / f"{label}.restarts.parquet")
            for label, method in section.methods.items()
            if method.needs
        },
        fit_restarts=read_table(studies / "fit.restarts.parquet"),
        layers={name: layers(section, name) for name in section.networks},
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies={
            name: _size_study(name)
            for name, network in section.networks.items()
            if network.is_selected
        },
        published=read_csv(PUBLISHED, R, ("network",), ("network",)).set_index("network"),
        **fields,
    )


def layers(section: Section, name: str) -> tuple[int, ...]:
    """Units of the hidden layers of a network, given or chosen."""
    network = section.networks[name]
    return read_layers(DATA / f"sizes/{name}.json") if network.is_selected else network.sizes[0]


def _size_study(name: str) -> SizeStudy:
    runs = read_table(DATA / f"sizes/{name}.parquet")
    n_goal = int((runs["stop_reason"] == "goal").sum())
    chosen = read_layers(DATA / f"sizes/{name}.json")
    return SizeStudy(by_size(runs), chosen, n_goal, len(runs))
