"""Tables of the SmartEE's report, metrics, and numbers for the sentences of its page."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee.report_results import (
    FACTORS,
    GOALS,
    LABELS,
    QUANTITIES,
    STEPS,
    UNITS,
    Results,
    scientific,
)
from flexik.cases.smartee.section import (
    CENTRE,
    CORNERS,
    NEWTON,
    OUTSIDE,
    PREVIOUS,
    PUBLISHED,
    RANDOM,
    VALIDATION,
    OutsidePoses,
)
from flexik.kinematics.status import NOT_CONVERGED, OTHER_BRANCH, REACHED, SINGULAR
from flexik.reporting.report import Content
from flexik.reporting.style import MM
from flexik.reporting.tables import Table

ANGLE = "angle_error"
STATUS_NAMES = {
    REACHED: "converged",
    NOT_CONVERGED: "not converged",
    SINGULAR: "singular",
    OTHER_BRANCH: "other branch",
}
# Elbows farther than this from the right ones, after Newton steps, belong to another pose, rad
RIGHT = 1e-6
N_STRETCHES = 5
# What STEPS Newton steps after a network are to reach, rad
TARGET = 1e-9
DRAWN = ("goal", "5 %", "median", "95 %")
TIMES = {"single (us)": "microseconds_single", "batched (us)": "microseconds_batched"}


def content(results: Results) -> Content:
    """Tables, metrics and values."""
    training = results.training.drop(columns="trainer", errors="ignore")
    tables = {
        "peaks": Table(peaks(results), 4),
        "restarts": Table(restarts(results), 4),
        "draws": Table(draws(results), {"meets (%)": 1} | dict.fromkeys(DRAWN, 4)),
        "other_geometries": Table(geometries(results)),
        "direct_kinematics": Table(
            direct_kinematics(results), dict(zip(TIMES, (0, 1), strict=True))
        ),
        "newton": Table(newton(results)),
        "outside": Table(outside(results)),
        "training": Table(training, 6),
    }
    return Content(tables, metrics=metrics(results), values=values(results))


def peaks(results: Results) -> pd.DataFrame:
    """A row for every quantity: the published peak, and those and means of the networks."""
    columns = [(LABELS[name], name, column) for name, column in QUANTITIES.items()]
    # what the printed orientation error is without the length of n x s
    columns.append(("orientation, unit vectors (mrad)", "orientation", ANGLE))
    rows = []
    for label, quantity, column in columns:
        row: dict[str, object] = {"error": label, "published": MM * results.published[quantity]}
        for name in GOALS:
            row[name] = MM * results.peak(name, 0, VALIDATION, column)
            row[f"{name} mean"] = MM * results.groups[name, 0, VALIDATION][column].mean()
            row[f"{name} random"] = MM * results.peak(name, 0, RANDOM, column)
            row[f"{name} corners"] = MM * results.peak(name, 0, CORNERS, column)
        rows.append(row)
    return pd.DataFrame(rows)


def restarts(results: Results) -> pd.DataFrame:
    """A row for every network and quantity: peaks of the networks of all restarts."""
    rows = []
    for name, margin in GOALS.items():
        for quantity, column in QUANTITIES.items():
            row: dict[str, object] = {"network": name, "error": LABELS[quantity]}
            row["goal"] = MM * results.published[quantity] / margin
            row["chosen"] = MM * results.peak(name, 0, VALIDATION, column)
            for conditions, suffix in ((VALIDATION, ""), (RANDOM, ", random")):
                found = MM * results.over_restarts(name, conditions, column)
                for statistic, label in (("min", "least"), ("median",) * 2, ("max", "largest")):
                    row[label + suffix] = found.agg(statistic)
            rows.append(row)
    return pd.DataFrame(rows)


def draws(results: Results) -> pd.DataFrame:
    """How much a peak hangs on the poses: sets as large as the validation, of the random ones.

    A row for every network with a goal and quantity, and one for all three at once.
    """
    given, n_poses = results.section.studies.draws, len(results.groups[PUBLISHED, 0, VALIDATION])
    rows: list[dict[str, object]] = []
    for name, margin in GOALS.items():
        table = results.groups[name, 0, RANDOM]
        generator = np.random.default_rng(given.seed)
        drawn = generator.integers(0, len(table), (given.n_draws, n_poses))
        met = []
        for quantity, column in QUANTITIES.items():
            found = MM * table[column].to_numpy()[drawn].max(axis=1)
            goal = MM * results.published[quantity] / margin
            met.append(found <= goal)
            numbers = (goal, *np.quantile(found, (0.05, 0.5, 0.95)))
            row = {
                "network": name,
                "error": LABELS[quantity],
                **dict(zip(DRAWN, numbers, strict=True)),
            }
            rows.append(row | {"meets (%)": 100.0 * met[-1].mean()})
        share = 100.0 * np.all(met, axis=0).mean()
        blank = dict.fromkeys(DRAWN, np.nan)
        rows.append({"network": name, "error": "all three", **blank, "meets (%)": share})
    return pd.DataFrame(rows)


def geometries(results: Results) -> pd.DataFrame:
    """A row for the assumed dimensions, and for each of the others."""
    found = results.geometries
    lengths = {"base (mm)": "base_radius", "plate (mm)": "plate_radius", "height (mm)": "height"}
    return pd.DataFrame(
        {
            "dimensions": found["name"],
            **{label: [f"{MM * v:g}" for v in found[column]] for label, column in lengths.items()},
            "reached (%)": 100.0 * found["reached_share"],
            "median condition": found["median_condition"],
            "largest condition": found["largest_condition"],
        }
    )


def direct_kinematics(results: Results) -> pd.DataFrame:
    """A row for every method and number of Newton steps: peaks (rad), and times of the benchmark.

    A step from the previous pose costs what one from the centre costs; poses of a path have to wait
    for one another, so there is no batch of them.
    """
    section, times = results.section, results.query_times.set_index(["method", "n_steps"])
    paths = [name for name, poses in section.conditions.items() if poses.kind == "path"]
    rows = []
    for name, method in section.methods.items():
        for n_steps in method.n_steps[name == CENTRE :]:
            fixed = method.tolerance is None
            row: dict[str, object] = {"start": method.start}
            row["Newton steps"] = str(n_steps) if fixed else "until converged"
            for conditions in (VALIDATION, RANDOM, *paths):
                row[conditions] = scientific(results.peak(name, n_steps, conditions))
            key = (CENTRE if name == PREVIOUS else name, n_steps)
            for title, column in list(TIMES.items())[: 1 if name == PREVIOUS else 2]:
                row[title] = times[column].get(key, np.nan)
            rows.append(row)
    return pd.DataFrame(rows)


def outside(results: Results) -> pd.DataFrame:
    """A row for every stretch of extent: elbow errors of the networks, and what Newton finds."""
    poses = results.section.conditions[OUTSIDE]
    assert isinstance(poses, OutsidePoses)  # the section sees to it
    limits = np.linspace(1.0, poses.extent, N_STRETCHES)
    rows = []
    for low, high in zip([0.0, *limits[:-1]], limits, strict=True):

        def within(table: pd.DataFrame, low: float = low, high: float = high) -> pd.DataFrame:
            return table[(table["extent"] > low) & (table["extent"] <= high)]

        row: dict[str, object] = {"extent": f"{low:g} to {high:g}"}
        for name in GOALS:
            errors = MM * within(results.groups[name, 0, OUTSIDE])["error"]
            row[f"{name} median (mrad)"] = float(errors.median())
            row[f"{name} peak (mrad)"] = float(errors.max())
            after = within(results.groups[name, STEPS, OUTSIDE])
            row[f"{name} + {STEPS} steps right (%)"] = 100.0 * (after["error"] <= RIGHT).mean()
        part = within(newton_groups(results)[OUTSIDE])
        row["Newton from the centre right (%)"] = 100.0 * float(right(part).mean())
        rows.append(row)
    return pd.DataFrame(rows)


def newton(results: Results) -> pd.DataFrame:
    """How many poses ended with which status, and how many steps they took."""
    rows = []
    for conditions, group in newton_groups(results).items():
        row: dict[str, object] = {"poses": conditions, "number": len(group)}
        row |= {
            name: int((group["status"] == status).sum()) for status, name in STATUS_NAMES.items()
        }
        found = group[group["status"] == REACHED]
        row["to wrong elbows"] = int((~right(found)).sum())
        row["mean steps"] = float(found["steps"].mean())
        row["most steps"] = int(found["steps"].max()) if len(found) else 0
        row["largest residual"] = scientific(float(found["residual"].max()))
        rows.append(row)
    return pd.DataFrame(rows)


def newton_groups(results: Results) -> dict[str, pd.DataFrame]:
    """Rows of Newton's method until it converges, by conditions."""
    return {key[2]: rows for key, rows in results.groups.items() if key[0] == NEWTON}


