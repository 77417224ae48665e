"""What the crane's report is made from: results of the stages, published values, timings."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.crane.section import SPRING, Section
from flexik.datasets.tables import read_csv, read_table
from flexik.evaluation.errors import STATISTICS, statistics, workspace_statistics
from flexik.evaluation.operations import (
    forward_operations,
    gauss_newton_step_operations,
    inversion_step_operations,
    normalisation_operations,
)
from flexik.files import read_json
from flexik.learning.perceptron import Network
from flexik.learning.size_selection import by_size, read_layers
from flexik.learning.torch_module import Module
from flexik.parameters.networks import Regressor, TorchModule
from flexik.planar import learning_curves, physics
from flexik.planar.fields import kept
from flexik.planar.learning import correction
from flexik.positioning.inverted_network import InvertedSettings
from flexik.positioning.method import Settings
from flexik.reporting.report import digest
from flexik.reporting.style import MM

BENCHMARKS, REFERENCE = Path("reports/benchmarks"), Path("data/reference/crane")
# What networks learn, as the thesis' methods call it
KIND = {
    "deflection": "deflection",
    "tip": "direct",
    "rigid_tip": "rigid",
    "coordinates": "inverse",
    None: "correction",
}
SELECTED = "_selected"
GROUPS = ("published", "selected", "beyond", "variants")
TIMES = {"single (us)": "microseconds_single", "batched (us)": "microseconds_batched"}
STEPS = {
    "gradient_descent": inversion_step_operations,
    "gauss_newton": gauss_newton_step_operations,
}


@dataclass(frozen=True)
class Results:
    """What the stages found; lengths in m.

    errors, workspace : long tables of evaluation.errors by method, under the published conditions
        and at random targets.
    spread : mean and largest error with the network of every restart, by method that has one.
    published : values of the thesis by file, errors in mm.
    training : a row for every restart of every network.
    studies : frame of learning.size_selection.by_size, and the chosen size, by network.
    by_corrections, draws : tables of planar.corrections and of parts.points.
    query_times, training_curves : measured by benchmarks.
    curves, physics : of planar.learning_curves and of planar.physics.
    """

    section: Section
    spring_stiffness: float
    grid: pd.DataFrame
    selection: pd.DataFrame
    errors: Mapping[str, pd.DataFrame]
    workspace: Mapping[str, pd.DataFrame]
    spread: Mapping[str, pd.DataFrame]
    published: Mapping[str, pd.DataFrame]
    mesh: pd.DataFrame
    training: pd.DataFrame
    studies: Mapping[str, tuple[pd.DataFrame, int]]
    trained: Mapping[str, Any]
    tolerances: pd.DataFrame
    fitting: pd.DataFrame
    by_corrections: pd.DataFrame
    draws: pd.DataFrame
    query_times: pd.DataFrame
    training_curves: pd.DataFrame
    shape: Mapping[str, Any]
    curves: pd.DataFrame
    physics: pd.DataFrame

    @property
    def methods(self) -> dict[str, Settings]:
        """Methods that compensate, by name."""
        return {k: method for k, method in self.section.methods.items() if k != "none"}

    @cached_property
    def kept(self) -> pd.DataFrame:
        """Samples of the grid that were solved."""
        return kept(self.grid)

    @property
    def points(self) -> list[tuple[float, float]]:
        """Published test points, m."""
        return list(self.section.conditions["published"].points)  # type: ignore[union-attr]

    @property
    def corrections(self) -> dict[str, np.ndarray]:
        """What networks of published size that correct another learn from (n, 2), m."""
        return {
            name: correction(self.kept, self.section.machine, self.trained[network.corrects])
            for name, network in self.section.networks.items()
            if network.corrects and not network.is_selected
        }

    @cached_property
    def statistics(self) -> dict[str, dict[str, float]]:
        """Statistics under the published conditions by method, m."""
        return {label: statistics(frame) for label, frame in self.errors.items()}

    @cached_property
    def workspace_statistics(self) -> dict[str, dict[str, float]]:
        """Statistics at random targets by method, m."""
        frames = self.workspace.items()
        return {label: workspace_statistics(frame) for label, frame in frames if len(frame)}

    def compared(self, labels: list[str]) -> pd.DataFrame:
        """STATISTICS (rows) in mm: columns LABEL and "LABEL published", NaN where nothing is."""
        published = self.published["positioning_errors"].set_index("statistic")
        columns: dict[str, Any] = {}
        for label in labels:
            theirs = published.get(self.section.methods[label].method)
            columns[label] = {name: MM * self.statistics[label][name] for name in STATISTICS}
            columns[f"{label} published"] = dict.fromkeys(STATISTICS) if theirs is None else theirs
        return pd.DataFrame(columns, list(STATISTICS), dtype=float)

    @property
    def groups(self) -> dict[str, list[str]]:
        """Methods that share a table: of published size, of selected size, variants, and beyond.

        The first are the thesis' with the name of their method, the second end with SELECTED; the
        last are of methods that the thesis does not know.
        """
        groups: dict[str, list[str]] = {name: [] for name in GROUPS}
        published = self.published["positioning_errors"]
        for label, method in self.methods.items():
            names = {method.method: "published", f"{method.method}{SELECTED}": "selected"}
            network = self.section.networks.get(method.network or "")
            known = method.method in published and not isinstance(network, Regressor | TorchModule)
            groups[names.get(label, "variants") if known else "beyond"].append(label)
        return groups

    @property
    def best(self) -> str:
        """The method of the least mean error at random targets, the flexible model itself aside."""
        found = self.workspace_statistics
        names = [name for name in self.methods if name in found and name != "exact"]
        return min(names, key=lambda name: found[name]["mean_error"])

    def numbers(self, network: str) -> int:
        """Numbers that trained `network` keeps; of a regressor those that its file has room for."""
        found = self.trained[network]
        if isinstance(found, Network):
            return found.n_weights
        if isinstance(found, Module):
            return sum(array.size for array in found.arrays.values())
        return self.section.file_of(network).stat().st_size // 8

    def memory(self, label: str) -> int:
        """Numbers that a controller needs of method `label`, as float64, in bytes.

        Weights of its network, samples of its table, sections of its beams; none of the rigid
        kinematics, which all need.
        """
        method, machine = self.section.methods[label], self.section.machine
        n = 0
        if method.network is not None:
            n += self.numbers(method.network)
        elif method.reads:
            n += 2 * len(self.grid)
        if method.asks_machine:
            profiles = [beam.profile() for beam in machine.beams.values()]
            n += sum(3 * len(profile.abscissa) for profile in profiles)
        return 8 * n

    def compare(self) -> pd.DataFrame:
        """A row a method: errors at published conditions and at random targets, and its cost."""
        published = self.published["positioning_errors"].set_index("statistic")
        groups = {label: name for name, labels in self.groups.items() for label in labels}
        times = self.query_times.set_index("method")
        rows = []
        for label, found in self.statistics.items():
            at_random = self.workspace_statistics[label]
            row = {
                "method": label,
                "group": groups.get(label, "published"),
                "mean": found["mean_error"],
                "max": found["max_error"],
                "thesis": published[label]["mean_error"] / MM if label in published else None,
                "workspace_mean": at_random["mean_error"],
                "workspace_p99": at_random["p99_error"],
                "workspace_max": at_random["max_error"],
                "n_failed": at_random["n_failed"],
                "n_targets": at_random["n_targets"],
                "kilobytes": self.memory(label) / 1e3,
                "microseconds": times["microseconds_batched"].get(label),
            }
            rows.append(row)
        return pd.DataFrame(rows)

    def published_size(self, name: str) -> int | None:
        """Published n_hidden of networks that learn what network `name` does, if there is one."""
        sizes = self.published["network_sizes"].set_index("network")["n_hidden"]
        kind = KIND[self.section.networks[name].learns]
        return int(sizes[kind]) if kind in sizes else None

    def query_operations(self, label: str) -> float | None:
        """Operations of its network that a query of method `label` takes, on average."""
        method = self.methods[label]
        if method.network is None:
            return None
        network = self.trained[method.network]
        if not isinstance(network, Network):
            return None
        if not isinstance(method, InvertedSettings):
            return getattr(method, "n_corrections", 1) * forward_operations(network)
        step = STEPS[method.inversion.kind](network, len(network.inputs) - 1)
        n_steps = float(self.errors[label]["n_iterations"].mean())
        return normalisation_operations(network) + n_steps * step

    def query_cost(self) -> pd.DataFrame:
        """Operations and microseconds of a query of every method, and its mean error."""
        published = self.published["operations"].set_index("method")["operations"]
        times = self.query_times.set_index("method")
        rows = [
            {
                "method": label,
                "operations": self.query_operations(label),
                "published": published.get(label) if label == method.method else None,
                **{title: times[name].get(label) for title, name in TIMES.items()},
                "mean R (mm)": MM * self.statistics[label]["mean_error"],
            }
            for label, method in self.methods.items()
        ]
        return pd.DataFrame(rows).astype(dict.fromkeys(["operations", "published", *TIMES], float))


def read(section: Section) -> Results:
    """Results of the stages, beside the published values."""
    data, networks, methods = section.data, section.networks, section.methods
    training = {name: pd.read_csv(data / f"networks/{name}.restarts.csv") for name in networks}
    spread = {label: data / f"errors/published/{label}.spread.parquet" for label in methods}
    times = read_csv(
        BENCHMARKS / "positioning.csv", list(TIMES.values()), ("method", "settings"), ("method",)
    ).query("method in @section.methods")
    keys = [query_key(section, name) for name in times["method"]]
    errors, workspace = (
        {label: read_table(data / f"errors/{name}/{label}.parquet") for label in methods}
        for name in ("published", "workspace")
    )
    return Results(
        section=section,
        spring_stiffness=read_json(data / "constants/constants.json")["constants"][SPRING],
        grid=read_table(data / "samples/grid.parquet"),
        selection=read_table(data / "samples/selection.parquet"),
        errors=errors,
        workspace=workspace,
        spread={label: read_table(path) for label, path in spread.items() if path.is_file()},
        published=published(),
        mesh=read_table(data / "studies/mesh.parquet"),
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies={
            name: (
                by_size(read_table(data / f"sizes/{name}.parquet")),
                read_layers(data / f"sizes/{name}.json")[0],
            )
            for name, network in networks.items()
            if network.is_selected
        },
        trained={name: section.load_of(name)(section.file_of(name))[0][0] for name in networks},
        tolerances=read_table(data / "studies/tolerance.parquet"),
        fitting=read_table(data / "studies/fitting.parquet"),
        by_corrections=read_table(data / "studies/corrections.parquet"),
        draws=read_table(data / "studies/points.parquet"),
        query_times=times[times["settings"] == keys],
        training_curves=read_csv(
            BENCHMARKS / "training_methods.csv", ("seconds", "error"), ("trainer",)
        ),
        shape=read_json(data / "studies/shape.json")
        | {"exaggeration": section.studies.shape.exaggeration},
        curves=learning_curves.read(section, section.studies.learning_curves),
        physics=physics.read(section, section.studies.physics),
    )


def query_key(section: Section, name: str) -> str:
    """Checksum of what the time of a query of method `name` depends on."""
    method = section.methods[name]
    network = section.networks[method.network].model_dump() if method.network else None
    given = method.model_dump(exclude={"n_targets"})
    return digest([section.geometry, given, network])


def published() -> dict[str, pd.DataFrame]:
    """Values of the thesis by file."""
    keys = {
        "positioning_errors": ("statistic",),
        "network_sizes": ("network",),
        "operations": ("method",),
        "without_worst_points": ("method", "x", "y"),
        "tolerance_study": ("method", "tolerance"),
    }
    return {name: read_csv(REFERENCE / f"{name}.csv", (), key, key) for name, key in keys.items()}
