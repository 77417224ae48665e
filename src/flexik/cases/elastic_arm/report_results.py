"""What the stages of the elastic arm left, put together by network and by method."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT
from flexik.cases.elastic_arm.section import Section
from flexik.datasets.tables import read_csv, read_table
from flexik.evaluation.errors import workspace_statistics
from flexik.evaluation.regression import correlation
from flexik.learning.size_selection import read_layers
from flexik.reporting.style import MM

PUBLISHED = Path("data/reference/elastic_arm/fit.csv")
# Nearer than this to the payload of a reading, a target's payload was learnt from, kg
NEAR = 0.1
R = [f"r_{name}" for name in ANGLES]
POSE = " in the pose to be found"
# What a method knows, by what its network learnt
KNOWS = {
    "gauges": f"target, gauges{POSE}",
    "gauges_without_dx": f"target, gauges but dx{POSE}",
    "gauges_elbow": f"target, elbow, gauges{POSE}",
    "coordinates": "target, payload, elbow",
}
EXTRA = {"gauges_without_dx": ", without dx", "gauges_elbow": ", and elbow"}

table = functools.cache(read_table)


def hyphened(name: str) -> str:
    """Name of what gauges show, as it is written."""
    return name.replace("_", "-")


def by_restart(values: pd.Series, decimals: int) -> str:
    """Millimetres of the restarts of a network, in their order."""
    return ", ".join(f"{MM * value:.{decimals}f}" for value in values)


@dataclass(frozen=True)
class Results:
    """The results of all stages."""

    section: Section

    @property
    def main(self) -> str:
        """Name of the network as published."""
        return self.section.studies.splits.network

    @property
    def conditions(self) -> str:
        """Name of the set of conditions."""
        return next(iter(self.section.conditions))

    def of(self, name: str) -> pd.DataFrame:
        """Table data/SECTION/NAME.parquet."""
        return table(self.section.data.absolute() / f"{name}.parquet")

    @property
    def readings(self) -> pd.DataFrame:
        """The readings."""
        return self.of("samples/readings")

    def shown(self, noise: str) -> pd.DataFrame:
        """What gauges show in the readings."""
        return self.of(f"samples/readings.{noise}")

    def layers(self, name: str) -> tuple[int, ...]:
        """Units of the hidden layers of a network, given or chosen."""
        network, chosen = self.section.networks[name], self.section.data / f"sizes/{name}.json"
        return read_layers(chosen) if network.is_selected else network.sizes[0]

    def hidden(self, name: str) -> str:
        """The same as the paper writes them, 12-40."""
        return "-".join(map(str, self.layers(name)))

    def joined(self, name: str) -> pd.DataFrame:
        """Readings with what the gauges show and what network `name` says, a row each."""
        shown, fit = self.shown(self.section.networks[name].readings), self.of("studies/fit")
        fit = fit[fit["network"] == name].set_index("reading").drop(columns="network")
        return pd.concat([self.readings, shown[["p_x", "p_y"]], fit], axis=1)

    @functools.cached_property
    def errors(self) -> dict[str, pd.DataFrame]:
        """Long tables of the methods at the random targets."""
        return {k: self.of(f"errors/{self.conditions}/{k}") for k in self.section.methods}

    @functools.cached_property
    def fits(self) -> pd.DataFrame:
        """Networks given gauges, by name: fit to training and held-out readings, R published.

        targets_: R at the random targets, NaN where no method takes the network or its angles do
        not vary; worst_, best_: of all restarts.
        """
        every, published = self.of("studies/fit.restarts"), read_csv(PUBLISHED, R, ("network",))
        networks = self.section.gauge_networks
        rows = every[every["chosen"] == 1].set_index("network").loc[list(networks)]
        starts = every.groupby("network")
        known = published.set_index("network")[R].add_prefix("published_")
        worst, best = starts[R].min().add_prefix("worst_"), starts[R].max().add_prefix("best_")
        rows = rows.join([known, worst, best])
        rows["hidden"] = [self.hidden(name) for name in networks]
        rows["trainer"] = [network.trainer for network in networks.values()]
        rows["gauges"] = [hyphened(n.readings) + EXTRA.get(n.learns, "") for n in networks.values()]
        rows["mean_errors"] = starts["mean_error"].agg(by_restart, 2)
        rows[[f"targets_{r}" for r in R]] = np.nan
        right = self.of(f"samples/{self.conditions}")[list(ANGLES)].to_numpy()
        for label, method in self.section.methods.items():
            found = self.errors[label][list(ANGLES)].to_numpy()
            if method.method == "gauges" and np.ptp(found, axis=0).all():
                rows.loc[method.network, [f"targets_{r}" for r in R]] = correlation(right, found)
        return rows

    @functools.cached_property
    def positioning(self) -> pd.DataFrame:
        """Methods by name: statistics at the random targets, m, and where they come from."""
        methods, rows = self.section.methods, dict[str, dict[str, Any]]()
        none = next(label for label, method in methods.items() if method.method == "none")
        for label, frame in self.errors.items():
            method, error = methods[label], frame["error"]
            row: dict[str, Any] = dict(workspace_statistics(frame))
            row["clipped"] = int((frame["n_clipped"] > 0).sum()) if "n_clipped" in frame else 0
            row["n_worse"] = int((error > self.errors[none]["error"]).sum())
            apart = np.abs(frame["payload"].to_numpy()[:, None] - self.section.samples.payloads)
            near = apart.min(axis=1) <= NEAR
            row |= {"n_near": int(near.sum()), "near": error[near].mean()}
            row |= {"far": error[~near].mean(), "knows": "target"}
            if method.network is not None:
                network = self.section.networks[method.network]
                restarts = self.of(f"errors/{self.conditions}/{label}.restarts")
                row["knows"] = KNOWS.get(network.learns, "target, payload")
                row["gauges"] = hyphened(network.readings) if network.has_gauges else ""
                row |= {"hidden": self.hidden(method.network), "trainer": network.trainer}
                row["mean_errors"] = by_restart(restarts["mean_error"], 3)
                row["max_errors"] = by_restart(restarts["max_error"], 3)
                row["worst_mean_error"] = restarts["mean_error"].max()
                row["worst_max_error"] = restarts["max_error"].max()
            rows[label] = row
        told = self.of("studies/payload_error").set_index("method")["mean_error"]
        found = pd.DataFrame.from_dict(rows, orient="index").assign(told=told)
        return found.rename_axis("method")

    @property
    def splits(self) -> pd.DataFrame:
        """R of the published network by every division, the main one first."""
        first = {"seed": self.section.samples.seed, **self.fits.loc[self.main, R]}
        return pd.concat([pd.DataFrame([first]), self.of("studies/splits")], ignore_index=True)

    def on_border(self) -> int:
        """Number of held-out readings on the border of the grid of angles."""
        angles = self.readings[list(ANGLES)].to_numpy()
        ends = np.isclose(angles, angles.min(axis=0)) | np.isclose(angles, angles.max(axis=0))
        return int(ends.any(axis=1)[self.readings["part"] == HELD_OUT].sum())
