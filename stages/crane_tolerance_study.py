"""Invert the networks of some methods to several tolerances, under all test conditions.

Reads params.yaml: crane.tolerance_study, crane.geometry, crane.structure, crane.evaluation,
crane.methods (and crane.grid, crane.selection, networks and trainers to know which network belongs
to them); data/crane/calibration.json; the networks of these methods.
Writes data/crane/tolerance_study.parquet, a row for every method and tolerance.
"""

import functools
from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.evaluations import TOLERANCE_FIELDS
from flexik.datasets.crane.provenance import tolerance_checksum
from flexik.datasets.tables import write_table
from flexik.evaluation.conditions import all_conditions
from flexik.evaluation.tolerance import tolerance_study
from flexik.kinematics.crane import CraneGeometry
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.model import tips
from flexik.parameters import load_parameters
from flexik.positioning.crane.assembly import crane_method
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.trained import trained_network
from flexik.positioning.method import Method, Network

FOLDER = Path("data/crane")


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    model = flexible_crane(crane, stiffness)
    conditions = all_conditions(crane.evaluation.points, crane.evaluation.payloads)
    initial = initial_positions(model.geometry, conditions.targets)
    studies = []
    for label in crane.tolerance_study.methods:
        method = crane.methods[label]
        network = trained_network(crane, method.network, stiffness, FOLDER / "networks")
        study = tolerance_study(
            functools.partial(with_tolerance, method, model.geometry, network),
            crane.tolerance_study.tolerances,
            conditions,
            initial,
            functools.partial(tips, model),
        )
        studies.append(study.assign(method=label))
        print(f"{label}: {len(study)} tolerances")
    table = pd.concat(studies)
    write_table(
        FOLDER / "tolerance_study.parquet",
        {field.name: table[field.name].to_numpy() for field in TOLERANCE_FIELDS},
        TOLERANCE_FIELDS,
        tolerance_checksum(crane, stiffness),
    )


def with_tolerance(
    method: parameters.MethodModel, geometry: CraneGeometry, network: Network, tolerance: float
) -> Method:
    """`method` with another tolerance of its inversion."""
    assert isinstance(method, parameters.InvertedModel)  # validated with the parameters
    inversion = method.inversion.model_copy(update={"tolerance": tolerance})
    return crane_method(method.model_copy(update={"inversion": inversion}), geometry, network)


if __name__ == "__main__":
    stage.run(main)
