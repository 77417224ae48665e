"""Command the flexible arm by what the networks given gauges say for every reading.

Reads params.yaml: elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges,
elastic_arm.readings, elastic_arm.networks, elastic_arm.selected_networks, elastic_arm.trainers;
the tables of elastic_arm_generate; the networks.
Writes data/elastic_arm/fit.parquet, a row for every network and reading.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.elastic_arm.learning import (
    FIT_FIELDS,
    KINDS,
    learning_table,
    read_readings,
)
from flexik.datasets.elastic_arm.provenance import fit_checksum, network_checksum
from flexik.datasets.elastic_arm.readings import columns_of
from flexik.datasets.tables import write_table
from flexik.learning.storage import load_network
from flexik.mechanisms.elastic_arm import DEFORMATION, flexible_forward
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import equilibria
from flexik.parameters import load_parameters

DATA = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    names = [name for name, network in arm.all_networks.items() if network.kind == "gauges"]
    parts = [fit(arm, name) for name in names]
    table = pd.concat(parts)
    write_table(
        DATA / "fit.parquet",
        {field.name: table[field.name].to_numpy() for field in FIT_FIELDS},
        FIT_FIELDS,
        fit_checksum(arm),
    )
    print(f"{len(names)} networks, {len(table)} commanded poses")


def fit(arm: parameters.ElasticArm, name: str) -> pd.DataFrame:
    """Columns FIT_FIELDS of network `name`."""
    model = flexible_arm(arm)
    readings, shown = read_readings(DATA, arm, arm.all_networks[name].readings or "")
    table = learning_table(readings, shown, "gauges")
    network, _ = load_network(DATA / "networks" / f"{name}.json", network_checksum(arm, name))
    angles = network.predict(table[[field.name for field in KINDS["gauges"].inputs]].to_numpy())
    tip = flexible_forward(model.geometry, angles, table[list(DEFORMATION)].to_numpy())
    achieved = equilibria(model, angles, readings["payload"].to_numpy()).tip
    numbers = np.arange(len(table))
    return pd.DataFrame(
        columns_of([np.full(len(table), name), numbers, angles, tip, achieved], FIT_FIELDS)
    )


if __name__ == "__main__":
    stage.run(main)
