"""Errors of the SmartEE's direct kinematics: networks, Newton's method, and both together.

Reads params.yaml: smartee.networks and their trainers under smartee.trainers, smartee.newton,
smartee.path, smartee.outside (and smartee.geometry, smartee.workspace, smartee.poses to know which
data belong to it); the poses of smartee_generate and the networks of smartee_train.
Writes data/smartee/errors.parquet and data/smartee/newton.parquet, a row for every method and
pose: of the validation and the random poses, of the corners of the box, of the path, and of poses
outside the box.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.smartee.poses import (
    POSE_FIELDS,
    corner_poses,
    geometry_of,
    joints_in,
    path_name,
    path_poses,
    read_poses,
    values,
)
from flexik.datasets.smartee.provenance import evaluation_checksum, network_checksum
from flexik.datasets.tables import Field, write_table
from flexik.evaluation.smartee.errors import (
    CORNERS,
    ERROR_FIELDS,
    NEWTON_FIELDS,
    OUTSIDE,
    error_table,
    newton_table,
    outside_poses,
)
from flexik.learning.storage import load_network
from flexik.parameters import load_parameters
from flexik.parameters.smartee import CENTRE, PREVIOUS
from flexik.positioning.smartee.direct import (
    Direct,
    along_path,
    by_network,
    centre_elbows,
    from_centre,
)

DATA = Path("data/smartee")
Poses = dict[str, tuple[np.ndarray, np.ndarray]]


def main() -> None:
    """Run the stage."""
    smartee = load_parameters().smartee
    made_with = evaluation_checksum(smartee)
    sets: Poses = {}
    for name in ("validation", "random"):
        table = read_poses(DATA / "poses", smartee, name)
        sets[name] = values(table, POSE_FIELDS), joints_in(table)
    poses, joints, n_missed = outside_poses(smartee)
    sets[OUTSIDE], sets[CORNERS] = (poses, joints), corner_poses(smartee)
    print(f"outside: {n_missed} of {smartee.outside.n_poses} poses out of reach, left out")
    newton = pd.concat(newton_table(smartee, name, *sets[name]) for name in sets)
    write(DATA / "newton.parquet", newton, NEWTON_FIELDS, made_with)
    for n_samples in smartee.path.n_samples:
        sets[path_name(n_samples)] = path_poses(smartee, n_samples)
    known = methods(smartee)
    tables = [
        error_table(smartee, (*label, name), poses, joints, method(joints[..., :2]))
        for name, (poses, joints) in sets.items()
        for label, method in known.items()
        # beyond the box, Newton from the centre is told by newton.parquet
        if (name, label[0]) != (OUTSIDE, CENTRE)
    ]
    errors = pd.concat([*tables, *previous(smartee, sets)])
    write(DATA / "errors.parquet", errors, ERROR_FIELDS, made_with)


def methods(smartee: parameters.SmartEE) -> dict[tuple[str, int], Direct]:
    """Networks and the centre by name, with each number of Newton steps from there."""
    geometry, newton = geometry_of(smartee), smartee.newton
    found: dict[tuple[str, int], Direct] = {}
    for name in smartee.networks:
        path = DATA / "networks" / f"{name}.json"
        network, _ = load_network(path, network_checksum(smartee, name))
        for n_steps in range(newton.network_steps + 1):
            found[name, n_steps] = by_network(geometry, network, n_steps)
    start = centre_elbows(geometry, smartee.workspace)
    for n_steps in range(newton.shown_steps + 1):
        found[CENTRE, n_steps] = from_centre(geometry, start, n_steps)
    return found


def previous(smartee: parameters.SmartEE, sets: Poses) -> Iterator[pd.DataFrame]:
    """Errors of Newton steps from the previous pose of the paths, which begin at the centre."""
    geometry = geometry_of(smartee)
    start = centre_elbows(geometry, smartee.workspace)
    for n_samples in smartee.path.n_samples:
        poses, joints = sets[path_name(n_samples)]
        for n_steps in range(1, smartee.newton.network_steps + 1):
            elbows = along_path(geometry, joints[..., :2], start, n_steps)
            label = (PREVIOUS, n_steps, path_name(n_samples))
            yield error_table(smartee, label, poses, joints, elbows)


def write(path: Path, table: pd.DataFrame, fields: tuple[Field, ...], made_with: str) -> None:
    """Write `table` of `fields`."""
    columns = {field.name: table[field.name].to_numpy() for field in fields}
    write_table(path, columns, fields, made_with)


if __name__ == "__main__":
    stage.run(main)
