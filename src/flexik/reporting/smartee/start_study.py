"""Tables of the study of initial weights of the SmartEE, and the sentences under them."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from flexik.learning.starts import by_trainer
from flexik.reporting.smartee.results import Results, scientific

MRAD = 1e3
PENALISED, UNPENALISED = "regularised_cg", "unpenalised_cg"
# A median error this near, relatively, to that of the best linear map is at its plateau
PLATEAU = 0.1
CAPPED = "iterations"


def starts(results: Results) -> pd.DataFrame:
    """A row for every trainer and spread, with the times of the benchmark."""
    table = by_trainer(results.starts)
    times = results.training_times.set_index(["trainer", "spread"])
    reasons = results.starts.groupby(["trainer", "spread"])["stop_reason"].agg(_counted)
    rows = []
    for row in table.to_dict("records"):
        key = row["trainer"], row["spread"]
        time = times.loc[key] if key in times.index else pd.Series(dtype=float)
        rows.append(
            {
                "trainer": row["trainer"],
                "start": row["spread"],
                "success (%)": 100.0 * float(row["success_share"]),
                "least error": scientific(row["least_error"]),
                "median error": scientific(row["median_error"]),
                "largest error": scientific(row["largest_error"]),
                "median elbow peak (mrad)": MRAD * float(row["median_judged"]),
                "iterations": str(results.smartee.trainers[str(row["trainer"])].n_iterations),
                "to success": _whole(float(row["median_success_iteration"])),
                "ended by": reasons[key],
                "seconds a run": float(time.get("seconds", np.nan)),
                "median error of long runs": scientific(float(time.get("long_error", np.nan))),
            }
        )
    return pd.DataFrame(rows)


def thresholds(results: Results) -> pd.DataFrame:
    """Share (%) of the starts that end at or below each error, a row a trainer and spread."""
    own = results.smartee.starts
    limits = sorted({own.success, *own.thresholds}, reverse=True)
    rows = []
    for (trainer, spread), group in results.starts.groupby(["trainer", "spread"], sort=False):
        shares = {f"{limit:g} (%)": _share(group["error"], limit) for limit in limits}
        rows.append({"trainer": trainer, "start": spread, **shares})
    return pd.DataFrame(rows)


def sensitivity(results: Results) -> pd.DataFrame:
    """A row for every pair of the two constants: what the same starts come to."""
    own = results.smartee.starts
    rows = []
    for pair, group in results.sensitivity.groupby("trainer", sort=False):
        penalty, decrease = str(pair).split(", ")
        rows.append(
            {
                "p": penalty,
                "tau": decrease,
                "success (%)": _share(group["error"], own.success),
                "least error": scientific(group["error"].min()),
                "median error": scientific(group["error"].median()),
                "largest error": scientific(group["error"].max()),
            }
        )
    return pd.DataFrame(rows)


def start_notes(results: Results) -> list[str]:
    """What the starts say about the paper's claim."""
    own = results.smartee.starts
    spreads = ", ".join(f"{name}: {value:g}" for name, value in own.spreads.items())
    return [
        f"Weights uniform up to the spread ({spreads}); {own.n_hidden} hidden neurons, all "
        "trainers from the same starts. Success: mean squared error of the normalised outputs "
        f"down to {own.success:g} within the iterations. Elbow peak: over the validation poses.",
        *_chosen_notes(results),
        *_penalty_notes(results),
        *_end_notes(results),
        *_long_notes(results),
    ]


def threshold_notes(results: Results) -> list[str]:
    """How the verdict on the penalty hangs on where success is cut."""
    table = thresholds(results)
    limits = [str(name) for name in table.columns if str(name).endswith(" (%)")]
    rows = {(row["trainer"], row["start"]): row for row in table.to_dict("records")}
    found = [
        "Success is a cut through curves that are steep (see the figure), so its share hangs on "
        "where one cuts as on the iterations; the errors themselves tell more."
    ]
    for spread in results.smartee.starts.spreads:
        keys = [(trainer, spread) for trainer in (PENALISED, UNPENALISED)]
        if not all(key in rows for key in keys):
            continue
        with_penalty, without = (rows[key] for key in keys)
        parts = [
            f"{limit.removesuffix(' (%)')}: {with_penalty[limit]:.0f} % against "
            f"{without[limit]:.0f} %"
            for limit in limits
        ]
        found.append(f"Starts {spread}, with the penalty against without: {'; '.join(parts)}.")
    return found


def sensitivity_notes(results: Results) -> list[str]:
    """How much hangs on the constants the paper does not give."""
    own = results.smartee.starts
    chosen, table = own.sensitivity, sensitivity(results)
    trainer = results.smartee.trainers[chosen.trainer].model_dump()
    shares = table["success (%)"]
    same = results.starts[
        (results.starts["spread"] == chosen.spread) & (results.starts["start"] < chosen.n_starts)
    ]
    medians = same.groupby("trainer", sort=False)["error"].median()
    found = [
        f"`{chosen.trainer}` has p = {trainer['penalty']:g} and tau = "
        f"{trainer['penalty_decrease']:g}; all else as there. Success with other pairs: "
        f"{shares.min():.0f} to {shares.max():.0f} %.",
    ]
    if UNPENALISED in medians:
        errors = results.sensitivity.groupby("trainer", sort=False)["error"].median()
        better = int((errors < medians[UNPENALISED]).sum())
        found.append(
            f"Without a penalty the same starts come to {scientific(medians[UNPENALISED])} in the "
            f"median; {better} of the {len(errors)} pairs come lower."
        )
    return found


