"""Constants of a machine that are free, as they are known or as they fit best.

`constants.json` holds their values and what the fit leaves: the statistics of the errors, or the
root mean square of the distances of the measured tips, with standard deviations of the constants.
"""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.datasets.parts import Part, Work, Writer, json_file, whole
from flexik.errors import DataError
from flexik.evaluation.calibration import fit_campaign, fit_mean_error
from flexik.evaluation.errors import evaluate, statistics, tip_judge
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.planar import tips
from flexik.parameters.conditions import Points
from flexik.planar.conditions import at_points
from flexik.planar.machine import columns_of
from flexik.planar.measured.campaign_file import coordinate_columns, own_campaign
from flexik.planar.measured.fields import MEASURED, values_of
from flexik.planar.section import Calibration, PlanarSection
from flexik.positioning.none import Uncompensated


def parts(section: PlanarSection) -> list[Part]:
    """`constants`; nothing where none is free."""
    if not section.machine.free:
        return []
    return [Part("constants", prepare, described(section), inputs(section))]


def described(section: PlanarSection) -> dict[str, Any]:
    """Settings of `prepare`."""
    points = {"conditions": section.calibration_points}
    return {
        "machine": section.machine,
        "calibration": section.calibration.model_copy(update=points),
    }


def inputs(section: PlanarSection) -> dict[str, Any]:
    """Inputs of `prepare`."""
    calibration = section.calibration
    found: dict[str, Any] = {"sections": section.machine.section_files}
    if calibration.ranges and calibration.campaign is not None:
        found["campaign"] = Path(calibration.campaign)
    return found


def prepare(
    *,
    machine: PlanarMachine,
    calibration: Calibration,
    sections: dict[str, Path],
    campaign: Path | None = None,
) -> Work:
    """Fit what is to be fitted."""
    return whole(_constants, machine=machine, calibration=calibration, campaign=campaign)


def _constants(
    machine: PlanarMachine, calibration: Calibration, campaign: Path | None
) -> dict[str, Writer]:
    found = fitted(machine, calibration, campaign)
    for key, value in found["constants"].items():
        print(f"{key} {value:.6g}" + (", as given" if key in calibration.known else ""))
    return {".json": json_file(found)}


def fitted(
    machine: PlanarMachine, calibration: Calibration, campaign: Path | None
) -> dict[str, Any]:
    """`constants` that are given or fitted, and what the fit leaves."""
    known = machine.with_constants(calibration.known)
    if campaign is not None:
        return _to_campaign(known, calibration, campaign)
    if calibration.ranges and isinstance(calibration.conditions, Points):
        return _to_mean_error(known, calibration, calibration.conditions)
    return {"constants": calibration.known}


def _to_mean_error(
    machine: PlanarMachine, calibration: Calibration, points: Points
) -> dict[str, Any]:
    manipulator, columns = manipulator_of(machine), columns_of(machine)
    conditions, method = at_points(points, manipulator), Uncompensated(manipulator)
    ((key, limits),) = calibration.ranges.items()
    assert calibration.mean_error is not None

    def uncompensated(value: float) -> pd.DataFrame:
        flexible = FlexibleMachine(machine.with_constants({key: value}))
        judge = tip_judge(functools.partial(tips, flexible))
        return pd.DataFrame(evaluate(method, conditions, judge, columns))

    value = fit_mean_error(uncompensated, calibration.mean_error, key, limits)
    left = statistics(uncompensated(value))
    return {"constants": calibration.known | {key: value}, "uncompensated": left}


def _to_campaign(machine: PlanarMachine, calibration: Calibration, file: Path) -> dict[str, Any]:
    campaign = own_campaign(file, machine)
    if campaign[values_of(machine)].isna().any(axis=None):
        raise DataError(f"{file}: expected the columns {list(coordinate_columns(machine))} too")
    values, payload = campaign[values_of(machine)].to_numpy(), campaign["payload"].to_numpy()

    def predicted(constants: Mapping[str, float]) -> np.ndarray:
        return tips(FlexibleMachine(machine.with_constants(constants)), values, payload)

    fit = fit_campaign(predicted, campaign[MEASURED].to_numpy(), calibration.ranges)
    return {
        "constants": calibration.known | fit.constants,
        "standard_deviations": fit.deviations,
        "left": {"rms_distance": fit.rms_distance, "n_measurements": len(campaign)},
    }
