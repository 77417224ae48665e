"""Sentences under the tables of the SmartEE's report, all from the data."""

import numpy as np

from flexik.datasets.smartee.poses import path_name
from flexik.evaluation.smartee.errors import CORNERS, OUTSIDE
from flexik.kinematics.smartee_newton import (
    CONVERGED,
    NOT_CONVERGED,
    OTHER_BRANCH,
    SINGULAR,
    STATUS_MEANING,
)
from flexik.parameters.smartee import BEST, CENTRE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting.smartee.draws import GOALS
from flexik.reporting.smartee.results import QUANTITIES, RIGHT, Results, right

STATUS_NAMES = {
    CONVERGED: "converged",
    NOT_CONVERGED: "not converged",
    SINGULAR: "singular",
    OTHER_BRANCH: "other branch",
}
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
        (BEST, GOALS[BEST], f"the published peaks over {GOALS[BEST]:g}"),
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
            f"{network.n_restarts} restarts by {chosen_by.n_poses} selection poses; every set has "
            "a seed of its own."
        )
    for name in smartee.networks:
        table = results.of(name, 0, VALIDATION)
        printed, unit = (1e3 * table[c].max() for c in ("orientation_error", "angle_error"))
        found.append(
            f"`{name}`: the orientation error as printed, arccos(a . n x s) with n x s as short as "
            f"it comes out, is {printed:.2f} mrad at most; with a unit vector it is {unit:.2f}."
        )
    corners = {
        quantity: results.peak(PUBLISHED, 0, CORNERS, quantity) / results.published_peak(quantity)
        for quantity in QUANTITIES
    }
    listed = ", ".join(f"{key} {ratio:.2f}" for key, ratio in corners.items())
    found.append(
        f"At the {len(results.of(PUBLISHED, 0, CORNERS))} corners of the box `{PUBLISHED}` is at "
        f"{listed} times the published peaks."
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
    text = (
        f"A pose takes `{PUBLISHED}` with {steps} steps {both[0]:.0f} us alone and {both[1]:.1f} "
        f"us in a batch, Newton from the centre until it converges {solved[0]:.0f} us and "
        f"{solved[1]:.1f} us; the latter tests each pose after each step, the former does not."
    )
    error = results.peak(PUBLISHED, steps, RANDOM, "elbow")
    needed = _steps_like(results, CENTRE, RANDOM, error)
    fixed = times.get((CENTRE, needed)) if needed is not None else None
    if fixed is None:
        return text
    return (
        f"{text} The like of it, {needed} fixed steps from the centre, which are as near: "
        f"{fixed[0]:.0f} us and {fixed[1]:.1f} us."
    )


def _steps_like(results: Results, method: str, poses: str, error: float) -> int | None:
    for n_steps in range(1, results.smartee.newton.shown_steps + 1):
        if results.peak(method, n_steps, poses, "elbow") <= error:
            return n_steps
    return None


def outside_notes(results: Results) -> list[str]:
    """How the errors grow beyond the box."""
    outside = results.smartee.outside
    table = results.of(PUBLISHED, 0, OUTSIDE)
    missed = outside.n_poses - len(table)
    steps, accepted = results.smartee.newton.network_steps, results.smartee.newton.accepted
    wrong, hidden, alarms = results.n_wrong(steps, OUTSIDE)
    return [
        "Extent: the largest coordinate of a pose in half extents of the box, uniform up to "
        f"{outside.extent:g}. {missed} of {outside.n_poses} poses are out of reach of the legs and "
        "left out.",
        f"Right: the elbows of the pose, to {RIGHT:g} rad, and of Newton's method a status that "
        "says so; the closure equations have other solutions, which it may find from a start that "
        "is far off.",
        f"`{PUBLISHED}` + {steps} steps: {wrong} wrong, of which {wrong - hidden} are noticed by "
        f"their status (a closure error above {accepted:g} of the squared side, or an elbow that "
        f"the joints do not reach) and {hidden} are not; {alarms} right ones are taken for wrong.",
    ]


def newton_notes(results: Results) -> list[str]:
    """What the columns mean, and what no status can tell."""
    meanings = "; ".join(
        f"{name}: {STATUS_MEANING[status]}"
        for status, name in STATUS_NAMES.items()
        if STATUS_MEANING[status] != name
    )
    wrong = {
        str(poses): int(((group["status"] == CONVERGED) & ~right(group)).sum())
        for poses, group in results.newton.groupby("poses", sort=False)
    }
    found = [f"Of the statuses {meanings}."]
    if any(wrong.values()):
        listed = ", ".join(f"{number} of {poses}" for poses, number in wrong.items() if number)
        found.append(
            f"Converged to wrong elbows: {listed}. They close the mechanism and lie between -pi "
            "and 0, so no status tells; that they are not the pose's own shows only beside it."
        )
    return found


def geometry_notes(results: Results) -> list[str]:
    """What is assumed, and what the table does not say."""
    space, geometry = results.smartee.workspace, results.smartee.geometry
    return [
        f"Not published and assumed: the circle of the leg bases ({1e3 * geometry.base_radius:g} "
        f"mm), that of the ball joints ({1e3 * geometry.plate_radius:g} mm), the height of the box "
        f"({1e3 * space.centre[2]:g} mm) and how the validation poses are drawn. Networks are "
        "trained for these alone, so how far their errors would move with others is not known."
    ]


def training_notes(results: Results) -> list[str]:
    """How the restarts of trainers with a fading penalty ended."""
    found, table = [], results.training
    for name, network in results.smartee.networks.items():
        trainer = results.smartee.trainers[network.trainer]
        if trainer.kind != "regularised_cg":
            continue
        reasons = table.loc[table["network"] == name, "stop_reason"]
        printed = int(reasons.isin(("goal", "stationary")).sum())
        found.append(
            f"`{name}`: {printed} of {len(reasons)} restarts ended by the paper's own tests of "
            f"success (error at most {trainer.goal:g} at the end of a round) or failure, the "
            "others at the number of iterations or a limit; what is kept is the iterate of least "
            "error, also within a round, not step 4's start of the next round."
        )
    return found


def size_notes(results: Results) -> list[str]:
    """How to read the two errors, and what the rows allow to say of the published M."""
    smartee = results.smartee
    own, extents = smartee.sizes, {k: v.extent for k, v in smartee.poses.items()}
    found = []
    for poses, table in ((own.poses, results.sizes), (own.beside, results.sizes_beside)):
        sizes = table["n_hidden"].to_numpy()
        best = sizes[np.argmin(table["selection_error"].to_numpy())]
        ratio = table["selection_error"] / table["training_error"]
        largest = ", the largest tried" if best == sizes.max() else ""
        found.append(
            f"{poses} ({smartee.poses[poses].n_poses} poses): selection error least at M = {best}"
            f"{largest}; selection over training error {ratio.min():.2f} to {ratio.max():.2f}."
        )
        if ratio.min() < 1.0 and extents[poses] > extents["selection"]:
            found.append(
                f"{poses}: selection below training, because it trains on {extents[poses]:g} times "
                f"the box, whose rim is hardest, and selects on {extents['selection']:g} times."
            )
    if all(
        np.argmin(table["selection_error"]) == len(table) - 1
        for table in (results.sizes, results.sizes_beside)
    ):
        found.append("Neither set of rows singles out a size: the error falls as far as was tried.")
    found.append(
        f"The paper took M = {smartee.networks[PUBLISHED].n_hidden}, without saying by what. "
        "Best of the starts by the selection error itself, all runs with one number of iterations."
    )
    return found
