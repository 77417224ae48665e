"""What the crane's report is made from: results of the stages, published values, timings."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.crane.parts.fields import kept, on_line
from flexik.cases.crane.parts.learning import correction, learnt_rows
from flexik.cases.crane.section import Section
from flexik.datasets.tables import read_csv, read_table
from flexik.evaluation.errors import statistics
from flexik.evaluation.operations import (
    forward_operations,
    gauss_newton_step_operations,
    inversion_step_operations,
    normalisation_operations,
)
from flexik.files import read_json
from flexik.kinematics.crane import CraneGeometry
from flexik.kinematics.crane_manipulator import CraneManipulator, geometry_of
from flexik.learning.perceptron import Network
from flexik.learning.size_selection import by_size, read_layers
from flexik.learning.storage import load_network
from flexik.positioning.inverted_network import InvertedSettings
from flexik.positioning.method import Settings
from flexik.reporting.report import digest
from flexik.reporting.style import MM

Array = NDArray[np.float64]

BENCHMARKS, REFERENCE = Path("reports/benchmarks"), Path("data/reference/crane")
# What networks learn, as the thesis' methods call it; those that correct others are `correction`
KIND = {
    "deflection": "deflection",
    "tip": "direct",
    "rigid_tip": "rigid",
    "coordinates": "inverse",
}
SELECTED = "_selected"
TIMES = ("microseconds_single", "microseconds_batched")


@dataclass(frozen=True)
class Results:
    """What the stages found; lengths in m.

    errors, workspace : long tables of evaluation.errors by method, under the published conditions
        and at random targets.
    spread : mean and largest error with the network of every restart, by method that has one.
    published : values of the thesis by file, errors in mm.
    training : a row for every restart of every network.
    studies : frame of learning.size_selection.by_size, and the chosen size, by network.
    query_times, training_curves : measured by benchmarks.
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
    trained: Mapping[str, Network]
    tolerances: pd.DataFrame
    fitting: pd.DataFrame
    query_times: pd.DataFrame
    training_curves: pd.DataFrame
    shape: Mapping[str, Any]

    @property
    def geometry(self) -> CraneGeometry:
        """Rigid dimensions."""
        return geometry_of(self.section.machine)

    @property
    def methods(self) -> dict[str, Settings]:
        """Methods that compensate, by name."""
        return {k: method for k, method in self.section.methods.items() if k != "none"}

    @property
    def networks(self) -> Mapping[str, Any]:
        """Parameters of the networks by name."""
        return self.section.networks

    @cached_property
    def kept(self) -> pd.DataFrame:
        """Samples of the grid that were solved."""
        return kept(self.grid)

    @property
    def points(self) -> list[tuple[float, float]]:
        """Published test points, m."""
        return list(self.section.conditions["published"].points)  # type: ignore[union-attr]

    @property
    def initial(self) -> Array:
        """Strokes (k, 3) in m at which all methods start."""
        return CraneManipulator(self.geometry).initial_positions(np.array(self.points))

    @property
    def corrections(self) -> dict[str, Array]:
        """What networks of published size that correct another learn from (n, 2), m."""
        return {
            name: correction(self.kept, self.trained[network.corrects])
            for name, network in self.networks.items()
            if network.corrects and not network.is_selected
        }

    @property
    def slice_samples(self) -> pd.DataFrame:
        """Samples of the grid on the line of poses of the study of fitting."""
        line = self.section.studies.fitting
        return self.kept[on_line(self.kept, line.jib, line.extension, line.payload)]

    @cached_property
    def statistics(self) -> dict[str, dict[str, float]]:
        """Statistics under the published conditions by method, m."""
        return {label: statistics(frame) for label, frame in self.errors.items()}

    @property
    def published_columns(self) -> dict[str, str | None]:
        """Published column that stands beside each method; None: there is none."""
        known = self.published["positioning_errors"].columns
        return {
            label: method.method if method.method in known else None
            for label, method in self.methods.items()
        }

    @property
    def groups(self) -> dict[str, list[str]]:
        """Methods that share a table: of published size, of selected size, other variants.

        The first are those with the name of their method, the second end with SELECTED.
        """
        groups: dict[str, list[str]] = {"published": [], "selected": [], "variants": []}
        for label, method in self.methods.items():
            names = {method.method: "published", f"{method.method}{SELECTED}": "selected"}
            groups[names.get(label, "variants")].append(label)
        return groups

    def kind(self, name: str) -> str:
        """Of network `name`, see KIND."""
        network = self.networks[name]
        return "correction" if network.corrects else KIND[network.learns]

    def published_size(self, name: str) -> int | None:
        """Published n_hidden of the kind of network `name`; None if there is none."""
        sizes = self.published["network_sizes"].set_index("network")["n_hidden"]
        return int(sizes[self.kind(name)]) if self.kind(name) in sizes else None

    def n_learnt(self, name: str) -> int:
        """Samples that network `name` learns from."""
        return len(
            learnt_rows(self.kept, self.networks[name].learns or "correction", self.geometry)
        )

    def query_operations(self, label: str) -> float | None:
        """Operations of its network that a query of method `label` takes, on average."""
        method = self.methods[label]
        if method.network is None:
            return None
        network = self.trained[method.network]
        if not isinstance(method, InvertedSettings):
            return getattr(method, "n_corrections", 1) * forward_operations(network)
        step = {
            "gradient_descent": inversion_step_operations,
            "gauss_newton": gauss_newton_step_operations,
        }[method.inversion.kind](network, len(network.inputs) - 1)
        n_steps = float(self.errors[label]["n_iterations"].mean())
        return normalisation_operations(network) + n_steps * step

    def query_cost(self) -> pd.DataFrame:
        """Operations and microseconds of a query of every method, and its mean error."""
        frame = pd.DataFrame({"method": list(self.methods)})
        frame["operations"] = [self.query_operations(k) for k in frame["method"]]
        theirs = self.published["operations"].set_index("method")["operations"].astype(float)
        frame["published"] = [
            theirs.get(k) if k == self.methods[k].method else None for k in frame["method"]
        ]
        times = self.query_times.set_index("method").reindex(frame["method"])
        frame[["single (us)", "batched (us)"]] = times[list(TIMES)].to_numpy()
        frame["mean R (mm)"] = [MM * self.statistics[k]["mean_error"] for k in frame["method"]]
        return frame.astype({"operations": float, "published": float})


