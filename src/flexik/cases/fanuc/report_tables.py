"""Tables of the six-joint arm; percent, mm and degrees."""

import itertools

import numpy as np
import pandas as pd

from flexik.cases.fanuc.report_results import Results, having, label
from flexik.cases.fanuc.section import EXACT, LOOKED_UP, PUBLISHED_NETWORKS, WHOLE
from flexik.kinematics.spherical_wrist import ELBOW, N_CONFIGURATIONS, SHOULDER, WRIST
from flexik.reporting.style import DEGREES, MM
from flexik.reporting.tables import Column, Table, mm, table

NOT_AVAILABLE = "not available"
VARIED = {"n_hidden": "hidden neurons", "learning_factor": "learning factor"}
# Root mean square error, share of a joint's range, that passes are counted to
PASS_ERRORS = (0.05, 0.02)
# Between the rows of the table of conditioning, m
SINGULAR_EDGES = (0.01, 0.03, 0.1, 0.3)
JOINTS = range(1, 7)
JOINT_COLUMNS = {
    "joint": "joint",
    "offset (deg)": Column("offset", 2, DEGREES),
    "d (m)": Column("d", 3),
    "a (m)": Column("a", 3),
    **{f"{n} (deg)": Column(n, 2, DEGREES) for n in ("alpha", "minimum", "maximum")},
}
POSITION = {"method": "label", "mean position (mm)": mm("mean", 3)}
REST = {
    "max position (mm)": mm("max", 3),
    "mean orientation (deg)": Column("mean_turn", 2, DEGREES),
    "max orientation (deg)": Column("max_turn", 2, DEGREES),
    "reached (%)": Column("reached", 2, 100.0),
}
TIMES = {
    "single (us)": Column("microseconds_single", 0),
    "batched (us)": Column("microseconds_batched", 2),
}
GROWTH_COLUMNS = {
    "hidden neurons": "n_hidden",
    "passes": "n_iterations",
    "core seconds": Column("seconds", 0),
    "mean position (mm)": Column("mean_position_error_mm", 1),
    "mean orientation (deg)": Column("mean_orientation_error_deg"),
    "reached after 3 steps (%)": Column("success_percent", 1),
}


def tables(results: Results) -> dict[str, Table]:
    """All tables."""
    joints = [
        {"joint": k, **j.model_dump()} for k, j in enumerate(results.section.machine.joints, 1)
    ]
    on_path, at_random = (
        results.statistics[where].reset_index() for where in ("path", "random_poses")
    )
    starts = results.start_shifts.groupby("method").agg(["min", "max"])
    spreads = {n: f"{MM * least:.3g} to {MM * most:.3g}" for n, least, most in starts.itertuples()}
    on_path["starts"] = on_path["label"].map(spreads).fillna("")
    times = results.times.rename(columns={"method": "label"})
    names = dict.fromkeys([*at_random["label"], *times["label"]])
    timed = at_random.merge(times, on="label", how="outer").set_index("label").loc[list(names)]
    off = results.of("off_path")
    return {
        "joints": table(joints, JOINT_COLUMNS),
        "total_errors": total_errors(results),
        "passes": passes(results),
        "path_errors": table(on_path, {**POSITION, "all starts (mm)": "starts", **REST}),
        **{f"study_{name}": study(results, name) for name in VARIED},
        "off_path": _by_distance(results, MM * off["error"], 2),
        "off_path_orientation": _by_distance(results, DEGREES * off["orientation_error"], 2),
        "off_path_success": _by_distance(results, 100.0 * off["reached"], 1),
        "whole_workspace": table(
            timed.reset_index(),
            {**POSITION, "median position (mm)": mm("median", 3), **REST, **TIMES},
        ),
        "conditioning": conditioning(results),
        "configurations": configurations(results),
        "growth": table(results.growth, GROWTH_COLUMNS),
    }


