"""The report of the six-joint arm: tables, metrics, and what the sentences of its page hold."""

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.fanuc.parts.samples import SHORTER
from flexik.cases.fanuc.report_figures import FLOOR, figures
from flexik.cases.fanuc.report_results import PUBLISHED, VARIED, Results, having, label, read
from flexik.cases.fanuc.section import EXACT, LOOKED_UP, PUBLISHED_NETWORKS, WHOLE, Section
from flexik.kinematics.spherical_wrist import ELBOW, SHOULDER, WRIST
from flexik.reporting.report import Content, write_section
from flexik.reporting.style import DEGREES, MM
from flexik.reporting.tables import Column, Table, mm, spread, table

# Digits of metrics: what machines agree on
PLACES = 4
NOT_AVAILABLE = "not available"
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
STUDY = {
    "starts": "starts",
    "median total error (%)": Column("median", 3),
    "least (%)": Column("least", 3),
    "largest (%)": Column("largest", 3),
    "median training error (%)": Column("training", 3),
    "ended early": "early",
}
GROWTH = {
    "hidden neurons": "n_hidden",
    "passes": "n_iterations",
    "core seconds": Column("seconds", 0),
    "mean position (mm)": Column("mean_position_error_mm", 1),
    "mean orientation (deg)": Column("mean_orientation_error_deg"),
    "reached after 3 steps (%)": Column("success_percent", 1),
}


def report(section: Section) -> None:
    """Write reports/fanuc from data/fanuc."""
    results = read(section)
    content = Content(tables(results), figures(results), metrics(results), values(results))
    write_section(section, Path(__file__).with_name("page.md.j2"), content, [PUBLISHED])


def tables(results: Results) -> dict[str, Table]:
    """All tables."""
    joints = pd.DataFrame([joint.model_dump() for joint in results.section.machine.joints])
    on_path, at_random = (results.statistics[k].reset_index() for k in ("path", "random_poses"))
    starts = results.start_shifts.groupby("method").agg(["min", "max"])
    spreads = {n: f"{MM * least:.3g} to {MM * most:.3g}" for n, least, most in starts.itertuples()}
    on_path["starts"] = on_path["label"].map(spreads).fillna("")
    times = results.times.rename(columns={"method": "label"})
    names = dict.fromkeys([*at_random["label"], *times["label"]])
    timed = at_random.merge(times, on="label", how="outer").set_index("label").loc[list(names)]
    of_all = {**POSITION, "median position (mm)": mm("median", 3), **REST, **TIMES}
    return {
        "joints": table(joints.assign(joint=JOINTS), JOINT_COLUMNS),
        "total_errors": total_errors(results),
        "passes": passes(results),
        "path_errors": table(on_path, {**POSITION, "all starts (mm)": "starts", **REST}),
        **{
            f"study_{name}": table(
                results.study_statistics(name), {what: Column("value", 3)} | STUDY
            )
            for name, what in VARIED.items()
        },
        "off_path": _by_distance(results, "error", MM, 2),
        "off_path_orientation": _by_distance(results, "orientation_error", DEGREES, 2),
        "off_path_success": _by_distance(results, "reached", 100.0, 1),
        "whole_workspace": table(timed.reset_index(), of_all),
        "conditioning": conditioning(results),
        "configurations": configurations(results),
        "growth": table(results.growth, GROWTH),
    }


def total_errors(results: Results) -> Table:
    """A row a joint and one for their mean; the published value beside each configuration."""
    columns: dict[str, list[object]] = {"joint": [*JOINTS, "mean"]}
    for name in results.networks:
        of = [having(results.starts, network=name, joint=k)["error_percent"] for k in JOINTS]
        columns[f"{name} (%)"] = [_with_range(v) for v in (*of, results.start_means[name])]
        if name in PUBLISHED_NETWORKS:
            known = results.published[name].reindex(JOINTS).astype(float)
            values = [*known, known.mean(skipna=False)]
            columns[f"{name} published"] = [NOT_AVAILABLE if np.isnan(v) else v for v in values]
    for name in LOOKED_UP:
        percents = results.error_percents[name]
        columns[f"{name} (%)"] = [*percents, float(percents.mean())]
    return Table(pd.DataFrame(columns, dtype=object), 3)


def _with_range(values: pd.Series) -> str:
    found = spread(values)
    several = f" ({found['least']:.3g} to {found['largest']:.3g})" if len(values) > 1 else ""
    return f"{found['median']:.3g}{several}"


