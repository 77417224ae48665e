"""Tables of the log crane's report."""

from pathlib import Path

import pandas as pd

from flexik.datasets.crane.evaluations import CONDITION_FIELDS
from flexik.datasets.crane.grid import kept
from flexik.evaluation.errors import statistics_without, workspace_statistics, worst_points
from flexik.files import write_text
from flexik.parameters import InvertedModel
from flexik.reporting import style, tables
from flexik.reporting.crane import learning_tables
from flexik.reporting.crane import notes as crane_notes
from flexik.reporting.crane.results import SELECTED, Results
from flexik.reporting.style import MM

# of the thesis' table of errors
PUBLISHED_TOLERANCE = 1e-7


def write_tables(results: Results, folder: Path) -> None:
    """Write every table as CSV and Markdown, and errors.csv with every test condition."""
    _write_errors(results, folder)
    _write_without_worst(results, folder)
    _write_inversions(results, folder)
    _write_tolerances(results, folder)
    _write_query_cost(results, folder)
    _write_workspace(results, folder)
    _write_calibration(results, folder)
    _write_mesh_study(results, folder)
    learning_tables.write_tables(results, folder)
    columns = [field.name for field in CONDITION_FIELDS]
    every = [frame[columns].assign(method=label) for label, frame in results.errors.items()]
    # micrometres: what another machine may differ in lies below
    text = pd.concat(every)[["method", *columns]].to_csv(index=False, float_format="%.6f")
    write_text(folder / "errors.csv", text)


def _write_errors(results: Results, folder: Path) -> None:
    """Table 4.1 three times: published sizes, selected sizes, other variants."""
    found, groups = results.statistics, results.groups
    n = found["none"]["n_conditions"]
    captions = {
        "published": f"Simulated positioning errors over {n} conditions, networks of "
        f"{_sizes_text(results)}, beside Rouvinen (1999).",
        "selected": "The same with networks of selected size.",
        "variants": "The same with other variants.",
    }
    files = {
        "published": "positioning_errors",
        "selected": "positioning_errors_selected",
        "variants": "positioning_errors_variants",
    }
    for group, file in files.items():
        labels = groups[group]
        if group == "published":
            labels = ["none", *labels]
        by_method = {label: found[label] for label in labels}
        errors = tables.positioning_errors_table(
            by_method, results.published.errors, results.published_columns
        )
        notes = _errors_notes(results, labels)
        if group == "selected":
            notes += _no_better_notes(results, labels)
        tables.write_table(folder / file, errors, 2, captions[group], notes)


def _sizes_text(results: Results) -> str:
    """Whether all networks of the first table have their published size."""
    networks = [results.crane.methods[label].network for label in results.groups["published"]]
    sizes = [getattr(results.network(name), "n_hidden", None) for name in networks]
    published = [results.published_size(name) for name in networks]
    return "published size" if sizes == published else "the sizes in params.yaml"


def _errors_notes(results: Results, labels: list[str]) -> list[str]:
    """What the numbers of a table owe to points, payloads and failures."""
    errors = {label: results.errors[label] for label in labels}
    notes = []
    if "none" in errors:
        notes += crane_notes.point_notes(results.crane.evaluation.points)
        payload = errors["none"]["payload"]
        notes += crane_notes.extrapolation_notes(payload, kept(results.grid)["payload"])
    notes += crane_notes.worse_notes({"none": results.errors["none"], **errors})
    return [*notes, *crane_notes.failure_notes(errors), *crane_notes.genetic_notes(errors)]


def _no_better_notes(results: Results, labels: list[str]) -> list[str]:
    """Methods that the selected size does not improve, with the selection errors."""
    found, notes = results.statistics, []
    least = results.training.groupby("network")["selection_error"].min()
    for label in labels:
        given = label.removesuffix(SELECTED)
        if given in found and found[label]["mean_error"] > found[given]["mean_error"]:
            names = [results.crane.methods[name].network for name in (label, given)]
            notes.append(
                f"{label}: no better than {given}; selection errors of the networks: "
                f"{least[names[0]]:.4f} and {least[names[1]]:.4f}, from "
                f"{results.network(names[0]).n_restarts} and "
                f"{results.network(names[1]).n_restarts} starts."
            )
    return notes


