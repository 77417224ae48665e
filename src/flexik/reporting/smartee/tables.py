"""Tables of the SmartEE's report."""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.smartee.poses import path_name
from flexik.evaluation.smartee.errors import CORNERS, OUTSIDE
from flexik.kinematics.smartee_newton import CONVERGED
from flexik.parameters.smartee import BEST, CENTRE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting.smartee import notes, start_study
from flexik.reporting.smartee.draws import draw_notes, draws
from flexik.reporting.smartee.results import QUANTITIES, RIGHT, Results, right, scientific
from flexik.reporting.tables import write_table

MRAD = 1e3
N_STRETCHES = 5
SINGLE, BATCHED = "single (us)", "batched (us)"


def write_tables(results: Results, folder: Path) -> None:
    """Write every table of the report, CSV and Markdown, into `folder`."""
    write_table(
        folder / "peaks",
        peaks(results),
        4,
        f"Peak errors over the {len(results.of(PUBLISHED, 0, VALIDATION))} validation poses beside "
        "the published ones, over the random poses and over the corners of the box.",
        notes.peak_notes(results),
    )
    write_table(
        folder / "draws",
        draws(results),
        {"meets (%)": 1, "5 %": 4, "median": 4, "95 %": 4, "goal": 4},
        f"Peaks of {results.smartee.draws.n_draws} draws of as many poses as the validation has, "
        "from the random poses: how much a peak hangs on which poses are drawn.",
        draw_notes(results),
    )
    write_table(
        folder / "other_geometries",
        other_geometries(results),
        {"reached (%)": 2, "median condition": 2, "largest condition": 2},
        "Closure equations of other dimensions over the same box, for those that were not "
        "published.",
        notes.geometry_notes(results),
    )
    write_table(
        folder / "direct_kinematics",
        direct_kinematics(results),
        {SINGLE: 0, BATCHED: 1},
        "Peak elbow error (rad) of every way to the elbows, and what a pose costs.",
        notes.direct_notes(results),
    )
    write_table(
        folder / "starts",
        start_study.starts(results),
        {"success (%)": 1, "median elbow peak (mrad)": 2, "seconds a run": 2},
        f"Trainers from {results.smartee.starts.n_starts} starts each, near the origin and far "
        "from it.",
        start_study.start_notes(results),
    )
    write_table(
        folder / "thresholds",
        start_study.thresholds(results),
        1,
        "Share of the same runs that end at or below other errors.",
        start_study.threshold_notes(results),
    )
    chosen = results.smartee.starts.sensitivity
    write_table(
        folder / "sensitivity",
        start_study.sensitivity(results),
        1,
        f"`{chosen.trainer}` with other p and tau, from the first {chosen.n_starts} starts "
        f"{chosen.spread}.",
        start_study.sensitivity_notes(results),
    )
    write_table(
        folder / "sizes",
        sizes(results),
        6,
        "Error against the number of hidden neurons M (root mean squares of normalised outputs).",
        notes.size_notes(results),
    )
    write_table(
        folder / "outside",
        outside(results),
        2,
        "Errors inside the box (extent up to 1) and beyond it.",
        notes.outside_notes(results),
    )
    write_table(
        folder / "newton",
        newton(results),
        2,
        "Newton's method from the centre.",
        notes.newton_notes(results),
    )
    write_table(
        folder / "training",
        results.training.drop(columns="trainer"),
        6,
        "Restarts of the networks (root mean squares of normalised outputs).",
        notes.training_notes(results),
    )


def peaks(results: Results) -> pd.DataFrame:
    """A row for every quantity: the published peak, and those and means of the networks."""
    columns = [(name, name, column) for name, column in QUANTITIES.items()]
    # what the printed orientation error is without the length of n x s
    columns.append(("orientation, unit vectors", "orientation", "angle_error"))
    rows = []
    for label, quantity, column in columns:
        unit, factor = results.shown(quantity)
        row: dict[str, object] = {
            "error": f"{label} ({unit})",
            "published": factor * results.published_peak(quantity),
        }
        for name in results.smartee.networks:
            found = {
                poses: factor * results.factor(quantity) * results.of(name, 0, poses)[column]
                for poses in (VALIDATION, RANDOM, CORNERS)
            }
            row[name] = found[VALIDATION].max()
            row[f"{name} mean"] = found[VALIDATION].mean()
            row[f"{name} random"] = found[RANDOM].max()
            row[f"{name} corners"] = found[CORNERS].max()
        rows.append(row)
    return pd.DataFrame(rows)


def other_geometries(results: Results) -> pd.DataFrame:
    """A row for the assumed dimensions, and for each of the others."""
    smartee = results.smartee
    own = results.condition_numbers()
    dimensions = (
        *(smartee.geometry.base_radius, smartee.geometry.plate_radius),
        smartee.workspace.centre[2],
    )
    found = {"assumed here": (dimensions, 1.0, own)}
    for name, other in smartee.other_geometries.items():
        dimensions = (other.base_radius, other.plate_radius, other.height)
        found[name] = (dimensions, *results.conditions_of(other))
    return pd.DataFrame(
        {
            "dimensions": name,
            **{
                f"{what} (mm)": f"{1e3 * value:g}"
                for what, value in zip(("base", "plate", "height"), lengths, strict=True)
            },
            "reached (%)": 100.0 * share,
            "median condition": float(np.median(numbers)) if len(numbers) else np.nan,
            "largest condition": float(numbers.max()) if len(numbers) else np.nan,
        }
        for name, (lengths, share, numbers) in found.items()
    )


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


def sizes(results: Results) -> pd.DataFrame:
    """A row for every size: of the two sets of rows to learn from."""
    own = results.smartee.sizes
    names = {
        "training_error": "training",
        "selection_error": "selection, best start",
        "worst_selection_error": "selection, worst start",
    }
    parts = []
    for poses, table in ((own.poses, results.sizes), (own.beside, results.sizes_beside)):
        labels = {column: f"{poses}: {label}" for column, label in names.items()}
        parts.append(table.set_index("n_hidden")[list(names)].rename(columns=labels))
    return pd.concat(parts, axis=1).rename_axis("M").reset_index()


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
            after = _within(results.of(name, steps, OUTSIDE), low, high)
            share = float((after["elbow_error"] <= RIGHT).mean())
            row[f"{name} + {steps} steps right (%)"] = 100.0 * share
        part = _within(newton, low, high)
        row["Newton from the centre right (%)"] = 100.0 * float(right(part).mean())
        rows.append(row)
    return pd.DataFrame(rows)


def newton(results: Results) -> pd.DataFrame:
    """How many poses ended with which status, and how many steps they took."""
    rows = []
    for poses, group in results.newton.groupby("poses", sort=False):
        row: dict[str, object] = {"poses": str(poses), "number": len(group)}
        for status, name in notes.STATUS_NAMES.items():
            row[name] = int((group["status"] == status).sum())
        found = group[group["status"] == CONVERGED]
        row["to wrong elbows"] = int((~right(found)).sum())
        row["mean steps"] = float(found["n_steps"].mean())
        row["most steps"] = int(found["n_steps"].max()) if len(found) else 0
        row["largest residual"] = scientific(float(found["residual"].max()))
        rows.append(row)
    return pd.DataFrame(rows)


def _within(table: pd.DataFrame, low: float, high: float) -> pd.DataFrame:
    return table[(table["extent"] > low) & (table["extent"] <= high)]
