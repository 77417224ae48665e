"""Tables, figures, metrics and the report page of the crane.

Reads params.yaml: crane; what the other crane stages wrote; the published table.
Writes reports/crane/: positioning_errors, calibration, mesh_study, training and size_selection/
(CSV and Markdown), errors.csv with every condition of every method, metrics.json, figures/ and
README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.datasets.crane import FIELDS
from flexik.datasets.evaluations import read_evaluation
from flexik.datasets.provenance import (
    evaluation_checksum,
    grid_checksum,
    network_checksum,
    selection_checksum,
)
from flexik.datasets.tables import read_csv, read_table
from flexik.files import read_json
from flexik.learning.size_selection import FIELDS as STUDY_FIELDS
from flexik.learning.size_selection import by_size, read_choice
from flexik.multibody.assembly import read_spring_stiffness
from flexik.parameters import load_parameters
from flexik.reporting.crane_report import Results, write_report

DATA, REPORTS = Path("data/crane"), Path("reports/crane")
MESH_COLUMNS = (
    "n_samples",
    "refinement",
    "mean_difference",
    "max_difference",
    "mean_relative",
    "max_relative",
)
TRAINING_COLUMNS = ("restart", "n_hidden", "n_iterations", "training_error", "selection_error")
PUBLISHED = Path("data/reference/crane/positioning_errors.csv")
PUBLISHED_SIZES = Path("data/reference/crane/network_sizes.csv")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    stiffness = read_spring_stiffness(DATA / "calibration.json")
    errors = {
        label: read_evaluation(
            DATA / "evaluations" / f"{label}.parquet",
            evaluation_checksum(crane, stiffness, label),
        )
        for label in ("none", *crane.methods)
    }
    names = [*crane.networks, *crane.selected_networks]
    training = {
        name: read_csv(DATA / "networks" / f"{name}_training.csv", TRAINING_COLUMNS)
        for name in names
    }
    studies = {}
    for name in crane.selected_networks:
        made_with = network_checksum(crane, stiffness, name)
        runs = read_table(DATA / "size_selection" / f"{name}.parquet", STUDY_FIELDS, made_with)
        chosen = read_choice(DATA / "size_selection" / f"{name}.json")
        studies[name] = by_size(runs), chosen
    selection_made = selection_checksum(crane, stiffness)
    sizes = read_csv(PUBLISHED_SIZES, ("n_hidden",), ("network",))
    results = Results(
        crane=crane,
        spring_stiffness=stiffness,
        grid=read_table(DATA / "grid.parquet", FIELDS, grid_checksum(crane, stiffness)),
        selection=read_table(DATA / "selection.parquet", FIELDS, selection_made),
        errors=errors,
        published=read_csv(PUBLISHED, ("none",), ("statistic",)),
        published_sizes=dict(zip(sizes["network"], sizes["n_hidden"], strict=True)),
        mesh_study=read_csv(DATA / "mesh_study.csv", MESH_COLUMNS, ("element",)),
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies=studies,
        shape=read_json(DATA / "shape.json"),
    )
    write_report(results, REPORTS, PUBLISHED)


if __name__ == "__main__":
    stage.run(main)
