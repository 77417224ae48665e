"""The measured crane in the report: tables 4.2 and 4.3, and what a few measurements give."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.crane_measured.campaign import TARGET
from flexik.datasets.crane_measured.fields import MISJUDGED
from flexik.evaluation.crane_measured.campaign import (
    campaign_table,
    reference_errors,
    split_campaign,
)
from flexik.evaluation.crane_measured.statistics import adaptation_statistics, budget_statistics
from flexik.kinematics.crane import inverse_with_smallest_extension
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.crane_measured.joint_play import joint_forces
from flexik.reporting import page, style, tables
from flexik.reporting.crane_measured import (
    campaign_figures,
    campaign_tables,
    deviations,
    identification,
)

CAPTIONS = {
    "measured_errors": "Measured positioning errors from the target (after table 4.2), mm.",
    "measured_reference_errors": "Measured positioning errors from the point reached with 0 kg and "
    "compensation (after table 4.3), mm.",
}
# Goals: after so many measurements, a share of the error of the unadapted, or m
HALVES, GOOD, GOOD_ERROR = 9, 30, 2e-3
# Figures of tables 4.2 and 4.3
NAMED_POINTS = np.array([[3.8, 0.15], [3.8, 0.95]])


@dataclass(frozen=True)
class Measured:
    """Campaign, what is identified from it, and studies on cranes as built; SI units.

    parameters : section crane.measured.
    campaign, budget, adaptation, offsets, predictions, commands : tables with MEASURED_FIELDS,
        BUDGET_FIELDS and so on of datasets.crane_measured.fields.
    published : statistics (mm) by name of CAPTIONS.
    """

    parameters: parameters.Measured
    campaign: pd.DataFrame
    budget: pd.DataFrame
    adaptation: pd.DataFrame
    offsets: pd.DataFrame
    predictions: pd.DataFrame
    commands: pd.DataFrame
    published: dict[str, pd.DataFrame]

    @property
    def has_targets(self) -> bool:
        """Whether the campaign tells its targets, as tables of errors need."""
        return bool(self.campaign[TARGET].notna().all(axis=None))

    @property
    def as_built(self) -> bool:
        """Whether a crane as built stands in for a real one."""
        return self.parameters.source == "as_built"

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Results of evaluation.crane_measured.campaign.campaign_table by name of CAPTIONS."""
        if not self.has_targets:
            return {}
        frames = split_campaign(self.campaign)
        return {
            "measured_errors": campaign_table(frames),
            "measured_reference_errors": campaign_table(reference_errors(frames)),
        }


def metrics(measured: Measured) -> dict[str, float]:
    """Mean errors of the campaign, and over all cranes, in mm."""
    found: dict[str, float] = {}
    names = {"measured_errors": "measured", "measured_reference_errors": "measured.reference"}
    for table, values in measured.tables.items():
        for method in ("none", "combined"):
            found[f"{names[table]}.{method}.mean_error_mm"] = float(
                values[f"{method}_all"]["mean_error"]
            )
    means = budget_statistics(measured.budget)
    means = means[means["deviation"] == "all"]
    for method in ("none", "combined"):
        for end, label in (("", method), ("_reference", f"reference.{method}")):
            mean = style.MM * means[f"{method}{end}"].mean()
            found[f"measured.cranes.{label}.mean_error_mm"] = mean
    statistics = adaptation_statistics(measured.adaptation)
    by_method = statistics.groupby(["method", "n_measurements"])[["mean_error", "p95_error"]].mean()
    for row in by_method.reset_index().to_dict("records"):
        label, n = row["method"], row["n_measurements"]
        prefix = f"measured.{label}_{n}" if n else f"measured.unadapted.{label}"
        for name in ("mean_error", "p95_error"):
            found[f"{prefix}.{name}_mm"] = style.MM * row[name]
    if len(measured.predictions):
        for crane in ("nominal", "adapted"):
            error = style.MM * measured.predictions[f"{crane}_error"].mean()
            found[f"measured.prediction.{crane}.mean_error_mm"] = error
    return {name: round(float(value), 4) for name, value in found.items() if np.isfinite(value)}