def _write_without_worst(results: Results, folder: Path) -> None:
    published = results.published.without_worst
    rows = []
    for label in results.groups["published"]:
        theirs = published[published["method"] == label]
        if theirs.empty:
            continue
        frame = results.errors[label]
        targets = set(zip(frame["target_x"], frame["target_y"], strict=True))
        named = [point for point in zip(theirs["x"], theirs["y"], strict=True) if point in targets]
        kinds = {"published": named, "our worst": [tuple(p) for p in worst_points(frame)]}
        for which, points in kinds.items():
            if len(points) < len(theirs):
                continue
            found = statistics_without(frame, points)
            beside = which == "published"
            rows.append(
                {
                    "method": label,
                    "without": " and ".join(style.coordinates(*point) for point in points),
                    "these are": which,
                    "max R (mm)": MM * found["max_error"],
                    "max R published (mm)": theirs["max_error"].iloc[0] if beside else None,
                    "mean R (mm)": MM * found["mean_error"],
                    "mean R published (mm)": theirs["mean_error"].iloc[0] if beside else None,
                }
            )
    columns = ["method", "without", "these are", "max R (mm)", "max R published (mm)"]
    columns += ["mean R (mm)", "mean R published (mm)"]
    caption = "Errors without the two points that the thesis leaves out, and without our worst two."
    tables.write_table(
        folder / "without_worst_points", pd.DataFrame(rows, columns=columns), 2, caption
    )


def _write_inversions(results: Results, folder: Path) -> None:
    """What the way of inverting a network changes."""
    times, statistics = results.query_times.set_index("method"), results.statistics
    rows = []
    for label, method in results.crane.methods.items():
        if not isinstance(method, InvertedModel):
            continue
        found, frame = statistics[label], results.errors[label]
        rows.append(
            {
                "method": label,
                "network": method.network,
                "inversion": method.inversion.kind.replace("_", " "),
                "tolerance": f"{method.inversion.tolerance:g}",
                "mean R (mm)": MM * found["mean_error"],
                "max R (mm)": MM * found["max_error"],
                "mean iterations": frame["n_iterations"].mean(),
                "max iterations": int(frame["n_iterations"].max()),
                "failed": int(found["n_failed"]),
                "at a limit": int((frame["n_clipped"] > 0).sum()),
                "single (us)": _time(times, label, "microseconds_single"),
                "batched (us)": _time(times, label, "microseconds_batched"),
            }
        )
    caption = "Ways of inverting the networks, over all test conditions."
    notes = [
        "tolerance: half the sum of the squared normalised output errors (equation 59).",
        "at a limit: conditions that end with a stroke at its limit.",
        _times_note(),
    ]
    decimals = {"mean iterations": 1, "single (us)": 0, "batched (us)": 2}
    table = pd.DataFrame(rows)
    if table.empty:
        decimals = {}
    tables.write_table(folder / "inversions", table, decimals, caption, notes)


def _time(times: pd.DataFrame, label: str, column: str) -> float | None:
    return float(times[column][label]) if label in times.index else None


def _times_note() -> str:
    return (
        "us: microseconds a query on one core, measured apart from the pipeline "
        "(`make benchmark-positioning`, reports/benchmarks/positioning.md): the median over the "
        "test conditions alone, the mean over random targets in a batch; empty: not measured with "
        "these settings."
    )


def _write_tolerances(results: Results, folder: Path) -> None:
    ours, theirs = results.tolerances, results.published.tolerances
    merged = ours.merge(theirs, "left", ["method", "tolerance"], suffixes=("", " published"))
    reference = ours[ours["tolerance"] == PUBLISHED_TOLERANCE].set_index("method")["mean_error"]
    ratio = merged["mean_error"] / merged["method"].map(reference)
    table = pd.DataFrame(
        {
            "method": merged["method"],
            "tolerance": [f"{value:g}" for value in merged["tolerance"]],
            "mean R (mm)": MM * merged["mean_error"],
            "max R (mm)": MM * merged["max_error"],
            "mean R over that at 1e-07": ratio,
            "published ratio": merged["error_ratio"],
            "mean iterations": merged["mean_iterations"],
            "published mean": merged["mean_iterations published"],
            "max iterations": merged["max_iterations"],
            "published max": merged["max_iterations published"],
            "failed": merged["n_failed"],
        }
    )
    decimals = {"mean iterations": 1, "published mean": 0, "published max": 0}
    caption = "Tolerance of the inversion, over all test conditions."
    methods = [results.crane.methods[label] for label in results.crane.tolerance_study.methods]
    descents = [
        isinstance(method, InvertedModel) and method.inversion.kind == "gradient_descent"
        for method in methods
    ]
    notes = (
        []
        if not all(descents)
        else [
            "The learning rate is not published. With a constant one the error falls by the same "
            "factor in every step, so each further decade takes as many steps as the last; the "
            "published numbers grow by 15 steps over two decades and by 3 over the next, which no "
            "constant rate gives.",
            "Published ratios: of `direct`, 43 % less from 1e-05 to 1e-07 and 3 % less again; of "
            "`modular`, twice at 1e-05. A tighter tolerance follows the network, not the crane: "
            "below the network's own error it need not help.",
        ]
    )
    tables.write_table(folder / "tolerance_study", table, decimals, caption, notes)


