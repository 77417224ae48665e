"""The report of the six-joint arm: tables, metrics, and what the sentences of its page hold."""

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.fanuc.parts.samples import SHORTER
from flexik.cases.fanuc.report_figures import FLOOR, figures
from flexik.cases.fanuc.report_results import PUBLISHED, Results, having, label, read
from flexik.cases.fanuc.report_tables import (
    JOINTS,
    PASS_ERRORS,
    SINGULAR_EDGES,
    VARIED,
    spread,
    tables,
)
from flexik.cases.fanuc.section import EXACT, LOOKED_UP, PUBLISHED_NETWORKS, WHOLE, Section
from flexik.reporting.report import Content, made_from, write_report
from flexik.reporting.style import DEGREES, MM

# Digits of metrics: what machines agree on
PLACES = 4


def report(section: Section) -> None:
    """Write reports/fanuc from data/fanuc."""
    results = read(section)
    write_report(
        section.report,
        Path(__file__).with_name("page.md.j2"),
        Content(tables(results), figures(results), metrics(results), values(results)),
        sources=made_from(section, [PUBLISHED]),
        record=section.data / "report.json",
    )


def metrics(results: Results) -> dict[str, float | None]:
    """Flat; percent, mm and degrees.

    path.METHOD: on the path's test samples; random_poses.METHOD: at random poses. METHOD alone is
    where it belongs: networks of the path on the path (those of the median start), networks of the
    whole workspace and the closed form at random poses.
    """
    found: dict[str, float] = {}
    for name in results.networks:
        for joint, value in zip(JOINTS, results.error_percents[name], strict=True):
            found[f"{name}.joint{joint}_error_percent"] = value
        shifts = MM * results.start_shifts[name]
        of_starts = {"error_percent": results.start_means[name], "position_error_mm": shifts}
        for key, starts in of_starts.items():
            found[f"{name}.least_mean_{key}"] = starts.min()
            found[f"{name}.largest_mean_{key}"] = starts.max()
    for where in ("path", "random_poses"):
        for label_, row in results.statistics[where].iterrows():
            name = str(label_)
            errors = {
                "mean_position_error_mm": MM * row["mean"],
                "max_position_error_mm": MM * row["max"],
                "mean_orientation_error_deg": DEGREES * row["mean_turn"],
            }
            rate = {"success_percent": 100.0 * row["reached"]}
            found |= {f"{where}.{name}.{key}": value for key, value in (errors | rate).items()}
            if where == "random_poses" or name in results.networks:
                alone = errors if where == "path" else errors | rate
                found |= {f"{name}.{key}": value for key, value in alone.items()}
    section, n = results.section, len(having(results.of("off_path"), method=EXACT))
    asked = section.samples.path.n_test * len(section.conditions.off_path.distances)
    found |= {"off_path.n_targets": n, "off_path.n_left_out": asked - n}
    return {key: round(float(value), PLACES) for key, value in found.items()}


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page hold."""
    section = results.section
    trainers = {n: section.trainers[e.trainer] for n, e in section.path_networks.items()}
    shapes = {n: (e.learns, e.sizes, e.activation) for n, e in section.path_networks.items()}
    on_path = results.statistics["path"].to_dict("index")
    firsts = {n: next(o for o in shapes if shapes[o] == shape) for n, shape in shapes.items()}
    return {
        "section": section,
        "networks": section.path_networks,
        "trainers": trainers,
        "kinds": list(results.by_trainer),
        "means": {name: spread(means) for name, means in results.start_means.items()},
        "verdict": verdict(results),
        "twins": {name: first for name, first in firsts.items() if first != name},
        "kept": kept(results),
        "on_path": on_path,
        "looked_up": LOOKED_UP,
        "beaten": {
            each: [n for n in results.networks if on_path[each]["mean"] < on_path[n]["mean"]]
            for each in LOOKED_UP
        },
        "turns": [DEGREES * on_path[name]["mean_turn"] for name in results.networks],
        "reached_degrees": DEGREES * section.success.orientation,
        "floor": FLOOR,
        "studies": {name: _study_values(results, name) for name in VARIED},
        "shorter": SHORTER,
        **off_path(results),
        **whole_workspace(results),
    }


def verdict(results: Results) -> dict[str, Any] | None:
    """Which of the published configurations is the more precise, and needs fewer passes."""
    one, other = PUBLISHED_NETWORKS
    if not {one, other} <= set(results.networks):
        return None
    means = results.start_means
    by_joint = results.starts.groupby(["network", "joint"])["error_percent"]
    decided = [
        clearly_less(by_joint.get_group((one, joint)), by_joint.get_group((other, joint)))
        for joint in JOINTS
    ]
    won = {}
    for error in PASS_ERRORS:
        medians = results.passes_needed(error).groupby(["network", "joint"])["passes"].median()
        first, second = medians[one], medians[other]
        won[error] = int((first < second).sum()), int((first > second).sum())
    clear = clearly_less(means[one], means[other])
    return {
        "names": PUBLISHED_NETWORKS,
        "winner": PUBLISHED_NETWORKS[clear - 1] if clear else None,
        "decided": (decided.count(1), decided.count(2)),
        "passes": won,
    }


def clearly_less(one: pd.Series, other: pd.Series) -> int:
    """1 if all of `one` are less than all of `other`, 2 the other way round, else 0."""
    return 1 if one.max() < other.min() else 2 if other.max() < one.min() else 0


def kept(results: Results) -> dict[str, dict[str, float]]:
    """By network: passes whose weights are kept, and test over training error there."""
    keys = ["network", "restart", "joint"]
    curves = results.curves.merge(results.starts[[*keys, "kept"]], on=keys)
    curves = curves[curves["iteration"] == curves["kept"]]
    ratio = curves["test_error"] / curves["training_error"]
    groups = curves.assign(ratio=ratio).groupby("network")
    found = groups[["kept", "ratio"]].agg(["min", "max"])
    found.columns = ["first", "last", "least", "largest"]
    return found.loc[results.networks].to_dict("index")  # type: ignore[return-value]


def _study_values(results: Results, varied: str) -> dict[str, Any]:
    frame = results.studies[varied]
    medians = frame.groupby("value")["error_percent"].median()
    best = medians.idxmin()
    early = frame[frame["stop_reason"] != "iterations"].groupby(["stop_reason", "value"])["kept"]
    return {
        "what": VARIED[varied],
        "best": best,
        "at_edge": len(medians) > 1 and best in (medians.index.min(), medians.index.max()),
        "settings": getattr(results.section.studies, varied),
        "early": [
            {
                "reason": reason,
                "value": value,
                "n": len(passes),
                "of": int((frame["value"] == value).sum()),
                "passes": (passes.min(), passes.max()),
            }
            for (reason, value), passes in early
        ],
    }


def off_path(results: Results) -> dict[str, Any]:
    """Targets left out; ends of the means; where networks beat looking up; how far all reach."""
    section, frame = results.section, results.of("off_path")
    distances, n_test = section.conditions.off_path.distances, section.samples.path.n_test
    counts = having(frame, method=EXACT).groupby("distance").size()
    there = [distance for distance in distances if distance in counts]
    means = having(frame, n_steps=0).groupby(["method", "distance"])["error"].mean()
    best = {d: min(means[name, d] for name in LOOKED_UP) for d in there}
    last = results.n_steps
    ends = having(results.start_errors, conditions="off_path", n_steps=last)
    return {
        "left_out": {d: n_test - counts.get(d, 0) for d in distances if counts.get(d, 0) < n_test},
        "distances": there,
        "ends": {
            name: [(d, means[name, d]) for d in dict.fromkeys(there[:1] + there[-1:])]
            for name in section.path_methods
        },
        "wins": {
            name: [MM * d for d in there if means[name, d] < best[d]] for name in results.networks
        },
        "reach": {
            label(name, last): _reach(having(frame, method=name, n_steps=last))
            for name in (*section.path_methods, WHOLE)
        },
        "reach_of_starts": {
            label(name, last): [
                _reach(rows) for _, rows in having(ends, method=name).groupby("restart")
            ]
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
    exact = having(frame, method=EXACT)
    low = exact[exact["singular_value"] < SINGULAR_EDGES[0]]
    wrong = frame["met"].astype(bool) & (frame["in_configuration"] == 0)
    whole = frame["method"] == WHOLE
    worst = {name: low[f"{name}error"].max() for name in ("", "orientation_")} if len(low) else {}
    return {
        "whole": WHOLE,
        "exact": EXACT,
        "last": label(WHOLE, results.n_steps),
        "at_random": results.statistics["random_poses"].to_dict("index"),
        "n_singular": int(exact["singular"].sum()),
        "exact_below": _power_above(MM * exact["error"].max()),
        "wrong": wrong[whole].groupby(frame["label"][whole], sort=False).mean().to_dict(),
        "edge": SINGULAR_EDGES[0],
        "near_singular": {
            "n": len(low),
            "least": low["singular_value"].min(),
            "position": _power_above(MM * worst[""]),
            "orientation": _power_above(DEGREES * worst["orientation_"]),
        }
        if len(low)
        else None,
        "n_growth": len(results.growth),
    }


def _power_above(value: float) -> float:
    """Least power of ten above `value`, at least 1e-9: digits below are the machine's."""
    return float(10.0 ** max(-9, np.floor(np.log10(max(value, 1e-10))) + 1))
