"""Train one network of the crane from several starts; the selection set chooses among them.

Usage: crane_train.py NETWORK, a name under crane.networks or crane.selected_networks.
Reads params.yaml: parallel, crane.networks.NETWORK or crane.selected_networks.NETWORK (and
crane.geometry, crane.structure, crane.grid, crane.selection to know which data belong to it); the
tables of crane_generate; for a selected network the choice of crane_select.
Writes data/crane/networks/NETWORK.json and the training records NETWORK_training.csv.
"""

import functools
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane_learning import INPUT_FIELDS, KINDS, read_learning_data
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.provenance import network_checksum
from flexik.errors import ParameterError, TrainingError
from flexik.files import write_text
from flexik.learning.perceptron import quantities
from flexik.learning.size_selection import read_choice
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, TrainingRecord, train_best, trainer_settings
from flexik.multibody.assembly import read_spring_stiffness
from flexik.parameters import load_parameters

DATA = Path("data/crane")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane, name = given.crane, stage.argument("NETWORK")
    network = crane.any_network(name)
    if network is None:
        known = ", ".join([*crane.networks, *crane.selected_networks])
        raise ParameterError(f"crane.networks: there is no {name!r} ({known})")
    stiffness = read_spring_stiffness(DATA / "calibration.json")
    data = read_learning_data(DATA, crane, stiffness, network.kind)
    trainer = network.trainer.model_dump()
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    try:
        architecture = Architecture(size_of(network, name), network.activation)
        best, record, records = train_best(
            data.inputs,
            data.outputs,
            data.selection_inputs,
            data.selection_outputs,
            architecture,
            trainer_settings(trainer.pop("kind"), trainer),
            network.seed,
            network.n_restarts,
            quantities(INPUT_FIELDS),
            quantities(KINDS[network.kind].outputs),
            functools.partial(parallel_map, settings=settings, description=f"train {name}"),
        )
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    folder = DATA / "networks"
    save_network(folder / f"{name}.json", best, record, network_checksum(crane, stiffness, name))
    write_text(folder / f"{name}_training.csv", summary(records, best.n_hidden))
    print(f"{name}: restart {record.restart}, selection error {record.selection_error:.3g}")


def size_of(network: parameters.NetworkModel | parameters.SelectedNetwork, name: str) -> int:
    """Number of hidden neurons, given or chosen."""
    if isinstance(network, parameters.NetworkModel):
        return network.n_hidden
    return read_choice(DATA / "size_selection" / f"{name}.json")


def summary(records: list[TrainingRecord], n_hidden: int | tuple[int, ...]) -> str:
    """CSV, a row a restart; errors are root mean squares of normalised outputs."""
    rows = [
        {
            "restart": record.restart,
            "n_hidden": n_hidden,
            "trainer": record.trainer,
            "n_iterations": len(record.errors) - 1,
            "training_error": np.sqrt(record.errors[record.kept]) if record.errors else np.nan,
            "selection_error": record.selection_error,
            "stop_reason": record.stop_reason,
        }
        for record in records
    ]
    return pd.DataFrame(rows).to_csv(index=False)


if __name__ == "__main__":
    stage.run(main)
