"""Studies of the SmartEE's trainings in its report: initial weights, constants, sizes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee.report_results import STATISTICS, Results, scientific
from flexik.cases.smartee.section import SELECTION
from flexik.learning.starts import by_trainer
from flexik.reporting.report import Content
from flexik.reporting.tables import Column, Table, mm, table

PENALISED, UNPENALISED = "regularised_cg", "unpenalised_cg"
# A median error this near, relatively, to that of the best linear map is at its plateau
PLATEAU = 0.1
CAPPED = "iterations"


def content(results: Results) -> Content:
    """Tables, metrics and values."""
    tables = {
        "starts": starts(results),
        "thresholds": Table(thresholds(results), 1),
        "sensitivity": Table(sensitivity(results), 1),
        "sizes": Table(sizes(results), 6),
    }
    return Content(tables, metrics=metrics(results), values=values(results))


def metrics(results: Results) -> dict[str, float]:
    """Share of success and median error of every trainer and spread, four digits."""
    found = {}
    for row in by_trainer(results.starts).to_dict("records"):
        for name in ("success_share", "median_error"):
            key = f"starts.{row['trainer']}.{row['spread']}.{name}"
            found[key] = float(f"{row[name]:.4g}")
    return found


STARTS = {
    "trainer": "trainer",
    "start": "spread",
    "success (%)": Column("success_share", 1, 100.0),
    **{f"{name} error": f"{name}_error" for name in STATISTICS},
    "median elbow peak (mrad)": mm("median_judged"),
    "iterations": "iterations",
    "to success": "median_success_iteration",
    "ended by": "reasons",
    "seconds a run": "seconds",
    "median error of long runs": "long_error",
}


def starts(results: Results) -> Table:
    """A row for every trainer and spread, with the times of the benchmark."""
    keys, trainers = ["trainer", "spread"], results.section.trainers
    times = results.training_times[[*keys, "seconds", "long_error"]]
    found = by_trainer(results.starts).merge(times, "left", keys)
    ends = results.starts.groupby(keys, sort=False)["stop_reason"].agg(_counted)
    found["reasons"] = ends.to_numpy()
    found["iterations"] = [str(trainers[name].n_iterations) for name in found["trainer"]]
    for name in ("least_error", "median_error", "largest_error", "long_error"):
        found[name] = found[name].map(scientific)
    first = found["median_success_iteration"]
    found["median_success_iteration"] = ["" if np.isnan(v) else f"{v:.0f}" for v in first]
    return table(found, STARTS)


def thresholds(results: Results) -> pd.DataFrame:
    """Share (%) of the starts that end at or below each error, a row a trainer and spread."""
    rows = []
    for (trainer, spread), group in results.starts.groupby(["trainer", "spread"], sort=False):
        shares = {f"{v:g} (%)": _share(group["error"], v) for v in _limits(results)}
        rows.append({"trainer": trainer, "start": spread, **shares})
    return pd.DataFrame(rows)


def sensitivity(results: Results) -> pd.DataFrame:
    """A row for every pair of the two constants: what the same starts come to."""
    rows = []
    for pair, group in results.sensitivity.groupby("trainer", sort=False)["error"]:
        row: dict[str, object] = dict(zip(("p", "tau"), str(pair).split(", "), strict=True))
        row["success (%)"] = _share(group, results.section.studies.starts.success)
        for name, statistic in STATISTICS.items():
            row[f"{name} error"] = scientific(group.agg(statistic))
        rows.append(row)
    return pd.DataFrame(rows)


def sizes(results: Results) -> pd.DataFrame:
    """A row for every size: of each of the sets of rows to learn from."""
    names = {
        "training_error": "training",
        "selection_error": "selection, best start",
        "worst_selection_error": "selection, worst start",
    }
    parts = []
    for poses, rows in results.sizes.groupby("poses", sort=False):
        labels = {column: f"{poses}: {label}" for column, label in names.items()}
        parts.append(rows.set_index("n_hidden")[list(names)].rename(columns=labels))
    return pd.concat(parts, axis=1).rename_axis("M").reset_index()


def values(results: Results) -> dict[str, Any]:
    """Numbers for the sentences."""
    own, times = results.section.studies.starts, results.training_times
    reached = times["long_error"] <= own.success
    return {
        "starts": own,
        "untuned": [name for name in own.trainers if name not in own.tuned],
        "penalised": PENALISED,
        "unpenalised": UNPENALISED,
        "differing": _differing(results),
        "penalty": _penalty(results),
        "n_runs": len(results.starts),
        "all_capped": set(results.starts["stop_reason"]) == {CAPPED},
        "linear_error": results.linear_error,
        "plateaus": [
            row
            for row in by_trainer(results.starts).to_dict("records")
            if abs(row["median_error"] / results.linear_error - 1.0) <= PLATEAU
        ],
        "seconds": times["seconds"].tolist(),
        "long": times[["n_starts", "long_factor"]].astype(int).to_dict("records")[:1],
        "long_runs": [
            (what, [f"{row.trainer} ({row.spread})" for row in times[rows].itertuples()])
            for what, rows in (("get there", reached), ("do not", ~reached))
        ],
        "long_ratios": _long_ratios(results),
        "other_constants": _other_constants(results),
        "sizes": [_size(results, str(k), v) for k, v in results.sizes.groupby("poses", sort=False)],
    }


def _differing(results: Results) -> list[str]:
    """Settings in which the two trainers with the same minimiser differ."""
    trainers = results.section.trainers
    if not {PENALISED, UNPENALISED} <= trainers.keys():
        return []
    one, other = (dict(trainers[name]) for name in (PENALISED, UNPENALISED))
    return [f"{key} ({one[key]} and {other.get(key)})" for key in one if one[key] != other.get(key)]


def _penalty(results: Results) -> list[dict[str, Any]]:
    """What the penalty does from the starts of each spread, and in how many starts."""
    found = []
    for spread in results.section.studies.starts.spreads:
        rows = results.starts[results.starts["spread"] == spread]
        errors = [rows.loc[rows["trainer"] == name, "error"] for name in (PENALISED, UNPENALISED)]
        if len(errors[0]) and len(errors[1]):
            medians = [series.median() for series in errors]
            lower = errors[0].to_numpy() < errors[1].to_numpy()
            shares = {limit: [_share(e, limit) for e in errors] for limit in _limits(results)}
            both = {"ratio": medians[0] / medians[1], "n_lower": int(lower.sum())}
            found.append({"spread": spread, "n_starts": len(lower), "shares": shares, **both})
    return found


def _limits(results: Results) -> list[float]:
    own = results.section.studies.starts
    return sorted({own.success, *own.thresholds}, reverse=True)


def _long_ratios(results: Results) -> list[str]:
    """Median error of long runs from the farthest starts over that from the nearest."""
    own = results.section.studies.starts
    near, far = (choose(own.spreads, key=own.spreads.__getitem__) for choose in (min, max))
    errors = results.training_times.set_index(["trainer", "spread"])["long_error"]
    return [
        f"{trainer} {errors[trainer, far] / errors[trainer, near]:.1f}"
        for trainer in own.trainers
        if near != far and (trainer, near) in errors and (trainer, far) in errors
    ]


def _other_constants(results: Results) -> dict[str, Any]:
    """How much hangs on the constants the paper does not give."""
    chosen, pairs = results.section.studies.sensitivity, sensitivity(results)
    trainer: Any = results.section.trainers[chosen.trainer]
    own = {"p": f"{trainer.penalty:g}", "tau": f"{trainer.penalty_decrease:g}"}
    shares = pairs.loc[(pairs[list(own)] != pd.Series(own)).any(axis=1), "success (%)"]
    same = results.starts.query("spread == @chosen.spread and start < @chosen.n_starts")
    medians = same.groupby("trainer")["error"].median()
    errors = results.sensitivity.groupby("trainer")["error"].median()
    without = float(medians.get(UNPENALISED, np.nan))
    return {
        "chosen": chosen,
        "trainer": trainer,
        "shares": [shares.min(), shares.max()] if len(shares) else [],
        "without": without,
        "n_lower": int((errors < without).sum()),
        "n_pairs": len(errors),
    }


def _size(results: Results, poses: str, rows: pd.DataFrame) -> dict[str, Any]:
    """Where the selection error is least, and what it is over the training error."""
    best = rows["n_hidden"].to_numpy()[rows["selection_error"].argmin()]
    ratio = rows["selection_error"] / rows["training_error"]
    samples = results.section.samples.poses
    return {
        "poses": poses,
        "n_poses": samples[poses].n_poses,
        "best": int(best),
        "largest": bool(best == rows["n_hidden"].max()),
        "ratios": [ratio.min(), ratio.max()],
        "extents": [samples[poses].extent, samples[SELECTION].extent],
    }


def _share(errors: pd.Series, limit: float) -> float:
    """Of errors at or below `limit`, %; a run that failed (NaN) is above."""
    return 100.0 * float((errors <= limit).mean())


def _counted(reasons: Sequence[str]) -> str:
    counts = pd.Series(reasons).value_counts()
    return ", ".join(f"{reason}: {count}" for reason, count in sorted(counts.items()))