def passes(results: Results) -> Table:
    """Passes from which on the training error of each joint stays below PASS_ERRORS."""
    columns: dict[str, list[object]] = {"joint": list(JOINTS)}
    for name, error in itertools.product(results.networks, PASS_ERRORS):
        needed = having(results.passes_needed(error), network=name).groupby("joint")["passes"]
        counts = needed.quantile(0.5, interpolation="higher")[list(JOINTS)]
        title = f"{name} to {100 * error:g} %"
        columns[title] = [int(count) if np.isfinite(count) else None for count in counts]
    return Table(pd.DataFrame(columns, dtype=object), 0)


def _by_distance(results: Results, column: str, scale: float, decimals: int) -> Table:
    """Means of a column of off_path: a row a method, a column a distance."""
    frame, distances = results.of("off_path"), results.section.conditions.off_path.distances
    frame["value"] = scale * frame[column]
    means = frame.pivot_table("value", "label", "distance", sort=False)
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
    columns = ["error", "orientation_error", "reached"]
    means = results.of("random_poses").pivot_table(columns, "configuration", "label")
    number = means.index.to_numpy(dtype=int)
    found = {
        "configuration": number,
        "shoulder": np.where(number & SHOULDER, "back", "front"),
        "elbow": np.where(number & ELBOW, "negative", "positive"),
        "wrist": np.where(number & WRIST, "negative", "positive"),
        "mean position (mm)": MM * means["error", WHOLE],
        "mean orientation (deg)": DEGREES * means["orientation_error", WHOLE],
    }
    for k in range(1, results.n_steps + 1):
        found[f"reached after {k} (%)"] = 100.0 * means["reached", label(WHOLE, k)]
    return Table(pd.DataFrame({**found, f"{EXACT} (%)": 100.0 * means["reached", EXACT]}))


