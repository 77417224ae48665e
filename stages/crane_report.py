"""Tables, figures, metrics and the report page of the crane.

Reads params.yaml: crane; what the other crane stages wrote; the published values; the timings that
the benchmarks wrote.
Writes reports/crane/: positioning_errors, positioning_errors_selected, positioning_errors_variants,
without_worst_points, inversions, tolerance_study, query_cost, workspace, measured_errors,
measured_reference_errors, measured_points, error_budget, measured_predictions, identified_offsets,
adaptation, calibration, mesh_study, training, training_race, size_rules and size_selection/ (CSV
and Markdown), errors.csv with every test condition of every method, adapted_strokes.csv,
measured_distances.csv, metrics.json, figures/ and README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.evaluations import TOLERANCE_FIELDS, read_evaluation
from flexik.datasets.crane.grid import FIELDS
from flexik.datasets.crane.learning import FITTING_FIELDS
from flexik.datasets.crane.provenance import (
    adaptation_checksum,
    budget_checksum,
    campaign_checksum,
    evaluation_checksum,
    fitting_checksum,
    grid_checksum,
    identification_checksum,
    network_checksum,
    query_checksum,
    selection_checksum,
    tolerance_checksum,
    workspace_checksum,
)
from flexik.datasets.crane_measured.fields import (
    ADAPTATION_FIELDS,
    BUDGET_FIELDS,
    COMMAND_FIELDS,
    MEASURED_FIELDS,
    OFFSET_FIELDS,
    PREDICTION_FIELDS,
)
from flexik.datasets.tables import read_csv, read_table
from flexik.errors import DataError
from flexik.files import read_json
from flexik.learning.size_selection import FIELDS as STUDY_FIELDS
from flexik.learning.size_selection import by_size, read_choice
from flexik.learning.storage import load_network
from flexik.multibody.crane.assembly import read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.reporting.crane.report import write_report
from flexik.reporting.crane.results import Published, Results
from flexik.reporting.crane_measured.campaign_tables import PUBLISHED_COLUMNS
from flexik.reporting.crane_measured.report import Measured

DATA, REPORTS = Path("data/crane"), Path("reports/crane")
BENCHMARKS, REFERENCE = Path("reports/benchmarks"), Path("data/reference/crane")
PUBLISHED = (
    "positioning_errors",
    "network_sizes",
    "without_worst_points",
    "tolerance_study",
    "operations",
    "measured_errors",
    "measured_reference_errors",
)
MESH_COLUMNS = (
    "n_samples",
    "refinement",
    "mean_difference",
    "max_difference",
    "mean_relative",
    "max_relative",
)
TRAINING_COLUMNS = ("restart", "n_hidden", "n_iterations", "training_error", "selection_error")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    stiffness = read_spring_stiffness(DATA / "calibration.json")
    training = {
        name: read_csv(DATA / "networks" / f"{name}_training.csv", TRAINING_COLUMNS)
        for name in crane.all_networks
    }
    selection_made = selection_checksum(crane, stiffness)
    tolerances_made = tolerance_checksum(crane, stiffness)
    fitting_made = fitting_checksum(crane, stiffness)
    results = Results(
        crane=crane,
        spring_stiffness=stiffness,
        grid=read_table(DATA / "grid.parquet", FIELDS, grid_checksum(crane, stiffness)),
        selection=read_table(DATA / "selection.parquet", FIELDS, selection_made),
        errors=evaluations(crane, stiffness, "evaluations"),
        workspace=evaluations(crane, stiffness, "workspace"),
        published=published(),
        mesh_study=read_csv(DATA / "mesh_study.csv", MESH_COLUMNS, ("element",)),
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies=studies(crane, stiffness),
        networks={
            name: load_network(
                DATA / "networks" / f"{name}.json", network_checksum(crane, stiffness, name)
            )[0]
            for name in crane.all_networks
        },
        tolerances=read_table(DATA / "tolerance_study.parquet", TOLERANCE_FIELDS, tolerances_made),
        fitting=read_table(DATA / "fitting.parquet", FITTING_FIELDS, fitting_made),
        query_times=query_times(crane),
        training_curves=read_csv(
            BENCHMARKS / "training_methods.csv", ("seconds", "error"), ("trainer",)
        ),
        measured=measured(crane, stiffness),
        shape=read_json(DATA / "shape.json"),
    )
    write_report(results, REPORTS, [REFERENCE / f"{name}.csv" for name in PUBLISHED])


def evaluations(crane: parameters.Crane, stiffness: float, folder: str) -> dict[str, pd.DataFrame]:
    """Errors by method, of the test conditions or over the workspace."""
    made_with = {"evaluations": evaluation_checksum, "workspace": workspace_checksum}[folder]
    return {
        label: read_evaluation(
            DATA / folder / f"{label}.parquet", made_with(crane, stiffness, label)
        )
        for label in ("none", *crane.methods)
    }


def studies(crane: parameters.Crane, stiffness: float) -> dict[str, tuple[pd.DataFrame, int]]:
    """Errors by size, and the chosen size, by network."""
    found = {}
    for name in crane.studies:
        made_with = network_checksum(crane, stiffness, name)
        runs = read_table(DATA / "size_selection" / f"{name}.parquet", STUDY_FIELDS, made_with)
        found[name] = by_size(runs), read_choice(DATA / "size_selection" / f"{name}.json")
    return found


def query_times(crane: parameters.Crane) -> pd.DataFrame:
    """Times of the methods that were measured with the settings they have now."""
    path, columns = BENCHMARKS / "positioning.csv", ("microseconds_single", "microseconds_batched")
    table = read_csv(path, columns, ("method", "settings"), ("method",))
    for name in columns:
        if (table[name] <= 0).any():
            raise DataError(f"{path}, column {name}: expected positive times")
    known = ("none", *crane.methods)
    current = [
        method in known and settings == query_checksum(crane, method)
        for method, settings in zip(table["method"], table["settings"], strict=True)
    ]
    return table[current]


def measured(crane: parameters.Crane, stiffness: float) -> Measured:
    """Campaign, what is identified from it, and studies on cranes as built."""
    identified = identification_checksum(crane, stiffness)
    found = {}
    for name, path, fields, made_with in (
        ("campaign", "measured", MEASURED_FIELDS, campaign_checksum(crane, stiffness)),
        ("budget", "error_budget", BUDGET_FIELDS, budget_checksum(crane, stiffness)),
        ("adaptation", "adaptation", ADAPTATION_FIELDS, adaptation_checksum(crane, stiffness)),
        ("offsets", "identified/offsets", OFFSET_FIELDS, identified),
        ("predictions", "identified/predictions", PREDICTION_FIELDS, identified),
        ("commands", "identified/commands", COMMAND_FIELDS, identified),
    ):
        found[name] = read_table(DATA / f"{path}.parquet", fields, made_with)
    tables = {
        name: read_csv(REFERENCE / f"{name}.csv", PUBLISHED_COLUMNS, ("statistic",), ("statistic",))
        for name in ("measured_errors", "measured_reference_errors")
    }
    return Measured(crane.measured, published=tables, **found)


def published() -> Published:
    """Values of the thesis."""
    sizes = read_csv(REFERENCE / "network_sizes.csv", ("n_hidden",), ("network",), ("network",))
    operations = read_csv(REFERENCE / "operations.csv", ("operations",), ("method",), ("method",))
    methods = ("none", "combined", "direct", "modular", "inverse")
    points = ("x", "y", "max_error", "mean_error")
    iterations = ("tolerance", "mean_iterations", "max_iterations", "error_ratio")
    return Published(
        errors=read_csv(
            REFERENCE / "positioning_errors.csv", methods, ("statistic",), ("statistic",)
        ),
        sizes=dict(zip(sizes["network"], sizes["n_hidden"], strict=True)),
        without_worst=read_csv(
            REFERENCE / "without_worst_points.csv", points, ("method",), ("method", "x", "y")
        ),
        tolerances=read_csv(
            REFERENCE / "tolerance_study.csv", iterations, ("method",), ("method", "tolerance")
        ),
        operations=dict(zip(operations["method"], operations["operations"], strict=True)),
    )


if __name__ == "__main__":
    stage.run(main)
