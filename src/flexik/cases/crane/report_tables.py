"""Tables of the crane's report, beside those of Rouvinen 1999."""

from typing import Any

import pandas as pd

from flexik.cases.crane.report_results import KIND, Results
from flexik.learning.size_rules import haykin, haykin_samples, oja
from flexik.planar.learning import learnt_rows
from flexik.positioning.inverted_network import InvertedSettings
from flexik.reporting import curves, style
from flexik.reporting.style import MM
from flexik.reporting.tables import Column, Table, mm, spread, table

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
SIZES = {
    "n hidden": "n_hidden",
    **{
        f"{name} error": Column(f"{name.replace(' ', '_')}_error", 5)
        for name in ("training", "selection", "median selection", "worst selection")
    },
    "best restart": "best_restart",
    "n failed": "n_failed",
}
WORKSPACE = {
    "method": "method",
    "mean R (mm)": mm("mean_error"),
    "median R (mm)": mm("median_error"),
    "95th percentile (mm)": mm("p95_error"),
    "99th percentile (mm)": mm("p99_error"),
    "max R (mm)": mm("max_error"),
    "targets": "n_targets",
    "failed": "n_failed",
}
MESH = {
    "element": "element",
    "refinement": "refinement",
    "mean tip difference (mm)": mm("mean_difference", 3),
    "max tip difference (mm)": mm("max_difference", 3),
    "mean (% of deflection)": Column("mean_relative", 2, 100.0),
    "max (% of deflection)": Column("max_relative", 2, 100.0),
}
COST = {"operations": 0, "published": 0, "single (us)": 0, "batched (us)": 2}
INVERSIONS = {
    "method": "method",
    "network": "network",
    "inversion": "kind",
    "tolerance": "tolerance",
    "mean R (mm)": mm("mean_error"),
    "max R (mm)": mm("max_error"),
    "mean iterations": Column("mean", 1),
    "max iterations": "max",
    "failed": "n_failed",
    "at a limit": "limited",
    "single (us)": Column("single (us)", 0),
    "batched (us)": "batched (us)",
}
METHODS = {
    "method": "method",
    "mean R (mm)": mm("mean", 4),
    "max R (mm)": mm("max", 3),
    "thesis, mean R (mm)": mm("thesis", 2),
    "at random: mean (mm)": mm("workspace_mean", 4),
    "99 % (mm)": mm("workspace_p99", 3),
    "max (mm)": mm("workspace_max", 3),
    "failed": "n_failed",
    "targets": "n_targets",
    "numbers (kB)": Column("kilobytes", 2),
    "a query (us)": Column("microseconds", 1),
}
CORRECTIONS = {
    "method": "method",
    "corrections": "n_corrections",
    "mean (mm)": mm("mean_error", 4),
    "99 % (mm)": mm("p99_error", 3),
    "max (mm)": mm("max_error", 3),
    "failed": "n_failed",
}
TOLERANCES = {
    "method": "method",
    "tolerance": "tolerance",
    "mean R (mm)": mm("mean_error"),
    "max R (mm)": mm("max_error"),
    f"mean R over that at {PUBLISHED_TOLERANCE:g}": "ratio",
    "published ratio": "error_ratio",
    "mean iterations": Column("mean_iterations", 1),
    "published mean": Column("mean_iterations_published", 0),
    "max iterations": "max_iterations",
    "published max": Column("max_iterations_published", 0),
    "failed": "n_failed",
}


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    groups, cost = results.groups, results.query_cost()
    training = results.training.rename(columns=lambda name: str(name).replace("_", " "))
    workspace = [{"method": k, **found} for k, found in results.workspace_statistics.items()]
    return {
        "methods": table(results.compare(), METHODS),
        "corrections": table(results.by_corrections, CORRECTIONS),
        "points": _draws(results.draws),
        "positioning_errors": _errors(results, ["none", *groups["published"]]),
        "positioning_errors_selected": _errors(results, groups["selected"]),
        "positioning_errors_variants": _errors(results, groups["variants"]),
        **({"restarts": _restarts(results)} if results.spread else {}),
        "without_worst_points": _without_worst(results),
        "inversions": _inversions(results, cost),
        "tolerance_study": _tolerances(results),
        "query_cost": Table(cost, COST),
        "workspace": table(workspace, WORKSPACE),
        "calibration": calibration(results),
        "mesh_study": table(results.mesh, MESH),
        "training": Table(training, {"training error": 4, "selection error": 4}),
        "training_race": _race(results.training_curves),
        **({"learning_curves": curves.table(results.curves)} if len(results.curves) else {}),
        **({"physics": curves.physics_table(results.physics)} if len(results.physics) else {}),
        "size_rules": Table(_size_rules(results), 0),
        **{f"size_selection/{k}": table(sizes, SIZES) for k, (sizes, _) in results.studies.items()},
    }


