"""Networks of the SmartEE's elbows of many sizes: error against the number of hidden neurons.

Reads params.yaml: parallel, smartee.sizes and its trainer under smartee.trainers (and
smartee.geometry, smartee.workspace, smartee.poses to know which data belong to it); the two sets of
poses to train on and the selection poses, all of smartee_generate.
Writes data/smartee/sizes.parquet and data/smartee/sizes_beside.parquet, a row for every run.
"""

from pathlib import Path

from flexik import parameters, stage
from flexik.datasets.parallel import ParallelSettings, from_environment
from flexik.datasets.smartee.poses import ACTUATED_FIELDS, ELBOW_FIELDS, read_poses, values
from flexik.datasets.smartee.provenance import sizes_checksum
from flexik.learning.perceptron import quantities
from flexik.learning.size_selection import Study, run_study
from flexik.learning.training import Architecture, trainer_settings
from flexik.parameters import load_parameters

DATA = Path("data/smartee")


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    sizes = given.smartee.sizes
    for file, poses in (("sizes", sizes.poses), ("sizes_beside", sizes.beside)):
        study(given.smartee, poses, DATA / f"{file}.parquet", settings)


def study(smartee: parameters.SmartEE, poses: str, path: Path, settings: ParallelSettings) -> None:
    """Train on the rows of `poses` and write `path`."""
    sizes = smartee.sizes
    train_on = read_poses(DATA / "poses", smartee, poses)
    select_by = read_poses(DATA / "poses", smartee, "selection")
    trainer = smartee.trainers[sizes.trainer].model_dump()
    numbers = range(
        sizes.n_hidden.minimum, sizes.n_hidden.maximum + 1, int(sizes.n_hidden.increment)
    )
    whole = Study(
        values(train_on, ACTUATED_FIELDS),
        values(train_on, ELBOW_FIELDS),
        values(select_by, ACTUATED_FIELDS),
        values(select_by, ELBOW_FIELDS),
        Architecture(numbers[0], "tanh"),
        trainer_settings(trainer.pop("kind"), trainer),
        sizes.seed,
        quantities(ACTUATED_FIELDS),
        quantities(ELBOW_FIELDS),
    )
    n_found = run_study(
        path,
        whole,
        numbers,
        sizes.n_restarts,
        sizes_checksum(smartee, poses),
        "smartee.sizes",
        settings,
        f"sizes, {poses}",
    )
    if n_found:
        print(f"{n_found} runs were there already")


if __name__ == "__main__":
    stage.run(main)
