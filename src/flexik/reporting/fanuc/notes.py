"""Sentences of the report of the six-joint arm, all of them from the results."""

import numpy as np

from flexik import parameters
from flexik.reporting.fanuc.results import EXACT, PUBLISHED_NETWORKS, WHOLE, Results, label
from flexik.reporting.style import MM

DEGREES = 180.0 / np.pi


def success(results: Results) -> str:
    """What counts as reached."""
    limits = results.fanuc.success
    return (
        f"within {MM * limits.position:g} mm and {DEGREES * limits.orientation:.3g} deg, all "
        "joints in their limits"
    )


def total_errors(results: Results) -> list[str]:
    """About the two configurations."""
    found = [
        "Total error: mean absolute error of the joint angle over the range of the joint along the "
        "path, times 100. How the thesis defines it is not available, nor are its values."
    ]
    if all(name in results.networks for name in PUBLISHED_NETWORKS):
        one, other = (results.error_percents[name] for name in PUBLISHED_NETWORKS)
        better = [str(joint + 1) for joint in np.flatnonzero(one < other)]
        found.append(
            "The abstract reports the better response, in precision and iterations, for the first "
            f"configuration. Here config1 is the more precise for joints {', '.join(better)}"
            f" ({len(better)} of 6); means {one.mean():.2f} % and {other.mean():.2f} %."
            if better
            else "The abstract reports the better response for the first configuration; here "
            f"config2 is the more precise for every joint (means {one.mean():.2f} % and "
            f"{other.mean():.2f} %)."
        )
        found.append("One start each: compare with the spread over starts in the study below.")
    known = results.fanuc.networks
    for number, name in enumerate(results.networks):
        for twin in results.networks[:number]:
            if _shape(known[name]) == _shape(known[twin]):
                found.append(
                    f"{name}: mean total error {results.error_percents[name].mean():.3f} %, with "
                    f"the samples and the networks of {twin} "
                    f"({results.error_percents[twin].mean():.3f} %) and another trainer."
                )
                break
    return found


def _shape(network: parameters.PathNetwork) -> tuple[str, int, str]:
    return network.outputs, network.n_hidden, network.activation


def passes(results: Results) -> list[str]:
    """How training and test errors compare at the end."""
    found = []
    for name in results.networks:
        curves = results.curves[results.curves["network"] == name]
        last = curves[curves["iteration"] == curves["iteration"].max()]
        ratio = last["test_error"] / last["training_error"]
        found.append(
            f"{name}: after the last pass the test error of a joint is {ratio.min():.2f} to "
            f"{ratio.max():.2f} times its training error."
        )
    return found


def path_errors(results: Results) -> list[str]:
    """How errors of joints become errors of the end effector."""
    return [
        f"Reached: {success(results)}.",
        "The networks know positions alone; orientation is right because the path repeats the "
        "orientations it was taught with.",
        f"{WHOLE}: the network of the path's arm configuration, trained on random poses, not on "
        "the path.",
    ]


def study(results: Results, varied: str) -> list[str]:
    """The best value, and runs that failed."""
    table = results.study[results.study["varied"] == varied]
    medians = table.groupby("value")["error_percent"].median()
    names = {"n_hidden": "hidden neurons", "learning_factor": "learning factor"}
    found = [f"Least median total error: {names[varied]} {float(str(medians.idxmin())):g}."]
    ended = table[table["stop_reason"] != "iterations"]["stop_reason"].value_counts()
    found += [
        f"{count} of {len(table)} trainings ended with {name}." for name, count in ended.items()
    ]
    found.append("Published curve (figure 5.15 or 5.16): not available.")
    return found


