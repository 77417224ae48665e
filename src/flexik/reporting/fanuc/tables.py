"""Tables of the six-joint arm; percent, mm and degrees."""

import itertools
from pathlib import Path

import numpy as np
import pandas as pd

from flexik.evaluation.fanuc.errors import statistics, within
from flexik.kinematics.fanuc import ELBOW, N_CONFIGURATIONS, SHOULDER, WRIST
from flexik.reporting.fanuc import notes
from flexik.reporting.fanuc.notes import DEGREES, NAMES, PASS_ERRORS, SINGULAR_EDGES
from flexik.reporting.fanuc.results import (
    EXACT,
    LOOKED_UP,
    PUBLISHED_NETWORKS,
    WHOLE,
    Results,
    label,
)
from flexik.reporting.style import MM
from flexik.reporting.tables import write_table

NOT_AVAILABLE = "not available"


def write_tables(results: Results, folder: Path) -> None:
    """Write all tables as CSV and Markdown."""
    _write_networks(results, folder)
    _write_study(results, folder)
    _write_off_path(results, folder)
    _write_workspace(results, folder)


def _write_networks(results: Results, folder: Path) -> None:
    write_table(
        folder / "joints",
        joints(results),
        {"d (m)": 3, "a (m)": 3},
        "Standard Denavit-Hartenberg table and joint limits.",
    )
    write_table(
        folder / "total_errors",
        total_errors(results),
        3,
        "Total error of each joint on the test samples, percent of its range (after table 5.1): "
        "median (least to largest) over the starts.",
        notes.total_errors(results),
    )
    write_table(
        folder / "passes",
        passes(results),
        0,
        "Passes over the training samples (steps, of Levenberg-Marquardt) from which on the "
        "root mean square training error stays below a share of the joint's range; empty: never.",
        notes.passes(results),
    )
    write_table(
        folder / "path_errors",
        path_errors(results),
        {"max position (mm)": 3, "mean position (mm)": 3},
        "Where the end effector comes to stand on the path's test samples.",
        notes.path_errors(results),
    )


def _write_study(results: Results, folder: Path) -> None:
    for varied, decimals in (("n_hidden", 0), ("learning_factor", 3)):
        table = study(results, varied)
        write_table(
            folder / f"study_{varied}",
            table,
            dict.fromkeys(table.columns[2:-1], 3) | {table.columns[0]: decimals},
            f"Joint {results.fanuc.study.joint}: {results.fanuc.study.n_restarts} starts, "
            f"{results.fanuc.trainers[results.fanuc.study.trainer].n_iterations} passes.",
            notes.study(results, varied),
        )


def _write_off_path(results: Results, folder: Path) -> None:
    write_table(
        folder / "off_path",
        off_path(results, "position_error", MM),
        2,
        "Mean position error (mm) at targets beside the path.",
        notes.off_path(results),
    )
    write_table(
        folder / "off_path_orientation",
        off_path(results, "orientation_error", DEGREES),
        2,
        "Mean orientation error (deg) at the same targets.",
    )
    write_table(
        folder / "off_path_success",
        off_path_success(results),
        1,
        f"Targets reached (%), {notes.success(results)}.",
    )


def _write_workspace(results: Results, folder: Path) -> None:
    write_table(
        folder / "whole_workspace",
        whole_workspace(results),
        {"single (us)": 0, "batched (us)": 2},
        "Random poses of all arm configurations.",
        notes.whole_workspace(results),
    )
    write_table(
        folder / "configurations",
        configurations(results),
        2,
        "The same by arm configuration.",
        [f"reached after k steps: {notes.success(results)}."],
    )
    write_table(
        folder / "conditioning",
        conditioning(results),
        1,
        f"Poses reached (%) by how close to singular they are: {notes.success(results)}.",
        notes.conditioning(results),
    )
    write_table(
        folder / "growth",
        results.growth.rename(columns=GROWTH_NAMES),
        {"core seconds": 0, "mean position (mm)": 1, "reached after 3 steps (%)": 1},
        "One arm configuration (number 0): what more neurons and more passes buy.",
        notes.growth(results),
    )


GROWTH_NAMES = {
    "n_hidden": "hidden neurons",
    "n_iterations": "passes",
    "seconds": "core seconds",
    "mean_position_error_mm": "mean position (mm)",
    "mean_orientation_error_deg": "mean orientation (deg)",
    "success_percent": "reached after 3 steps (%)",
}


