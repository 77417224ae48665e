"""The report of the SmartEE: tables, metrics, and what the sentences of its page hold.

Conditions and methods stand here by the names that the section asks for.
"""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee import report_starts
from flexik.cases.smartee.report_figures import figures
from flexik.cases.smartee.report_results import (
    GOALS,
    LABELS,
    PUBLISHED_FILE,
    QUANTITIES,
    STEPS,
    UNITS,
    Results,
    read,
    scientific,
)
from flexik.cases.smartee.section import Section
from flexik.kinematics.status import NOT_CONVERGED, OTHER_BRANCH, REACHED, SINGULAR
from flexik.learning.starts import by_trainer
from flexik.reporting.report import Content, write_section
from flexik.reporting.style import MM
from flexik.reporting.tables import Column, Table, mm, spread, table

TEMPLATE = Path(__file__).with_name("page.md.j2")
ANGLE = "angle_error"
STATUS_NAMES = {
    "converged": REACHED,
    "not converged": NOT_CONVERGED,
    "singular": SINGULAR,
    "other branch": OTHER_BRANCH,
}
# Elbows farther than this from the right ones, after Newton steps, belong to another pose, rad
RIGHT = 1e-6
N_STRETCHES = 5
# What STEPS Newton steps after a network are to reach, rad
TARGET = 1e-9
DRAWN = ("goal", "5 %", "median", "95 %")
# Sets of poses by the prefix of their metrics
PREFIXES = {"": "validation", "random_": "random", "corners_": "corners"}
GEOMETRIES = {
    "dimensions": "name",
    "base (mm)": mm("base_radius", 0),
    "plate (mm)": mm("plate_radius", 0),
    "height (mm)": mm("height", 0),
    "reached (%)": Column("reached_share", scale=100.0),
    "median condition": "median_condition",
    "largest condition": "largest_condition",
}


def report(section: Section) -> None:
    """Write reports/NAME from data/NAME."""
    write_section(section, TEMPLATE, content(read(section)), [PUBLISHED_FILE])


def content(results: Results) -> Content:
    """All of the page."""
    return Content(tables(results), figures(results), metrics(results), values(results))


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    training = results.training.drop(columns="trainer", errors="ignore")
    times = {"single (us)": 0, "batched (us)": 1}
    return {
        "peaks": Table(peaks(results), 4),
        "restarts": Table(restarts(results), 4),
        "draws": Table(draws(results), {"meets (%)": 1} | dict.fromkeys(DRAWN, 4)),
        "other_geometries": table(results.geometries, GEOMETRIES),
        "direct_kinematics": Table(direct_kinematics(results), times),
        "newton": Table(newton(results)),
        "outside": Table(outside(results)),
        "training": Table(training, 6),
        **report_starts.tables(results),
    }


def peaks(results: Results) -> pd.DataFrame:
    """A row for every quantity: the published peak, and those and means of the networks."""
    columns = [(LABELS[quantity], quantity, column) for quantity, column in QUANTITIES.items()]
    # what the printed orientation error is without the length of n x s
    columns.append(("orientation, unit vectors (mrad)", "orientation", ANGLE))
    rows = []
    for label, quantity, column in columns:
        row: dict[str, object] = {"error": label, "published": MM * results.published[quantity]}
        for name in GOALS:
            row[name] = MM * results.peak(name, 0, "validation", column)
            row[f"{name} mean"] = MM * results.groups[name, 0, "validation"][column].mean()
            row[f"{name} random"] = MM * results.peak(name, 0, "random", column)
            row[f"{name} corners"] = MM * results.peak(name, 0, "corners", column)
        rows.append(row)
    return pd.DataFrame(rows)


def restarts(results: Results) -> pd.DataFrame:
    """A row for every network and quantity: peaks of the networks of all restarts."""
    rows = []
    for (name, margin), (quantity, column) in itertools.product(GOALS.items(), QUANTITIES.items()):
        row: dict[str, object] = {"network": name, "error": LABELS[quantity]}
        row["goal"] = MM * results.published[quantity] / margin
        row["chosen"] = MM * results.peak(name, 0, "validation", column)
        for conditions, suffix in (("validation", ""), ("random", ", random")):
            found = spread(MM * results.over_restarts(name, conditions, column))
            row |= {f"{label}{suffix}": value for label, value in found.items()}
        rows.append(row)
    return pd.DataFrame(rows)