def _errors(results: Results, labels: list[str]) -> Table:
    """Six statistics in mm, ours and the published one for every method; then the counts."""
    errors = results.compared(labels).T
    for count in COUNT_NAMES:  # objects, so that integers stay integers beside floats
        counts = [n for label in labels for n in (results.statistics[label][count], None)]
        errors[count] = pd.Series(counts, errors.index, dtype=object)
    errors = errors.T
    errors.insert(0, "statistic", errors.index.map(STATISTIC_NAMES | COUNT_NAMES))
    return Table(errors)


def _draws(draws: pd.DataFrame) -> Table:
    """Median and range over the draws of what is reported of one of them."""
    rows = []
    for name, of_method in draws.groupby("method", sort=False):
        row: dict[str, Any] = {"method": name, "draws": len(of_method)}
        for what in ("mean", "max"):
            found = spread(MM * of_method[f"{what}_error"])
            row |= {f"{which} {what} R (mm)": value for which, value in found.items()}
        rows.append(row)
    return Table(pd.DataFrame(rows))


def calibration(results: Results) -> Table:
    """Our six statistics without compensation beside the published ones."""
    errors = results.compared(["none"]).set_axis(["ours", "published"], axis=1)
    errors["difference (%)"] = 100 * (errors["ours"] / errors["published"] - 1)
    errors.insert(0, "statistic", errors.index.map(STATISTIC_NAMES))
    return Table(errors, {"difference (%)": 1})


def _without_worst(results: Results) -> Table:
    """Errors without the two points that the thesis leaves out, and without our worst two."""
    published, rows = results.published["without_worst_points"], []
    for label in results.groups["published"]:
        theirs, frame = published[published["method"] == label], results.errors[label]
        places = pd.MultiIndex.from_frame(frame[["target_x", "target_y"]])
        largest = frame["error"].groupby(places).max().nlargest(len(theirs))
        named = [p for p in zip(theirs["x"], theirs["y"], strict=True) if p in places]
        for which, points in {"published": named, "our worst": list(largest.index)}.items():
            if len(points) < max(len(theirs), 1):
                continue
            left = MM * frame.loc[~places.isin(points), "error"]
            beside: Any = theirs.iloc[0] if which == "published" else {}
            rows.append(
                {
                    "method": label,
                    "without": " and ".join(style.coordinates(*point) for point in points),
                    "these are": which,
                    "max R (mm)": left.max(),
                    "max R published (mm)": beside.get("max_error"),
                    "mean R (mm)": left.mean(),
                    "mean R published (mm)": beside.get("mean_error"),
                }
            )
    columns = ["method", "without", "these are", "max R (mm)", "max R published (mm)"]
    return Table(pd.DataFrame(rows, columns=[*columns, "mean R (mm)", "mean R published (mm)"]))


def _restarts(results: Results) -> Table:
    """Errors with the network that was chosen, and the spread over all restarts of its training."""
    rows = []
    for label, errors in results.spread.items():
        row: dict[str, Any] = {"method": label, "starts": len(errors)}
        for what in ("mean", "max"):
            row[f"{what} R (mm)"] = MM * results.statistics[label][f"{what}_error"]
            found = spread(MM * errors[f"{what}_error"])
            row |= {f"{which} {what} R": value for which, value in found.items()}
        rows.append(row)
    return Table(pd.DataFrame(rows))


def _inversions(results: Results, cost: pd.DataFrame) -> Table:
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
    return table(pd.DataFrame(rows).merge(cost) if rows else rows, INVERSIONS)


def _tolerances(results: Results) -> Table:
    ours, theirs = results.tolerances, results.published["tolerance_study"]
    merged = ours.merge(theirs, "left", ["method", "tolerance"], suffixes=("", "_published"))
    reference = ours[ours["tolerance"] == PUBLISHED_TOLERANCE].set_index("method")["mean_error"]
    merged["ratio"] = merged["mean_error"] / merged["method"].map(reference)
    merged["tolerance"] = [f"{value:g}" for value in merged["tolerance"]]
    return table(merged, TOLERANCES)


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
    return Table(frame, dict.fromkeys(map(str, frame.columns[1:-1]), 4))


def _size_rules(results: Results) -> pd.DataFrame:
    """What rules of thumb would have chosen."""
    rows, machine = [], results.section.machine
    for name, (_, chosen) in results.studies.items():
        learns, network = results.section.networks[name].learns, results.trained[name]
        n_samples = len(learnt_rows(results.kept, learns or "correction", machine))
        n_inputs, n_outputs = len(network.inputs), len(network.outputs)
        asked = haykin_samples(n_inputs, chosen, n_outputs, ERROR_FRACTION)
        rows.append(
            {
                "network": name,
                "learns": KIND[learns],
                "samples": n_samples,
                "published": results.published_size(name),
                "chosen": chosen,
                "Oja (57)": round(oja(n_samples, n_inputs, n_outputs)),
                "Haykin (58)": haykin(n_samples, n_inputs, n_outputs, ERROR_FRACTION),
                "samples (58) asks for": round(asked),
            }
        )
    return pd.DataFrame(rows)
