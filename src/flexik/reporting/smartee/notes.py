"""Sentences under the tables of the SmartEE's report, all from the data."""

import numpy as np

from flexik.datasets.smartee.poses import path_name
from flexik.evaluation.smartee.errors import OUTSIDE
from flexik.learning.starts import by_trainer
from flexik.parameters.smartee import BEST, CENTRE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting.smartee.results import QUANTITIES, Results

# The better network is to be this many times below the published peaks
MARGIN = 10.0
# Elbow error that two Newton steps are to reach, rad
TARGET = 1e-9
# n_steps of the benchmark where Newton's method goes on until it converges
SOLVED = -1


def peak_notes(results: Results) -> list[str]:
    """Whether the peaks are where they are to be."""
    smartee = results.smartee
    found = []
    for name, margin, goal in (
        (PUBLISHED, 1.0, "the published peaks"),
        (BEST, MARGIN, f"the published peaks over {MARGIN:g}"),
    ):
        ratios = {
            quantity: results.peak(name, 0, VALIDATION, quantity) / results.published_peak(quantity)
            for quantity in QUANTITIES
        }
        missed = [f"{key} ({ratio:.2f})" for key, ratio in ratios.items() if ratio * margin > 1.0]
        listed = ", ".join(f"{key} {ratio:.3f}" for key, ratio in ratios.items())
        verdict = "misses " + ", ".join(missed) if missed else "meets all three"
        found.append(f"`{name}` against {goal}: {verdict}. Ratio to the published peak: {listed}.")
    for name, network in smartee.networks.items():
        poses = smartee.poses[network.poses]
        rows = 6 * poses.n_poses if poses.permutations == "legs" else poses.n_poses
        images = ", with the images of each under leg permutations" if rows > poses.n_poses else ""
        trainer, chosen_by = smartee.trainers[network.trainer].kind, smartee.poses["selection"]
        found.append(
            f"`{name}`: {network.n_hidden} hidden neurons, trained by {trainer} on {rows} rows of "
            f"{poses.n_poses} poses over {poses.extent:g} times the box{images}; best of "
            f"{network.n_restarts} restarts by {chosen_by.n_poses} selection poses, none of which "
            "is a validation pose."
        )
    random = len(results.random)
    found.append(
        f"random: {random} poses that nothing was chosen by. A peak over more poses is larger, so "
        "beside the published peaks stand those of the validation poses."
    )
    return found


def direct_notes(results: Results) -> list[str]:
    """What the ways to the elbows come to."""
    smartee = results.smartee
    steps = smartee.newton.network_steps
    peaks = {
        poses: results.peak(PUBLISHED, steps, poses, "elbow") for poses in (VALIDATION, RANDOM)
    }
    verdict = "reached" if max(peaks.values()) <= TARGET else "missed"
    found = [
        f"`{PUBLISHED}` and {steps} Newton steps: {peaks[VALIDATION]:.1e} rad at most over the "
        f"validation poses, {peaks[RANDOM]:.1e} rad over the random ones; {TARGET:g} rad is "
        f"{verdict}.",
        "Columns: the validation and random poses, and closed paths through the box by the number "
        "of their samples. `centre`: from the elbows at the centre of the box; `previous`: from "
        "those found at the sample before.",
    ]
    needed = _steps_like(results, CENTRE, RANDOM, peaks[RANDOM])
    if needed is not None:
        found.append(
            f"From the centre Newton needs {needed} steps to be as near over the random poses as "
            f"`{PUBLISHED}` with {steps}."
        )
    else:
        found.append(
            f"From the centre {smartee.newton.shown_steps} Newton steps are not yet as near over "
            f"the random poses as `{PUBLISHED}` with {steps}."
        )
    first = results.peak(CENTRE, 1, RANDOM, "elbow")
    start = results.peak(CENTRE, 0, RANDOM, "elbow")
    if first > start:
        found.append(
            f"The first step from the centre goes too far for some poses: from {start:.2f} to "
            f"{first:.2f} rad."
        )
    for n_samples in smartee.path.n_samples:
        path = path_name(n_samples)
        own = results.peak(PREVIOUS, 1, path, "elbow")
        other = results.peak(PUBLISHED, 1, path, "elbow")
        better = "less" if own < other else "more"
        found.append(
            f"A path of {n_samples} samples: one step from the previous pose leaves {own:.1e} rad, "
            f"{better} than one step from `{PUBLISHED}` ({other:.1e} rad)."
        )
    found.append(_time_note(results))
    condition = results.condition_numbers()
    found.append(
        f"Condition number of the closure equations by the elbows: {np.median(condition):.2f} in "
        f"the median of the random poses, {condition.max():.2f} at most."
    )
    return found