def metrics(results: Results) -> dict[str, float | None]:
    """Flat; percent, mm and degrees.

    path.METHOD: on the path's test samples; random_poses.METHOD: at random poses. METHOD alone is
    where it belongs: networks of the path on the path (those of the median start), networks of the
    whole workspace and the closed form at random poses.
    """
    found: dict[str, float] = {}
    for name in results.networks:
        percents = zip(JOINTS, results.error_percents[name], strict=True)
        found |= {f"{name}.joint{joint}_error_percent": value for joint, value in percents}
        shifts = MM * results.start_shifts[name]
        of_starts = {"error_percent": results.start_means[name], "position_error_mm": shifts}
        for key, starts in of_starts.items():
            found[f"{name}.least_mean_{key}"] = starts.min()
            found[f"{name}.largest_mean_{key}"] = starts.max()
    for where in ("path", "random_poses"):
        for method, row in results.statistics[where].to_dict("index").items():
            errors = {
                "mean_position_error_mm": MM * row["mean"],
                "max_position_error_mm": MM * row["max"],
                "mean_orientation_error_deg": DEGREES * row["mean_turn"],
            }
            rate = {"success_percent": 100.0 * row["reached"]}
            found |= {f"{where}.{method}.{key}": value for key, value in (errors | rate).items()}
            if where == "random_poses" or method in results.networks:
                alone = errors if where == "path" else errors | rate
                found |= {f"{method}.{key}": value for key, value in alone.items()}
    section, n = results.section, len(having(results.of("off_path"), method=EXACT))
    asked = section.samples.path.n_test * len(section.conditions.off_path.distances)
    found |= {"off_path.n_targets": n, "off_path.n_left_out": asked - n}
    return {key: round(float(value), PLACES) for key, value in found.items()}


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page hold."""
    section = results.section
    shapes = {n: (e.learns, e.sizes, e.activation) for n, e in section.path_networks.items()}
    firsts = {n: next(o for o in shapes if shapes[o] == shape) for n, shape in shapes.items()}
    on_path = results.statistics["path"]
    mean = on_path["mean"]
    return {
        "results": results,
        "section": section,
        "means": {n: spread(means) | {"n": len(means)} for n, means in results.start_means.items()},
        "verdict": verdict(results),
        "twins": {name: first for name, first in firsts.items() if first != name},
        "kept": kept(results),
        "on_path": mean,
        "looked_up": LOOKED_UP,
        "beaten": {k: [n for n in results.networks if mean[k] < mean[n]] for k in LOOKED_UP},
        "turns": DEGREES * on_path.loc[results.networks, "mean_turn"],
        "reached_degrees": DEGREES * section.success.orientation,
        "floor": FLOOR,
        "studies": {name: {"what": VARIED[name], **_study(results, name)} for name in VARIED},
        "shorter": SHORTER,
        **off_path(results),
        **whole_workspace(results),
    }


def verdict(results: Results) -> dict[str, Any] | None:
    """Which of the published configurations is the more precise, and needs fewer passes."""
    if not set(PUBLISHED_NETWORKS) <= set(results.networks):
        return None
    pairs, keys = list(itertools.permutations(PUBLISHED_NETWORKS)), ["network", "joint"]
    means, of_joints = results.start_means, results.starts.groupby(keys)["error_percent"]
    least, largest = of_joints.min(), of_joints.max()
    needed = {e: results.passes_needed(e).groupby(keys)["passes"].median() for e in PASS_ERRORS}
    return {
        "names": PUBLISHED_NETWORKS,
        "winner": next((a for a, b in pairs if means[a].max() < means[b].min()), None),
        "decided": [(largest[a] < least[b]).sum() for a, b in pairs],
        "passes": {e: [(of[a] < of[b]).sum() for a, b in pairs] for e, of in needed.items()},
    }


def kept(results: Results) -> dict[Any, Any]:
    """By network: passes whose weights are kept, and test over training error there."""
    keys = ["network", "restart", "joint"]
    curves = results.curves.merge(results.starts[[*keys, "kept"]], on=keys)
    curves = curves[curves["iteration"] == curves["kept"]]
    curves["ratio"] = curves["test_error"] / curves["training_error"]
    found = curves.groupby("network", sort=False)[["kept", "ratio"]].agg(["min", "max"])
    return found.set_axis(["first", "last", "least", "largest"], axis=1).to_dict("index")


def _study(results: Results, varied: str) -> dict[str, Any]:
    frame = results.studies[varied]
    values = frame.groupby("value")
    medians = values["error_percent"].median()
    best = medians.idxmin()
    early = frame.assign(of=values["kept"].transform("size"))
    ended = early[early["stop_reason"] != "iterations"].groupby(["stop_reason", "value"])
    found = ended.agg(
        n=("of", "size"), of=("of", "max"), first=("kept", "min"), last=("kept", "max")
    )
    return {
        "best": best,
        "at_edge": len(medians) > 1 and best in (medians.index.min(), medians.index.max()),
        "early": found.reset_index().to_dict("records"),
    }


def off_path(results: Results) -> dict[str, Any]:
    """Targets left out; mean errors, and the least of looking up; how far all reach."""
    section, frame, last = results.section, results.of("off_path"), results.n_steps
    distances, n_test = section.conditions.off_path.distances, section.samples.path.n_test
    counts = having(frame, method=EXACT).groupby("distance").size()
    there = [distance for distance in distances if distance in counts]
    means = having(frame, n_steps=0).pivot_table("error", "distance", "method")
    means = means.reindex(index=there, columns=section.path_methods)
    ends = having(results.start_errors, conditions="off_path", n_steps=last)
    return {
        "left_out": {d: n_test - n for d in distances if (n := counts.get(d, 0)) < n_test},
        "distances": there,
        "by_distance": means,
        "best": means[list(LOOKED_UP)].min(axis=1),
        "reach": {
            label(name, last): _reach(having(frame, method=name, n_steps=last))
            for name in (*section.path_methods, WHOLE)
        },
        "reach_of_starts": {
            label(name, last): [_reach(r) for _, r in having(ends, method=name).groupby("restart")]
            for name in results.networks
        },
    }


def _reach(frame: pd.DataFrame) -> float | None:
    """Largest distance, m, up to which every target is reached; None: not even the first."""
    by_distance = frame.groupby("distance")["reached"].all()
    until: Iterable[Any] = itertools.takewhile(lambda item: item[1], by_distance.items())
    return max((distance for distance, _ in until), default=None)


def whole_workspace(results: Results) -> dict[str, Any]:
    """Networks against the closed form."""
    frame = results.of("random_poses")
    exact, whole = having(frame, method=EXACT), having(frame, method=WHOLE)
    low = exact[exact["singular_value"] < SINGULAR_EDGES[0]]
    wrong = whole["met"].astype(bool) & (whole["in_configuration"] == 0)
    return {
        "whole": WHOLE,
        "exact": EXACT,
        "last": label(WHOLE, results.n_steps),
        "at_random": results.statistics["random_poses"].to_dict("index"),
        "n_singular": int(exact["singular"].sum()),
        "exact_below": _power_above(MM * exact["error"].max()),
        "wrong": wrong.groupby(whole["label"], sort=False).mean().to_dict(),
        "edge": SINGULAR_EDGES[0],
        "near_singular": {
            "n": len(low),
            "least": low["singular_value"].min(),
            "position": _power_above(MM * low["error"].max()),
            "orientation": _power_above(DEGREES * low["orientation_error"].max()),
        },
    }


def _power_above(value: float) -> float:
    """Least power of ten above `value`, at least 1e-9: digits below are the machine's."""
    return float(10.0 ** max(-9, np.floor(np.log10(max(value, 1e-10))) + 1))
