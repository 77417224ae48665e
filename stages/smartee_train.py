"""Train one network of the SmartEE's elbows from several starts; selection poses choose.

Usage: smartee_train.py NETWORK, a name under smartee.networks.
Reads params.yaml: parallel, the network under smartee.networks, its trainer under smartee.trainers
(and smartee.geometry, smartee.workspace, smartee.poses to know which data belong to it); its poses
and the selection poses, both of smartee_generate.
Writes data/smartee/networks/NETWORK.json and the training records NETWORK_training.csv.
"""

import functools
from pathlib import Path

from flexik import stage
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.smartee.poses import ACTUATED_FIELDS, ELBOW_FIELDS, read_poses, values
from flexik.datasets.smartee.provenance import network_checksum
from flexik.errors import ParameterError, TrainingError
from flexik.files import write_text
from flexik.learning.perceptron import quantities
from flexik.learning.records import restarts_csv
from flexik.learning.storage import save_network
from flexik.learning.training import Architecture, train_best, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/smartee")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    smartee, name = given.smartee, stage.argument("NETWORK")
    if name not in smartee.networks:
        known = ", ".join(smartee.networks)
        raise ParameterError(f"smartee.networks: there is no network {name!r} ({known})")
    network = smartee.networks[name]
    train_on = read_poses(DATA / "poses", smartee, network.poses)
    select_by = read_poses(DATA / "poses", smartee, "selection")
    trainer = smartee.trainers[network.trainer].model_dump()
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    try:
        best, record, records = train_best(
            values(train_on, ACTUATED_FIELDS),
            values(train_on, ELBOW_FIELDS),
            values(select_by, ACTUATED_FIELDS),
            values(select_by, ELBOW_FIELDS),
            Architecture(network.n_hidden, network.activation),
            trainer_settings(trainer.pop("kind"), trainer),
            network.seed,
            network.n_restarts,
            quantities(ACTUATED_FIELDS),
            quantities(ELBOW_FIELDS),
            functools.partial(parallel_map, settings=settings, description=f"train {name}"),
        )
    except TrainingError as error:
        raise TrainingError(f"network {name}: {error}") from None
    folder = DATA / "networks"
    write_text(folder / f"{name}_training.csv", restarts_csv(records, best.n_hidden))
    save_network(folder / f"{name}.json", best, record, network_checksum(smartee, name))
    print(f"{name}: restart {record.restart}, selection error {record.selection_error:.3g}")


if __name__ == "__main__":
    stage.run(main)