def _chosen_notes(results: Results) -> list[str]:
    """How the settings were chosen, and in how far they compare."""
    own, found = results.smartee.starts, []
    others = [name for name in own.trainers if name not in own.tuned]
    if own.tuned and others:
        found.append(
            f"Constants of {_names(own.tuned)} were searched for on this problem, over a small "
            f"grid; {_names(others)} had no such search: part of the difference is owed to that."
        )
    seconds = results.training_times["seconds"]
    if len(seconds):
        found.append(
            f"Iterations were to take about the same time; a run takes {seconds.min():.2f} to "
            f"{seconds.max():.2f} s."
        )
    if {PENALISED, UNPENALISED} <= set(own.trainers):
        one, other = (results.smartee.trainers[k].model_dump() for k in (PENALISED, UNPENALISED))
        keys = [key for key in one if one[key] != other.get(key)]
        differing = ", ".join(f"{key} ({one[key]} and {other.get(key)})" for key in keys)
        found.append(
            f"`{UNPENALISED}` is the minimiser of `{PENALISED}`; settings that differ: {differing}."
        )
    return found


def _penalty_notes(results: Results) -> list[str]:
    found = []
    rows = {(r["trainer"], r["spread"]): r for r in by_trainer(results.starts).to_dict("records")}
    for spread in results.smartee.starts.spreads:
        keys = [(trainer, spread) for trainer in (PENALISED, UNPENALISED)]
        if not all(key in rows for key in keys):
            continue
        with_penalty, without = (rows[key] for key in keys)
        ratio = with_penalty["median_error"] / without["median_error"]
        effect = "lowers" if ratio < 1.0 else "raises"
        found.append(
            f"Starts {spread}: the penalty {effect} the median error, {ratio:.2f} times that "
            f"without; {100 * with_penalty['success_share']:.0f} % of the starts succeed with it, "
            f"{100 * without['success_share']:.0f} % without, at these constants, this error and "
            "these iterations."
        )
    return found


def _end_notes(results: Results) -> list[str]:
    """What the ends of the runs do and do not say."""
    found = []
    reasons = results.starts["stop_reason"]
    if set(reasons) == {CAPPED}:
        found.append(
            f"All {len(reasons)} runs ended at their number of iterations, which is a cap: that "
            "none ended in a stationary point says little about local minima, only that what "
            "fails is still falling or crosses a plateau too slowly."
        )
    for row in by_trainer(results.starts).to_dict("records"):
        if abs(row["median_error"] / results.linear_error - 1.0) <= PLATEAU:
            found.append(
                f"{row['trainer']} ({row['spread']}) ends on a plateau: its median error "
                f"{scientific(row['median_error'])} is that of the best linear map of the inputs, "
                f"{scientific(results.linear_error)}."
            )
    return found


def _long_notes(results: Results) -> list[str]:
    """Runs of the benchmark with many times the iterations."""
    times, own = results.training_times, results.smartee.starts
    if times.empty:
        return ["No times: the benchmark was run with other parameters."]
    factor, n_long = int(times["long_factor"].iloc[0]), int(times["n_starts"].iloc[0])
    found = [
        f"Seconds a run and long runs ({factor} times the iterations): measured by a benchmark, "
        f"medians of {n_long} starts, which are few beside the {own.n_starts} of the study."
    ]
    low, slow = times[times["long_error"] <= own.success], times[times["long_error"] > own.success]
    for part, what in ((low, "get there"), (slow, "do not")):
        if len(part):
            pairs = zip(part["trainer"], part["spread"], strict=True)
            names = ", ".join(f"{trainer} ({spread})" for trainer, spread in pairs)
            found.append(f"With {factor} times the iterations these {what}: {names}.")
    near, far = (choose(own.spreads, key=own.spreads.__getitem__) for choose in (min, max))
    errors = times.set_index(["trainer", "spread"])["long_error"].to_dict()
    ratios = [
        f"{trainer} {errors[trainer, far] / errors[trainer, near]:.1f}"
        for trainer in own.trainers
        if (trainer, near) in errors and (trainer, far) in errors
    ]
    if ratios and near != far:
        found.append(
            f"Long runs, median error of starts {far} over that of starts {near}: "
            f"{', '.join(ratios)}."
        )
    return found


def _names(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _share(errors: pd.Series, limit: float) -> float:
    """Of errors at or below `limit`, %; a run that failed (NaN) is above."""
    return 100.0 * float((errors <= limit).mean())


def _whole(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.0f}"


def _counted(reasons: Sequence[str]) -> str:
    counts = pd.Series(reasons).value_counts()
    return ", ".join(f"{reason}: {count}" for reason, count in sorted(counts.items()))
