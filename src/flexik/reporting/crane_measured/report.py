"""The measured crane in the report: tables 4.2 and 4.3, and what a few measurements give."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.crane.grid import STROKES
from flexik.evaluation.crane_measured.campaign import (
    adaptation_statistics,
    campaign_table,
    reference_errors,
    split_campaign,
)
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.crane_measured.joint_play import joint_forces
from flexik.reporting import page, style, tables
from flexik.reporting.crane_measured import campaign_figures, campaign_tables

CAPTIONS = {
    "measured_errors": "Measured positioning errors from the target (after table 4.2), mm.",
    "measured_reference_errors": "Measured positioning errors from the point reached with 0 kg and "
    "compensation (after table 4.3), mm.",
}
# Goals: after so many measurements, a share of the error of the unadapted, or m
HALVES, GOOD, GOOD_ERROR = 9, 30, 2e-3


@dataclass(frozen=True)
class Measured:
    """Campaign and adaptation; SI units.

    parameters : section crane.measured.
    campaign : MEASURED_FIELDS of datasets.crane_measured.fields.
    adaptation : ADAPTATION_FIELDS of datasets.crane_measured.fields.
    published : statistics (mm) by name of CAPTIONS.
    """

    parameters: parameters.Measured
    campaign: pd.DataFrame
    adaptation: pd.DataFrame
    published: dict[str, pd.DataFrame]

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Results of evaluation.crane_measured.campaign.campaign_table by name of CAPTIONS."""
        frames = split_campaign(self.campaign)
        return {
            "measured_errors": campaign_table(frames),
            "measured_reference_errors": campaign_table(reference_errors(frames)),
        }


def metrics(measured: Measured) -> dict[str, float]:
    """Mean errors over all points and payloads, and over all cranes, in mm."""
    found: dict[str, float] = {}
    names = {"measured_errors": "measured", "measured_reference_errors": "measured.reference"}
    for table, values in measured.tables.items():
        for method in ("none", "combined"):
            mean = float(values[f"{method}_all"]["mean_error"])
            found[f"{names[table]}.{method}.mean_error_mm"] = round(mean, 4)
    by_crane = adaptation_statistics(measured.adaptation).groupby("n_measurements")
    for n, row in by_crane[["mean_error", "p95_error"]].mean().iterrows():
        for name in ("mean_error", "p95_error"):
            found[f"measured.adapted_{n}.{name}_mm"] = round(style.MM * row[name], 4)
    return found


def pushes(measured: Measured, crane: FlexibleCrane) -> pd.DataFrame:
    """Rows of the campaign without compensation, and whether the jib cylinder `pushes` there.

    By statics of the rigid nominal crane.
    """
    rows = measured.campaign[measured.campaign["method"] == "none"]
    load = np.zeros((len(rows), 2))
    load[:, 1] = -crane.structure.gravity * rows["payload"]
    strokes = rows[list(STROKES)].to_numpy()
    force = joint_forces(crane, strokes, load, crane.structure.gravity).joints["jib_cylinder"]
    return rows.assign(pushes=force[:, 0] < 0.0)


def point_notes(measured: Measured, crane: FlexibleCrane) -> list[str]:
    """Where the jib force changes its direction, and where compensation does not help."""
    frames = split_campaign(measured.campaign)
    push, notes = pushes(measured, crane), []
    points = frames["none"].drop_duplicates("point")
    changing, worse = [], []
    for _, row in points.iterrows():
        number = int(row["point"]) + 1
        same = (push["target_x"] == row["target_x"]) & (push["target_y"] == row["target_y"])
        of_point = push.loc[same & push["pushes"], "payload"]
        if len(of_point):
            loads = ", ".join(f"{payload:g}" for payload in of_point)
            changing.append(f"{number} (with {loads} kg)")
        errors = [
            frame.loc[frame["point"] == row["point"], "error"].mean() for frame in frames.values()
        ]
        if errors[1] > errors[0]:
            worse.append(str(number))
    notes.append(
        "The jib cylinder pushes in "
        + (f"point {', '.join(changing)}" if changing else "no point")
        + ", elsewhere it pulls; in the thesis it pushes in points 2 and 3, which are better "
        "without compensation. "
        + (
            f"Here compensation does not help in point {', '.join(worse)}."
            if worse
            else "Here compensation lowers the mean error of every point."
        )
    )
    return notes