def right(table: pd.DataFrame) -> pd.Series:
    """Rows with the elbows of their pose, and a status that says so."""
    return (table["status"] == REACHED) & (table["error"] <= RIGHT)


def n_wrong(results: Results, n_steps: int) -> dict[str, int]:
    """How often PUBLISHED and fixed steps beyond the box are wrong, unnoticed, and false alarms.

    What is noticed has a status that is not REACHED.
    """
    table = results.groups[PUBLISHED, n_steps, OUTSIDE]
    wrong, noticed = ~(table["error"] <= RIGHT), table["status"] != REACHED
    found = {"all": wrong, "hidden": wrong & ~noticed, "alarms": ~wrong & noticed}
    return {name: int(rows.sum()) for name, rows in found.items()}


def metrics(results: Results) -> dict[str, float | None]:
    """Flat, four digits; null for what is not finite."""
    found: dict[str, float] = {}
    for name in GOALS:
        for conditions, prefix in ((VALIDATION, ""), (RANDOM, "random_"), (CORNERS, "corners_")):
            for quantity, column in QUANTITIES.items():
                key = f"{name}.{prefix}peak_{quantity}_{UNITS[quantity]}"
                factor = FACTORS[UNITS[quantity]]
                spread = factor * results.over_restarts(name, conditions, column)
                found[key] = factor * results.peak(name, 0, conditions, column)
                found |= {f"{key}_median": spread.median(), f"{key}_largest": spread.max()}
    for row in draws(results).query("error == 'all three'").to_dict("records"):
        found[f"{row['network']}.draws_share"] = 0.01 * row["meets (%)"]
    for n_steps in range(1, STEPS + 1):
        for conditions, prefix in ((VALIDATION, ""), (RANDOM, "random_")):
            key = f"newton{n_steps}.{prefix}peak_elbow_rad"
            found[key] = results.peak(PUBLISHED, n_steps, conditions)
        wrong = n_wrong(results, n_steps)
        found[f"newton{n_steps}.outside_n_failed"] = wrong["all"]
        found[f"newton{n_steps}.outside_n_unnoticed"] = wrong["hidden"]
    for conditions, group in newton_groups(results).items():
        found[f"newton.{conditions}_n_failed"] = int((~right(group)).sum())
    for row in newton(results).to_dict("records"):
        found[f"newton.{row['poses']}_n_wrong"] = row["to wrong elbows"]
        found[f"newton.{row['poses']}_mean_steps"] = row["mean steps"]
    found["closure.largest_condition_number"] = results.geometries["largest_condition"].iloc[0]
    return {key: _four_digits(value) for key, value in found.items()}


