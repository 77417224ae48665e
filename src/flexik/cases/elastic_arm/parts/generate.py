"""Readings of the experiment on the flexible arm, random targets, and what gauges show there."""

from typing import Any

import numpy as np

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.arm import (
    Equilibria,
    FlexibleArm,
    equilibria,
    flexible_arm,
    solve,
)
from flexik.cases.elastic_arm.parts.readings import (
    ANGLES,
    FIELDS,
    QUERY,
    columns_of,
    degree_axis,
    divide,
    poses,
)
from flexik.cases.elastic_arm.section import Machine, Samples, Section
from flexik.datasets.parts import Part, Work, Writer, json_file, table, whole
from flexik.datasets.tables import Field
from flexik.errors import ParameterError
from flexik.evaluation.targets import Targets, draw_candidates, reachable_targets
from flexik.kinematics.elastic_arm import flexible_forward
from flexik.parameters.conditions import RandomTargets

TARGET_FIELDS = (
    *QUERY,
    *(Field(name, "rad", "puts the loaded tip on the target") for name in ANGLES),
)
# candidates drawn for each target that is wanted, at most
MAXIMUM_CANDIDATES = 20


def parts(section: Section) -> list[Part]:
    """Tables `readings` and, by name of the conditions, of targets; `.NOISE.parquet` of gauges."""
    settings = {"machine": section.machine, "samples": section.samples}
    found = [Part("readings", prepare_readings, settings)]
    for name, workspace in section.conditions.items():
        own = {"key": f"{section.name}.conditions.{name}", "workspace": workspace}
        found.append(Part(name, prepare_targets, settings | own))
    return found


def prepare_readings(**settings: Any) -> Work:
    """All readings, divided into training, selection and held-out ones."""
    return whole(_readings, **settings)


def prepare_targets(**settings: Any) -> Work:
    """Random targets and payloads that the loaded arm can be put on, and how many were drawn."""
    return whole(_targets, **settings)


def _readings(machine: Machine, samples: Samples) -> dict[str, Writer]:
    arm = flexible_arm(machine)
    angles, payload = poses(samples)
    found = equilibria(arm, angles, payload)
    part = divide(len(payload), samples.selection_share, samples.held_out_share, samples.seed)
    columns = columns_of([angles, payload, part, arm.geometry.forward(angles), *found], FIELDS)
    n_of_part = {str(name): int(np.sum(part == name)) for name in np.unique(part)}
    print(f"{len(payload)} readings: {n_of_part}")
    shown = _shown(machine, angles, found, samples.noise_seed, gauges.STREAM_OF_READINGS)
    return {".parquet": table(columns, FIELDS), **shown}


def _shown(
    machine: Machine, angles: np.ndarray, found: Equilibria, seed: int, stream: int
) -> dict[str, Writer]:
    """What gauges show in the poses at `angles`, with and without noise."""
    writers = {}
    for shown in gauges.SHOWN:
        generator = gauges.noise_generator(shown, seed, stream)
        exact = shown == gauges.NOISY_VOLTAGES
        read = gauges.read(machine, *found[1:], generator, exact_strains=exact)
        tip = flexible_forward(flexible_arm(machine).geometry, angles, read.deformation)
        columns = columns_of([*read, tip], gauges.FIELDS)
        writers[f".{shown}.parquet"] = table(columns, gauges.FIELDS)
    return writers


def _targets(
    machine: Machine, samples: Samples, key: str, workspace: RandomTargets
) -> dict[str, Writer]:
    arm, generator = flexible_arm(machine), np.random.default_rng(workspace.seed)
    wanted, n_drawn, n_found = workspace.n_targets, 0, 0
    found: list[Targets] = []
    while n_found < wanted:
        if n_drawn >= MAXIMUM_CANDIDATES * wanted:
            raise ParameterError(
                f"{key}: of {n_drawn} targets drawn in x, y only {n_found} "
                f"are reached, expected {wanted}"
            )
        n_drawn += wanted
        found.append(_reached(arm, samples, workspace, generator))
        n_found += len(found[-1])
    columns = [
        np.concatenate([getattr(part, column) for part in found])[:wanted]
        for column in ("targets", "payload", "values")
    ]
    print(f"{n_found} of {n_drawn} random targets are reached, {wanted} kept")
    _, payload, angles = columns
    solved, seed = equilibria(arm, angles, payload), samples.noise_seed
    return {
        ".parquet": table(columns_of(columns, TARGET_FIELDS), TARGET_FIELDS),
        ".json": json_file({"drawn": n_drawn, "reached": n_found, "kept": wanted}),
        **_shown(machine, angles, solved, seed, gauges.STREAM_OF_TARGETS),
    }


def _reached(
    arm: FlexibleArm, samples: Samples, workspace: RandomTargets, generator: np.random.Generator
) -> Targets:
    """Those of as many candidates as are wanted that are reached within the readings' range."""
    lower, upper = zip(workspace.x, workspace.y, strict=True)
    drawn = draw_candidates(workspace.n_targets, lower, upper, workspace.payload, generator)
    found = reachable_targets(
        *drawn,
        arm.geometry,
        lambda angles, payload: solve(arm, angles, payload)[0].tip,
        workspace.tolerance,
        workspace.n_iterations,
    )
    axes = (degree_axis(samples.theta_1_degrees), degree_axis(samples.theta_2_degrees))
    least, most = zip(*((axis[0], axis[-1]) for axis in axes), strict=True)
    inside = ((found.values >= least) & (found.values <= most)).all(axis=1)
    return Targets(found.targets[inside], found.payload[inside], found.values[inside])
