"""Studies of the SmartEE, each in a module of its own, so that none depends on another's code."""

from flexik.cases.smartee.parts.geometries import prepare_geometries
from flexik.cases.smartee.parts.sizes import prepare_sizes
from flexik.cases.smartee.parts.starts import prepare_linear, prepare_starts
from flexik.cases.smartee.section import RANDOM, SELECTION, VALIDATION, Section, Sensitivity
from flexik.datasets.parts import Part
from flexik.parameters.trainers import Stopping


def parts(section: Section) -> list[Part]:
    """Parts starts_TRAINER, sensitivity, linear, sizes_POSES and geometries."""
    studies, trainers = section.studies, section.trainers
    starts, sensitivity, sizes = studies.starts, studies.sensitivity, studies.sizes
    samples = section.data / "samples"
    rows = {name: samples / f"{name}.parquet" for name in section.samples.poses}
    random = samples / f"{RANDOM}.parquet"
    inputs = {"rows": rows[starts.poses], "judged": samples / f"{VALIDATION}.parquet"}
    shared = {"n_hidden": starts.n_hidden, "seed": starts.seed, "success": starts.success}
    every = shared | {"spreads": starts.spreads, "n_starts": starts.n_starts}
    few = shared | {
        "trainers": other_constants(sensitivity, trainers[sensitivity.trainer]),
        "spreads": {sensitivity.spread: starts.spreads[sensitivity.spread]},
        "n_starts": sensitivity.n_starts,
    }
    of_sizes = {"study": sizes, "trainer": trainers[sizes.trainer]}
    lengths = {"machine": section.machine, "height": section.samples.box.centre[2]}
    found = [
        Part("sensitivity", prepare_starts, few, inputs),
        Part("linear", prepare_linear, {}, {"rows": rows[starts.poses]}),
        Part(
            "geometries",
            prepare_geometries,
            lengths | {"others": studies.geometries},
            {"random": random},
        ),
    ]
    for name in starts.trainers:
        given = every | {"trainers": {name: trainers[name]}}
        found.append(Part(f"starts_{name}", prepare_starts, given, inputs))
    for poses in sizes.poses:
        files = {"rows": rows[poses], "selection": rows[SELECTION]}
        found.append(Part(f"sizes_{poses}", prepare_sizes, of_sizes, files))
    return found


def other_constants(study: Sensitivity, trainer: Stopping) -> dict[str, Stopping]:
    """Settings with every pair of penalty and decrease, by the pair."""
    return {
        f"{penalty:g}, {decrease:g}": trainer.but(penalty=penalty, penalty_decrease=decrease)
        for penalty in study.penalties
        for decrease in study.penalty_decreases
    }