def write(measured: Measured, crane: FlexibleCrane, folder: Path) -> None:
    """Write tables and figures into `folder`."""
    for name, table in measured.tables.items():
        beside = campaign_tables.measured_errors_table(table, measured.published[name])
        notes = []
        if name == "measured_errors":
            notes = [*point_notes(measured, crane), campaign_tables.PUBLISHED_NOTE]
        tables.write_table(folder / name, beside, 1, CAPTIONS[name], notes)
    statistics = adaptation_statistics(measured.adaptation)
    settings = measured.parameters.adaptation
    caption = (
        f"Errors at {settings.n_targets} other targets on each of {settings.n_cranes} cranes as "
        "built, after N measurements; N = 0: the compensator of the nominal crane. The percentile "
        "is that of each crane, averaged."
    )
    table = campaign_tables.adaptation_table(statistics)
    tables.write_table(folder / "adaptation", table, 2, caption)
    _write_figures(measured, statistics, crane, folder / "figures")


def _write_figures(
    measured: Measured, statistics: pd.DataFrame, crane: FlexibleCrane, folder: Path
) -> None:
    frames = split_campaign(measured.campaign)
    moved = reference_errors(frames)
    unloaded = measured.campaign[
        (measured.campaign["method"] == "none") & (measured.campaign["payload"] == 0.0)
    ]
    points = unloaded[["target_x", "target_y"]].to_numpy()
    strokes = unloaded[list(STROKES)].to_numpy()
    by_point = pushes(measured, crane).groupby(["target_x", "target_y"], sort=False)["pushes"]
    pushing = by_point.any().to_dict()
    jib_pushes = [pushing[tuple(point)] for point in points]
    path = folder / "measured_points.png"
    campaign_figures.measured_points(path, crane.geometry, strokes, points, jib_pushes)
    for axis in ("x", "y"):
        path = folder / f"measured_errors_{axis}.png"
        campaign_figures.errors_by_point(path, frames, axis)
        path = folder / f"measured_reference_errors_{axis}.png"
        campaign_figures.errors_by_point(path, moved, axis)
    for number, target in enumerate(named_points(points), start=1):
        campaign_figures.achieved(folder / f"measured_point_{number}.png", frames, target)
    unadapted = statistics[statistics["n_measurements"] == 0]["mean_error"].mean()
    goals = {
        n: goal
        for n, goal in ((HALVES, 0.5 * unadapted), (GOOD, GOOD_ERROR))
        if n in measured.parameters.adaptation.n_measurements
    }
    campaign_figures.adaptation(folder / "adaptation.png", statistics, goals)


def target_points(measured: Measured) -> np.ndarray:
    """Targets (k, 2) of the campaign, m, in their order."""
    keys = ["target_x", "target_y"]
    return measured.campaign[keys].drop_duplicates().to_numpy()


def named_points(points: np.ndarray) -> np.ndarray:
    """The two points of figures 4.24 and 4.25, or the last two where those are not measured."""
    named = np.array([[3.8, 0.15], [3.8, 0.95]])
    there = [np.isclose(points, point).all(axis=1).any() for point in named]
    return named if all(there) else points[-2:]


def section(measured: Measured, folder: Path) -> page.Section:
    """Part of the report page."""
    figures = folder / "figures"
    own = measured.parameters.source == "file"
    source = (
        f"The measurements are those of `{measured.parameters.file}`."
        if own
        else "No crane was measured here: the flexible model with hidden differences from the "
        "nominal one (pins, lengths, joint play, stroke sensors, stiffness) stands in for it, so "
        "single values cannot agree with the published ones, only their order and what "
        "compensation changes."
    )
    return page.Section(
        "Measured crane",
        f"{source}\n\n"
        "Adaptation, on cranes as built in the model whatever the source of the campaign: from N "
        "measured points the most probable offsets of pins, lengths, strokes, play and stiffness "
        "of the nominal crane are identified, and the compensator uses them. The cranes differ "
        "from the nominal one only in such offsets, so a real crane will leave more. Before "
        "measuring it expects `expected`, the cranes are drawn with `deviations` (params.yaml). "
        "Errors include the repeatability of the strokes.",
        [
            folder / "measured_errors.md",
            folder / "measured_reference_errors.md",
            folder / "adaptation.md",
        ],
        [
            (figures / "measured_points.png", "Measured points (after figure 4.20)."),
            (figures / "measured_errors_x.png", "Errors in x from the target (after figure 4.22)."),
            (figures / "measured_errors_y.png", "Errors in y from the target (after figure 4.22)."),
            (
                figures / "measured_reference_errors_x.png",
                "Errors in x from the reference point (after figure 4.23).",
            ),
            (
                figures / "measured_reference_errors_y.png",
                "Errors in y from the reference point (after figure 4.23).",
            ),
            *(
                (figures / f"measured_point_{number}.png", "Points reached about one target.")
                for number in range(1, 1 + len(named_points(target_points(measured))))
            ),
            (figures / "adaptation.png", "Error by number of measurements."),
        ],
    )
