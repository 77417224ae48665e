"""The measured crane in the report: tables 4.2 and 4.3, and what a few measurements give."""

from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.crane.measured_figures import campaign_figures, named_points
from flexik.cases.crane.measured_results import PUBLISHED_PAYLOADS, Measured, jib_pushes, read
from flexik.cases.crane.measured_tables import (
    BUDGET_TITLES,
    DEVIATIONS,
    MOVED,
    PERFECT,
    budget_by_kind,
    point_table,
    tables,
    worse_shares,
)
from flexik.cases.crane.section import Section
from flexik.kinematics.status import REACHED
from flexik.planar.measured.fields import MEASURED, METHODS
from flexik.planar.measured.predictions import misfit
from flexik.planar.measured.report import adaptation_figure
from flexik.reporting.report import Content
from flexik.reporting.style import MM

# Points of figure 4.20 whose jib arm is beyond the vertical and where compensation made things
# worse (chapter 4.6); the share of the cranes, %, from which on that holds here too
THESIS_POINTS, REPRODUCED = (2, 3), 80.0
# Goals: after so many measurements, a share of the error of the unadapted, or m
HALVES, GOOD, GOOD_ERROR = 9, 30, 2e-3
# Identified offsets this many expected deviations from the expected are named; measured distances
# are this many times as large as they should be before they are worth a note
FAR, POOR, LISTED = 4.0, 1.5, 5
DECIMALS = 5  # of strokes, m


def measured(section: Section) -> Content:
    """Tables, figures, metrics and values of the part measured.md.j2."""
    return content(read(section))


def content(results: Measured) -> Content:
    """See `measured`."""
    drawn = {"adaptation": adaptation_figure(results.adapted, goals(results))}
    if results.errors is not None:
        geometry, (strokes, pushes) = results.crane.geometry, jib_pushes(results)
        drawn |= campaign_figures(results.errors, geometry, strokes, pushes)
    return Content(tables(results), drawn, metrics(results), values(results), _files(results))


def goals(results: Measured) -> dict[int, float]:
    """Mean error (m) to fall below, by number of measurements."""
    adapted, method = results.adapted, results.section.studies.measured.campaign.method
    unadapted = (adapted["method"] == method) & (adapted["n_measurements"] == 0)
    mean = adapted.loc[unadapted, "mean_error"].mean()
    numbers = results.section.studies.measured.adaptation.n_measurements
    return {n: goal for n, goal in {HALVES: 0.5 * mean, GOOD: GOOD_ERROR}.items() if n in numbers}


def metrics(results: Measured) -> dict[str, float]:
    """Mean errors of the campaign, and over all cranes with least and largest, in mm."""
    found: dict[str, float] = {}
    whole = results.budget_means.query("deviation == 'all'")
    for prefix, end in (("", ""), ("reference.", "_reference")):
        for method in METHODS:
            if (errors := results.errors) is not None:
                column = f"{end[1:]}_error".lstrip("_")
                mean = errors.loc[errors["method"] == method, column].mean()
                found[f"{prefix}{method}.mean_error"] = mean
            cranes = whole[f"{method}{end}"]
            found[f"cranes.{prefix}{method}.mean_error"] = cranes.mean()
            found[f"cranes.{prefix}{method}.least_mean_error"] = cranes.min()
            found[f"cranes.{prefix}{method}.largest_mean_error"] = cranes.max()
    groups = results.adapted.groupby(["method", "n_measurements"])[["mean_error", "p95_error"]]
    for row in groups.mean().reset_index().to_dict("records"):
        label, n = row["method"], row["n_measurements"]
        prefix = f"{label}_{n}" if n else f"unadapted.{label}"
        found |= {f"{prefix}.{name}": row[name] for name in ("mean_error", "p95_error")}
    for name in ("nominal", "adapted") if len(results.predictions) else ():
        found[f"prediction.{name}.mean_error"] = results.predictions[f"{name}_error"].mean()
    found = {name: value for name, value in found.items() if np.isfinite(value)}
    return {f"measured.{name}_mm": round(MM * float(value), 4) for name, value in found.items()}


def values(results: Measured) -> dict[str, Any]:
    """What the sentences of measured.md.j2 say, as `measured`."""
    found = {
        "results": results,
        "settings": results.section.studies.measured,
        "n_named": len(named_points(results.targets)),
        "n_failed": int((results.commands["status"] != REACHED).sum()),
        "least_trained_payload": results.section.samples.grid["payload"].minimum,
        "published_payloads": sorted(results.campaign["payload"].unique()) == PUBLISHED_PAYLOADS,
        "titles": BUDGET_TITLES,
        "sensitivity": _sensitivity(results),
        "points": _points_said(point_table(results)),
        "restarts": _restarts_said(results.restarts),
    }
    if len(results.offsets):
        found["predictions"] = _predictions_said(results.predictions, results.offsets)
    return {"measured": found}


