"""Check params.yaml before any other stage runs, and remove results of names it no longer has.

DVC deletes the outputs of a stage before running it, so a wrong value must be found before.
Reads params.yaml. Writes data/validated.txt, whose content never changes.
"""

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.errors import DataError, FlexikError, ParameterError
from flexik.files import write_text
from flexik.mechanisms.crane import CraneGeometry, check_assembly, smallest_extension
from flexik.mechanisms.elastic_arm import inverse_by_rule
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.parameters import load_parameters

OUTPUT = Path("data/validated.txt")
DATA, ARM_DATA = Path("data/crane"), Path("data/elastic_arm")


def main() -> None:
    """Run the stage; with --check alone nothing is written or removed."""
    given = load_parameters()
    crane = given.crane
    check_crane(crane)
    check_arm(given.elastic_arm)
    if sys.argv[1:] == ["--check"]:
        return
    if sys.argv[1:]:
        raise FlexikError("usage: validate.py [--check]")
    remove_stale(DATA, crane_names(crane))
    remove_stale(ARM_DATA, arm_names(given.elastic_arm))
    write_text(OUTPUT, "params.yaml is valid\n")


def check_crane(crane: parameters.Crane) -> None:
    """Section tables are there, the linkage closes, every test point is reached."""
    geometry = CraneGeometry(**crane.geometry.model_dump())
    try:
        flexible_crane(crane, 1.0)
    except DataError as error:
        raise ParameterError(f"params.yaml: {error}") from None
    try:
        check_assembly(geometry)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: crane.geometry: {error}") from None
    points = np.array(crane.evaluation.points)
    missed = np.isnan(smallest_extension(geometry, points))
    if missed.any():
        number = int(np.argmax(missed))
        x, y = points[number]
        raise ParameterError(
            f"params.yaml: crane.evaluation.points.{number}: the rigid crane does not reach "
            f"({x:g}, {y:g}) m" + (f", nor {missed.sum() - 1} others" if missed.sum() > 1 else "")
        )
    space = crane.workspace
    raster = np.array(
        [(x, y) for x in np.linspace(*space.x, 60) for y in np.linspace(*space.y, 60)]
    )
    raster = raster[raster[:, 0] >= crane.grid.minimum_tip_x]
    if np.isnan(smallest_extension(geometry, raster)).all():
        raise ParameterError("params.yaml: crane.workspace: the crane reaches nothing in x, y")


def check_arm(arm: parameters.ElasticArm) -> None:
    """The arm reaches something of the workspace within its joint limits."""
    space = arm.workspace
    raster = np.array(
        [(x, y) for x in np.linspace(*space.x, 60) for y in np.linspace(*space.y, 60)]
    )
    if not inverse_by_rule(flexible_arm(arm).geometry, raster).reached.any():
        raise ParameterError("params.yaml: elastic_arm.workspace: the arm reaches nothing in x, y")


def crane_names(crane: parameters.Crane) -> dict[str, set[str]]:
    """Files of the crane by folder that belong to a name of params.yaml."""
    evaluations = {f"{label}.parquet" for label in ("none", *crane.methods)}
    return {
        "evaluations": evaluations,
        "workspace": evaluations,
        **network_names(crane.all_networks, crane.studies),
    }


def arm_names(arm: parameters.ElasticArm) -> dict[str, set[str]]:
    """Files of the elastic arm by folder that belong to a name of params.yaml."""
    return network_names(arm.all_networks, arm.selected_networks)


def network_names(networks: Iterable[str], studies: Iterable[str]) -> dict[str, set[str]]:
    """Files of `networks`, and of `studies` of sizes, by folder."""
    return {
        "networks": {f"{name}{end}" for name in networks for end in (".json", "_training.csv")},
        "size_selection": {f"{name}{end}" for name in studies for end in (".json", ".parquet")},
    }


def remove_stale(data: Path, current: dict[str, set[str]]) -> None:
    """Delete what stages of earlier names left, which would stay inputs of the report."""
    for folder, names in current.items():
        for path in (data / folder).glob("[!.]*"):
            if path.is_file() and path.name not in names:
                print(f"removing {path}: its name is not in params.yaml")
                path.unlink()


if __name__ == "__main__":
    stage.run(main)
