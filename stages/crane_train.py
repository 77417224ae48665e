"""Train one network of the crane from several starts; the selection set chooses among them.

Usage: crane_train.py NETWORK, a name under crane.networks, crane.modular_networks,
crane.selected_networks or crane.selected_modular_networks.
Reads params.yaml: parallel, the section of NETWORK, its trainer under crane.trainers (and
crane.geometry, crane.structure, crane.grid, crane.selection to know which data belong to it); the
tables of crane_generate; for a selected network the choice of crane_select; for a modular one the
rigid network it corrects, with which it is joined.
Writes data/crane/networks/NETWORK.json and the training records NETWORK_training.csv.
"""

import functools
from dataclasses import replace
from pathlib import Path

from flexik import parameters, stage
from flexik.datasets.crane.learning import KINDS, read_learning_data
from flexik.datasets.crane.provenance import network_checksum
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.errors import ParameterError, TrainingError
from flexik.files import write_text
from flexik.learning.modular import combine
from flexik.learning.perceptron import Network, quantities
from flexik.learning.records import restarts_csv
from flexik.learning.size_selection import read_choice
from flexik.learning.storage import load_network, save_network
from flexik.learning.training import Architecture, train_best, trainer_settings
from flexik.multibody.crane.assembly import read_spring_stiffness
from flexik.parameters import load_parameters

DATA = Path("data/crane")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane, name = given.crane, stage.argument("NETWORK")
    if name not in crane.all_networks:
        known = ", ".join(crane.all_networks)
        raise ParameterError(f"crane: there is no network {name!r} ({known})")
    network = crane.all_networks[name]
    stiffness = read_spring_stiffness(DATA / "calibration.json")
    rigid = rigid_network(crane, stiffness, network)
    data = read_learning_data(DATA, crane, stiffness, network.kind, rigid)
    trainer = crane.trainers[network.trainer].model_dump()
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    try:
        architecture = Architecture(size_of(crane, name), network.activation)
        best, record, records = train_best(
            data.inputs,
            data.outputs,
            data.selection_inputs,
            data.selection_outputs,
            architecture,
            trainer_settings(trainer.pop("kind"), trainer),
            network.seed,
            network.n_restarts,
            quantities(KINDS[network.kind].inputs),
            quantities(KINDS[network.kind].outputs),
            functools.partial(parallel_map, settings=settings, description=f"train {name}"),
            data.judge,
        )
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    folder = DATA / "networks"
    write_text(folder / f"{name}_training.csv", restarts_csv(records, best.n_hidden))
    if rigid is not None:
        best = combine(rigid, replace(best, outputs=rigid.outputs))
        best = replace(best, outputs=tuple(quantities(KINDS["direct"].outputs)))
    save_network(folder / f"{name}.json", best, record, network_checksum(crane, stiffness, name))
    print(f"{name}: restart {record.restart}, selection error {record.selection_error:.3g}")


def rigid_network(
    crane: parameters.Crane, stiffness: float, network: parameters.AnyNetwork
) -> Network | None:
    """The rigid network that a modular one corrects; None for the others."""
    if not isinstance(network, parameters.ModularNetwork | parameters.SelectedModularNetwork):
        return None
    path = DATA / "networks" / f"{network.rigid}.json"
    return load_network(path, network_checksum(crane, stiffness, network.rigid))[0]


def size_of(crane: parameters.Crane, name: str) -> int:
    """Number of hidden neurons, given or chosen."""
    network = crane.all_networks[name]
    if isinstance(network, parameters.NetworkModel | parameters.ModularNetwork):
        return network.n_hidden
    return read_choice(DATA / "size_selection" / f"{name}.json")


if __name__ == "__main__":
    stage.run(main)
