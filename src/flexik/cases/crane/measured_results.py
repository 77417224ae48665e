"""What the report of the measured crane is made from: results of its parts, published values."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.report_results import REFERENCE
from flexik.cases.crane.section import Section
from flexik.datasets.tables import read_csv, read_table
from flexik.kinematics.crane import inverse_with_smallest_extension
from flexik.multibody.joint_forces import joint_forces
from flexik.planar.measured.errors import campaign_errors
from flexik.planar.measured.fields import TARGET
from flexik.planar.measured.report import by_twin

# data/reference/crane/measured_errors.csv and measured_reference_errors.csv hold tables 4.2 and 4.3
# as printed. Over all payloads and without compensation table 4.2, and the text with it, has a
# largest R of 28.8 mm, but 28.9 mm at 172 kg: a slip of rounding in the thesis. The scan lost the
# heading "172 kg" of a column of table 4.3 and added a stray "0x" to the 11 mm of max |dX| there.
# The means over all agree with those by payload, to the last digit, in both tables.
PUBLISHED_PAYLOADS = [0.0, 86.0, 172.0]
# By name of the table, whence the errors count: column prefix of campaign_errors
ERRORS = {"measured_errors": "", "measured_reference_errors": "reference_"}


@dataclass(frozen=True)
class Measured:
    """The nominal crane, tables of parts.measured, and published statistics (mm) by name of ERRORS.

    SI units.
    """

    section: Section
    crane: FlexibleCrane
    campaign: pd.DataFrame
    budget: pd.DataFrame
    restarts: pd.DataFrame
    adaptation: pd.DataFrame
    offsets: pd.DataFrame
    predictions: pd.DataFrame
    commands: pd.DataFrame
    published: Mapping[str, pd.DataFrame]

    @cached_property
    def errors(self) -> pd.DataFrame | None:
        """Result of campaign_errors; None where the campaign does not tell its targets."""
        known = self.campaign[TARGET].notna().all(axis=None)
        return campaign_errors(self.campaign) if known else None

    @property
    def targets(self) -> np.ndarray:
        """Targets (k, 2) of the campaign, m, in their order; NaN where it does not tell them."""
        return self.campaign[TARGET].drop_duplicates().to_numpy()

    @cached_property
    def budget_means(self) -> pd.DataFrame:
        """Mean errors of each crane, m: deviation, factor, twin; by method, from either origin."""
        keys, ends = ["deviation", "factor", "twin"], {"error": "", "reference_error": "_reference"}
        found = self.budget.pivot_table(list(ends), keys, "method", sort=False)
        names = [f"{pair[1]}{ends[pair[0]]}" for pair in found.columns.to_flat_index()]
        return found.set_axis(names, axis=1).reset_index()

    @cached_property
    def adapted(self) -> pd.DataFrame:
        """Result of by_twin."""
        return by_twin(self.adaptation)


def read(section: Section) -> Measured:
    """Results of the parts beside the published values."""
    files = {name: name for name in ("campaign", "budget", "adaptation")}
    files |= {"restarts": "budget.restarts", "offsets": "identified"}
    files |= {name: f"identified.{name}" for name in ("predictions", "commands")}
    folder = section.data / "studies/measured"
    crane = flexible(section.machine, section.data / "constants/constants.json")
    return Measured(
        section,
        crane,
        **{name: read_table(folder / f"{file}.parquet") for name, file in files.items()},
        published={
            name: read_csv(REFERENCE / f"{name}.csv", (), ("statistic",)).set_index("statistic")
            for name in ERRORS
        },
    )


def jib_pushes(results: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Strokes (k, 3) in m of the rigid inverse at the targets, and where its jib cylinder pushes.

    (k,), with one of the payloads or more, by statics of the rigid nominal crane.
    """
    strokes = inverse_with_smallest_extension(results.crane.geometry, results.targets).values
    payloads = results.campaign["payload"].unique()
    forces = [jib_force(results.crane, strokes, payload) for payload in payloads]
    return strokes, np.any(np.array(forces) < 0.0, axis=0)


def jib_force(crane: FlexibleCrane, strokes: np.ndarray, payload: float) -> np.ndarray:
    """Tension (k,) of the jib cylinder in N."""
    load = np.tile([0.0, -crane.machine.gravity * payload], (len(strokes), 1))
    return joint_forces(crane.machine, crane.linkage.poses(strokes), load)["drives.jib"][:, 0]
