"""Train one network of the arm from several starts and keep the one of least selection error.

Usage: elastic_arm_train.py NETWORK, a name under elastic_arm.networks or
elastic_arm.selected_networks.
Reads params.yaml: the section of NETWORK, its trainers under elastic_arm.trainers (and
elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges, elastic_arm.readings to know which
data belong to it); the tables of elastic_arm_generate; for a selected network the choice of
elastic_arm_select.
Writes data/elastic_arm/networks/NETWORK.json and the training records NETWORK_training.csv.
"""

from pathlib import Path

from flexik import parameters, stage
from flexik.datasets.elastic_arm.learning import KINDS, read_learning_data
from flexik.datasets.elastic_arm.provenance import network_checksum
from flexik.errors import DataError, ParameterError, TrainingError
from flexik.files import write_text
from flexik.learning.perceptron import quantities
from flexik.learning.records import restarts_csv
from flexik.learning.size_selection import read_layers
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, train_best, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    arm, name = load_parameters().elastic_arm, stage.argument("NETWORK")
    if name not in arm.all_networks:
        known = ", ".join(arm.all_networks)
        raise ParameterError(f"elastic_arm: there is no network {name!r} ({known})")
    network = arm.all_networks[name]
    kind, data = KINDS[network.kind], read_learning_data(DATA, arm, name)
    trainer = arm.trainers[network.trainer].model_dump()
    try:
        best, record, records = train_best(
            data.inputs,
            data.outputs,
            data.selection_inputs,
            data.selection_outputs,
            Architecture(size_of(network, name), network.activation),
            trainer_settings(trainer.pop("kind"), trainer),
            network.seed,
            network.n_restarts,
            quantities(kind.inputs),
            quantities(kind.outputs),
        )
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    folder = DATA / "networks"
    write_text(folder / f"{name}_training.csv", restarts_csv(records, best.n_hidden))
    save_network(folder / f"{name}.json", best, record, network_checksum(arm, name))
    print(f"{name}: restart {record.restart}, selection error {record.selection_error:.3g}")


def size_of(
    network: parameters.ArmNetwork | parameters.SelectedArmNetwork, name: str
) -> tuple[int, ...]:
    """Neurons of every hidden layer, given or chosen."""
    if isinstance(network, parameters.ArmNetwork):
        return tuple(network.n_hidden)
    path = DATA / "size_selection" / f"{name}.json"
    chosen = read_layers(path)
    if len(chosen) != len(network.select.n_hidden):
        raise DataError(f"{path}: {len(chosen)} layers, expected {len(network.select.n_hidden)}")
    return chosen


if __name__ == "__main__":
    stage.run(main)
