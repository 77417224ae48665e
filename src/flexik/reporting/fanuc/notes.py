"""Sentences of the report of the six-joint arm, all of them from the results."""

import itertools

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.fanuc.samples import _SHORTER
from flexik.evaluation.fanuc.errors import near_enough, within
from flexik.reporting.fanuc.results import (
    EXACT,
    LOOKED_UP,
    PUBLISHED_NETWORKS,
    WHOLE,
    Results,
    label,
)
from flexik.reporting.style import MM

DEGREES = 180.0 / np.pi
NAMES = {"n_hidden": "hidden neurons", "learning_factor": "learning factor"}


def success(results: Results) -> str:
    """What counts as reached."""
    limits = results.fanuc.success
    return (
        f"within {MM * limits.position:g} mm and {DEGREES * limits.orientation:.3g} deg, all "
        "joints in their limits, the arm in the configuration asked for"
    )


def spread(values: pd.Series) -> str:
    """Median and range over starts."""
    if len(values) == 1:
        return f"{values.iloc[0]:.3g} %, one start"
    return f"{values.median():.3g} % ({values.min():.3g} to {values.max():.3g})"


def total_errors(results: Results) -> list[str]:
    """About the two configurations."""
    found = [
        "Total error: mean absolute error of the joint angle over the range of the joint along the "
        "path, times 100. How the thesis defines it is not available, nor are its values.",
        "Median and, in brackets, least and largest over the starts; each start keeps the weights "
        "of its least training error. The start whose mean over the joints is the median one is "
        "the one whose networks are judged from here on and whose errors stand in metrics.json.",
    ]
    if all(name in results.networks for name in PUBLISHED_NETWORKS):
        found += [_verdict(results), _verdict_on_passes(results)]
    known = results.fanuc.networks
    for number, name in enumerate(results.networks):
        for twin in results.networks[:number]:
            if _shape(known[name]) == _shape(known[twin]):
                found.append(
                    f"{name}: mean total error {spread(results.start_means[name])}, with the "
                    f"samples and the networks of {twin} ({spread(results.start_means[twin])}) and "
                    "another trainer."
                )
                break
    return found


def _verdict(results: Results) -> str:
    """Which of the published configurations is the more precise, over all starts."""
    one, other = PUBLISHED_NETWORKS
    means = results.start_means
    text = (
        f"The abstract reports the better response, in precision and iterations, for the first "
        f"configuration. Mean total error here: {one} {spread(means[one].dropna())}, "
        f"{other} {spread(means[other].dropna())}: "
    )
    if clear := clearly_less(means[one].dropna(), means[other].dropna()):
        text += f"every start of {PUBLISHED_NETWORKS[clear - 1]} is the more precise"
    else:
        text += "the ranges overlap, so that neither is shown to be the more precise"
    by_joint = results.starts.groupby(["network", "joint"])["error_percent"]
    decided = [
        clearly_less(by_joint.get_group((one, joint)), by_joint.get_group((other, joint)))
        for joint in range(1, 7)
    ]
    return (
        f"{text}. Joint by joint, every start of {one} is the more precise for "
        f"{decided.count(1)}, every start of {other} for {decided.count(2)} of 6 joints."
    )


def _verdict_on_passes(results: Results) -> str:
    """Which of the published configurations needs fewer passes."""
    counts = passes_needed(results)
    parts = []
    for error in PASS_ERRORS:
        one, other = (
            counts[(counts["network"] == name) & (counts["error"] == error)]
            .groupby("joint")["passes"]
            .median()
            for name in PUBLISHED_NETWORKS
        )
        first, second = int((one < other).sum()), int((one > other).sum())
        parts.append(
            f"to {100 * error:g} % {PUBLISHED_NETWORKS[0]} needs fewer for {first}, "
            f"{PUBLISHED_NETWORKS[1]} for {second} of 6 joints"
        )
    return f"Passes, medians over the starts: {'; '.join(parts)}."


def clearly_less(one: pd.Series, other: pd.Series) -> int:
    """1 if all of `one` are less than all of `other`, 2 the other way round, else 0."""
    return 1 if one.max() < other.min() else 2 if other.max() < one.min() else 0


# Root mean square error, share of a joint's range, that passes are counted to
PASS_ERRORS = (0.05, 0.02)


def passes_needed(results: Results) -> pd.DataFrame:
    """Columns network, restart, joint, error, passes: from where the error stays below PASS_ERRORS.

    Infinite where the last pass is not below.
    """
    rows = []
    for (network, restart, joint), curve in results.curves.groupby(["network", "restart", "joint"]):
        errors = curve.sort_values("iteration")["training_error"].to_numpy()
        for error in PASS_ERRORS:
            above = np.flatnonzero(~(errors <= error))
            first = 0 if not len(above) else int(above[-1]) + 1
            passes = float(first) if first < len(errors) else np.inf
            rows.append((network, restart, joint, error, passes))
    return pd.DataFrame(rows, columns=["network", "restart", "joint", "error", "passes"])


