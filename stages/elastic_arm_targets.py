"""Draw random targets and payloads, and keep those that the loaded arm can be put on.

Reads params.yaml: elastic_arm.geometry, elastic_arm.structure, elastic_arm.gauges,
elastic_arm.readings, elastic_arm.workspace.
Writes data/elastic_arm/targets.parquet: targets, payloads, and angles that put the loaded tip on
them; and targets.json, how many were drawn, reached and kept.
"""

import functools
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.elastic_arm.learning import TARGET_FIELDS
from flexik.datasets.elastic_arm.provenance import targets_checksum
from flexik.datasets.elastic_arm.readings import columns_of, degree_axis
from flexik.datasets.tables import write_table
from flexik.errors import ParameterError
from flexik.evaluation.targets import Targets, draw_candidates, reachable_targets
from flexik.files import write_json
from flexik.kinematics.elastic_arm import forward
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.multibody.elastic_arm.model import FlexibleArm, solve
from flexik.parameters import load_parameters
from flexik.positioning.elastic_arm.closed_form import closed_form

FOLDER = Path("data/elastic_arm")
# candidates drawn for each target that is wanted, at most
MAXIMUM_CANDIDATES = 20


def main() -> None:
    """Run the stage."""
    arm = load_parameters().elastic_arm
    model, generator = flexible_arm(arm), np.random.default_rng(arm.workspace.seed)
    wanted, n_drawn, n_found = arm.workspace.n_targets, 0, 0
    found: list[Targets] = []
    while n_found < wanted:
        if n_drawn >= MAXIMUM_CANDIDATES * wanted:
            raise ParameterError(
                f"elastic_arm.workspace: of {n_drawn} targets drawn in x, y only {n_found} are "
                f"reached, expected {wanted}"
            )
        n_drawn += wanted
        found.append(reach(arm, model, generator))
        n_found += len(found[-1])
    columns = [
        np.concatenate([getattr(part, name) for part in found])[:wanted]
        for name in ("targets", "payload", "strokes")
    ]
    write_table(
        FOLDER / "targets.parquet",
        columns_of(columns, TARGET_FIELDS),
        TARGET_FIELDS,
        targets_checksum(arm),
    )
    counts = {"drawn": n_drawn, "reached": n_found, "kept": wanted}
    write_json(FOLDER / "targets.json", counts)
    print(f"{n_found} of {n_drawn} random targets are reached, {wanted} kept")


def reach(
    arm: parameters.ElasticArm, model: FlexibleArm, generator: np.random.Generator
) -> Targets:
    """Those of as many candidates as are wanted that are reached within the readings' range."""
    space, geometry = arm.workspace, model.geometry
    lower, upper = zip(space.x, space.y, strict=True)
    targets, payload = draw_candidates(space.n_targets, lower, upper, space.payload, generator)
    found = reachable_targets(
        targets,
        payload,
        closed_form(geometry),
        functools.partial(forward, geometry),
        lambda angles, mass: solve(model, angles, mass)[0].tip,
        space.tolerance,
        space.n_iterations,
        n_strokes=2,
    )
    axes = (degree_axis(arm.readings.theta_1_degrees), degree_axis(arm.readings.theta_2_degrees))
    least, most = zip(*((axis[0], axis[-1]) for axis in axes), strict=True)
    inside = ((found.strokes >= least) & (found.strokes <= most)).all(axis=1)
    return Targets(found.targets[inside], found.payload[inside], found.strokes[inside])


if __name__ == "__main__":
    stage.run(main)
