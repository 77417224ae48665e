"""Tables of the measured crane beside those of Rouvinen 1999, chapter 4.6."""

from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.crane.measured_results import ERRORS, PUBLISHED_PAYLOADS, Measured, jib_force
from flexik.cases.crane.report_tables import STATISTIC_NAMES
from flexik.evaluation.errors import STATISTICS
from flexik.kinematics.crane import inverse_with_smallest_extension, pose
from flexik.planar.measured.fields import TARGET
from flexik.planar.measured.report import adaptation_table, offset_table, prediction_table
from flexik.reporting.style import MM
from flexik.reporting.tables import Table, mm, table

COMPENSATION = {"none": "without", "combined": "with"}
# By column of Measured.budget_means
BUDGET_TITLES = {
    f"{method}{end}": f"{label}{origin}"
    for end, origin in (("", ""), ("_reference", ", from reference"))
    for method, label in COMPENSATION.items()
}
PERFECT = ", no deviations"
MOVED = "R with a load, from reference (mm)"
DEVIATIONS = {
    "pivot": "pins",
    "length": "lengths",
    "play": "joint play",
    "stroke_offset": "stroke offset",
    "repeatability": "repeatability",
    "section": "bending stiffness",
    "spring": "ground spring",
}


def tables(results: Measured) -> dict[str, Table]:
    """All tables by name; those that the campaign cannot give are left out."""
    found = {"measured_points": _points_table(results), "error_budget": _budget_table(results)}
    if results.errors is not None:
        found |= {name: _errors_table(results, name) for name in ERRORS}
    if len(results.offsets):
        found["measured_predictions"] = prediction_table(results.predictions)
        found["identified_offsets"] = offset_table(results.offsets)
    return found | {"adaptation": adaptation_table(results.adapted)}


def _errors_table(results: Measured, name: str) -> Table:
    """Six statistics in mm by payload and over all, ours and published."""
    assert results.errors is not None
    prefix, published, names = ERRORS[name], results.published[name], list(STATISTICS)
    ours = results.errors.assign(
        **{key: results.errors[f"{prefix}{key}"] for key in ("error_x", "error_y", "error")}
    )
    payloads = sorted(ours["payload"].unique())
    blocks = []
    for method, label in COMPENSATION.items():
        rows = ours[ours["method"] == method]
        parts = {f"{p:g} kg": rows[rows["payload"] == p] for p in payloads} | {"all": rows}
        block: dict[str, Any] = {"compensation": label}
        block["statistic"] = [STATISTIC_NAMES[key] for key in names]
        for heading, part in parts.items():
            key = f"{method}_{heading.replace(' ', '_')}"
            # nothing is published over all of other payloads
            known = key in published and (heading != "all" or payloads == PUBLISHED_PAYLOADS)
            block[heading] = [MM * float(statistic(part)) for statistic in STATISTICS.values()]
            block[f"{heading} published"] = (
                published.loc[names, key].to_numpy() if known else np.nan
            )
        blocks.append(pd.DataFrame(block))
    return Table(pd.concat(blocks, ignore_index=True), 1)


def point_table(results: Measured) -> pd.DataFrame:
    """What is particular at each point, for the nominal rigid crane and over all cranes.

    Columns point (from 1), x and y in m, angle of the jib arm from the vertical in degrees
    (negative: beyond it), force of the jib cylinder in kN by payload (positive: it pulls), mean R
    in mm without and with compensation, the same with compensation and a load from the point of
    reference, and the share of the cranes (%) on which compensation makes the point worse, from the
    target and from the point of reference.
    """
    crane, budget = results.crane, results.budget
    points = budget[TARGET].drop_duplicates().to_numpy()
    strokes = inverse_with_smallest_extension(crane.geometry, points).values
    angle = np.degrees(pose(crane.geometry, strokes).jib_angle) + 90.0
    found = pd.DataFrame({"point": np.arange(1, len(points) + 1), "x (m)": points[:, 0]})
    found = found.assign(**{"y (m)": points[:, 1], "jib from vertical (deg)": angle})
    for payload in sorted(budget["payload"].unique()):
        found[f"jib force, {payload:g} kg (kN)"] = 1e-3 * jib_force(crane, strokes, payload)
    means = _point_means(budget, "all").groupby(level=TARGET, sort=False).mean()
    for method, label in COMPENSATION.items():
        found[f"R {label} (mm)"] = MM * means["error", method].to_numpy()
    found[MOVED] = MM * means["reference_error", "combined"].to_numpy()
    for ending, deviation in (("", "all"), (PERFECT, "none")):
        shares = worse_shares(budget, deviation)
        found[f"worse with{ending} (%)"] = shares["error"].to_numpy()
        found[f"worse with, from reference{ending} (%)"] = shares["reference_error"].to_numpy()
    return found


def worse_shares(budget: pd.DataFrame, deviation: str) -> pd.DataFrame:
    """Share of the cranes (%) on which compensation makes a target worse, by `_point_means`.

    Columns error and reference_error, a row a target.
    """
    means = _point_means(budget, deviation).swaplevel(axis=1)
    worse: Any = means["combined"] > means["none"]
    return 100 * worse.groupby(level=TARGET, sort=False).mean()


def _point_means(budget: pd.DataFrame, deviation: str) -> pd.DataFrame:
    """Mean errors over the payloads, by target and crane; columns by error and method.

    From the points of reference over the payloads but the lightest, which is the reference itself.
    """
    rows = budget[budget["deviation"] == deviation]
    loaded = rows["reference_error"].where(rows["payload"] > rows["payload"].min())
    rows = rows.assign(reference_error=loaded)
    keys = [*TARGET, "twin"]
    return rows.pivot_table(["error", "reference_error"], keys, "method", sort=False)


def _points_table(results: Measured) -> Table:
    points = point_table(results)
    places = {name: 0 if name.endswith("(%)") else 1 for name in points.columns[3:]}
    return Table(points, {"x (m)": 2, "y (m)": 2} | places)


def budget_by_kind(results: Measured) -> pd.DataFrame:
    """Mean over the cranes, m, by deviation and factor in their order."""
    groups = results.budget_means.groupby(["deviation", "factor"], sort=False)
    return groups[list(BUDGET_TITLES)].mean().reset_index()


def _budget_table(results: Measured) -> Table:
    means = budget_by_kind(results)
    means["deviation"] = [
        name
        if name not in DEVIATIONS
        else f"{DEVIATIONS[name]} alone"
        if factor == 0
        else f"all, {DEVIATIONS[name]} x {factor:g}"
        for name, factor in zip(means["deviation"], means["factor"], strict=True)
    ]
    titles = {f"{title} (mm)": mm(name, 1) for name, title in BUDGET_TITLES.items()}
    return table(means, {"deviation": "deviation", **titles})
