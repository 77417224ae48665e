"""Correct the compensator by a few measurements, on many machines as built, and judge it."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexik.datasets.parts import Columns, Work, rows, stacked
from flexik.errors import ParameterError
from flexik.evaluation.targets import draw_candidates
from flexik.kinematics.machine_file import manipulator_of
from flexik.kinematics.manipulator import Manipulator
from flexik.kinematics.status import REACHED
from flexik.machines.planar import PlanarMachine
from flexik.planar.machine import flexible
from flexik.planar.measured.adapted import Adapted, Measurements, Nominal, identify, misjudged
from flexik.planar.measured.fields import ADAPTATION, ADAPTED, MISJUDGED
from flexik.planar.measured.nominal import asked
from flexik.planar.measured.section import Adaptation, Campaign
from flexik.planar.measured.twins import Generator, measured_tips, twin_and_generator
from flexik.planar.methods import trained_methods
from flexik.positioning.combined import Combined
from flexik.positioning.method import Array, Method, PositioningError

KEY = "studies.measured.adaptation"
# candidates drawn for each target that is wanted
CANDIDATES = 4
# inside the reach, m: a machine as built reaches a little less in places
MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class Study:
    """What all machines share.

    nominal : with the network of the method that is adapted.
    baselines : methods of the nominal machine; the first is what is adapted.
    """

    nominal: Nominal
    baselines: Mapping[str, Combined]
    campaign: Campaign
    adaptation: Adaptation


def prepare(
    *,
    machine: PlanarMachine,
    campaign: Campaign,
    adaptation: Adaptation,
    methods: Mapping[str, Mapping[str, Any]],
    built_from: Mapping[str, Mapping[str, Any]],
    sections: object,
    constants: Path | None = None,
) -> Work:
    """A table of ADAPTATION; an item is a machine.

    methods, built_from : by name, of the method that is adapted, of that of the campaign, and of
        the others.
    """
    built, manipulator = flexible(machine, constants), manipulator_of(machine)
    baselines: dict[str, Any] = trained_methods(methods, built_from, manipulator, built.machine)
    nominal = Nominal(built, baselines[adaptation.method].network, adaptation.expected)
    study = Study(nominal, baselines, campaign, adaptation)
    items = range(adaptation.n_twins)
    return Work(functools.partial(errors_of, study), items, rows(*ADAPTATION))


def errors_of(study: Study, number: int) -> Columns:
    """Errors on machine `number`, of the methods of the nominal machine and adapted."""
    settings, nominal = study.adaptation, study.nominal
    drawn_from = nominal.flexible, study.campaign.deviations, settings.seed + number
    twin, generator = twin_and_generator(*drawn_from)
    machine, manipulator = nominal.machine, manipulator_of(nominal.machine)
    most = settings.n_measurements[-1]
    query = drawn(manipulator, settings, most + settings.n_targets, generator)
    learn, judge = query[:most], query[most:]
    first = next(iter(study.baselines.values()))
    strokes = commanded(machine, first, learn)
    tips = measured_tips(twin, {"": strokes}, learn[:, 2], study.campaign.noise, generator)
    learnt = Measurements(strokes, learn[:, 2], tips[""])
    methods: dict[tuple[str, int], Method] = {
        (name, 0): method for name, method in study.baselines.items()
    }
    methods |= adapted_methods(study, learnt)
    commands = {kind: commanded(machine, method, judge) for kind, method in methods.items()}
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
    kinds = [(ADAPTED, settings.expected, settings.n_measurements)]
    if (other := settings.misjudged) is not None:
        kinds.append((MISJUDGED, misjudged(settings.expected, other.share), other.n_measurements))
    for name, expected, numbers in kinds:
        for n in numbers:
            nominal = replace(study.nominal, expected=expected)
            offsets = identify(nominal, learnt[:n])
            found[name, n] = Adapted(nominal, offsets, settings.n_corrections)
    for name in settings.others:
        nominal = replace(study.nominal, network=study.baselines[name].network)
        offsets = identify(nominal, learnt)
        found[name, len(learnt.payload)] = Adapted(nominal, offsets, settings.n_corrections)
    return found


def drawn(manipulator: Manipulator, area: Adaptation, n: int, generator: Generator) -> Array:
    """Query (n, 3) of random targets that the rigid machine reaches with MARGIN to spare."""
    lower, upper = zip(area.x, area.y, strict=True)
    targets, payload = draw_candidates(CANDIDATES * n, lower, upper, area.payload, generator)
    about = [targets + MARGIN * np.array(way) for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    middle = np.tile((manipulator.lower + manipulator.upper) / 2, (len(targets), 1))
    reached = [manipulator.inverse(near, middle).reached for near in about]
    kept = np.flatnonzero(np.all(reached, axis=0))[:n]
    if len(kept) < n:
        raise ParameterError(
            f"{KEY}: the machine reaches {len(kept)} of {len(targets)} random targets in x, y, "
            f"expected {n}"
        )
    return np.column_stack([targets[kept], payload[kept]])


def commanded(machine: PlanarMachine, method: Method, query: Array) -> Array:
    """Coordinates (n, k); raises PositioningError where `method` finds none."""
    answer = asked(machine, method, query)
    failed = np.flatnonzero(answer.status != REACHED)
    if failed.size:
        x, y, _ = query[failed[0]]
        raise PositioningError(
            f"{KEY}: {failed.size} targets are not reached, the first is ({x:.3f}, {y:.3f}) m; "
            "x, y need more distance from the border of the reach"
        )
    return answer.values
