"""Fit the ground spring so that the uncompensated mean error is the published one.

Reads params.yaml: crane.geometry, crane.structure, crane.evaluation, crane.calibration; the
published table data/reference/crane/positioning_errors.csv.
Writes data/crane/calibration.json: spring stiffness, statistics of the uncompensated errors.
"""

import functools
from pathlib import Path

import pandas as pd

from flexik import stage
from flexik.datasets.crane.provenance import calibration_checksum
from flexik.datasets.tables import read_csv
from flexik.errors import DataError
from flexik.evaluation.conditions import all_conditions
from flexik.evaluation.crane.calibration import fit_spring
from flexik.evaluation.errors import evaluate, statistics
from flexik.files import write_json
from flexik.multibody.crane.assembly import flexible_crane
from flexik.multibody.crane.model import tips
from flexik.parameters import load_parameters
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.none import Uncompensated

PUBLISHED = Path("data/reference/crane/positioning_errors.csv")
OUTPUT = Path("data/crane/calibration.json")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    conditions = all_conditions(crane.evaluation.points, crane.evaluation.payloads)
    geometry = flexible_crane(crane, 1.0).geometry
    initial = initial_positions(geometry, conditions.targets)
    method = Uncompensated(closed_form(geometry))

    def uncompensated(stiffness: float) -> pd.DataFrame:
        flexible_tip = functools.partial(tips, flexible_crane(crane, stiffness))
        return evaluate(method, conditions, initial, flexible_tip)

    published = read_csv(PUBLISHED, ("none",), ("statistic",)).set_index("statistic")["none"]
    if "mean_error" not in published:
        raise DataError(f"{PUBLISHED}: expected a row mean_error")
    mean_error = 1e-3 * float(published["mean_error"])
    fit = fit_spring(uncompensated, mean_error, crane.calibration.stiffness_range)
    print(f"ground spring {fit.spring_stiffness:.6g} N m/rad")
    write_json(
        OUTPUT,
        {
            "spring_stiffness": fit.spring_stiffness,
            "uncompensated": statistics(fit.errors),
            # stages that depend on this file do not watch these parameters themselves
            "made_with": calibration_checksum(crane),
        },
    )


if __name__ == "__main__":
    stage.run(main)
