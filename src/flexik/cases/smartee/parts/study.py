"""Studies of the SmartEE: initial weights, sizes of the network, dimensions not published."""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.smartee.parts.poses import (
    POSE_FIELDS,
    SAMPLES,
    geometry_of,
    values,
)
from flexik.cases.smartee.parts.train import lesson, queries_and_answers
from flexik.cases.smartee.section import (
    RANDOM,
    SELECTION,
    VALIDATION,
    Geometry,
    Machine,
    Section,
    Sensitivity,
    SizeStudy,
)
from flexik.datasets.parts import Part, Work, Writer, json_file, table, whole
from flexik.datasets.tables import Field, read_table
from flexik.kinematics.smartee import (
    SmartEEGeometry,
    closure_jacobian,
    elbow_circles,
    inverse,
    leg_tip_velocities,
    leg_tips,
    rotation_zyz,
)
from flexik.kinematics.status import REACHED
from flexik.learning.perceptron import Network, Normalisation
from flexik.learning.size_selection import select
from flexik.learning.starts import from_starts
from flexik.learning.training import Architecture
from flexik.parameters.trainers import Stopping

Array = NDArray[np.float64]

GEOMETRY_FIELDS = (
    Field("name", "1", "of the dimensions", "string"),
    Field("base_radius", "m", "circle of the leg bases"),
    Field("plate_radius", "m", "circle of the ball joints"),
    Field("height", "m", "of the centre of the box"),
    Field("reached_share", "1", "share of the random poses that the legs reach"),
    Field("median_condition", "1", "of the closure equations' Jacobian by the elbows, there"),
    Field("largest_condition", "1", "of the closure equations' Jacobian by the elbows, there"),
)
ASSUMED = "assumed here"


def parts(section: Section) -> list[Part]:
    """Parts starts, sensitivity, linear, sizes_POSES and geometries."""
    starts, sensitivity, sizes = (
        getattr(section.studies, name) for name in ("starts", "sensitivity", "sizes")
    )
    rows = {name: SAMPLES / f"{name}.parquet" for name in section.samples.poses}
    judged = {name: SAMPLES / f"{name}.parquet" for name in (VALIDATION, RANDOM)}
    inputs = {"rows": rows[starts.poses], "judged": judged[VALIDATION]}
    shared = {"n_hidden": starts.n_hidden, "seed": starts.seed, "success": starts.success}
    every = {
        "trainers": {name: section.trainers[name] for name in starts.trainers},
        "spreads": starts.spreads,
        "n_starts": starts.n_starts,
    }
    few = {
        "trainers": other_constants(sensitivity, section.trainers[sensitivity.trainer]),
        "spreads": {sensitivity.spread: starts.spreads[sensitivity.spread]},
        "n_starts": sensitivity.n_starts,
    }
    of_sizes = {"study": sizes, "trainer": section.trainers[sizes.trainer]}
    lengths = {"machine": section.machine, "height": section.samples.box.centre[2]}
    return [
        Part("starts", prepare_starts, shared | every, inputs),
        Part("sensitivity", prepare_starts, shared | few, inputs),
        Part("linear", prepare_linear, {}, {"rows": rows[starts.poses]}),
        *(
            Part(
                f"sizes_{poses}",
                prepare_sizes,
                of_sizes,
                {"rows": rows[poses], "selection": rows[SELECTION]},
            )
            for poses in sizes.poses
        ),
        Part(
            "geometries",
            prepare_geometries,
            lengths | {"others": section.studies.geometries},
            {"random": judged[RANDOM]},
        ),
    ]


def other_constants(study: Sensitivity, trainer: Stopping) -> dict[str, Stopping]:
    """Settings with every pair of penalty and decrease, by the pair."""
    return {
        f"{penalty:g}, {decrease:g}": trainer.but(penalty=penalty, penalty_decrease=decrease)
        for penalty in study.penalties
        for decrease in study.penalty_decreases
    }


