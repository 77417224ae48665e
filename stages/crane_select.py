"""Train one network in many sizes, from several starts each, and choose its size.

Usage: crane_select.py NETWORK, a name under crane.selected_networks or
crane.selected_modular_networks.
Reads params.yaml: parallel, the section of NETWORK, its trainers under crane.trainers (and
crane.geometry, crane.structure, crane.grid, crane.selection to know which data belong to it); the
tables of crane_generate; for a modular network the rigid network it corrects.
Writes data/crane/size_selection/NETWORK.parquet, one row a run, and NETWORK.json with the chosen
n_hidden. Killed and run again it goes on where it was.
"""

from pathlib import Path

from flexik import datasets, learning, parameters, stage
from flexik.datasets.crane.grid import axis
from flexik.datasets.crane.learning import KINDS, read_learning_data
from flexik.datasets.crane.provenance import network_checksum
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.files import checksum, source_checksum, write_json
from flexik.learning.perceptron import quantities
from flexik.learning.size_selection import FIELDS, Study, by_size, choose, run_study
from flexik.learning.storage import load_network
from flexik.learning.training import Architecture, trainer_settings
from flexik.multibody.crane.assembly import read_spring_stiffness
from flexik.parameters import load_parameters

DATA = Path("data/crane")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane, name = given.crane, stage.argument("NETWORK")
    if name not in crane.studies:
        known = ", ".join(crane.studies)
        raise ParameterError(f"crane: there is no network of selected size {name!r} ({known})")
    chosen = crane.studies[name]
    select = chosen.select
    sizes = [round(size) for size in axis(**select.n_hidden.model_dump())]
    stiffness = read_spring_stiffness(DATA / "calibration.json")
    rigid = None
    if isinstance(chosen, parameters.SelectedModularNetwork):
        path = DATA / "networks" / f"{chosen.rigid}.json"
        rigid, _ = load_network(path, network_checksum(crane, stiffness, chosen.rigid))
    data = read_learning_data(DATA, crane, stiffness, chosen.kind, rigid)
    trainer = crane.trainers[select.trainer].model_dump()
    study = Study(
        data.inputs,
        data.outputs,
        data.selection_inputs,
        data.selection_outputs,
        Architecture(sizes[0], chosen.activation),
        trainer_settings(trainer.pop("kind"), trainer),
        chosen.seed,
        quantities(KINDS[chosen.kind].inputs),
        quantities(KINDS[chosen.kind].outputs),
        data.judge,
    )
    made_with = network_checksum(crane, stiffness, name)
    folder = DATA / "size_selection"
    path = folder / f"{name}.parquet"
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
    table = by_size(read_table(path, FIELDS, made_with))
    n_hidden = choose(table, select.tolerance)
    print(f"{name}: {n_hidden} hidden neurons, {table['n_failed'].sum()} failed runs")
    write_json(folder / f"{name}.json", {"n_hidden": n_hidden})


if __name__ == "__main__":
    stage.run(main)