def write(measured: Measured, crane: FlexibleCrane, payload_minimum: float, folder: Path) -> None:
    """Write tables and figures into `folder`; tables that the campaign cannot give are empty."""
    for name in CAPTIONS.keys() - measured.tables.keys():
        _write_absent(folder / name, CAPTIONS[name])
    for name, table in measured.tables.items():
        published = measured.published[name]
        beside = campaign_tables.measured_errors_table(table, published)
        notes = []
        if name == "measured_errors" and measured.as_built:
            notes.append(deviations.spread_note(measured.budget))
        if not campaign_tables.has_published_payloads(table):
            notes.append("Other payloads than published, so nothing stands beside those over all.")
        elif name == "measured_errors":
            notes.append(campaign_tables.published_note(published))
        tables.write_table(folder / name, beside, 1, CAPTIONS[name], notes)
    points = deviations.point_table(measured.budget, crane)
    caption = "Points of params.yaml: the nominal rigid crane, and cranes as built."
    notes = deviations.point_notes(points)
    places = {"x (m)": 2, "y (m)": 2} | {
        name: 0 if name.endswith("(%)") else 1 for name in points.columns[3:]
    }
    tables.write_table(folder / "measured_points", points, places, caption, notes)
    reference = measured.published["measured_reference_errors"].set_index("statistic")
    caption = (
        "Mean R over the points and payloads of params.yaml on cranes as built, by deviation. "
        "`none`: a crane without any, so that with compensation the noise of measuring and the "
        f"network's own error are left; its training payloads begin at {payload_minimum:g} kg."
    )
    theirs = float(reference["combined_all"]["mean_error"])
    notes = [deviations.sensitivity_note(measured.budget, theirs)]
    table = deviations.budget_table(measured.budget)
    tables.write_table(folder / "error_budget", table, 1, caption, notes)
    _write_adaptation(measured, folder)
    _write_identification(measured, folder)
    _write_figures(measured, crane, folder / "figures")


def _write_adaptation(measured: Measured, folder: Path) -> None:
    settings = measured.parameters.adaptation
    caption = (
        f"Errors at {settings.n_targets} other targets on each of {settings.n_cranes} cranes as "
        f"built after N measurements; N = 0: methods of the nominal crane, `{settings.method}` the "
        f"one that is adapted. `{MISJUDGED}`: adapted by one who expects no play and "
        f"{100 * settings.misjudged.share:g} % of the other deviations of the crane. The "
        "percentile is that of the targets of each crane, averaged over the cranes; max R is over "
        "everything."
    )
    table = campaign_tables.adaptation_table(adaptation_statistics(measured.adaptation))
    tables.write_table(folder / "adaptation", table, 2, caption)


def _write_identification(measured: Measured, folder: Path) -> None:
    identification.write_commands(folder / "adapted_strokes.csv", measured.commands)
    captions = {
        "identified_offsets": "Offsets of the nominal crane, identified from all measurements of "
        "the campaign.",
        "measured_predictions": "Measured points beside the predicted: distances for the nominal "
        "crane, and for cranes adapted to the measurements of the other targets alone.",
    }
    if not len(measured.offsets):
        for name, caption in captions.items():
            _write_absent(folder / name, caption)
        identification.write_predictions(folder / "measured_distances.csv", measured.predictions)
        return
    table = identification.offset_table(measured.offsets)
    tables.write_table(folder / "identified_offsets", table, 3, captions["identified_offsets"])
    tables.write_table(
        folder / "measured_predictions",
        identification.prediction_table(measured.predictions),
        1,
        captions["measured_predictions"],
        identification.prediction_notes(measured.predictions, measured.offsets),
    )
    path = folder / "measured_distances.csv"
    identification.write_predictions(path, measured.predictions)


def _write_absent(path: Path, caption: str) -> None:
    notes = ["The campaign does not give it."]
    tables.write_table(path, pd.DataFrame({"statistic": []}), 1, caption, notes)


def _write_figures(measured: Measured, crane: FlexibleCrane, folder: Path) -> None:
    for path in folder.glob("measured_*.png"):
        path.unlink()
    statistics = adaptation_statistics(measured.adaptation)
    unadapted = statistics[statistics["method"] == measured.parameters.method]["mean_error"]
    goals = {
        n: goal
        for n, goal in ((HALVES, 0.5 * unadapted.mean()), (GOOD, GOOD_ERROR))
        if n in measured.parameters.adaptation.n_measurements
    }
    campaign_figures.adaptation(folder / "adaptation.png", statistics, goals)
    if not measured.has_targets:
        return
    frames = split_campaign(measured.campaign)
    moved = reference_errors(frames)
    points = target_points(measured)
    strokes, pushes = jib_pushes(measured, crane)
    path = folder / "measured_points.png"
    campaign_figures.measured_points(path, crane.geometry, strokes, points, pushes)
    for axis in ("x", "y"):
        path = folder / f"measured_errors_{axis}.png"
        campaign_figures.errors_by_point(path, frames, axis)
        path = folder / f"measured_reference_errors_{axis}.png"
        campaign_figures.errors_by_point(path, moved, axis)
    for number, target in enumerate(named_points(points), start=1):
        campaign_figures.achieved(folder / f"measured_point_{number}.png", frames, target)


