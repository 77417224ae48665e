"""Check params.yaml before any other stage runs, and remove results of names it no longer has.

DVC deletes the outputs of a stage before running it, so a wrong value must be found before.
Reads params.yaml and the files it names. Writes data/validated.txt, whose content never changes.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

from flexik import parameters, stage
from flexik.datasets.crane_measured.own import own_campaign
from flexik.datasets.fanuc.samples import taught_path
from flexik.datasets.smartee.poses import draw, geometry_of, joints_of, path_poses
from flexik.errors import DataError, FlexikError, ParameterError
from flexik.files import write_text
from flexik.mechanisms.crane import CraneGeometry, check_assembly, smallest_extension
from flexik.mechanisms.fanuc import check_spherical_wrist
from flexik.mechanisms.serial_arm import SerialArm
from flexik.multibody.crane.assembly import flexible_crane
from flexik.parameters import load_parameters

OUTPUT = Path("data/validated.txt")
DATA, FANUC, SMARTEE = Path("data/crane"), Path("data/fanuc"), Path("data/smartee")


def main() -> None:
    """Run the stage; with --check alone nothing is written or removed."""
    given = load_parameters()
    crane, fanuc, smartee = given.crane, given.fanuc, given.smartee
    check_crane(crane)
    check_fanuc(fanuc)
    check_smartee(smartee)
    if sys.argv[1:] == ["--check"]:
        return
    if sys.argv[1:]:
        raise FlexikError("usage: validate.py [--check]")
    remove_stale(crane)
    remove_stale_networks(fanuc)
    remove_stale_smartee(smartee)
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
    """The legs reach the centre of the workspace, every pose that is drawn, and the paths."""
    try:
        for name in smartee.poses:
            draw(smartee, name)
        for n_samples in smartee.path.n_samples:
            path_poses(smartee, n_samples)
        centre = np.array([[*smartee.workspace.centre, 0.0, 0.0, 0.0]])
        joints_of(geometry_of(smartee), centre, "smartee.workspace.centre")
    except ParameterError as error:
        raise ParameterError(f"params.yaml: {error}") from None


def remove_stale(crane: parameters.Crane) -> None:
    """Delete what stages of earlier names left, which would stay inputs of the report."""
    evaluations = {f"{label}.parquet" for label in ("none", *crane.methods)}
    current = {
        "evaluations": evaluations,
        "workspace": evaluations,
        "networks": {
            f"{name}{end}" for name in crane.all_networks for end in (".json", "_training.csv")
        },
        "size_selection": {
            f"{name}{end}" for name in crane.studies for end in (".json", ".parquet")
        },
    }
    _remove_others(DATA, current)


def remove_stale_smartee(smartee: parameters.SmartEE) -> None:
    """The same for the SmartEE."""
    current = {
        "poses": {f"{name}.parquet" for name in smartee.poses},
        "networks": {
            f"{name}{end}" for name in smartee.networks for end in (".json", "_training.csv")
        },
    }
    _remove_others(SMARTEE, current)


def _remove_others(data: Path, current: dict[str, set[str]]) -> None:
    for folder, names in current.items():
        for path in (data / folder).glob("[!.]*"):
            if path.is_file() and path.name not in names:
                print(f"removing {path}: its name is not in params.yaml")
                path.unlink()


def remove_stale_networks(fanuc: parameters.Fanuc) -> None:
    """Delete networks of the taught path, and their curves, of names that are no more."""
    for path in [*FANUC.glob("networks/[!.]*"), *FANUC.glob("curves/[!.]*")]:
        if path.name.removesuffix(".parquet") not in fanuc.networks:
            print(f"removing {path}: its name is not in params.yaml")
            shutil.rmtree(path) if path.is_dir() else path.unlink()


if __name__ == "__main__":
    stage.run(main)