def read(section: Section, data: Path) -> Results:
    """Results of the stages under `data`, beside the published values."""
    training = {
        name: pd.read_csv(data / "networks" / f"{name}.restarts.csv") for name in section.networks
    }
    errors = {
        conditions: {
            label: read_table(data / "errors" / conditions / f"{label}.parquet")
            for label in section.methods
        }
        for conditions in ("published", "workspace")
    }
    spread = {
        label: data / "errors" / "published" / f"{label}.spread.parquet"
        for label in section.methods
    }
    times = read_csv(
        BENCHMARKS / "positioning.csv", TIMES, ("method", "settings"), ("method",)
    ).query("method in @section.methods")
    keys = [query_key(section, name) for name in times["method"]]
    studies, sizes = data / "studies", data / "sizes"
    return Results(
        section=section,
        spring_stiffness=read_json(data / "constants" / "spring.json")["spring_stiffness"],
        grid=read_table(data / "samples" / "grid.parquet"),
        selection=read_table(data / "samples" / "selection.parquet"),
        errors=errors["published"],
        workspace=errors["workspace"],
        spread={label: read_table(path) for label, path in spread.items() if path.is_file()},
        published=published(),
        mesh=read_table(studies / "mesh.parquet"),
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies={
            name: (
                by_size(read_table(sizes / f"{name}.parquet")),
                read_layers(sizes / f"{name}.json")[0],
            )
            for name, network in section.networks.items()
            if network.is_selected
        },
        trained={
            name: load_network(data / "networks" / f"{name}.json")[0] for name in section.networks
        },
        tolerances=read_table(studies / "tolerance.parquet"),
        fitting=read_table(studies / "fitting.parquet"),
        query_times=times[times["settings"] == keys],
        training_curves=read_csv(
            BENCHMARKS / "training_methods.csv", ("seconds", "error"), ("trainer",)
        ),
        shape=read_json(studies / "shape.json"),
    )


def query_key(section: Section, name: str) -> str:
    """Checksum of what the time of a query of method `name` depends on."""
    method = section.methods[name]
    network = section.networks[method.network].model_dump() if method.network else None
    given = method.model_dump(exclude={"n_targets"})
    return digest([section.machine.geometry.model_dump(), given, network])


def published() -> dict[str, pd.DataFrame]:
    """Values of the thesis by file."""
    files: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
        "positioning_errors": (
            ("none", "combined", "direct", "modular", "inverse"),
            ("statistic",),
        ),
        "network_sizes": (("n_hidden",), ("network",)),
        "operations": (("operations",), ("method",)),
        "without_worst_points": (("x", "y", "max_error", "mean_error"), ("method", "x", "y")),
        "tolerance_study": (("mean_iterations", "max_iterations"), ("method", "tolerance")),
    }
    return {
        name: read_csv(REFERENCE / f"{name}.csv", numbers, keys[:1], keys)
        for name, (numbers, keys) in files.items()
    }
