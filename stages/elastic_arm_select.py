"""Train one network with many combinations of hidden layers and choose among them.

Usage: elastic_arm_select.py NETWORK, a name under elastic_arm.selected_networks.
Reads params.yaml: parallel, elastic_arm.selected_networks.NETWORK, its trainers under
elastic_arm.trainers (and elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges,
elastic_arm.readings to know which data belong to it); the tables of elastic_arm_generate.
Writes data/elastic_arm/size_selection/NETWORK.parquet, one row a run, and NETWORK.json with the
chosen n_hidden. Killed and run again it goes on where it was.
"""

import itertools
from pathlib import Path

from flexik import datasets, learning, stage
from flexik.datasets.elastic_arm.learning import KINDS, read_learning_data
from flexik.datasets.elastic_arm.provenance import network_checksum
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.files import checksum, source_checksum, write_json
from flexik.learning.perceptron import quantities
from flexik.learning.size_selection import Study, by_size, choose_layers, run_study, study_fields
from flexik.learning.training import Architecture, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/elastic_arm")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    arm, name = given.elastic_arm, stage.argument("NETWORK")
    if name not in arm.selected_networks:
        known = ", ".join(arm.selected_networks)
        raise ParameterError(
            f"elastic_arm: there is no network of selected size {name!r} ({known})"
        )
    network = arm.selected_networks[name]
    select, kind = network.select, KINDS[network.kind]
    sizes = list(itertools.product(*(axis.values() for axis in select.n_hidden)))
    data = read_learning_data(DATA, arm, name)
    trainer = arm.trainers[select.trainer].model_dump()
    study = Study(
        data.inputs,
        data.outputs,
        data.selection_inputs,
        data.selection_outputs,
        Architecture(sizes[0], network.activation),
        trainer_settings(trainer.pop("kind"), trainer),
        network.seed,
        quantities(kind.inputs),
        quantities(kind.outputs),
    )
    made_with = network_checksum(arm, name)
    path = DATA / "size_selection" / f"{name}.parquet"
    reused = run_study(
        path,
        study,
        sizes,
        select.n_restarts,
        made_with,
        checksum(made_with, source_checksum(datasets, learning)),
        from_environment(ParallelSettings(**given.parallel.model_dump())),
        f"select {name}",
    )
    if reused:
        print(f"{name}: {reused} runs were there from an interrupted study")
    table = by_size(read_table(path, study_fields(len(sizes[0])), made_with))
    n_hidden = choose_layers(table, select.tolerance)
    print(f"{name}: {'-'.join(map(str, n_hidden))} hidden neurons")
    write_json(path.with_suffix(".json"), {"n_hidden": n_hidden})


if __name__ == "__main__":
    stage.run(main)
