"""Tables, figures, metrics and the report page of the elastic arm.

Reads params.yaml: elastic_arm; what the other stages of the arm wrote; the published values.
Writes reports/elastic_arm/: sensitivity, positioning_errors, fit, splits, gauges, training and
size_selection/ (CSV and Markdown), metrics.json, figures/ and README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import (
    EVALUATION_FIELDS,
    FIT_FIELDS,
    PAYLOAD_ERROR_FIELDS,
    SENSITIVITY_FIELDS,
    SPLIT_FIELDS,
    TARGET_FIELDS,
    read_readings,
)
from flexik.datasets.elastic_arm.provenance import (
    evaluation_checksum,
    fit_checksum,
    network_checksum,
    payload_error_checksum,
    splits_checksum,
    targets_checksum,
)
from flexik.datasets.tables import read_csv, read_table
from flexik.errors import DataError
from flexik.files import read_json
from flexik.learning.size_selection import by_size, read_layers, study_fields
from flexik.learning.storage import load_network
from flexik.parameters import load_parameters
from flexik.reporting.elastic_arm.report import write_report
from flexik.reporting.elastic_arm.results import Results, SizeStudy

DATA, REPORTS = Path("data/elastic_arm"), Path("reports/elastic_arm")
PUBLISHED = Path("data/reference/elastic_arm/fit.csv")
TRAINING_COLUMNS = ("restart", "n_iterations", "training_error", "selection_error")


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    training = {
        name: read_csv(DATA / "networks" / f"{name}_training.csv", TRAINING_COLUMNS)
        for name in arm.all_networks
    }
    results = Results(
        arm=arm,
        readings=read_readings(DATA, arm)[0],
        shown={shown: read_readings(DATA, arm, shown)[1] for shown in gauges.SHOWN},
        fit=read_table(DATA / "fit.parquet", FIT_FIELDS, fit_checksum(arm)),
        layers={name: layers(arm, name) for name in arm.all_networks},
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        studies=studies(arm),
        errors={
            label: read_table(
                DATA / "evaluations" / f"{label}.parquet",
                EVALUATION_FIELDS,
                evaluation_checksum(arm, label),
            )
            for label in ("none", *arm.methods)
        },
        targets=read_table(DATA / "targets.parquet", TARGET_FIELDS, targets_checksum(arm)),
        target_counts=target_counts(DATA / "targets.json"),
        sensitivity=read_table(DATA / "sensitivity.parquet", SENSITIVITY_FIELDS, fit_checksum(arm)),
        payload_error=read_table(
            DATA / "payload_error.parquet", PAYLOAD_ERROR_FIELDS, payload_error_checksum(arm)
        ),
        splits=read_table(DATA / "splits.parquet", SPLIT_FIELDS, splits_checksum(arm)),
        published=read_csv(PUBLISHED, ("r_theta_1", "r_theta_2"), ("network",), ("network",)),
    )
    write_report(results, REPORTS, [PUBLISHED])


def layers(arm: parameters.ElasticArm, name: str) -> tuple[int, ...]:
    """Neurons of every hidden layer of a trained network."""
    network, _ = load_network(DATA / "networks" / f"{name}.json", network_checksum(arm, name))
    return network.n_hidden if isinstance(network.n_hidden, tuple) else (network.n_hidden,)


def target_counts(path: Path) -> dict[str, int]:
    """How many targets were drawn, reached and kept."""
    counts = read_json(path)
    names = ("drawn", "reached", "kept")
    if not isinstance(counts, dict) or not all(isinstance(counts.get(n), int) for n in names):
        raise DataError(f"{path}: expected the numbers {', '.join(names)}")
    return {name: counts[name] for name in names}


def studies(arm: parameters.ElasticArm) -> dict[str, SizeStudy]:
    """Study of sizes by network."""
    found, folder = {}, DATA / "size_selection"
    for name, network in arm.selected_networks.items():
        fields = study_fields(len(network.select.n_hidden))
        runs = read_table(folder / f"{name}.parquet", fields, network_checksum(arm, name))
        chosen = read_layers(folder / f"{name}.json")
        if len(chosen) != len(network.select.n_hidden):
            raise DataError(
                f"{folder / name}.json: {len(chosen)} layers, expected "
                f"{len(network.select.n_hidden)}"
            )
        n_goal = int((runs["stop_reason"] == "goal").sum())
        found[name] = SizeStudy(by_size(runs), chosen, n_goal, len(runs))
    return found


if __name__ == "__main__":
    stage.run(main)
