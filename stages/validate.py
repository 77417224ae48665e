"""Check params.yaml before any other stage runs, and remove results of names it no longer has.

DVC deletes the outputs of a stage before running it, so a wrong value must be found before.
Reads params.yaml and the files it names. Writes data/validated.txt, whose content never changes.
"""

import shutil
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.crane_measured.own import own_campaign
from flexik.datasets.fanuc.samples import taught_path
from flexik.datasets.smartee.poses import corner_poses, draw, geometry_of, joints_of, path_poses
from flexik.errors import DataError, FlexikError, ParameterError
from flexik.files import write_text
from flexik.kinematics.crane import CraneGeometry, check_assembly, smallest_extension
from flexik.kinematics.elastic_arm import inverse_by_rule
from flexik.kinematics.fanuc import check_spherical_wrist
from flexik.kinematics.serial_arm import SerialArm
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.parameters import load_parameters

OUTPUT = Path("data/validated.txt")
DATA = Path("data")


def main() -> None:
    """Run the stage; with --check alone nothing is written or removed."""
    given = load_parameters()
    check_crane(given.crane)
    check_arm(given.elastic_arm)
    check_fanuc(given.fanuc)
    check_smartee(given.smartee)
    if sys.argv[1:] == ["--check"]:
        return
    if sys.argv[1:]:
        raise FlexikError("usage: validate.py [--check]")
    remove_stale("crane", crane_names(given.crane))
    remove_stale("elastic_arm", arm_names(given.elastic_arm))
    remove_stale("smartee", smartee_names(given.smartee))
    remove_stale_networks(given.fanuc)
    write_text(OUTPUT, "params.yaml is valid\n")


def check_crane(crane: parameters.Crane) -> None:
    """Section tables are there, the linkage closes, points are reached, a campaign can be read."""
    geometry = CraneGeometry(**crane.geometry.model_dump())
    try:
        flexible_crane(crane, 1.0)
    except DataError as error:
        raise ParameterError(f"params.yaml: {error}") from None
    try:
        check_assembly(geometry)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: crane.geometry: {error}") from None
    for key, section in (("evaluation", crane.evaluation), ("measured", crane.measured)):
        points = np.array(section.points)
        missed = np.isnan(smallest_extension(geometry, points))
        if missed.any():
            number = int(np.argmax(missed))
            x, y = points[number]
            others = f", nor {missed.sum() - 1} others" if missed.sum() > 1 else ""
            raise ParameterError(
                f"params.yaml: crane.{key}.points.{number}: the rigid crane does not reach "
                f"({x:g}, {y:g}) m{others}"
            )
    for key, area in (
        ("workspace", crane.workspace),
        ("measured.adaptation", crane.measured.adaptation),
    ):
        raster = np.array(
            [(x, y) for x in np.linspace(*area.x, 60) for y in np.linspace(*area.y, 60)]
        )
        raster = raster[raster[:, 0] >= crane.grid.minimum_tip_x]
        if np.isnan(smallest_extension(geometry, raster)).all():
            raise ParameterError(f"params.yaml: crane.{key}: the crane reaches nothing in x, y")
    if crane.measured.source == "file":
        try:
            own_campaign(crane.measured.file, geometry)
        except DataError as error:
            raise DataError(f"params.yaml: crane.measured.file: {error}") from None


def check_fanuc(fanuc: parameters.Fanuc) -> None:
    """The closed form fits the arm, the taught path stays within the limits of the joints."""
    try:
        arm = SerialArm.from_rows([joint.model_dump() for joint in fanuc.joints])
        check_spherical_wrist(arm)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: fanuc.joints: {error}") from None
    try:
        taught_path(arm, fanuc.path)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: {error}") from None


def check_smartee(smartee: parameters.SmartEE) -> None:
    """The legs reach the box from centre to corners, every pose that is drawn, and the paths."""
    try:
        for name in smartee.poses:
            draw(smartee, name)
        for n_samples in smartee.path.n_samples:
            path_poses(smartee, n_samples)
        centre = np.array([[*smartee.workspace.centre, 0.0, 0.0, 0.0]])
        joints_of(geometry_of(smartee), centre, "smartee.workspace.centre")
        corner_poses(smartee)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: {error}") from None


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


def smartee_names(smartee: parameters.SmartEE) -> dict[str, set[str]]:
    """Files of the SmartEE by folder that belong to a name of params.yaml."""
    poses = {f"{name}.parquet" for name in smartee.poses}
    return {"poses": poses, "networks": network_names(smartee.networks, ())["networks"]}


def network_names(networks: Iterable[str], studies: Iterable[str]) -> dict[str, set[str]]:
    """Files of `networks`, and of `studies` of sizes, by folder."""
    return {
        "networks": {f"{name}{end}" for name in networks for end in (".json", "_training.csv")},
        "size_selection": {f"{name}{end}" for name in studies for end in (".json", ".parquet")},
    }


def remove_stale(case: str, current: dict[str, set[str]]) -> None:
    """Delete what stages of earlier names left, which would stay inputs of the report."""
    for folder, names in current.items():
        for path in (DATA / case / folder).glob("[!.]*"):
            if path.is_file() and path.name not in names:
                print(f"removing {path}: its name is not in params.yaml")
                path.unlink()


def remove_stale_networks(fanuc: parameters.Fanuc) -> None:
    """Delete networks of the taught path, their curves and errors, of names that are no more."""
    folders = ("networks", "curves", "starts")
    for path in [path for name in folders for path in (DATA / "fanuc").glob(f"{name}/[!.]*")]:
        if path.name.removesuffix(".parquet") not in fanuc.networks:
            print(f"removing {path}: its name is not in params.yaml")
            shutil.rmtree(path) if path.is_dir() else path.unlink()


if __name__ == "__main__":
    stage.run(main)