def joints(results: Results) -> pd.DataFrame:
    """Denavit-Hartenberg table; degrees and m."""
    rows = [
        {
            "joint": number,
            "offset (deg)": DEGREES * joint.offset,
            "d (m)": joint.d,
            "a (m)": joint.a,
            "alpha (deg)": DEGREES * joint.alpha,
            "minimum (deg)": DEGREES * joint.minimum,
            "maximum (deg)": DEGREES * joint.maximum,
        }
        for number, joint in enumerate(results.fanuc.joints, start=1)
    ]
    return pd.DataFrame(rows)


def total_errors(results: Results) -> pd.DataFrame:
    """A row a joint and one for their mean; the published value beside each configuration."""
    columns: dict[str, list[object]] = {"joint": [*range(1, 7), "mean"]}
    for name in results.networks:
        starts = results.starts[results.starts["network"] == name]
        groups = [starts.loc[starts["joint"] == joint, "error_percent"] for joint in range(1, 7)]
        columns[f"{name} (%)"] = [
            _spread(values) for values in [*groups, results.start_means[name].dropna()]
        ]
        if name in PUBLISHED_NETWORKS:
            columns[f"{name} published"] = published(results.published, name)
    for name in LOOKED_UP:
        values = results.error_percents[name]
        columns[f"{name} (%)"] = [*values, float(values.mean())]
    return pd.DataFrame(columns, dtype=object)


def _spread(values: pd.Series) -> str:
    """Median, and the range of several."""
    if len(values) == 1:
        return f"{values.iloc[0]:.3g}"
    return f"{values.median():.3g} ({values.min():.3g} to {values.max():.3g})"


def published(table: pd.DataFrame, name: str) -> list[object]:
    """Six published values of network `name` and their mean, NOT_AVAILABLE where there is none."""
    by_joint = table.set_index("joint")[name]
    values = [float(by_joint.get(joint, np.nan)) for joint in range(1, 7)]
    values.append(float(np.mean(values)))
    return [NOT_AVAILABLE if np.isnan(value) else value for value in values]


def passes(results: Results) -> pd.DataFrame:
    """Passes from which on the training error of each joint stays below PASS_ERRORS."""
    columns: dict[str, list[object]] = {"joint": list(range(1, 7))}
    needed = notes.passes_needed(results)
    for name, error in itertools.product(results.networks, PASS_ERRORS):
        some = needed[(needed["network"] == name) & (needed["error"] == error)]
        medians = some.groupby("joint")["passes"].quantile(0.5, interpolation="higher")
        counts = [int(medians[j]) if np.isfinite(medians[j]) else None for j in range(1, 7)]
        columns[f"{name} to {100 * error:g} %"] = [*counts]
    return pd.DataFrame(columns, dtype=object)


def path_errors(results: Results) -> pd.DataFrame:
    """Position and orientation errors of every method on the path."""
    return _error_rows(results.on_path)


def _error_rows(by_method: dict[str, dict[str, float]]) -> pd.DataFrame:
    rows = [
        {
            "method": name,
            "mean position (mm)": MM * values["mean_position_error"],
            "max position (mm)": MM * values["max_position_error"],
            "mean orientation (deg)": DEGREES * values["mean_orientation_error"],
            "max orientation (deg)": DEGREES * values["max_orientation_error"],
            "reached (%)": 100.0 * values["success_rate"],
        }
        for name, values in by_method.items()
    ]
    return pd.DataFrame(rows)


def study(results: Results, varied: str) -> pd.DataFrame:
    """Errors of one joint by what was varied, over the starts."""
    table = results.study[results.study["varied"] == varied]
    rows = []
    for value, group in table.groupby("value"):
        errors = group["error_percent"]
        number = int(np.float64(str(value))) if varied == "n_hidden" else value
        rows.append(
            {
                NAMES[varied]: number,
                "starts": len(group),
                "median total error (%)": errors.median(),
                "least (%)": errors.min(),
                "largest (%)": errors.max(),
                "median training error (%)": group["training_percent"].median(),
                "ended early": int((group["stop_reason"] != "iterations").sum()),
            }
        )
    return pd.DataFrame(rows)