def _sensitivity(results: Measured) -> dict[str, Any]:
    """Which deviation the mean from the reference with compensation hangs on most; m."""
    means, column = budget_by_kind(results), "combined_reference"
    given = means.loc[means["deviation"] == "all", column].iloc[0]
    worst = means[means["factor"] > 1].nlargest(1, column).iloc[0]
    return {
        "given": given,
        "published": results.published["measured_reference_errors"]["combined_all"]["mean_error"],
        "matters": worst[column] > 1.01 * given,
        "name": DEVIATIONS[worst["deviation"]],
        "factor": worst["factor"],
        "larger": worst[column],
    }


def _points_said(points: pd.DataFrame) -> dict[str, Any]:
    """The thesis's remark on its points 2 and 3, checked in a `point_table`."""
    forces = points.filter(like="jib force")
    loads = [str(label).split(", ")[1].removesuffix(" (kN)") for label in forces]
    turns = forces.lt(0).any(axis=1) & forces.gt(0).any(axis=1)
    named = points[points["point"].isin(THESIS_POINTS)]
    columns = ["worse with (%)", "worse with, from reference (%)"]
    perfect = [column.replace(" (%)", f"{PERFECT} (%)") for column in columns]
    return {
        "thesis": list(THESIS_POINTS),
        "beyond": points.loc[points["jib from vertical (deg)"] < 0, "point"].tolist(),
        "pushing": [
            f"{point} ({', '.join(np.array(loads)[pushes])})"
            for point, pushes in zip(points["point"], forces.to_numpy() < 0, strict=True)
            if pushes.any()
        ],
        "turning": points.loc[turns, "point"].tolist(),
        "turned": 1e-3 * points.loc[turns, MOVED].mean(),
        "others": 1e-3 * points.loc[~turns, MOVED].mean(),
        "shares": named[["point", *columns]].to_numpy().tolist(),
        "perfect": named[["point", *perfect]].to_numpy().tolist(),
        "reproduced": bool((named[columns] >= REPRODUCED).all(axis=None)),
    }


def _restarts_said(restarts: pd.DataFrame) -> dict[str, Any] | None:
    """What hangs on the network: means (m) without deviations, and THESIS_POINTS made worse."""
    if restarts.empty:
        return None
    means = restarts[restarts["method"] == "combined"].groupby("twin")[["error", "reference_error"]]
    shares = worse_shares(restarts, "none")
    return {
        "n": restarts["twin"].nunique(),
        "least": means.mean().min().to_list(),
        "most": means.mean().max().to_list(),
        "shares": [
            [number, *shares.iloc[number - 1]] for number in THESIS_POINTS if number <= len(shares)
        ],
    }


def _predictions_said(predictions: pd.DataFrame, offsets: pd.DataFrame) -> dict[str, Any]:
    """Which measurements stand out, and how well crane and expectations fit."""
    distance = predictions["left_out_surprise"].fillna(predictions["surprise"])
    out = predictions.assign(distance=distance)[predictions["used"] == 0]
    away = (offsets["identified"] - offsets["expected"]).abs() / offsets["expected_deviation"]
    far = offsets.assign(away=away)[away > FAR].nlargest(LISTED, "away")
    factor = misfit(distance[predictions["used"] == 1].to_numpy())
    return {
        "n": len(predictions),
        "n_out": len(out),
        "out": out.nlargest(LISTED, "distance").to_dict("records"),
        "misfit": factor if factor > POOR else None,
        "far_deviations": FAR,
        "far": far[["offset", "away"]].to_dict("records"),
        "n_alone": int(predictions["adapted_error"].isna().sum()),
    }


def _files(results: Measured) -> dict[str, str]:
    """Commands, and distances of every measurement, as CSV with units in the names."""

    def text(frame: pd.DataFrame, *lengths: str) -> str:
        units = {name: f"{name}_m" for name in lengths} | {"payload": "payload_kg"}
        rounded = frame.rename(columns=units).round(DECIMALS)
        return rounded.to_csv(index=False, lineterminator="\n")

    commands = results.commands.drop(columns="status")
    lengths = [str(name) for name in commands if name != "payload"]
    distances = (*MEASURED, "nominal_error", "adapted_error")
    return {
        "adapted_strokes.csv": text(commands, *lengths),
        "measured_distances.csv": text(results.predictions, *distances),
    }
