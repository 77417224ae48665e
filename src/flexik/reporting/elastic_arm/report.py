"""The report of the elastic arm: metrics, tables, figures and page, from the stages' results."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flexik.datasets.elastic_arm.gauges import FREE_OF_NOISE, NOISY
from flexik.datasets.elastic_arm.readings import ANGLES, HELD_OUT, degree_axis
from flexik.evaluation.errors import workspace_statistics
from flexik.evaluation.regression import correlation
from flexik.files import file_checksum, write_json
from flexik.parameters import BackPropagation, parameters_checksum
from flexik.reporting import page
from flexik.reporting.elastic_arm import figures
from flexik.reporting.elastic_arm.results import Results
from flexik.reporting.elastic_arm.sensitivity import (
    NOISE,
    NOTHING,
    mean_errors,
    sensitivity_text,
)
from flexik.reporting.elastic_arm.tables import layers_name, write_tables
from flexik.reporting.style import MM

# Statistics of random targets that are metrics
STATISTICS = ("mean_error", "median_error", "p95_error", "max_error")


def write_report(results: Results, folder: Path, published_files: list[Path]) -> None:
    """Write all of the report into `folder`; `published_files` are named in its provenance."""
    write_json(folder / "metrics.json", metrics(results))
    write_tables(results, folder)
    write_figures(results, folder / "figures")
    inputs = {str(path): file_checksum(path) for path in published_files}
    write_page(results, folder, inputs)


def metrics(results: Results) -> dict[str, float]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    found: dict[str, float] = {}
    for name, (training, held_out) in results.fits.items():
        for k in (0, 1):
            found[f"{name}.r_theta{k + 1}"] = round(float(held_out.r[k]), 6)
            found[f"{name}.training_r_theta{k + 1}"] = round(float(training.r[k]), 6)
        found[f"{name}.held_out_mean_error_mm"] = round(MM * held_out.mean_error, 4)
        found[f"{name}.held_out_max_error_mm"] = round(MM * held_out.max_error, 4)
        for k, r in enumerate(results.target_r(name), start=1):
            if np.isfinite(r):
                found[f"{name}.targets_r_theta{k}"] = round(float(r), 6)
    for label, frame in results.errors.items():
        values = workspace_statistics(frame)
        for name in STATISTICS:
            found[f"{label}.{name}_mm"] = round(MM * values[name], 4)
        found[f"{label}.n_failed"] = int(values["n_failed"])
    for told, error in results.payload_error.groupby("method", sort=False)["error"]:
        found[f"{told}.payload_off_mean_error_mm"] = round(MM * float(error.mean()), 4)
    errors = mean_errors(results)[results.arm.splits.network].drop(NOTHING)
    for changed, value in errors.dropna().items():
        found[f"{results.arm.splits.network}.{changed}_off_mean_error_mm"] = round(float(value), 4)
    splits = results.all_splits()
    for k, name in enumerate(ANGLES, start=1):
        r = splits[f"r_{name}"]
        found[f"splits.median_r_theta{k}"] = round(float(r.median()), 6)
        found[f"splits.least_r_theta{k}"] = round(float(r.min()), 6)
    for name, study in results.studies.items():
        for layer, n_hidden in enumerate(study.chosen, start=1):
            found[f"select.{name}.n_hidden_{layer}"] = n_hidden
    for part, n in results.readings["part"].value_counts().sort_index().items():
        found[f"readings.n_{part}"] = int(n)
    return found


def write_figures(results: Results, folder: Path) -> None:
    """Write all figures into `folder`."""
    # steepest: at 0 no force acts along link 1
    theta_1 = float(degree_axis(results.arm.readings.theta_1_degrees)[-1])
    for link in (1, 2):
        path = folder / f"deformation_link_{link}.png"
        shown = results.shown[FREE_OF_NOISE], results.shown[NOISY]
        figures.deformation(path, results.readings, *shown, link, theta_1)
    for name in shown_networks(results):
        table = results.joined(name)
        part = table[table["part"] == HELD_OUT]
        names = [*ANGLES, "p_x", "p_y"]
        r = correlation(part[names].to_numpy(), part[[f"network_{n}" for n in names]].to_numpy())
        path = folder / f"target_and_network_{name}.png"
        published = dict(zip(ANGLES, results.published_r(name).tolist(), strict=True))
        found = dict(zip(names, r.tolist(), strict=True))
        figures.target_and_network(path, table, found, published)
    labels = {
        name: f"{name} ({layers_name(results.layers[name])})" for name in results.gauge_networks
    }
    figures.network_comparison(
        folder / "network_comparison.png",
        {labels[name]: held_out.r for name, (_, held_out) in results.fits.items()},
        {labels[name]: results.published_r(name) for name in results.gauge_networks},
    )
    figures.error_distribution(folder / "error_distribution.png", results.errors)
    shown_methods = [label for label in results.errors if label not in hidden_methods(results)]
    figures.error_over_targets(
        folder / "error_over_targets.png", {name: results.errors[name] for name in shown_methods}
    )


def shown_networks(results: Results) -> list[str]:
    """Networks whose values are published, or the first one."""
    known = [name for name in results.published["network"] if name in results.gauge_networks]
    return known or results.gauge_networks[:1]


def hidden_methods(results: Results) -> list[str]:
    """All but the first method of every kind, and no compensation."""
    seen: set[str] = set()
    hidden = ["none"]
    for label, method in results.arm.methods.items():
        if method.method in seen:
            hidden.append(label)
        seen.add(method.method)
    return hidden


def write_page(results: Results, folder: Path, inputs: Mapping[str, str]) -> None:
    """Write README.md of `folder` from the tables and figures there."""
    arm, drawn = results.arm, folder / "figures"
    theta_1 = arm.readings.theta_1_degrees.maximum
    sections = [
        page.Section(
            "What the gauges tell",
            sensitivity_text(results),
            [folder / "sensitivity.md"],
            [],
        ),
        page.Section(
            "Positioning errors",
            _positioning_text(results),
            [folder / "positioning_errors.md"],
            [
                (drawn / "error_distribution.png", "Share of the targets below an error."),
                (drawn / "error_over_targets.png", "Error at every random target."),
            ],
        ),
        page.Section(
            "Networks given gauges",
            _fit_text(results),
            [folder / "fit.md", folder / "splits.md"],
            [
                *(
                    (
                        drawn / f"target_and_network_{name}.png",
                        f"Angles and tip by `{name}` against their targets, R of the held-out "
                        "readings (after figures 15 to 18).",
                    )
                    for name in shown_networks(results)
                ),
                (
                    drawn / "network_comparison.png",
                    "Networks of several sizes and trainers (after figures 19 to 22).",
                ),
            ],
        ),
        page.Section(
            "Deformation and gauges",
            _gauges_text(results),
            [folder / "gauges.md"],
            [
                (
                    drawn / f"deformation_link_{link}.png",
                    f"Link {link} at theta_1 = {theta_1:g} deg: model (lines) and gauges with "
                    f"noise "
                    "(dots); dx by the gauges in a panel of its own, without noise as lines; after "
                    f" figures {8 + 3 * (link - 1)} to {10 + 3 * (link - 1)}.",
                )
                for link in (1, 2)
            ],
        ),
        page.Section(
            "Training",
            _training_text(results),
            [
                folder / "training.md",
                *(folder / "size_selection" / f"{name}.md" for name in results.studies),
            ],
        ),
    ]
    made_with = {
        f"elastic_arm.{name}": parameters_checksum(
            list(part.values()) if isinstance(part := getattr(arm, name), dict) else [part]
        )
        for name in type(arm).model_fields
    }
    title = "Elastic two-link arm (Al-Khafaji & Jweeg 2017)"
    page.page(folder / "README.md", title, sections, made_with, inputs)


def _positioning_text(results: Results) -> str:
    arm = results.arm
    lines = [
        "Error = target minus tip of the flexible model at the commanded angles. "
        f"Of {results.target_counts['drawn']} targets drawn at random "
        f"{results.target_counts['reached']} are reached with angles within the readings' range by "
        f"the loaded tip; the first {results.target_counts['kept']} are kept. The payload is "
        f"uniform "
        "and told exactly, but where a note says otherwise. Of the two elbows every method takes "
        "the one farther inside the joint limits.",
        "- `none`: rigid inverse kinematics alone.",
    ]
    for label, method in arm.methods.items():
        network = arm.all_networks[method.network]
        hidden = f"{layers_name(results.layers[method.network])}, {network.trainer}"
        if method.method == "gauges":
            told = {
                "gauges_without_dx": "the target and the deformation but dx",
                "gauges_elbow": "target, elbow and the deformation",
            }.get(network.kind, "the target and the deformation")
            text = (
                f"network `{method.network}` ({hidden}) of {told} that gauges "
                f"({NOISE[network.readings or FREE_OF_NOISE]}) show in the very pose it should "
                "find. No controller knows that "
                "before the arm is there."
            )
        elif method.method == "inverse":
            text = f"network `{method.network}` ({hidden}) of target, payload and elbow."
        else:
            text = (
                f"rigid inverse, deflection by the network `{method.network}` ({hidden}), "
                "corrected target, rigid inverse again (corrections: "
                f"{method.n_corrections}); the code of the crane."
            )
        lines.append(f"- `{label}`: {text}")
    lines.append(
        "\nMethods differ in inputs, size and trainer, all named in the table; where two rows "
        "differ in more than one of them, their difference is not that of the idea alone."
    )
    return lines[0] + "\n\n" + "\n".join(lines[1:])


def _fit_text(results: Results) -> str:
    n = results.readings["part"].value_counts()
    border, held_out = results.on_border()
    return (
        f"{len(results.readings)} readings, divided at random: {n['training']} train, "
        f"{n['selection']} select among restarts and sizes and end the trainers with patience, "
        f"{n['held_out']} are held out of both. Inputs are the six deformation variables by the "
        f"gauges and the tip by equations 44 and "
        "45 from them, as in the paper, less or more where the column of gauges says so; R is the "
        f"correlation of network and target. {border} of the {held_out} held-out readings lie on "
        "the border of the grid of angles, so that no reading beyond them trains. All have "
        "payloads "
        "of the readings, while those of the random targets lie between. R at the random targets "
        "is "
        "that of the commanded angles."
    )


def _training_text(results: Results) -> str:
    lines = [
        "The selection readings choose among restarts and sizes and, where a trainer has patience "
        "(stop_reason selection), end its runs; the held-out readings are in neither set."
    ]
    for name, trainer in results.arm.trainers.items():
        if isinstance(trainer, BackPropagation):
            lines.append(
                f"`{name}`: steps along the whole gradient, at most {trainer.n_iterations} epochs, "
                f"goal {trainer.goal:g}, minimum gradient {trainer.minimum_gradient:g}, learning "
                f"rate from {trainer.learning_rate:g} on, times {trainer.rate_increase:g} after a "
                f"better and {trainer.rate_decrease:g} after a much worse epoch, momentum "
                f'{trainer.momentum:g}. The paper\'s "learning increment 0.9" is read as the '
                "momentum: as a factor of the rate it would let the rate die out."
            )
    return "\n\n".join(lines)


def _gauges_text(results: Results) -> str:
    given = results.arm.gauges
    largest = MM * np.abs(results.readings[["dy_1", "dy_2"]].to_numpy()).max()
    return (
        "Voltages are those of the model's deflections by the published calibration lines "
        "(equations 48 to 53; the powers of ten of their intercepts are illegible in the source "
        "and "
        f"assumed); deflections reach {largest:.1f} mm. dphi is the direction of the "
        "line through two deflections (equation 47) and so less than the slope of the bent tip; dx "
        "is an axial strain times the length (equation 54) and misses by how much a bent link "
        "becomes shorter. Both gauges of a tip are averaged by the inverse squares of their "
        "slopes, "
        f"as least squares does. With noise: {1e3 * given.noise:g} mV and steps of "
        f"{1e3 * given.resolution:g} mV, {1e6 * given.strain_noise:g} microstrain and steps of "
        f"{1e6 * given.strain_resolution:g}."
    )
