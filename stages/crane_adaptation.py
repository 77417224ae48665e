"""Correct the compensator by a few measurements, on many cranes as built, and judge it.

Reads params.yaml: parallel, crane.measured.method, crane.measured.noise, crane.measured.deviations,
crane.measured.adaptation, crane.geometry, crane.structure, the compensating methods under
crane.methods (and crane.grid, crane.selection, networks and trainers to know which networks belong
to them); data/crane/calibration.json; their networks.
Writes data/crane/adaptation.parquet, a row for every crane, method, number of measurements and
target.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.provenance import adaptation_checksum
from flexik.datasets.crane_measured.fields import ADAPTATION_FIELDS, ADAPTED, MISJUDGED
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.tables import write_table
from flexik.errors import ParameterError
from flexik.evaluation.conditions import Conditions, random_conditions
from flexik.evaluation.targets import draw_candidates
from flexik.learning.perceptron import Network
from flexik.kinematics.crane import smallest_extension
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.multibody.crane_measured.as_built import (
    AsBuiltCrane,
    Magnitudes,
    as_built_tips,
    draw_twin,
)
from flexik.parameters import load_parameters
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_method, trained_network
from flexik.positioning.crane_measured.adapted import (
    AdaptationSettings,
    Adapted,
    Measurements,
    identify,
)
from flexik.positioning.method import REACHED, Array, Method, PositioningError

FOLDER = Path("data/crane")
# candidates drawn for each target that is wanted
CANDIDATES = 4
# inside the reach, m: a crane as built reaches a little less in places
MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class Study:
    """What all cranes share."""

    measured: parameters.Measured
    nominal: FlexibleCrane
    network: Network
    baselines: Mapping[str, Method]  # of the nominal crane; the first is what is adapted


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane = given.crane
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    nominal = flexible_crane(crane, stiffness)
    label, folder = crane.measured.adaptation.method, FOLDER / "networks"
    network = trained_network(crane, crane.methods[label].network, stiffness, folder)
    baselines = {
        name: trained_method(crane, name, nominal.geometry, stiffness, folder)
        for name in (label, crane.measured.method)
    }
    study = Study(crane.measured, nominal, network, baselines)
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    numbers = range(crane.measured.adaptation.n_cranes)
    found = parallel_map(functools.partial(errors_of, study), numbers, settings, "adaptation")
    table = pd.concat(found)
    write_table(
        FOLDER / "adaptation.parquet",
        {field.name: table[field.name].to_numpy() for field in ADAPTATION_FIELDS},
        ADAPTATION_FIELDS,
        adaptation_checksum(crane, stiffness),
    )
    own = table[table["method"].isin([label, ADAPTED])]
    means = 1e3 * own.groupby("n_measurements")["error"].mean()
    print(", ".join(f"{n} measurements: mean {mean:.2f} mm" for n, mean in means.items()))


def errors_of(study: Study, number: int) -> pd.DataFrame:
    """Errors on crane `number`, of the methods of the nominal crane and adapted."""
    measured, settings = study.measured, study.measured.adaptation
    seed = settings.seed + number
    twin = draw_twin(study.nominal, Magnitudes(**measured.deviations.model_dump()), seed)
    generator = np.random.default_rng((seed, 1))
    most = settings.n_measurements[-1]
    conditions = drawn(study, most + settings.n_targets, generator)
    learn, judge = conditions[:most], conditions[most:]
    strokes, tip = approached(next(iter(study.baselines.values())), learn, study, twin, generator)
    tip = tip + measured.noise * generator.standard_normal(tip.shape)
    right = AdaptationSettings(**settings.expected.model_dump())
    methods: dict[tuple[str, int], Method] = {
        (label, 0): method for label, method in study.baselines.items()
    }
    wrong = right.misjudged(settings.misjudged.share)
    for label, expected, numbers in (
        (ADAPTED, right, settings.n_measurements),
        (MISJUDGED, wrong, settings.misjudged.n_measurements),
    ):
        for n in numbers:
            measurements = Measurements(strokes[:n], learn.payload[:n], tip[:n])
            offsets = identify(study.nominal, study.network, measurements, expected)
            methods[label, n] = Adapted(
                study.nominal, study.network, offsets, settings.n_corrections
            )
    tables = []
    for (label, n), method in methods.items():
        reached = approached(method, judge, study, twin, generator)[1]
        columns = {
            "twin": number,
            "method": label,
            "n_measurements": n,
            "target_x": judge.targets[:, 0],
            "target_y": judge.targets[:, 1],
            "payload": judge.payload,
            "error": np.linalg.norm(reached - judge.targets, axis=1),
        }
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables)


def drawn(study: Study, n: int, generator: np.random.Generator) -> Conditions:
    """`n` random targets that the rigid crane reaches with MARGIN to spare, and payloads."""
    area = study.measured.adaptation
    lower, upper = zip(area.x, area.y, strict=True)
    targets, payload = draw_candidates(CANDIDATES * n, lower, upper, area.payload, generator)
    about = [targets + MARGIN * np.array(way) for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    reached = [np.isfinite(smallest_extension(study.nominal.geometry, near)) for near in about]
    rows = np.flatnonzero(np.all(reached, axis=0))[:n]
    if len(rows) < n:
        raise ParameterError(
            f"crane.measured.adaptation: the crane reaches {len(rows)} of {len(targets)} random "
            f"targets in x, y, expected {n}"
        )
    return random_conditions(targets[rows], payload[rows])


def approached(
    method: Method,
    conditions: Conditions,
    study: Study,
    twin: AsBuiltCrane,
    generator: np.random.Generator,
) -> tuple[Array, Array]:
    """Commanded strokes and where the tip comes to rest, (n, 3) and (n, 2) in m."""
    initial = initial_positions(study.nominal.geometry, conditions.targets)
    command = method(conditions.targets, conditions.payload, initial)
    failed = np.flatnonzero(command.status != REACHED)
    if failed.size:
        x, y = conditions.targets[failed[0]]
        raise PositioningError(
            f"crane.measured.adaptation: {failed.size} targets are not reached, the first is "
            f"({x:.3f}, {y:.3f}) m; x, y need more distance from the border of the reach"
        )
    return command.strokes, as_built_tips(twin, command.strokes, conditions.payload, generator)


if __name__ == "__main__":
    stage.run(main)
