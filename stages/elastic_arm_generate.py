"""Take the readings of the experiment on the flexible arm, and what its gauges show of them.

Reads params.yaml: elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges,
elastic_arm.readings.
Writes data/elastic_arm/readings.parquet, what the model has, and what the gauges show:
gauges_noise_free.parquet, gauges_noisy.parquet and gauges_noisy_voltages.parquet (strains exact).
"""

from pathlib import Path

import numpy as np

from flexik import stage
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.provenance import readings_checksum
from flexik.datasets.elastic_arm.readings import (
    FIELDS,
    STREAM_OF_READINGS,
    columns_of,
    divide,
    gauges_of,
    noise_generator,
    poses,
)
from flexik.datasets.tables import write_table
from flexik.kinematics.elastic_arm import flexible_forward, forward
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import equilibria
from flexik.parameters import load_parameters

FOLDER = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    model, made_with = flexible_arm(arm), readings_checksum(arm)
    angles, payload = poses(arm.readings)
    found = equilibria(model, angles, payload)
    readings = arm.readings
    part = divide(len(payload), readings.selection_share, readings.held_out_share, readings.seed)
    columns = columns_of([angles, payload, part, forward(model.geometry, angles), *found], FIELDS)
    write_table(FOLDER / "readings.parquet", columns, FIELDS, made_with)
    for shown in gauges.SHOWN:
        read = gauges.read(
            gauges_of(arm, shown), *found[1:], noise_generator(arm, shown, STREAM_OF_READINGS)
        )
        tip = flexible_forward(model.geometry, angles, read.deformation)
        write_table(
            FOLDER / f"gauges_{shown}.parquet",
            columns_of([*read, tip], gauges.FIELDS),
            gauges.FIELDS,
            made_with,
        )
    n_of_part = {str(name): int(np.sum(part == name)) for name in np.unique(part)}
    print(f"{len(payload)} readings: {n_of_part}")


if __name__ == "__main__":
    stage.run(main)