def off_path(results: Results, column: str, unit: float) -> pd.DataFrame:
    """Mean of an error by distance from the path, a row a method with and without steps."""
    return _by_distance(results, results.off_path[column] * unit)


def off_path_success(results: Results) -> pd.DataFrame:
    """Share of the targets reached, by distance, in percent."""
    reached = within(results.off_path, results.success)
    return _by_distance(results, 100.0 * reached)


def _by_distance(results: Results, values: pd.Series) -> pd.DataFrame:
    """Means of `values`, one a row of off_path: a row a method, a column a distance."""
    frame, rows = results.off_path.assign(value=values), []
    for name in frame["method"].unique():
        for n_steps in sorted(frame.loc[frame["method"] == name, "n_steps"].unique()):
            chosen = frame[(frame["method"] == name) & (frame["n_steps"] == n_steps)]
            means = chosen.groupby("distance")["value"].mean()
            row: dict[str, object] = {"method": label(name, n_steps)}
            for distance in results.fanuc.off_path.distances:
                row[f"{MM * distance:g} mm"] = means.get(distance, np.nan)
            rows.append(row)
    return pd.DataFrame(rows)


def whole_workspace(results: Results) -> pd.DataFrame:
    """Errors at random poses, and the time a pose takes where it was measured."""
    table = _error_rows(results.on_targets)
    medians = [MM * values["median_position_error"] for values in results.on_targets.values()]
    table.insert(2, "median position (mm)", medians)
    times = results.times.set_index("method")
    for kind in ("single", "batched"):
        column = times[f"microseconds_{kind}"]
        table[f"{kind} (us)"] = [column.get(method, np.nan) for method in table["method"]]
    extra = [name for name in times.index if name not in set(table["method"])]
    rows = [
        {
            "method": name,
            "single (us)": times["microseconds_single"][name],
            "batched (us)": times["microseconds_batched"][name],
        }
        for name in extra
    ]
    return pd.concat([table, pd.DataFrame(rows)], ignore_index=True) if rows else table


def conditioning(results: Results) -> pd.DataFrame:
    """Share of the poses reached by the smallest singular value of the Jacobian there."""
    frame = results.workspace
    edges = [0.0, *SINGULAR_EDGES, np.inf]
    reached = within(frame, results.success)
    rows = []
    for low, high in itertools.pairwise(edges):
        chosen = (frame["singular_value"] >= low) & (frame["singular_value"] < high)
        exact = chosen & (frame["method"] == EXACT)
        upper = "" if np.isinf(high) else f" to {high:g}"
        row: dict[str, object] = {
            "smallest singular value (m)": f"{low:g}{upper}" if upper else f"over {low:g}",
            "poses": int(exact.sum()),
        }
        for n_steps in range(results.fanuc.refinement.n_steps + 1):
            some = chosen & (frame["method"] == WHOLE) & (frame["n_steps"] == n_steps)
            row[label(WHOLE, n_steps)] = 100.0 * float(reached[some].mean())
        row[EXACT] = 100.0 * float(reached[exact].mean())
        rows.append(row)
    return pd.DataFrame(rows)


def configurations(results: Results) -> pd.DataFrame:
    """Errors of the networks of the whole workspace by arm configuration."""
    frame = results.workspace
    rows = []
    for number in range(N_CONFIGURATIONS):
        row: dict[str, object] = {
            "configuration": number,
            "shoulder": "back" if number & SHOULDER else "front",
            "elbow": "negative" if number & ELBOW else "positive",
            "wrist": "negative" if number & WRIST else "positive",
        }
        for n_steps in range(results.fanuc.refinement.n_steps + 1):
            chosen = frame[
                (frame["method"] == WHOLE)
                & (frame["n_steps"] == n_steps)
                & (frame["configuration"] == number)
            ]
            values = statistics(chosen, results.success)
            if n_steps == 0:
                row["mean position (mm)"] = MM * values["mean_position_error"]
                row["mean orientation (deg)"] = DEGREES * values["mean_orientation_error"]
            else:
                row[f"reached after {n_steps} (%)"] = 100.0 * values["success_rate"]
        exact = frame[(frame["method"] == EXACT) & (frame["configuration"] == number)]
        row[f"{EXACT} (%)"] = 100.0 * statistics(exact, results.success)["success_rate"]
        rows.append(row)
    return pd.DataFrame(rows)
