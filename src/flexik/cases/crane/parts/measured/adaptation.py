"""Correct the compensator by a few measurements, on many cranes as built, and judge it."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexik.cases.crane.measured_section import Adaptation, Campaign
from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.parts.measured.adapted import Adapted, Measurements, identify, misjudged
from flexik.cases.crane.parts.measured.fields import ADAPTATION, ADAPTED, MISJUDGED
from flexik.cases.crane.parts.measured.nominal import compensating, read_network
from flexik.cases.crane.parts.measured.twins import Generator, measured_tips, twin_and_generator
from flexik.datasets.parts import Columns, Work, rows, stacked
from flexik.errors import ParameterError
from flexik.evaluation.targets import draw_candidates
from flexik.kinematics.crane import CraneGeometry, smallest_extension
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import REACHED
from flexik.machines.planar import PlanarMachine
from flexik.positioning import combined
from flexik.positioning.method import Array, Method, Network, PositioningError

KEY = "studies.measured.adaptation"
# candidates drawn for each target that is wanted
CANDIDATES = 4
# inside the reach, m: a crane as built reaches a little less in places
MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class Study:
    """What all cranes share.

    network : predicts the nominal deflection; of the method that is adapted.
    baselines : methods of the nominal crane; the first is what is adapted.
    """

    crane: FlexibleCrane
    network: Network
    baselines: Mapping[str, Method]
    campaign: Campaign
    adaptation: Adaptation


def prepare(
    *,
    machine: PlanarMachine,
    campaign: Campaign,
    adaptation: Adaptation,
    methods: Mapping[str, combined.Settings],
    networks: Mapping[str, Path],
    constants: Path,
    sections: object,
) -> Work:
    """A table of ADAPTATION; an item is a crane.

    methods, networks : by name, of the method that is adapted and of that of the campaign.
    """
    crane = flexible(machine, constants)
    read = {name: read_network(path) for name, path in networks.items()}
    baselines = {name: compensating(crane, methods[name], read[name]) for name in methods}
    study = Study(crane, read[adaptation.method], baselines, campaign, adaptation)
    items = range(adaptation.n_cranes)
    return Work(functools.partial(errors_of, study), items, rows(*ADAPTATION))


def errors_of(study: Study, number: int) -> Columns:
    """Errors on crane `number`, of the methods of the nominal crane and adapted."""
    settings, crane = study.adaptation, study.crane
    twin, generator = twin_and_generator(crane, study.campaign.deviations, settings.seed + number)
    most = settings.n_measurements[-1]
    query = drawn(crane.geometry, settings, most + settings.n_targets, generator)
    learn, judge = query[:most], query[most:]
    first = next(iter(study.baselines.values()))
    strokes = commanded(crane, first, learn)
    tips = measured_tips(twin, {"": strokes}, learn[:, 2], study.campaign.noise, generator)
    learnt = Measurements(strokes, learn[:, 2], tips[""])
    methods = {(name, 0): method for name, method in study.baselines.items()}
    methods |= adapted_methods(study, learnt)
    commands = {kind: commanded(crane, method, judge) for kind, method in methods.items()}
    reached = measured_tips(twin, commands, judge[:, 2], None, generator)
    tables = [
        {
            "twin": np.full(len(judge), number),
            "method": np.full(len(judge), name),
            "n_measurements": np.full(len(judge), n),
            **dict(zip(("target_x", "target_y", "payload"), judge.T, strict=True)),
            "error": np.linalg.norm(reached[name, n] - judge[:, :2], axis=1),
        }
        for name, n in methods
    ]
    return stacked(tables, ADAPTATION)


def adapted_methods(study: Study, learnt: Measurements) -> dict[tuple[str, int], Method]:
    """Methods adapted to the first of the measurements `learnt`, by name and number of those."""
    settings = study.adaptation
    found: dict[tuple[str, int], Method] = {}
    wrong = misjudged(settings.expected, settings.misjudged.share)
    for name, expected, numbers in (
        (ADAPTED, settings.expected, settings.n_measurements),
        (MISJUDGED, wrong, settings.misjudged.n_measurements),
    ):
        for n in numbers:
            offsets = identify(study.crane, study.network, learnt[:n], expected)
            found[name, n] = Adapted(study.crane, study.network, offsets, settings.n_corrections)
    return found


def drawn(geometry: CraneGeometry, area: Adaptation, n: int, generator: Generator) -> Array:
    """Query (n, 3) of random targets that the rigid crane reaches with MARGIN to spare."""
    lower, upper = zip(area.x, area.y, strict=True)
    targets, payload = draw_candidates(CANDIDATES * n, lower, upper, area.payload, generator)
    about = [targets + MARGIN * np.array(way) for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    reached = [np.isfinite(smallest_extension(geometry, near)) for near in about]
    kept = np.flatnonzero(np.all(reached, axis=0))[:n]
    if len(kept) < n:
        raise ParameterError(
            f"{KEY}: the crane reaches {len(kept)} of {len(targets)} random targets in x, y, "
            f"expected {n}"
        )
    return np.column_stack([targets[kept], payload[kept]])


def commanded(crane: FlexibleCrane, method: Method, query: Array) -> Array:
    """Strokes (n, 3) in m; raises PositioningError where `method` finds none."""
    current = CraneManipulator(crane.geometry).initial_positions(query[:, :2])
    answer = method(query, current)
    failed = np.flatnonzero(answer.status != REACHED)
    if failed.size:
        x, y, _ = query[failed[0]]
        raise PositioningError(
            f"{KEY}: {failed.size} targets are not reached, the first is ({x:.3f}, {y:.3f}) m; "
            "x, y need more distance from the border of the reach"
        )
    return answer.values
