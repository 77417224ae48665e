"""Draw random targets and payloads, and keep those that the loaded crane can be put on.

Reads params.yaml: parallel, crane.geometry, crane.structure, crane.workspace,
crane.grid.minimum_tip_x; data/crane/calibration.json.
Writes data/crane/targets.parquet: targets, payloads, and strokes that put the loaded tip on them.
"""

import functools
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexik import parameters, stage
from flexik.datasets.crane.evaluations import TARGET_FIELDS
from flexik.datasets.crane.provenance import targets_checksum
from flexik.datasets.parallel import ParallelSettings, from_environment, parallel_map
from flexik.datasets.tables import write_table
from flexik.errors import ParameterError
from flexik.evaluation.targets import Targets, draw_candidates, reachable_targets
from flexik.kinematics.crane import forward
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.model import FlexibleCrane, solve
from flexik.parameters import load_parameters
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.method import Array

FOLDER = Path("data/crane")
ROWS_PER_PART = 400
# candidates drawn for each target that is wanted, at most
MAXIMUM_CANDIDATES = 20


class Candidates(NamedTuple):
    """Targets (n, 2) in m and payload (n,) in kg."""

    targets: Array
    payload: Array


def main() -> None:
    """Run the stage."""
    given = load_parameters()
    crane = given.crane
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    function = functools.partial(reach, flexible_crane(crane, stiffness), crane.workspace)
    settings = from_environment(ParallelSettings(**given.parallel.model_dump()))
    generator = np.random.default_rng(crane.workspace.seed)
    wanted, n_drawn = crane.workspace.n_targets, 0
    found: list[Targets] = []
    while (n_found := sum(len(part) for part in found)) < wanted:
        if n_drawn >= MAXIMUM_CANDIDATES * wanted:
            raise ParameterError(
                f"crane.workspace: of {n_drawn} targets drawn in x, y only {n_found} are reached, "
                f"expected {wanted}"
            )
        n = wanted if n_drawn == 0 else round(1.1 * (wanted - n_found) * n_drawn / max(n_found, 1))
        parts = draw(crane, generator, min(max(n, ROWS_PER_PART), wanted))
        n_drawn += sum(len(part.payload) for part in parts)
        found += parallel_map(function, parts, settings, "targets")
    targets, payload, strokes = (
        np.concatenate([getattr(part, name) for part in found])[:wanted]
        for name in ("targets", "payload", "strokes")
    )
    columns = [*targets.T, payload, *strokes.T]
    write_table(
        FOLDER / "targets.parquet",
        {field.name: column for field, column in zip(TARGET_FIELDS, columns, strict=True)},
        TARGET_FIELDS,
        targets_checksum(crane, stiffness),
    )
    print(f"{n_found} of {n_drawn} random targets are reached, {wanted} kept")


def draw(crane: parameters.Crane, generator: np.random.Generator, n: int) -> list[Candidates]:
    """`n` candidates of the workspace in parts, without those behind the slew axis."""
    space = crane.workspace
    lower, upper = zip(space.x, space.y, strict=True)
    targets, payload = draw_candidates(n, lower, upper, space.payload, generator)
    kept = targets[:, 0] >= crane.grid.minimum_tip_x
    targets, payload = targets[kept], payload[kept]
    cuts = range(0, len(targets), ROWS_PER_PART)
    return [
        Candidates(targets[k : k + ROWS_PER_PART], payload[k : k + ROWS_PER_PART]) for k in cuts
    ]


def reach(crane: FlexibleCrane, space: parameters.Workspace, candidates: Candidates) -> Targets:
    """Those of `candidates` that `crane` reaches."""
    geometry = crane.geometry
    return reachable_targets(
        candidates.targets,
        candidates.payload,
        closed_form(geometry),
        functools.partial(forward, geometry),
        lambda strokes, payload: solve(crane, strokes, payload)[0],
        space.tolerance,
        space.n_iterations,
    )


if __name__ == "__main__":
    stage.run(main)
