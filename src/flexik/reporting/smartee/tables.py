"""Tables of the SmartEE's report."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.smartee.poses import path_name
from flexik.evaluation.smartee.errors import OUTSIDE
from flexik.learning.starts import by_trainer
from flexik.mechanisms.smartee_newton import CONVERGED, NOT_CONVERGED, OTHER_BRANCH, SINGULAR
from flexik.parameters.smartee import BEST, CENTRE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting.smartee import notes
from flexik.reporting.smartee.results import QUANTITIES, Results
from flexik.reporting.tables import write_table

# What is smaller is rounding, rad
ROUNDING = 1e-12
# Elbows farther than this from the right ones, after Newton steps, belong to another pose, rad
RIGHT = 1e-6
MRAD = 1e3
N_STRETCHES = 5
STATUS_NAMES = {
    CONVERGED: "converged",
    NOT_CONVERGED: "not converged",
    SINGULAR: "singular",
    OTHER_BRANCH: "other branch",
}
SINGLE, BATCHED = "single (us)", "batched (us)"


def write_tables(results: Results, folder: Path) -> None:
    """Write every table of the report, CSV and Markdown, into `folder`."""
    write_table(
        folder / "peaks",
        peaks(results),
        4,
        f"Peak errors over the {len(results.of(PUBLISHED, 0, VALIDATION))} validation poses beside "
        "the published ones, and over the random poses.",
        notes.peak_notes(results),
    )
    write_table(
        folder / "direct_kinematics",
        direct_kinematics(results),
        {SINGLE: 1, BATCHED: 3},
        "Peak elbow error (rad) of every way to the elbows, and what a pose costs.",
        notes.direct_notes(results),
    )
    write_table(
        folder / "starts",
        starts(results),
        {"success (%)": 1, "median elbow peak (mrad)": 2, "seconds a run": 2},
        f"Trainers from {results.smartee.starts.n_starts} starts each, near the origin and far "
        "from it.",
        notes.start_notes(results),
    )
    write_table(
        folder / "sizes",
        sizes(results),
        6,
        "Error against the number of hidden neurons M (root mean squares of normalised outputs).",
    )
    write_table(
        folder / "outside",
        outside(results),
        2,
        "Errors inside the box (extent up to 1) and beyond it.",
        notes.outside_notes(results),
    )
    write_table(folder / "newton", newton(results), 2, "Newton's method from the centre.")
    write_table(
        folder / "training",
        results.training.drop(columns="trainer"),
        6,
        "Restarts of the networks (root mean squares of normalised outputs).",
    )


def peaks(results: Results) -> pd.DataFrame:
    """A row for every quantity: the published peak, and those and means of the networks."""
    rows = []
    for quantity, column in QUANTITIES.items():
        unit, factor = results.shown(quantity)
        row: dict[str, object] = {
            "error": f"{quantity} ({unit})",
            "published": factor * results.published_peak(quantity),
        }
        for name in results.smartee.networks:
            row[name] = factor * results.peak(name, 0, VALIDATION, quantity)
            mean = results.of(name, 0, VALIDATION)[column].mean()
            row[f"{name} mean"] = factor * results.factor(quantity) * mean
            row[f"{name} random"] = factor * results.peak(name, 0, RANDOM, quantity)
        rows.append(row)
    return pd.DataFrame(rows)


def direct_kinematics(results: Results) -> pd.DataFrame:
    """A row for every start and number of Newton steps."""
    smartee = results.smartee
    paths = [path_name(n_samples) for n_samples in smartee.path.n_samples]
    labels = results.errors[["method", "n_steps"]].drop_duplicates()
    rows = []
    for method, n_steps in labels.itertuples(index=False, name=None):
        if method == CENTRE and n_steps == 0:
            continue
        row: dict[str, object] = {"start": method, "Newton steps": str(n_steps)}
        for poses in (VALIDATION, RANDOM, *paths):
            row[poses] = scientific(results.peak(method, n_steps, poses, "elbow"))
        rows.append(row | _times(results, method, n_steps))
    solved = {poses: scientific(_solved_peak(results, poses)) for poses in (VALIDATION, RANDOM)}
    row = {"start": CENTRE, "Newton steps": "until converged", **solved}
    rows.append(row | dict.fromkeys(paths, "") | _times(results, CENTRE, notes.SOLVED))
    return pd.DataFrame(rows)


def _solved_peak(results: Results, poses: str) -> float:
    table = results.newton
    return float(table.loc[table["poses"] == poses, "elbow_error"].max())


def _times(results: Results, method: str, n_steps: int) -> dict[str, float]:
    """Of the benchmark; a step from the previous pose costs what one from the centre costs.

    Poses of a path have to wait for one another, so there is no batch of them.
    """
    table = results.query_times
    measured = CENTRE if method == PREVIOUS else method
    found = table[(table["method"] == measured) & (table["n_steps"] == n_steps)]
    columns = {SINGLE: "microseconds_single", BATCHED: "microseconds_batched"}
    return {
        name: float(found[column].iloc[0])
        if len(found) and (method, name) != (PREVIOUS, BATCHED)
        else np.nan
        for name, column in columns.items()
    }


def starts(results: Results) -> pd.DataFrame:
    """A row for every trainer and spread, with the times of the benchmark."""
    table = by_trainer(results.starts)
    times = results.training_times.set_index(["trainer", "spread"])
    reasons = results.starts.groupby(["trainer", "spread"])["stop_reason"].agg(_counted)
    rows = []
    for row in table.to_dict("records"):
        key = row["trainer"], row["spread"]
        time = times.loc[key] if key in times.index else pd.Series(dtype=float)
        rows.append(
            {
                "trainer": row["trainer"],
                "start": row["spread"],
                "success (%)": 100.0 * float(row["success_share"]),
                "least error": scientific(row["least_error"]),
                "median error": scientific(row["median_error"]),
                "largest error": scientific(row["largest_error"]),
                "median elbow peak (mrad)": MRAD * float(row["median_judged"]),
                "iterations": str(results.smartee.trainers[str(row["trainer"])].n_iterations),
                "to success": _whole(float(row["median_success_iteration"])),
                "ended by": reasons[key],
                "seconds a run": float(time.get("seconds", np.nan)),
                "median error of long runs": scientific(float(time.get("long_error", np.nan))),
            }
        )
    return pd.DataFrame(rows)


def sizes(results: Results) -> pd.DataFrame:
    """A row for every size."""
    names = {
        "n_hidden": "M",
        "training_error": "training",
        "selection_error": "selection, best start",
        "worst_selection_error": "selection, worst start",
    }
    return results.sizes[list(names)].rename(columns=names)


def outside(results: Results) -> pd.DataFrame:
    """A row for every stretch of extent: elbow errors of the networks, and what Newton finds."""
    smartee, steps = results.smartee, results.smartee.newton.network_steps
    newton = results.newton[results.newton["poses"] == OUTSIDE]
    limits = np.linspace(1.0, smartee.outside.extent, N_STRETCHES)
    rows = []
    for low, high in zip([0.0, *limits[:-1]], limits, strict=True):
        row: dict[str, object] = {"extent": f"{low:g} to {high:g}"}
        for name in (PUBLISHED, BEST):
            errors = MRAD * _within(results.of(name, 0, OUTSIDE), low, high)["elbow_error"]
            row[f"{name} median (mrad)"] = float(errors.median())
            row[f"{name} peak (mrad)"] = float(errors.max())
            after = _within(results.of(name, steps, OUTSIDE), low, high)["elbow_error"]
            row[f"{name} + {steps} steps right (%)"] = 100.0 * float((after <= RIGHT).mean())
        part = _within(newton, low, high)
        found = (part["status"] == CONVERGED) & (part["elbow_error"] <= RIGHT)
        row["Newton from the centre right (%)"] = 100.0 * float(found.mean())
        rows.append(row)
    return pd.DataFrame(rows)


def newton(results: Results) -> pd.DataFrame:
    """How many poses ended with which status, and how many steps they took."""
    rows = []
    for poses, group in results.newton.groupby("poses", sort=False):
        row: dict[str, object] = {"poses": str(poses), "number": len(group)}
        for status, name in STATUS_NAMES.items():
            row[name] = int((group["status"] == status).sum())
        found = group[group["status"] == CONVERGED]
        row["to wrong elbows"] = int((found["elbow_error"] > RIGHT).sum())
        row["mean steps"] = float(found["n_steps"].mean())
        row["most steps"] = int(found["n_steps"].max())
        rows.append(row)
    return pd.DataFrame(rows)


def scientific(value: float) -> str:
    """Three digits; what is below ROUNDING is not told apart, NaN is empty."""
    if np.isnan(value):
        return ""
    return f"{value:.2e}" if value >= ROUNDING else f"< {ROUNDING:.0e}"


def _within(table: pd.DataFrame, low: float, high: float) -> pd.DataFrame:
    return table[(table["extent"] > low) & (table["extent"] <= high)]


def _whole(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.0f}"


def _counted(reasons: Sequence[str]) -> str:
    counts = pd.Series(reasons).value_counts()
    return ", ".join(f"{reason}: {count}" for reason, count in sorted(counts.items()))
