"""Tables, figures, metrics and the report page of the elastic arm.

Reads params.yaml: elastic_arm; what the other stages of the arm wrote; the published values.
Writes reports/elastic_arm/: positioning_errors, fit, gauges, training and size_selection/ (CSV and
Markdown), metrics.json, figures/ and README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import EVALUATION_FIELDS, FIT_FIELDS, read_readings
from flexik.datasets.elastic_arm.provenance import (
    evaluation_checksum,
    fit_checksum,
    network_checksum,
)
from flexik.datasets.tables import read_csv, read_table
from flexik.learning.size_selection import by_size, read_layers, study_fields
from flexik.learning.storage import load_network
from flexik.parameters import load_parameters
from flexik.reporting.elastic_arm.report import write_report
from flexik.reporting.elastic_arm.results import Results

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
        shown={
            shown: read_readings(DATA, arm, shown)[1]
            for shown in (gauges.FREE_OF_NOISE, gauges.NOISY)
        },
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
        published=read_csv(PUBLISHED, ("r_theta_1", "r_theta_2"), ("network",), ("network",)),
    )
    write_report(results, REPORTS, [PUBLISHED])


def layers(arm: parameters.ElasticArm, name: str) -> tuple[int, ...]:
    """Neurons of every hidden layer of a trained network."""
    network, _ = load_network(DATA / "networks" / f"{name}.json", network_checksum(arm, name))
    return network.n_hidden if isinstance(network.n_hidden, tuple) else (network.n_hidden,)


def studies(arm: parameters.ElasticArm) -> dict[str, tuple[pd.DataFrame, tuple[int, ...]]]:
    """Errors by size, and the chosen layers, by network."""
    found, folder = {}, DATA / "size_selection"
    for name, network in arm.selected_networks.items():
        fields = study_fields(len(network.select.n_hidden))
        runs = read_table(folder / f"{name}.parquet", fields, network_checksum(arm, name))
        found[name] = by_size(runs), read_layers(folder / f"{name}.json")
    return found


if __name__ == "__main__":
    stage.run(main)