def _time_note(results: Results) -> str:
    table, steps = results.query_times, results.smartee.newton.network_steps
    times = {
        (method, int(n_steps)): (single, batched)
        for method, n_steps, single, batched in table[
            ["method", "n_steps", "microseconds_single", "microseconds_batched"]
        ].itertuples(index=False, name=None)
    }
    both, solved = times.get((PUBLISHED, steps)), times.get((CENTRE, SOLVED))
    if both is None or solved is None:
        return "No times: the benchmark was run with other parameters."
    return (
        f"A pose takes `{PUBLISHED}` with {steps} steps {both[0]:.0f} us alone and {both[1]:.1f} "
        f"us in a batch, Newton from the centre until it converges {solved[0]:.0f} us and "
        f"{solved[1]:.1f} us."
    )


def _steps_like(results: Results, method: str, poses: str, error: float) -> int | None:
    for n_steps in range(1, results.smartee.newton.shown_steps + 1):
        if results.peak(method, n_steps, poses, "elbow") <= error:
            return n_steps
    return None


def start_notes(results: Results) -> list[str]:
    """What the starts say about the paper's claim."""
    starts = results.smartee.starts
    table = by_trainer(results.starts)
    spreads = ", ".join(f"{name}: {value:g}" for name, value in starts.spreads.items())
    found = [
        f"Weights uniform up to the spread ({spreads}); {starts.n_hidden} hidden neurons, all "
        "trainers from the same starts, with iterations that take about the same time. Success: "
        f"mean squared error of the normalised outputs down to {starts.success:g} within them. "
        f"Elbow peak: over the validation poses.",
        "`unpenalised_cg` is the minimiser of `regularised_cg` with no penalty to speak of, so the "
        "two differ by the paper's proposal alone.",
    ]
    rows = {(row["trainer"], row["spread"]): row for row in table.to_dict("records")}
    for spread in starts.spreads:
        keys = [(trainer, spread) for trainer in ("regularised_cg", "unpenalised_cg")]
        if not all(key in rows for key in keys):
            continue
        with_penalty, without = (rows[key] for key in keys)
        ratio = with_penalty["median_error"] / without["median_error"]
        effect = "lowers" if ratio < 1.0 else "raises"
        found.append(
            f"Starts {spread}: the penalty {effect} the median error, {ratio:.2f} times that "
            f"without; {100 * with_penalty['success_share']:.0f} % of the starts succeed with it, "
            f"{100 * without['success_share']:.0f} % without."
        )
    ended = set(results.starts["stop_reason"])
    if ended == {"iterations"}:
        found.append(
            "No run ended in a stationary point: within these iterations a start that fails is one "
            "that is slow. The last column tells what becomes of it."
        )
    times = results.training_times
    if times.empty:
        found.append("No times: the benchmark was run with other parameters.")
    else:
        factor, n_long = int(times["long_factor"].iloc[0]), int(times["n_starts"].iloc[0])
        found.append(
            f"Seconds a run and long runs ({factor} times the iterations, median of {n_long} "
            "starts): measured by a benchmark."
        )
        low = times[times["long_error"] <= starts.success]
        slow = times[times["long_error"] > starts.success]
        for part, what in ((low, "get there"), (slow, "do not")):
            if len(part):
                names = ", ".join(
                    f"{trainer} ({spread})"
                    for trainer, spread in zip(part["trainer"], part["spread"], strict=True)
                )
                found.append(f"With {factor} times the iterations these {what}: {names}.")
        found += _far_notes(results)
    return found


def _far_notes(results: Results) -> list[str]:
    """What the widest spread costs against the narrowest, in long runs."""
    spreads = results.smartee.starts.spreads
    near, far = min(spreads, key=spreads.__getitem__), max(spreads, key=spreads.__getitem__)
    times = results.training_times.set_index(["trainer", "spread"])["long_error"].to_dict()
    ratios = [
        f"{trainer} {times[trainer, far] / times[trainer, near]:.1f}"
        for trainer in results.smartee.starts.trainers
        if (trainer, near) in times and (trainer, far) in times
    ]
    if not ratios or near == far:
        return []
    return [
        f"Long runs, error of starts {far} over that of starts {near}, what even many iterations "
        f"do not mend: {', '.join(ratios)}."
    ]


def outside_notes(results: Results) -> list[str]:
    """How the errors grow beyond the box."""
    outside = results.smartee.outside
    table = results.of(PUBLISHED, 0, OUTSIDE)
    missed = outside.n_poses - len(table)
    return [
        "Extent: the largest coordinate of a pose in half extents of the box, uniform up to "
        f"{outside.extent:g}. {missed} of {outside.n_poses} poses are out of reach of the legs and "
        "left out.",
        "Right: the elbows of the pose, to 1e-6 rad; the closure equations have other solutions, "
        "which Newton's method may find from a start that is far off.",
    ]