def _four_digits(value: float) -> float | None:
    if isinstance(value, int):
        return value
    return float(f"{value:.4g}") if np.isfinite(value) else None


def values(results: Results) -> dict[str, Any]:
    """Numbers for the sentences."""
    section = results.section
    return {
        "section": section,
        "goals": [_goal(results, name, margin) for name, margin in GOALS.items()],
        "corners": _ratios(results, lambda column: results.peak(PUBLISHED, 0, CORNERS, column)),
        "n_poses": {key[2]: len(rows) for key, rows in results.groups.items() if not key[1]},
        "all_three": draws(results).query("error == 'all three'").to_dict("records"),
        "own": results.geometries.iloc[0].to_dict(),
        "numbers": {"steps": STEPS, "target": TARGET, "right": RIGHT},
        "peak": results.peak,
        "like": next(
            (
                n_steps
                for n_steps in section.methods[CENTRE].n_steps
                if results.peak(CENTRE, n_steps, RANDOM) <= results.peak(PUBLISHED, STEPS, RANDOM)
            ),
            None,
        ),
        "times": {
            (row["method"], row["n_steps"]): row for row in results.query_times.to_dict("records")
        },
        "n_by_test": {
            name: int(rows["stop_reason"].isin(("goal", "stationary")).sum())
            for name, rows in results.training.groupby("network")
        },
        "wrong": n_wrong(results, STEPS),
        "wrong_newton": {
            row["poses"]: row["to wrong elbows"]
            for row in newton(results).to_dict("records")
            if row["to wrong elbows"]
        },
    }


def _ratios(results: Results, peak: Callable[[str], float]) -> dict[str, float]:
    """Largest error by column, over the published peak of each quantity."""
    return {q: peak(column) / results.published[q] for q, column in QUANTITIES.items()}


def _goal(results: Results, name: str, margin: float) -> dict[str, Any]:
    """Peaks of a network over the published ones, also in the median of the restarts; misses."""
    spread = functools.partial(results.over_restarts, name, VALIDATION)
    found = {
        "chosen": _ratios(results, lambda column: results.peak(name, 0, VALIDATION, column)),
        "median": _ratios(results, lambda column: spread(column).median()),
    }
    missed = {key: [q for q, r in d.items() if margin * r > 1.0] for key, d in found.items()}
    angles = [results.peak(name, 0, VALIDATION, c) for c in (QUANTITIES["orientation"], ANGLE)]
    return {"name": name, "margin": margin, "missed": missed, "angles": angles, **found}