def jib_pushes(measured: Measured, crane: FlexibleCrane) -> tuple[np.ndarray, np.ndarray]:
    """Strokes (k, 3) in m of the rigid inverse at the targets, and where its jib cylinder pushes.

    (k,), with one of the payloads or more, by statics of the rigid nominal `crane`.
    """
    points = target_points(measured)
    strokes = inverse_with_smallest_extension(crane.geometry, points).strokes
    pushes = np.zeros(len(points), dtype=bool)
    for payload in measured.campaign["payload"].unique():
        load = np.tile([0.0, -crane.structure.gravity * payload], (len(points), 1))
        force = joint_forces(crane, strokes, load, crane.structure.gravity).joints["jib_cylinder"]
        pushes |= force[:, 0] < 0.0
    return strokes, pushes


def target_points(measured: Measured) -> np.ndarray:
    """Targets (k, 2) of the campaign, m, in their order."""
    return measured.campaign[TARGET].drop_duplicates().to_numpy()


def named_points(points: np.ndarray) -> np.ndarray:
    """The two points of figures 4.24 and 4.25, or the last two where those are not measured."""
    same = [np.isclose(points, point).all(axis=1) for point in NAMED_POINTS]
    there = [points[rows][0] for rows in same if rows.any()]
    return np.array(there) if len(there) == len(same) else points[-2:]


def section(measured: Measured, folder: Path) -> page.Section:
    """Part of the report page."""
    texts = [_source_text(measured), _adaptation_text(measured)]
    names = [*measured.tables, "measured_points", "error_budget"]
    names += ["measured_predictions", "identified_offsets"] if len(measured.offsets) else []
    return page.Section(
        "Measured crane",
        "\n\n".join(texts),
        [folder / f"{name}.md" for name in [*names, "adaptation"]],
        _figures(measured, folder / "figures"),
    )


def _source_text(measured: Measured) -> str:
    if measured.as_built:
        return (
            "No crane was measured here: the flexible model with hidden differences from the "
            "nominal one (pins, lengths, joint play, stroke sensors, stiffness) stands in for it, "
            "so single values cannot agree with the published ones, only their order and what "
            "compensation changes."
        )
    text = (
        f"The measurements are those of `{measured.parameters.file}`; the published ones beside "
        "them are of the nine points of the thesis. Points and budget below are those of "
        "params.yaml, on cranes as built."
    )
    if not measured.has_targets:
        text += " It has no targets, so there are no tables of errors and no commands."
    return text


def _adaptation_text(measured: Measured) -> str:
    text = (
        "Adaptation: from measured points the most probable offsets of pins, lengths, strokes, "
        "play and stiffness of the nominal crane are identified, and the compensator uses them. "
        "Before measuring it expects `expected`, the cranes as built are drawn with `deviations` "
        "(params.yaml), so they differ from the nominal one only in what is looked for, and a real "
        "crane will leave more. Errors include the repeatability of the strokes. "
    )
    if not len(measured.offsets):
        return text + "The campaign has no strokes or too few rows: nothing is identified from it."
    if not len(measured.commands):
        return text.rstrip()
    return text + identification.command_text(measured.commands, "adapted_strokes.csv")


def _figures(measured: Measured, figures: Path) -> list[tuple[Path, str]]:
    found = [(figures / "adaptation.png", "Error by number of measurements, all cranes.")]
    if not measured.has_targets:
        return found
    return [
        (figures / "measured_points.png", "Measured points (after figure 4.20)."),
        (
            figures / "measured_errors_x.png",
            "Errors in x: target minus measured point (after figure 4.22).",
        ),
        (
            figures / "measured_errors_y.png",
            "Errors in y: target minus measured point; positive: too low (after figure 4.22).",
        ),
        (
            figures / "measured_reference_errors_x.png",
            "Errors in x: reference minus measured point (after figure 4.23).",
        ),
        (
            figures / "measured_reference_errors_y.png",
            "Errors in y: reference minus measured point (after figure 4.23).",
        ),
        *(
            (
                figures / f"measured_point_{number}.png",
                "Points reached about one target (after figures 4.24 and 4.25).",
            )
            for number in range(1, 1 + len(named_points(target_points(measured))))
        ),
        *found,
    ]