def draws(results: Results) -> pd.DataFrame:
    """How much a peak hangs on the poses: sets as large as the validation, of the random ones.

    A row for every network with a goal and quantity, and one for all three at once.
    """
    given, n_poses = results.section.studies.draws, len(results.groups["network", 0, "validation"])
    rows: list[dict[str, object]] = []
    for name, margin in GOALS.items():
        errors = results.groups[name, 0, "random"]
        generator = np.random.default_rng(given.seed)
        drawn = generator.integers(0, len(errors), (given.n_draws, n_poses))
        met = np.full(given.n_draws, True)
        for quantity, column in QUANTITIES.items():
            found = MM * errors[column].to_numpy()[drawn].max(axis=1)
            goal = MM * results.published[quantity] / margin
            numbers = dict(zip(DRAWN, (goal, *np.quantile(found, (0.05, 0.5, 0.95))), strict=True))
            share = {"meets (%)": 100.0 * (found <= goal).mean()}
            rows.append({"network": name, "error": LABELS[quantity], **numbers, **share})
            met &= found <= goal
        rows.append({"network": name, "error": "all three", "meets (%)": 100.0 * met.mean()})
    return pd.DataFrame(rows)


def direct_kinematics(results: Results) -> pd.DataFrame:
    """A row for every method and number of Newton steps: peaks (rad), and times of the benchmark.

    A step from the previous pose costs what one from the centre costs; poses of a path have to wait
    for one another, so there is no batch of them.
    """
    section, times = results.section, results.query_times.set_index(["method", "n_steps"])
    paths = [name for name, poses in section.conditions.items() if poses.kind == "path"]
    rows = []
    for name, method in section.methods.items():
        for n_steps in method.n_steps[name == "centre" :]:
            key = ("centre" if name == "previous" else name, n_steps)
            batched = times["microseconds_batched"].get(key, np.nan)
            peaks = {p: results.peak(name, n_steps, p) for p in ("validation", "random", *paths)}
            rows.append(
                {
                    "start": method.start,
                    "Newton steps": str(n_steps) if method.tolerance is None else "until converged",
                    **{conditions: scientific(peak) for conditions, peak in peaks.items()},
                    "single (us)": times["microseconds_single"].get(key, np.nan),
                    "batched (us)": np.nan if name == "previous" else batched,
                }
            )
    return pd.DataFrame(rows)


def outside(results: Results) -> pd.DataFrame:
    """A row for every stretch of extent: elbow errors of the networks, and what Newton finds."""
    poses: Any = results.section.conditions["outside"]
    edges = [0.0, *np.linspace(1.0, poses.extent, N_STRETCHES)]
    labels = [f"{low:g} to {high:g}" for low, high in itertools.pairwise(edges)]

    def by_stretch(rows: pd.DataFrame, values: pd.Series) -> Any:
        return values.groupby(pd.cut(rows["extent"], edges, labels=labels), observed=False)

    columns = {}
    for name in GOALS:
        start, after = (results.groups[name, n_steps, "outside"] for n_steps in (0, STEPS))
        errors, met = by_stretch(start, MM * start["error"]), after["error"] <= RIGHT
        columns[f"{name} median (mrad)"] = errors.median()
        columns[f"{name} peak (mrad)"] = errors.max()
        columns[f"{name} + {STEPS} steps right (%)"] = 100.0 * by_stretch(after, met).mean()
    found = newton_groups(results)["outside"]
    columns["Newton from the centre right (%)"] = 100.0 * by_stretch(found, right(found)).mean()
    return pd.DataFrame(columns).reset_index()


def newton(results: Results) -> pd.DataFrame:
    """How many poses ended with which status, and how many steps they took."""
    rows = []
    for conditions, group in newton_groups(results).items():
        found = group[group["status"] == REACHED]
        ends = {name: int((group["status"] == code).sum()) for name, code in STATUS_NAMES.items()}
        rows.append(
            {
                "poses": conditions,
                "number": len(group),
                **ends,
                "to wrong elbows": int((~right(found)).sum()),
                "mean steps": float(found["steps"].mean()),
                "most steps": int(found["steps"].max()) if len(found) else 0,
                "largest residual": scientific(float(found["residual"].max())),
            }
        )
    return pd.DataFrame(rows)


def newton_groups(results: Results) -> dict[str, pd.DataFrame]:
    """Rows of Newton's method until it converges, by conditions."""
    return {key[2]: rows for key, rows in results.groups.items() if key[0] == "newton"}


def right(rows: pd.DataFrame) -> pd.Series:
    """Rows with the elbows of their pose, and a status that says so."""
    return (rows["status"] == REACHED) & (rows["error"] <= RIGHT)


def n_wrong(results: Results, n_steps: int) -> dict[str, int]:
    """How often the network and fixed steps beyond the box are wrong, unnoticed; false alarms.

    What is noticed has a status that is not REACHED.
    """
    rows = results.groups["network", n_steps, "outside"]
    wrong, noticed = ~(rows["error"] <= RIGHT), rows["status"] != REACHED
    found = {"all": wrong, "hidden": wrong & ~noticed, "alarms": ~wrong & noticed}
    return {name: int(which.sum()) for name, which in found.items()}