def _write_query_cost(results: Results, folder: Path) -> None:
    """Operations and microseconds a query."""
    caption = "What a query costs, and what it gives."
    notes = [
        "operations: of the network alone, counted from its architecture and, where it is "
        "inverted, from the mean number of steps; an addition, multiplication or activation is "
        "one. Rigid kinematics, in closed form or by the genetic algorithm, are not counted.",
        "The thesis counted its 395 with MATLAB, where an activation takes several operations.",
        _times_note(),
    ]
    decimals = {"operations": 0, "published": 0, "single (us)": 0, "batched (us)": 2}
    tables.write_table(folder / "query_cost", query_cost(results), decimals, caption, notes)


def query_cost(results: Results) -> pd.DataFrame:
    """A row for every method of params.yaml."""
    times, statistics = results.query_times.set_index("method"), results.statistics
    rows = []
    for label, method in results.crane.methods.items():
        published = results.published.operations.get(method.method)
        rows.append(
            {
                "method": label,
                "operations": float(results.query_operations(label)),
                "published": float(published) if label == method.method and published else None,
                "single (us)": _time(times, label, "microseconds_single"),
                "batched (us)": _time(times, label, "microseconds_batched"),
                "mean R (mm)": MM * statistics[label]["mean_error"],
            }
        )
    return pd.DataFrame(rows)


def _write_workspace(results: Results, folder: Path) -> None:
    names = {
        "mean_error": "mean R (mm)",
        "median_error": "median R (mm)",
        "p95_error": "95th percentile (mm)",
        "p99_error": "99th percentile (mm)",
        "max_error": "max R (mm)",
    }
    rows = []
    for label, frame in results.workspace.items():
        if frame.empty:
            continue
        found = workspace_statistics(frame)
        rows.append(
            {"method": label}
            | {title: MM * found[name] for name, title in names.items()}
            | {"targets": int(found["n_targets"]), "failed": int(found["n_failed"])}
        )
    space = results.crane.workspace
    caption = (
        "Positioning errors at random targets that the loaded crane reaches, payloads "
        f"{space.payload[0]:g} to {space.payload[1]:g} kg (seed {space.seed})."
    )
    notes = crane_notes.failure_notes(results.workspace)
    tables.write_table(folder / "workspace", pd.DataFrame(rows), 2, caption, notes)


def _write_calibration(results: Results, folder: Path) -> None:
    fitted = tables.calibration_table(results.statistics["none"], results.published.errors)
    caption = "Uncompensated crane after the fit of the ground spring; mean R is what was fitted."
    notes = [
        *crane_notes.calibration_notes(fitted),
        *crane_notes.worst_point_notes(results.errors["none"]),
    ]
    tables.write_table(folder / "calibration", fitted, {"difference (%)": 1}, caption, notes)


def _write_mesh_study(results: Results, folder: Path) -> None:
    study = results.mesh_study.copy()
    style.require("mesh study", study, ("n_samples", "mean_relative", "max_relative"))
    n_samples = study.pop("n_samples").max()
    shares = {f"{k} (% of deflection)": 100 * study.pop(f"{k}_relative") for k in ("mean", "max")}
    caption = (
        f"Tip against the mesh of refinement {study['refinement'].max()} with "
        f"{results.crane.structure.element} elements, {n_samples} random samples."
    )
    study = tables.mesh_table(study).assign(**shares)
    decimals = {str(name): 2 if name in shares else 3 for name in study}
    tables.write_table(folder / "mesh_study", study, decimals, caption)
