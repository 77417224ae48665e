"""The ground spring, so that the uncompensated mean error is the published one, or as it is known.

`constants.json` holds the stiffness, and the statistics of the errors that it leaves.
"""

import functools
from pathlib import Path

import pandas as pd

from flexik.cases.crane.parts.crane import on_spring
from flexik.cases.crane.section import SPRING, Calibration, Section
from flexik.datasets.parts import Part, Work, Writer, json_file, whole
from flexik.datasets.tables import read_csv
from flexik.errors import DataError
from flexik.evaluation.calibration import fit_spring
from flexik.evaluation.errors import evaluate, statistics, tip_judge
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.machine_file import crane_geometry
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.planar.conditions import at_points
from flexik.planar.machine import columns_of
from flexik.positioning.none import Uncompensated

PUBLISHED = Path("data/reference/crane/positioning_errors.csv")


def parts(section: Section) -> list[Part]:
    """`constants`."""
    settings = {"machine": section.machine, "calibration": section.calibration}
    sections = section.machine.section_files
    return [Part("constants", prepare, settings, {"published": PUBLISHED, "sections": sections})]


def prepare(
    *, machine: PlanarMachine, calibration: Calibration, published: Path, sections: dict[str, Path]
) -> Work:
    """Fit the spring, or take the known one."""
    return whole(_spring, machine=machine, calibration=calibration, published=published)


def published_mean(file: Path) -> float:
    """Published mean error without compensation, m; raises DataError if `file` lacks it."""
    table = read_csv(file, ("none",), ("statistic",)).set_index("statistic")["none"]
    if "mean_error" not in table:
        raise DataError(f"{file}: expected a row mean_error")
    return 1e-3 * float(table["mean_error"])


def _spring(machine: PlanarMachine, calibration: Calibration, published: Path) -> dict[str, Writer]:
    if calibration.stiffness is not None:
        print(f"ground spring {calibration.stiffness:.6g} N m/rad, as given")
        return {".json": json_file({"constants": {SPRING: calibration.stiffness}})}
    manipulator, columns = CraneManipulator(crane_geometry(machine)), columns_of(machine)
    conditions = at_points(calibration.conditions, manipulator)
    method = Uncompensated(manipulator)

    def uncompensated(stiffness: float) -> pd.DataFrame:
        judge = tip_judge(functools.partial(tips, on_spring(machine, stiffness)))
        return pd.DataFrame(evaluate(method, conditions, judge, columns))

    fit = fit_spring(uncompensated, published_mean(published), calibration.stiffness_range)
    print(f"ground spring {fit.spring_stiffness:.6g} N m/rad")
    left = {"constants": {SPRING: fit.spring_stiffness}, "uncompensated": statistics(fit.errors)}
    return {".json": json_file(left)}