def off_path(results: Results) -> list[str]:
    """What a network of one path knows beside it, and targets left out."""
    frame = results.off_path
    n_test = results.fanuc.path.n_test
    counts = frame[frame["method"] == EXACT].groupby("distance").size()
    found = [
        f"{n_test} targets of each distance, moved from the test samples in a random direction; "
        f"orientation kept. _refined_k: k damped Newton steps after the method."
    ]
    found += [
        f"{n_test - int(counts.get(distance, 0))} targets at {MM * distance:g} mm are left out for "
        "all methods: the path's arm configuration does not reach them within the limits."
        for distance in results.fanuc.off_path.distances
        if int(counts.get(distance, 0)) < n_test
    ]
    means = frame[frame["n_steps"] == 0].groupby(["method", "distance"])["position_error"].mean()
    distances = results.fanuc.off_path.distances
    for name in results.networks:
        near, there = (MM * float(means[name, d]) for d in (distances[0], distances[-1]))
        found.append(
            f"{name}: mean position error {near:.2f} mm at {MM * distances[0]:g} mm from the path, "
            f"{there:.0f} mm at {MM * distances[-1]:g} mm."
        )
    n_steps = results.fanuc.refinement.n_steps
    for name in [*results.networks, WHOLE]:
        reached = _reached_everywhere(results, name, n_steps)
        found.append(
            f"{label(name, n_steps)}: reaches all targets up to {MM * reached:g} mm from the path."
            if reached is not None
            else f"{label(name, n_steps)}: misses targets even on the path."
        )
    return found


def _reached_everywhere(results: Results, method: str, n_steps: int) -> float | None:
    """Largest distance, m, up to which every target is reached; None: not even the first."""
    frame, limits = results.off_path, results.fanuc.success
    chosen = frame[(frame["method"] == method) & (frame["n_steps"] == n_steps)]
    reached = (
        (chosen["within_limits"] == 1)
        & (chosen["position_error"] <= limits.position)
        & (chosen["orientation_error"] <= limits.orientation)
    )
    last = None
    for distance, all_reached in reached.groupby(chosen["distance"]).all().items():
        if not all_reached:
            break
        last = float(str(distance))
    return last


def whole_workspace(results: Results) -> list[str]:
    """Networks against the closed form."""
    space, counts = results.fanuc.workspace, results.on_targets[EXACT]
    last = label(WHOLE, results.fanuc.refinement.n_steps)
    values = results.on_targets[last]
    return [
        f"{int(counts['n_targets'])} random poses, {space.n_targets} of each arm configuration, "
        "which is asked for.",
        f"Reached: {success(results)}.",
        f"{last}: reached {100 * values['success_rate']:.1f} %, median position error "
        f"{MM * values['median_position_error']:.3g} mm; {EXACT}: reached "
        f"{100 * counts['success_rate']:.1f} %, largest position error below "
        f"{_power_above(MM * counts['max_position_error']):.0e} mm.",
        "us: microseconds a pose on one core, measured apart from the pipeline (`make "
        "benchmark-fanuc`, reports/benchmarks/fanuc.md); single: one pose a call, batched: many; "
        "empty: not measured with these settings. opw: the package py-opw-kinematics, all "
        "configurations (as closed_form), from Python.",
    ]


def _power_above(value: float) -> float:
    """Least power of ten above `value`, at least 1e-9: digits below are the machine's."""
    return float(10.0 ** max(-9, np.floor(np.log10(max(value, 1e-10))) + 1))


def conditioning(results: Results) -> list[str]:
    """What the singular value is, and what it explains."""
    length = results.fanuc.refinement.orientation_length
    return [
        f"Of the Jacobian at the pose, a radian of orientation counted as {length:g} m; 0 at a "
        "singular pose. Newton steps converge slowly near singular poses, where a small step of "
        "the pose is a large one of the joints; the closed form does not care.",
    ]


def growth(results: Results) -> list[str]:
    """What the table is."""
    if results.growth.empty:
        return ["Not measured with these settings."]
    return [
        "Measured apart from the pipeline (`make benchmark-fanuc`); core seconds of the processor "
        "for one of the eight networks.",
        "Errors before refinement, at the random poses of the configuration.",
    ]