def prepare_starts(
    *,
    n_hidden: int,
    seed: int,
    success: float,
    trainers: Mapping[str, Stopping],
    spreads: Mapping[str, float],
    n_starts: int,
    rows: Path,
    judged: Path,
) -> Work:
    """Train with every trainer from every start of every spread."""
    inputs, outputs = queries_and_answers(judged)
    judge = functools.partial(peak, inputs=inputs, outputs=outputs)
    any_trainer = next(iter(trainers.values()))
    task = lesson(Architecture(n_hidden), any_trainer, seed, rows, judge=judge)
    return from_starts(task, trainers, spreads, n_starts, success)


def peak(network: Network, inputs: Array, outputs: Array) -> float:
    """Largest norm (rad) of the elbow errors."""
    return float(np.linalg.norm(network.predict(inputs) - outputs, axis=1).max())


def prepare_linear(*, rows: Path) -> Work:
    """What a network comes to whose hidden units all stay in their linear part."""
    return whole(linear, rows=rows)


def linear(rows: Path) -> dict[str, Writer]:
    """The error of the best linear map of the poses in `rows`."""
    return {".json": json_file({"mean_squared_error": linear_error(*queries_and_answers(rows))})}


def linear_error(inputs: Array, outputs: Array) -> float:
    """Mean squared error of the normalised `outputs` (n, q) by the best linear map of `inputs`."""
    normalised = Normalisation.from_data(outputs).to_unit(outputs)
    matrix = np.column_stack(
        [Normalisation.from_data(inputs).to_unit(inputs), np.ones(len(inputs))]
    )
    weights = np.linalg.lstsq(matrix, normalised, rcond=None)[0]
    return float(np.mean((matrix @ weights - normalised) ** 2))


def prepare_sizes(*, study: SizeStudy, trainer: Stopping, rows: Path, selection: Path) -> Work:
    """Train networks of all sizes, from several starts each."""
    sizes = [(n_hidden,) for n_hidden in study.n_hidden.values()]
    task = lesson(Architecture(sizes[0]), trainer, study.seed, rows, selection)
    return select(task, sizes, study.n_restarts, tolerance=None)


def prepare_geometries(
    *, machine: Machine, height: float, others: Mapping[str, Geometry], random: Path
) -> Work:
    """How the closure is conditioned with other dimensions, at the same poses about the height."""
    own = machine.model_dump(include={"base_radius", "plate_radius"}) | {"height": height}
    named = {ASSUMED: own} | {name: other.model_dump() for name, other in others.items()}
    return whole(compared, machine=machine, lengths=named, random=random)


def compared(
    machine: Machine, lengths: Mapping[str, Mapping[str, float]], random: Path
) -> dict[str, Writer]:
    """A row GEOMETRY_FIELDS for the assumed dimensions, and for each of the others."""
    poses, found = values(read_table(random), POSE_FIELDS), []
    for name, given in lengths.items():
        radii = {key: given[key] for key in ("base_radius", "plate_radius")}
        geometry = replace(geometry_of(machine), **radii)
        raised = poses[:, :3] + [0.0, 0.0, given["height"] - lengths[ASSUMED]["height"]]
        solved = inverse(geometry, raised, rotation_zyz(poses[:, 3:]))
        reached = solved.status == REACHED
        numbers = conditions(geometry, solved.joints[reached])
        spread = (np.median(numbers), numbers.max()) if len(numbers) else (np.nan, np.nan)
        found.append((name, *radii.values(), given["height"], reached.mean(), *spread))
    columns = zip(GEOMETRY_FIELDS, zip(*found, strict=True), strict=True)
    return {".parquet": table({f.name: np.array(v) for f, v in columns}, GEOMETRY_FIELDS)}


def conditions(geometry: SmartEEGeometry, joints: Array) -> Array:
    """Condition numbers (n,) of the closure equations' Jacobian by the elbows at `joints`."""
    circles = elbow_circles(geometry, joints[..., :2])
    tips = leg_tips(circles, joints[..., 2])
    return np.linalg.cond(closure_jacobian(tips, leg_tip_velocities(circles, joints[..., 2])))
