"""Networks of the SmartEE's elbows, each from several starts; the selection poses choose."""

from pathlib import Path

from flexik.cases.smartee.parts.poses import ACTUATED_FIELDS, ELBOW_FIELDS, values
from flexik.cases.smartee.section import SELECTION, Section
from flexik.datasets.parts import Part, Work
from flexik.datasets.tables import read_table
from flexik.learning.fit import fit
from flexik.learning.perceptron import Array, quantities
from flexik.learning.training import Architecture, Judge, Lesson
from flexik.parameters.networks import Network
from flexik.parameters.trainers import Stopping


def parts(section: Section) -> list[Part]:
    """A part a network."""
    samples = section.data / "samples"
    return [
        Part(
            name,
            prepare,
            {"network": network, "trainer": section.trainers[network.trainer]},
            {
                "rows": samples / f"{network.learns}.parquet",
                "selection": samples / f"{SELECTION}.parquet",
            },
        )
        for name, network in section.networks.items()
    ]


def prepare(*, network: Network, trainer: Stopping, rows: Path, selection: Path) -> Work:
    """Train from every start."""
    (n_hidden,) = network.sizes  # the section refuses several
    architecture = Architecture(n_hidden, network.activation)
    return fit(lesson(architecture, trainer, network.seed, rows, selection), network.n_restarts)


def lesson(
    architecture: Architecture,
    trainer: Stopping,
    seed: int,
    rows: Path,
    selection: Path | None = None,
    judge: Judge | None = None,
) -> Lesson:
    """Elbows by actuated joints, learnt from `rows`."""
    return Lesson(
        *queries_and_answers(rows),
        quantities(ACTUATED_FIELDS),
        quantities(ELBOW_FIELDS),
        architecture,
        trainer,
        seed,
        None if selection is None else queries_and_answers(selection),
        judge,
    )


def queries_and_answers(rows: Path) -> tuple[Array, Array]:
    """Actuated joints (n, 6) and elbows (n, 3) of the poses of a file."""
    poses = read_table(rows)
    return values(poses, ACTUATED_FIELDS), values(poses, ELBOW_FIELDS)
