"""Train one network of the crane from several starts; the selection set chooses among them.

Usage: crane_train.py NETWORK, a name under crane.networks.
Reads params.yaml: parallel, crane.networks.NETWORK (and crane.geometry, crane.structure,
crane.grid, crane.selection to know which data belong to them); the tables of crane_generate.
Writes data/crane/networks/NETWORK.json and the training records NETWORK_training.csv.
"""

import functools
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import stage
from flexik.datasets.crane import FIELDS, INPUTS, deflection, kept
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.provenance import grid_checksum, network_checksum, selection_checksum
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.files import read_json, write_text
from flexik.learning.perceptron import Quantity
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, LevenbergMarquardt, TrainingRecord, train_best
from flexik.parameters import load_parameters

FOLDER = Path("data/crane")
INPUT_QUANTITIES = [Quantity(f.name, f.unit) for f in FIELDS if f.name in INPUTS]

# What each kind of network learns from the inputs: outputs, and their values from a table
KINDS = {
    "deflection": ([Quantity("deflection_x", "m"), Quantity("deflection_y", "m")], deflection),
}


def main() -> None:
    """Run the stage."""
    parameters = load_parameters()
    crane = parameters.crane
    name = sys.argv[1]
    if name not in crane.networks:
        raise ParameterError(f"crane.networks: there is no {name!r} ({', '.join(crane.networks)})")
    network = crane.networks[name]
    stiffness = read_json(FOLDER / "calibration.json")["spring_stiffness"]
    grid = kept(read_table(FOLDER / "grid.parquet", FIELDS, grid_checksum(crane, stiffness)))
    selection = kept(
        read_table(FOLDER / "selection.parquet", FIELDS, selection_checksum(crane, stiffness))
    )
    outputs, values = KINDS[network.kind]
    settings = from_environment(ParallelSettings(**parameters.parallel.model_dump()))
    best, record, records = train_best(
        grid[list(INPUTS)].to_numpy(),
        values(grid),
        selection[list(INPUTS)].to_numpy(),
        values(selection),
        Architecture(network.n_hidden, network.activation),
        LevenbergMarquardt(**network.trainer.model_dump()),
        network.seed,
        network.n_restarts,
        INPUT_QUANTITIES,
        outputs,
        functools.partial(parallel_map, settings=settings, description=f"train {name}"),
    )
    folder = FOLDER / "networks"
    save_network(folder / f"{name}.json", best, record, network_checksum(crane, stiffness, name))
    write_text(folder / f"{name}_training.csv", summary(records).to_csv(index=False))
    print(f"{name}: restart {record.restart}, selection error {record.selection_error:.3g}")


def summary(records: list[TrainingRecord]) -> pd.DataFrame:
    """One row a restart: errors are root mean squares of normalised outputs."""
    return pd.DataFrame(
        {
            "restart": record.restart,
            "n_iterations": len(record.errors) - 1,
            "training_error": np.sqrt(record.errors[-1]) if record.errors else np.nan,
            "selection_error": record.selection_error,
            "stop_reason": record.stop_reason,
        }
        for record in records
    )


if __name__ == "__main__":
    stage.run(main)
