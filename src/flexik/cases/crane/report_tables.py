"""Tables of the crane's report, beside those of Rouvinen 1999."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from flexik.cases.crane.report_results import Results
from flexik.evaluation.errors import (
    comparison,
    statistics_without,
    workspace_statistics,
    worst_points,
)
from flexik.learning.size_rules import haykin, haykin_samples, oja
from flexik.positioning.inverted_network import InvertedSettings
from flexik.reporting import style
from flexik.reporting.style import MM
from flexik.reporting.tables import Column, Table, mm, table

# As in the thesis' table of simulated positioning errors
STATISTIC_NAMES = {
    "max_abs_dx": "max |dX| (mm)",
    "max_abs_dy": "max |dY| (mm)",
    "max_error": "max R (mm)",
    "mean_abs_dx": "mean |dX| (mm)",
    "mean_abs_dy": "mean |dY| (mm)",
    "mean_error": "mean R (mm)",
}
COUNT_NAMES = {"n_conditions": "conditions", "n_failed": "failed conditions"}
PUBLISHED_TOLERANCE = 1e-7  # of the thesis' table of errors
RACE_TIMES = (0.1, 1.0, 10.0, 60.0)  # s
ERROR_FRACTION = 0.1  # share of wrong answers permitted in equation 58
SIZE_TABLE = {
    "n hidden": "n_hidden",
    **{
        f"{name} error": Column(f"{name.replace(' ', '_')}_error", 5)
        for name in ("training", "selection", "median selection", "worst selection")
    },
    "best restart": "best_restart",
    "n failed": "n_failed",
}


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    files = {"published": "", "selected": "_selected", "variants": "_variants"}
    training = results.training.rename(columns=lambda name: str(name).replace("_", " "))
    return {
        **{
            f"positioning_errors{ending}": _errors(results, group)
            for group, ending in files.items()
        },
        **({"restarts": _restarts(results)} if results.spread else {}),
        "without_worst_points": _without_worst(results),
        "inversions": _inversions(results),
        "tolerance_study": _tolerances(results),
        "query_cost": Table(
            results.query_cost(),
            {"operations": 0, "published": 0, "single (us)": 0, "batched (us)": 2},
        ),
        "workspace": _workspace(results),
        "calibration": Table(calibration(results), {"difference (%)": 1}),
        "mesh_study": _mesh(results.mesh),
        "training": Table(training, {"training error": 4, "selection error": 4}),
        "training_race": _race(results.training_curves),
        "size_rules": Table(_size_rules(results), 0),
        **{
            f"size_selection/{name}": table(sizes, SIZE_TABLE)
            for name, (sizes, _) in results.studies.items()
        },
    }


def _errors(results: Results, group: str) -> Table:
    """Six statistics in mm, ours and the published one for every method; then the counts."""
    labels = [*(["none"] if group == "published" else []), *results.groups[group]]
    by_method = {label: results.statistics[label] for label in labels}
    errors = comparison(
        by_method, results.published["positioning_errors"], results.published_columns
    )
    columns: dict[str, list[object]] = {
        "statistic": [*(STATISTIC_NAMES[str(name)] for name in errors.index), *COUNT_NAMES.values()]
    }
    for label, values in by_method.items():
        columns[label] = [*errors[label], *(int(values[count]) for count in COUNT_NAMES)]
        theirs = f"{label} published"
        columns[theirs] = [*errors[theirs], *(None for _ in COUNT_NAMES)]
    return Table(pd.DataFrame(columns, dtype=object))  # integers stay integers beside floats


def calibration(results: Results) -> pd.DataFrame:
    """Our six statistics without compensation beside the published ones."""
    errors = comparison(
        {"none": results.statistics["none"]}, results.published["positioning_errors"]
    )
    ours, theirs = errors["none"], errors["none published"]
    return pd.DataFrame(
        {
            "statistic": [STATISTIC_NAMES[str(name)] for name in errors.index],
            "ours": ours.to_numpy(),
            "published": theirs.to_numpy(),
            "difference (%)": (100 * (ours / theirs - 1)).to_numpy(),
        }
    )


def _without_worst(results: Results) -> Table:
    """Errors without the two points that the thesis leaves out, and without our worst two."""
    published, rows = results.published["without_worst_points"], []
    for label in results.groups["published"]:
        theirs, frame = published[published["method"] == label], results.errors[label]
        if theirs.empty:
            continue
        targets = set(zip(frame["target_x"], frame["target_y"], strict=True))
        named = [point for point in zip(theirs["x"], theirs["y"], strict=True) if point in targets]
        for which, points in {
            "published": named,
            "our worst": [tuple(p) for p in worst_points(frame)],
        }.items():
            if len(points) == len(theirs):
                found = statistics_without(frame, points)
                beside: Any = theirs.iloc[0] if which == "published" else {}
                rows.append(
                    {
                        "method": label,
                        "without": " and ".join(style.coordinates(*point) for point in points),
                        "these are": which,
                        "max R (mm)": MM * found["max_error"],
                        "max R published (mm)": beside.get("max_error"),
                        "mean R (mm)": MM * found["mean_error"],
                        "mean R published (mm)": beside.get("mean_error"),
                    }
                )
    columns = ["method", "without", "these are", "max R (mm)", "max R published (mm)"]
    return Table(pd.DataFrame(rows, columns=[*columns, "mean R (mm)", "mean R published (mm)"]))


def _restarts(results: Results) -> Table:
    """Errors with the network that was chosen, and the spread over all restarts of its training."""
    rows = []
    for label, spread in results.spread.items():
        row: dict[str, Any] = {"method": label, "starts": len(spread)}
        for what in ("mean", "max"):
            row[f"{what} R (mm)"] = MM * results.statistics[label][f"{what}_error"]
            for which, name in (("min", "least"), ("median", "median"), ("max", "largest")):
                row[f"{name} {what} R"] = MM * spread[f"{what}_error"].agg(which)
        rows.append(row)
    return Table(pd.DataFrame(rows))


def _inversions(results: Results) -> Table:
    """What the way of inverting a network changes."""
    rows = [
        {
            **results.statistics[label],
            "method": label,
            "network": method.network,
            "kind": method.inversion.kind.replace("_", " "),
            "tolerance": f"{method.inversion.tolerance:g}",
            "mean": results.errors[label]["n_iterations"].mean(),
            "max": int(results.errors[label]["n_iterations"].max()),
            "limited": int((results.errors[label]["n_clipped"] > 0).sum()),
        }
        for label, method in results.methods.items()
        if isinstance(method, InvertedSettings)
    ]
    columns = {"method": "method", "network": "network", "inversion": "kind"}
    return table(
        pd.DataFrame(rows).merge(results.query_cost()) if rows else rows,
        {
            **columns,
            "tolerance": "tolerance",
            "mean R (mm)": mm("mean_error"),
            "max R (mm)": mm("max_error"),
            "mean iterations": Column("mean", 1),
            "max iterations": "max",
            "failed": "n_failed",
            "at a limit": "limited",
            "single (us)": Column("single (us)", 0),
            "batched (us)": "batched (us)",
        },
    )


def _tolerances(results: Results) -> Table:
    ours, theirs = results.tolerances, results.published["tolerance_study"]
    merged = ours.merge(theirs, "left", ["method", "tolerance"], suffixes=("", "_published"))
    reference = ours[ours["tolerance"] == PUBLISHED_TOLERANCE].set_index("method")["mean_error"]
    merged["ratio"] = merged["mean_error"] / merged["method"].map(reference)
    merged["tolerance"] = [f"{value:g}" for value in merged["tolerance"]]
    columns = {
        "method": "method",
        "tolerance": "tolerance",
        "mean R (mm)": mm("mean_error"),
        "max R (mm)": mm("max_error"),
        "mean R over that at 1e-07": "ratio",
        "published ratio": "error_ratio",
        "mean iterations": Column("mean_iterations", 1),
        "published mean": Column("mean_iterations_published", 0),
        "max iterations": "max_iterations",
        "published max": Column("max_iterations_published", 0),
        "failed": "n_failed",
    }
    return table(merged, columns)


def _workspace(results: Results) -> Table:
    rows = [
        {"method": label} | workspace_statistics(frame)
        for label, frame in results.workspace.items()
        if len(frame)
    ]
    columns = {
        "method": "method",
        "mean R (mm)": mm("mean_error"),
        "median R (mm)": mm("median_error"),
        "95th percentile (mm)": mm("p95_error"),
        "99th percentile (mm)": mm("p99_error"),
        "max R (mm)": mm("max_error"),
        "targets": "n_targets",
        "failed": "n_failed",
    }
    return table(rows, columns)


def _mesh(study: pd.DataFrame) -> Table:
    return table(
        study,
        {
            "element": "element",
            "refinement": "refinement",
            "mean tip difference (mm)": mm("mean_difference", 3),
            "max tip difference (mm)": mm("max_difference", 3),
            "mean (% of deflection)": Column("mean_relative", 2, 100.0),
            "max (% of deflection)": Column("max_relative", 2, 100.0),
        },
    )


def _race(curves: pd.DataFrame) -> Table:
    """Error of each trainer after some times."""
    rows: list[dict[str, Any]] = []
    for trainer, curve in curves.groupby("trainer", sort=False):
        row: dict[str, Any] = {"trainer": trainer}
        for seconds in RACE_TIMES:
            done = curve.loc[curve["seconds"] <= seconds, "error"]
            row[f"after {seconds:g} s"] = None if done.empty else done.iloc[-1]
        last = curve.iloc[-1]
        rows.append(row | {"at its end": last["error"], "ended after (s)": last["seconds"]})
    frame = pd.DataFrame(rows)
    return Table(frame, {str(name): 4 for name in frame if str(name)[:2] in ("af", "at")})


def _size_rules(results: Results) -> pd.DataFrame:
    """What rules of thumb would have chosen."""
    rows = []
    for name, (_, chosen) in results.studies.items():
        n_samples, network = results.n_learnt(name), results.trained[name]
        n_inputs, n_outputs = len(network.inputs), len(network.outputs)
        rows.append(
            {
                "network": name,
                "learns": results.kind(name),
                "samples": n_samples,
                "published": results.published_size(name),
                "chosen": chosen,
                "Oja (57)": round(oja(n_samples, n_inputs, n_outputs)),
                "Haykin (58)": haykin(n_samples, n_inputs, n_outputs, ERROR_FRACTION),
                "samples (58) asks for": round(
                    haykin_samples(n_inputs, chosen, n_outputs, ERROR_FRACTION)
                ),
            }
        )
    return pd.DataFrame(rows)


def every_condition(errors: dict[str, pd.DataFrame], columns: Sequence[str]) -> str:
    """CSV text of every condition of every method, to the micrometre."""
    frames = [frame[list(columns)].assign(method=label) for label, frame in errors.items()]
    # micrometres: what another machine may differ in lies below
    return pd.concat(frames)[["method", *columns]].to_csv(index=False, float_format="%.6f")