def total_errors(results: Results) -> Table:
    """A row a joint and one for their mean; the published value beside each configuration."""
    columns: dict[str, list[object]] = {"joint": [*JOINTS, "mean"]}
    for name in results.networks:
        of_network = having(results.starts, network=name)
        groups = [having(of_network, joint=joint)["error_percent"] for joint in JOINTS]
        spreads = [spread(values) for values in [*groups, results.start_means[name]]]
        columns[f"{name} (%)"] = [
            f"{s['median']:.3g}" + (f" ({s['least']:.3g} to {s['largest']:.3g})" * (s["n"] > 1))
            for s in spreads
        ]
        if name in PUBLISHED_NETWORKS:
            known = results.published[name].reindex(JOINTS).astype(float)
            values = [*known, known.mean(skipna=False)]
            columns[f"{name} published"] = [NOT_AVAILABLE if np.isnan(v) else v for v in values]
    for name in LOOKED_UP:
        percents = results.error_percents[name]
        columns[f"{name} (%)"] = [*percents, float(percents.mean())]
    return Table(pd.DataFrame(columns, dtype=object), 3)


def spread(values: pd.Series) -> dict[str, float]:
    """Median and range over starts, and their number."""
    found = {"median": values.median(), "least": values.min(), "largest": values.max()}
    return {name: float(value) for name, value in found.items()} | {"n": len(values)}


def passes(results: Results) -> Table:
    """Passes from which on the training error of each joint stays below PASS_ERRORS."""
    columns: dict[str, list[object]] = {"joint": list(JOINTS)}
    for name, error in itertools.product(results.networks, PASS_ERRORS):
        needed = having(results.passes_needed(error), network=name).groupby("joint")["passes"]
        counts = needed.quantile(0.5, interpolation="higher")
        columns[f"{name} to {100 * error:g} %"] = [
            int(counts[joint]) if np.isfinite(counts[joint]) else None for joint in JOINTS
        ]
    return Table(pd.DataFrame(columns, dtype=object), 0)


def study(results: Results, varied: str) -> Table:
    """Errors of one joint by what was varied, over the starts."""
    rows = results.study_statistics(varied)
    if varied == "n_hidden":
        rows["value"] = rows["value"].astype(int)
    columns = {
        "median total error (%)": "median",
        "least (%)": "least",
        "largest (%)": "largest",
        "median training error (%)": "training",
    }
    shown = {title: Column(name, 3) for title, name in columns.items()}
    first = {VARIED[varied]: Column("value", 3), "starts": "starts"}
    return table(rows, first | shown | {"ended early": "early"})


def _by_distance(results: Results, values: pd.Series, decimals: int) -> Table:
    """Means of `values`, one a row of off_path: a row a method, a column a distance."""
    frame = results.of("off_path").assign(value=values)
    means = frame.pivot_table(index="label", columns="distance", values="value", sort=False)
    distances = results.section.conditions.off_path.distances
    means = means.reindex(index=frame["label"].unique(), columns=distances)
    means.columns = pd.Index([f"{MM * distance:g} mm" for distance in distances])
    return Table(means.rename_axis("method").reset_index(), decimals)


def conditioning(results: Results) -> Table:
    """Share of the poses reached by the smallest singular value of the Jacobian there."""
    frame, edges = results.of("random_poses"), [0.0, *SINGULAR_EDGES, np.inf]
    names = [f"{low:g} to {high:g}" for low, high in itertools.pairwise(edges)]
    names[-1] = f"over {edges[-2]:g}"
    frame["place"] = pd.cut(frame["singular_value"], edges, right=False, labels=names)
    rates = frame.pivot_table(index="place", columns="label", values="reached", sort=False)
    rates = 100.0 * rates.reindex(index=names, columns=frame["label"].unique())
    rates.insert(0, "poses", having(frame, method=EXACT)["place"].value_counts()[names])
    return Table(rates.rename_axis("smallest singular value (m)").reset_index(), 1)


def configurations(results: Results) -> Table:
    """Errors of the networks of the whole workspace by arm configuration."""
    frame = results.of("random_poses")
    groups = frame.groupby(["configuration", "label"])
    means = groups[["error", "orientation_error", "reached"]].mean().to_dict()
    rows = [
        {
            "configuration": number,
            "shoulder": "back" if number & SHOULDER else "front",
            "elbow": "negative" if number & ELBOW else "positive",
            "wrist": "negative" if number & WRIST else "positive",
            "mean position (mm)": MM * means["error"][number, WHOLE],
            "mean orientation (deg)": DEGREES * means["orientation_error"][number, WHOLE],
            **{
                f"reached after {k} (%)": 100.0 * means["reached"][number, label(WHOLE, k)]
                for k in range(1, results.n_steps + 1)
            },
            f"{EXACT} (%)": 100.0 * means["reached"][number, EXACT],
        }
        for number in range(N_CONFIGURATIONS)
    ]
    return Table(pd.DataFrame(rows), 2)