def metrics(results: Results) -> dict[str, float | None]:
    """Flat, four digits; null for what is not finite."""
    found: dict[str, float] = {}
    kinds = itertools.product(GOALS, PREFIXES.items(), QUANTITIES.items())
    for name, (prefix, conditions), (quantity, column) in kinds:
        unit, factor = UNITS[quantity]
        key = f"{name}.{prefix}peak_{quantity}_{unit}"
        peaks = factor * results.over_restarts(name, conditions, column)
        found[key] = factor * results.peak(name, 0, conditions, column)
        found |= {f"{key}_median": peaks.median(), f"{key}_largest": peaks.max()}
    for row in draws(results).query("error == 'all three'").to_dict("records"):
        found[f"{row['network']}.draws_share"] = 0.01 * row["meets (%)"]
    for n_steps in range(1, STEPS + 1):
        for prefix, conditions in list(PREFIXES.items())[:2]:
            key = f"newton{n_steps}.{prefix}peak_elbow_rad"
            found[key] = results.peak("network", n_steps, conditions)
        wrong = n_wrong(results, n_steps)
        found[f"newton{n_steps}.outside_n_failed"] = wrong["all"]
        found[f"newton{n_steps}.outside_n_unnoticed"] = wrong["hidden"]
    for row in newton(results).to_dict("records"):
        key, n_wrong_elbows = f"newton.{row['poses']}", row["to wrong elbows"]
        found[f"{key}_n_failed"] = row["number"] - row["converged"] + n_wrong_elbows
        found |= {f"{key}_n_wrong": n_wrong_elbows, f"{key}_mean_steps": row["mean steps"]}
    found["closure.largest_condition_number"] = results.geometries["largest_condition"].iloc[0]
    for row in by_trainer(results.starts).to_dict("records"):
        for key in ("success_share", "median_error"):
            found[f"starts.{row['trainer']}.{row['spread']}.{key}"] = row[key]
    return {key: _four_digits(value) for key, value in found.items()}


def _four_digits(value: float) -> float | None:
    if isinstance(value, int):
        return value
    return float(f"{value:.4g}") if np.isfinite(value) else None


def values(results: Results) -> dict[str, Any]:
    """Numbers for the sentences."""
    section, peak = results.section, results.peak
    near = peak("network", STEPS, "random")
    wrong_elbows = newton(results).set_index("poses")["to wrong elbows"]
    steps = section.methods["centre"].n_steps
    ends = results.training.groupby("network")["stop_reason"]
    return {
        "results": results,
        "section": section,
        "goals": [_goal(results, name, margin) for name, margin in GOALS.items()],
        "corners": _ratios(results, "network", "corners"),
        "n_poses": {key[2]: len(rows) for key, rows in results.groups.items() if not key[1]},
        "all_three": draws(results).query("error == 'all three'").to_dict("records"),
        "own": results.geometries.iloc[0].to_dict(),
        "numbers": {"steps": STEPS, "target": TARGET, "right": RIGHT},
        "peak": peak,
        # steps from the centre that come as near as the network's
        "like": next((n for n in steps if peak("centre", n, "random") <= near), None),
        "times": {(r["method"], r["n_steps"]): r for r in results.query_times.to_dict("records")},
        "n_by_test": {name: int(rows.isin(("goal", "stationary")).sum()) for name, rows in ends},
        "wrong": n_wrong(results, STEPS),
        "wrong_newton": wrong_elbows[wrong_elbows > 0].to_dict(),
        **report_starts.values(results),
    }


def _ratios(results: Results, name: str, conditions: str) -> dict[str, float]:
    """Largest errors of a network over the published peaks."""
    return {
        quantity: results.peak(name, 0, conditions, column) / results.published[quantity]
        for quantity, column in QUANTITIES.items()
    }


def _goal(results: Results, name: str, margin: float) -> dict[str, Any]:
    """Peaks of a network over the published ones, also in the median of the restarts; misses.

    n_met : restarts, of n_restarts, that miss none.
    """
    peaks = {q: results.over_restarts(name, "validation", c) for q, c in QUANTITIES.items()}
    ratios = pd.DataFrame(peaks) / [results.published[quantity] for quantity in QUANTITIES]
    found: dict[str, dict] = {"chosen": _ratios(results, name, "validation")}
    found["median"] = ratios.median().to_dict()
    return {
        "name": name,
        "margin": margin,
        **found,
        "missed": {key: [q for q, r in d.items() if margin * r > 1.0] for key, d in found.items()},
        "angles": [results.peak(name, 0, "validation", c) for c in ("orientation_error", ANGLE)],
        "n_met": int((margin * ratios <= 1.0).all(axis=1).sum()),
        "n_restarts": len(ratios),
    }
