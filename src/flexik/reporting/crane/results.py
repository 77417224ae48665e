"""What the report of the log crane is made from."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from flexik import parameters
from flexik.evaluation.errors import statistics
from flexik.evaluation.operations import (
    forward_operations,
    gauss_newton_step_operations,
    inversion_step_operations,
    normalisation_operations,
)
from flexik.learning.perceptron import Network
from flexik.parameters import AnyNetwork, CombinedModel, InvertedModel
from flexik.reporting.crane_measured.report import Measured

SELECTED = "_selected"


@dataclass(frozen=True)
class Published:
    """Values of the thesis.

    errors : statistics in mm, see evaluation.errors.comparison.
    sizes : n_hidden by kind of network.
    without_worst : a row for every point left out; method, x, y (m), max_error, mean_error (mm).
    tolerances : method, tolerance, mean_iterations, max_iterations, and error_ratio, the mean
        error over that at 1e-7.
    operations : floating-point operations a query by method.
    """

    errors: pd.DataFrame
    sizes: Mapping[str, int]
    without_worst: pd.DataFrame
    tolerances: pd.DataFrame
    operations: Mapping[str, float]


@dataclass(frozen=True)
class Results:
    """What the stages found; lengths in m.

    grid, selection : tables of datasets.crane.grid.
    errors, workspace : frames of evaluation.errors.evaluate by method, `none` among them, under
        the test conditions and at random targets.
    mesh_study : frame of multibody.crane.mesh_study.
    training : a row for every restart of every network.
    studies : frame of learning.size_selection.by_size, and the chosen size, by network.
    networks : trained networks by name.
    tolerances : a row for every method and tolerance, see evaluation.tolerance.
    fitting : FITTING_FIELDS of datasets.crane.learning.
    query_times : microseconds a query by method, measured by a benchmark.
    training_curves : error against seconds by trainer, measured by a benchmark.
    measured : campaign and adaptation.
    shape : see reporting.crane.schematic.
    """

    crane: parameters.Crane
    spring_stiffness: float
    grid: pd.DataFrame
    selection: pd.DataFrame
    errors: Mapping[str, pd.DataFrame]
    workspace: Mapping[str, pd.DataFrame]
    published: Published
    mesh_study: pd.DataFrame
    training: pd.DataFrame
    studies: Mapping[str, tuple[pd.DataFrame, int]]
    networks: Mapping[str, Network]
    tolerances: pd.DataFrame
    fitting: pd.DataFrame
    query_times: pd.DataFrame
    training_curves: pd.DataFrame
    measured: Measured
    shape: Mapping[str, Any]

    @property
    def statistics(self) -> dict[str, dict[str, float]]:
        """Statistics under the test conditions by method, m."""
        return {label: statistics(frame) for label, frame in self.errors.items()}

    @property
    def published_columns(self) -> dict[str, str | None]:
        """Published column that stands beside each method of params.yaml; None: there is none."""
        return {
            label: method.method if method.method in self.published.errors.columns else None
            for label, method in self.crane.methods.items()
        }

    @property
    def groups(self) -> dict[str, list[str]]:
        """Methods that share a table: of published size, of selected size, other variants.

        The first are those with the name of their method, the second end with SELECTED.
        """
        groups: dict[str, list[str]] = {"published": [], "selected": [], "variants": []}
        for label, method in self.crane.methods.items():
            names = {method.method: "published", f"{method.method}{SELECTED}": "selected"}
            groups[names.get(label, "variants")].append(label)
        return groups

    def published_size(self, name: str) -> int | None:
        """Published n_hidden of the kind of network `name`; None if there is none."""
        return self.published.sizes.get(self.network(name).kind)

    def network(self, name: str) -> AnyNetwork:
        """Parameters of network `name`."""
        return self.crane.all_networks[name]

    def query_operations(self, label: str) -> float:
        """Operations of its network that a query of method `label` takes, on average."""
        method = self.crane.methods[label]
        network = self.networks[method.network]
        if isinstance(method, CombinedModel):
            return method.n_corrections * forward_operations(network)
        if not isinstance(method, InvertedModel):
            return forward_operations(network)
        step = {
            "gradient_descent": inversion_step_operations,
            "gauss_newton": gauss_newton_step_operations,
        }[method.inversion.kind](network, len(network.inputs) - 1)
        n_steps = float(self.errors[label]["n_iterations"].mean())
        return normalisation_operations(network) + n_steps * step