def _shape(network: parameters.PathNetwork) -> tuple[str, int, str]:
    return network.outputs, network.n_hidden, network.activation


def passes(results: Results) -> list[str]:
    """How training and test errors compare where the weights are kept."""
    found = [
        "Median over the starts, of two in the middle the larger. An error that falls below and "
        "comes back does not count."
    ]
    kept = results.starts[["network", "restart", "joint", "kept"]]
    curves = results.curves.merge(kept, on=["network", "restart", "joint"])
    curves = curves[curves["iteration"] == curves["kept"]]
    for name in results.networks:
        some = curves[curves["network"] == name]
        ratio = some["test_error"] / some["training_error"]
        found.append(
            f"{name}: at the pass whose weights are kept (least training error; passes "
            f"{some['kept'].min()} to {some['kept'].max()}) the test error of a joint is "
            f"{ratio.min():.2f} to {ratio.max():.2f} times its training error, over all starts."
        )
    return found


def path_errors(results: Results) -> list[str]:
    """How errors of joints become errors of the end effector."""
    turned = [
        DEGREES * results.on_path[name]["mean_orientation_error"] for name in results.networks
    ]
    shifts = {name: MM * results.on_path[name]["mean_position_error"] for name in results.of_path}
    found = [
        f"Reached: {success(results)}.",
        "The networks of the path know positions alone and give the orientations that belong to "
        f"their joints; mean orientation errors on the path {min(turned):.2g} to "
        f"{max(turned):.2g} deg.",
        "Without a network: nearest_sample commands the joints of the training sample nearest in "
        "position, interpolated those between two samples that follow one another, linearly.",
    ]
    for name in LOOKED_UP:
        better = [each for each in results.networks if shifts[name] < shifts[each]]
        found.append(
            f"{name}: mean position error {shifts[name]:.3g} mm, better than {len(better)} of "
            f"{len(results.networks)} networks of the path"
            + (f" ({', '.join(better)})." if better else ".")
        )
    found.append(
        f"{WHOLE}: the network of the path's arm configuration, trained on random poses, not on "
        "the path."
    )
    return found


def study(results: Results, varied: str) -> list[str]:
    """The best value, and runs that failed."""
    table = results.study[results.study["varied"] == varied]
    medians = table.groupby("value")["error_percent"].median()
    best = float(str(medians.idxmin()))
    text = f"Least median total error: {NAMES[varied]} {best:g}"
    if len(medians) > 1 and best in (medians.index.min(), medians.index.max()):
        text += ", the edge of what was tried: the best value may lie beyond"
    found = [
        f"{text}.",
        "Both errors are mean absolute ones, over the range of the joint; each training keeps the "
        "weights of its least training error.",
    ]
    if varied == "learning_factor":
        found.append(
            "The learning factor is constant: no pass is taken back, and a training whose error "
            "grows beyond all numbers ends."
        )
    ended = table[table["stop_reason"] != "iterations"].groupby(["stop_reason", "value"])
    for (reason, value), group in ended:
        n_all = int((table["value"] == value).sum())
        why = "error beyond all numbers" if reason == "line_search" else str(reason)
        found.append(
            f"{NAMES[varied]} {value:g}: {len(group)} of {n_all} trainings ended early "
            f"({why}), weights kept of passes {group['kept'].min()} to {group['kept'].max()}."
        )
    found.append("Published curve (figure 5.15 or 5.16): not available.")
    return found


def off_path(results: Results) -> list[str]:
    """What a network of one path knows beside it, and targets left out."""
    frame, distances = results.off_path, results.fanuc.off_path.distances
    n_test = results.fanuc.path.n_test
    counts = frame[frame["method"] == EXACT].groupby("distance").size()
    found = [
        f"{n_test} targets of each distance, moved from the test samples at right angles to the "
        f"path, so that no part of the path is nearer than that by {100 * _SHORTER:g} %; "
        "orientation kept. "
        "_refined_k: k damped Newton steps after the method."
    ]
    found += [
        f"{n_test - int(counts.get(distance, 0))} targets at {MM * distance:g} mm are left out for "
        "all methods: the path's arm configuration does not reach them within the limits, or they "
        "are nearer to another part of the path."
        for distance in distances
        if int(counts.get(distance, 0)) < n_test
    ]
    plain = frame[frame["n_steps"] == 0]
    means = MM * plain.groupby(["method", "distance"])["position_error"].mean()
    there = [distance for distance in distances if int(counts.get(distance, 0))]
    if not there:
        return [*found, "No target is left."]
    for name in results.of_path:
        ends = (
            f"{means[name, d]:.3g} mm at {MM * d:g} mm from the path"
            for d in dict.fromkeys((there[0], there[-1]))
        )
        found.append(f"{name}: mean position error {', '.join(ends)}.")
    found.append(_against_look_up(results, means, there))
    n_steps = results.fanuc.refinement.n_steps
    for name in [*results.of_path, WHOLE]:
        reached = _reached_everywhere(results, name, n_steps)
        found.append(
            f"{label(name, n_steps)}: reaches all targets up to {MM * reached:g} mm from the path."
            if reached is not None
            else f"{label(name, n_steps)}: misses targets even {MM * there[0]:g} mm from the path."
        )
    return found


