"""Studies of the SmartEE's trainings in its report: initial weights, constants, sizes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.smartee.report_results import Results, scientific
from flexik.learning.starts import by_trainer
from flexik.reporting.tables import Column, Table, mm, spread, table

PENALISED, UNPENALISED = "regularised_cg", "unpenalised_cg"
# A median error this near, relatively, to that of the best linear map is at its plateau
PLATEAU = 0.1
CAPPED = "iterations"
STARTS = {
    "trainer": "trainer",
    "start": "spread",
    "success (%)": Column("success_share", 1, 100.0),
    **{f"{name} error": f"{name}_error" for name in ("least", "median", "largest")},
    "median elbow peak (mrad)": mm("median_judged"),
    "iterations": "iterations",
    "to success": "median_success_iteration",
    "ended by": "reasons",
    "seconds a run": "seconds",
    "median error of long runs": "long_error",
}


def tables(results: Results) -> dict[str, Table]:
    """Tables by name."""
    return {
        "starts": starts(results),
        "thresholds": Table(thresholds(results), 1),
        "sensitivity": Table(sensitivity(results), 1),
        "sizes": Table(sizes(results), 6),
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
    errors = results.starts.groupby(["trainer", "spread"], sort=False)["error"]
    shares = pd.DataFrame({f"{v:g} (%)": errors.agg(_share, v) for v in _limits(results)})
    return shares.rename_axis(["trainer", "start"]).reset_index()


def sensitivity(results: Results) -> pd.DataFrame:
    """A row for every pair of the two constants: what the same starts come to."""
    rows = []
    for pair, group in results.sensitivity.groupby("trainer", sort=False)["error"]:
        row: dict[str, object] = dict(zip(("p", "tau"), str(pair).split(", "), strict=True))
        row["success (%)"] = _share(group, results.section.studies.starts.success)
        row |= {f"{name} error": scientific(error) for name, error in spread(group).items()}
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
    reached, ends = times["long_error"] <= own.success, by_trainer(results.starts)
    return {
        "starts": own,
        "untuned": [name for name in own.trainers if name not in own.tuned],
        "penalised": PENALISED,
        "unpenalised": UNPENALISED,
        "differing": _differing(results),
        "penalty": _penalty(results),
        "all_capped": set(results.starts["stop_reason"]) == {CAPPED},
        "plateaus": ends[(ends["median_error"] / results.linear_error - 1.0).abs() <= PLATEAU],
        "seconds": times["seconds"].tolist(),
        "long": times[["n_starts", "long_factor"]].astype(int).to_dict("records")[:1],
        "long_runs": [
            (what, [f"{row.trainer} ({row.spread})" for row in times[rows].itertuples()])
            for what, rows in (("get there", reached), ("do not", ~reached))
        ],
        "long_ratios": _long_ratios(results),
        "other_constants": _other_constants(results),
        "sizes": {name: _size(rows) for name, rows in results.sizes.groupby("poses", sort=False)},
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
    for name, rows in results.starts.groupby("spread", sort=False):
        errors = rows.pivot_table("error", "start", "trainer", dropna=False)
        if {PENALISED, UNPENALISED} <= set(errors):
            one, other = errors[PENALISED], errors[UNPENALISED]
            shares = {limit: [_share(e, limit) for e in (one, other)] for limit in _limits(results)}
            both = {"ratio": one.median() / other.median(), "n_lower": int((one < other).sum())}
            found.append({"spread": name, "n_starts": len(errors), "shares": shares, **both})
    return found


def _limits(results: Results) -> list[float]:
    own = results.section.studies.starts
    return sorted({own.success, *own.thresholds}, reverse=True)


def _long_ratios(results: Results) -> list[str]:
    """Median error of long runs from the farthest starts over that from the nearest."""
    own = results.section.studies.starts
    near, far = (choose(own.spreads, key=own.spreads.__getitem__) for choose in (min, max))
    errors = results.training_times.pivot_table("long_error", "trainer", "spread")
    if not {near, far} <= set(errors) or near == far:
        return []
    ratios = (errors[far] / errors[near]).reindex(own.trainers).dropna()
    return [f"{trainer} {ratio:.1f}" for trainer, ratio in ratios.items()]


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


def _size(rows: pd.DataFrame) -> dict[str, Any]:
    """Where the selection error is least, and what it is over the training error."""
    rows = rows.set_index("n_hidden")
    best = rows["selection_error"].idxmin()
    ratio = rows["selection_error"] / rows["training_error"]
    largest = best == rows.index.max()
    return {"best": best, "largest": largest, "ratios": [ratio.min(), ratio.max()]}


def _share(errors: pd.Series, limit: float) -> float:
    """Of errors at or below `limit`, %; a run that failed (NaN) is above."""
    return 100.0 * float((errors <= limit).mean())


def _counted(reasons: Sequence[str]) -> str:
    counts = pd.Series(reasons).value_counts()
    return ", ".join(f"{reason}: {count}" for reason, count in sorted(counts.items()))