def _against_look_up(results: Results, means: pd.Series, distances: list[float]) -> str:
    """At how many distances each network is better than the best without one."""
    best = [min(means[name, distance] for name in LOOKED_UP) for distance in distances]
    parts = []
    for name in results.networks:
        won = [d for d, least in zip(distances, best, strict=True) if means[name, d] < least]
        at = f" ({', '.join(f'{MM * d:g}' for d in won)} mm)" if won else ""
        parts.append(f"{name} at {len(won)} of {len(distances)} distances{at}")
    return (
        f"Smaller mean position error than the better of {' and '.join(LOOKED_UP)}, which need no "
        f"network: {'; '.join(parts)}."
    )


def _reached_everywhere(results: Results, method: str, n_steps: int) -> float | None:
    """Largest distance, m, up to which every target is reached; None: not even the first."""
    frame = results.off_path
    chosen = frame[(frame["method"] == method) & (frame["n_steps"] == n_steps)]
    by_distance = within(chosen, results.success).groupby(chosen["distance"]).all()
    until = list(itertools.takewhile(lambda item: item[1], by_distance.items()))
    return float(str(until[-1][0])) if until else None


def whole_workspace(results: Results) -> list[str]:
    """Networks against the closed form."""
    space, counts = results.fanuc.workspace, results.on_targets[EXACT]
    last = label(WHOLE, results.fanuc.refinement.n_steps)
    values, frame = results.on_targets[last], results.workspace
    exact = frame[frame["method"] == EXACT]
    found = [
        f"{int(counts['n_targets'])} random poses, {space.n_targets} of each arm configuration, "
        f"which is asked for; {int(exact['singular'].sum())} of them are flagged as singular.",
        f"Reached: {success(results)}.",
        f"{last}: reached {100 * values['success_rate']:.1f} %, median position error "
        f"{MM * values['median_position_error']:.3g} mm; {EXACT}: reached "
        f"{100 * counts['success_rate']:.1f} %, largest position error below "
        f"{_power_above(MM * counts['max_position_error']):.0e} mm.",
    ]
    wrong = near_enough(frame, results.success) & (frame["in_configuration"] == 0)
    parts = [
        f"{label(WHOLE, n_steps)} {100 * float(wrong[some].mean()):.2f} %"
        for n_steps in range(results.fanuc.refinement.n_steps + 1)
        if (some := (frame["method"] == WHOLE) & (frame["n_steps"] == n_steps)).any()
    ]
    return [
        *found,
        "Poses met by another arm configuration than the one asked for, which do not count: "
        f"{', '.join(parts)}.",
        "us: microseconds a pose on one core, measured apart from the pipeline (`make "
        "benchmark-fanuc`, reports/benchmarks/fanuc.md); single: one pose a call, batched: many; "
        f"empty: not measured with these settings. {EXACT}: all eight configurations are solved "
        "and the one asked for is taken. opw: the package py-opw-kinematics, all configurations "
        "too, from Python.",
    ]


def _power_above(value: float) -> float:
    """Least power of ten above `value`, at least 1e-9: digits below are the machine's."""
    return float(10.0 ** max(-9, np.floor(np.log10(max(value, 1e-10))) + 1))


def conditioning(results: Results) -> list[str]:
    """What the singular value is, and what it explains."""
    length, frame = results.fanuc.refinement.orientation_length, results.workspace
    exact = frame[frame["method"] == EXACT]
    low = exact[exact["singular_value"] < SINGULAR_EDGES[0]]
    found = [
        f"Of the Jacobian at the pose, a radian of orientation counted as {length:g} m; 0 at a "
        "singular pose. Newton steps converge slowly near singular poses, where a small step of "
        "the pose is a large one of the joints."
    ]
    if len(low):
        shift, turn = (low[f"{name}_error"].max() for name in ("position", "orientation"))
        found.append(
            f"{EXACT}: errors below {_power_above(MM * shift):.0e} mm and "
            f"{_power_above(DEGREES * turn):.0e} deg at the {len(low)} poses below "
            f"{SINGULAR_EDGES[0]:g} m, the least {low['singular_value'].min():.1e} m."
        )
    return found


# Between the rows of the table of conditioning, m
SINGULAR_EDGES = (0.01, 0.03, 0.1, 0.3)


def growth(results: Results) -> list[str]:
    """What the table is."""
    if results.growth.empty:
        return ["Not measured with these settings."]
    return [
        "Measured apart from the pipeline (`make benchmark-fanuc`); core seconds of the processor "
        "for one of the eight networks. One start each, so that small differences may be chance.",
        "Errors before refinement, at the random poses of the configuration.",
    ]
