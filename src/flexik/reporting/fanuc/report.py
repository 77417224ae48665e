"""The report of the six-joint arm: metrics, tables, figures and page."""

from pathlib import Path

from flexik.datasets.fanuc.tables import JOINTS
from flexik.files import file_checksum, write_json
from flexik.parameters import parameters_checksum
from flexik.reporting import page
from flexik.reporting.fanuc import notes
from flexik.reporting.fanuc.figures import FLOOR, trainer_kinds, write_figures
from flexik.reporting.fanuc.notes import DEGREES
from flexik.reporting.fanuc.results import EXACT, WHOLE, Results
from flexik.reporting.fanuc.tables import write_tables
from flexik.reporting.style import MM

# Digits of metrics: what machines agree on
PLACES = 4


def write_report(results: Results, folder: Path, inputs: list[Path]) -> None:
    """Write all of the report into `folder`; `inputs` are named in its provenance."""
    write_json(folder / "metrics.json", metrics(results))
    write_tables(results, folder)
    write_figures(results, folder / "figures")
    fanuc = results.fanuc
    made_with = {"fanuc.joints": parameters_checksum(fanuc.joints)}
    for name in type(fanuc).model_fields:
        part = getattr(fanuc, name)
        if isinstance(part, dict):
            for label, each in part.items():
                made_with[f"fanuc.{name}.{label}"] = parameters_checksum([each])
        elif name != "joints":
            made_with[f"fanuc.{name}"] = parameters_checksum([part])
    page.page(
        folder / "README.md",
        "Six-joint arm after the FANUC M-710i (Hasan 2005)",
        _sections(results, folder),
        made_with,
        {str(path): file_checksum(path) for path in inputs},
    )


def metrics(results: Results) -> dict[str, float]:
    """Flat; percent, mm and degrees.

    path.METHOD: on the path's test samples; random_poses.METHOD: at random poses. METHOD alone is
    where it belongs: networks of the path on the path (those of the median start), networks of the
    whole workspace and the closed form at random poses.
    """
    found: dict[str, float] = {}
    for name in results.networks:
        for joint, value in zip(JOINTS, results.error_percents[name], strict=True):
            found[f"{name}.{joint.replace('_', '')}_error_percent"] = round(float(value), PLACES)
        found |= _errors(name, results.on_path[name])
    for name, values in results.on_targets.items():
        found |= _errors(name, values)
        found[f"{name}.success_percent"] = round(100.0 * values["success_rate"], PLACES)
    for place, by_method in (("path", results.on_path), ("random_poses", results.on_targets)):
        for name, values in by_method.items():
            found |= _errors(f"{place}.{name}", values)
            rate = 100.0 * values["success_rate"]
            found[f"{place}.{name}.success_percent"] = round(rate, PLACES)
    for name in results.networks:
        means = results.start_means[name].dropna()
        for which, value in (("least", means.min()), ("largest", means.max())):
            found[f"{name}.{which}_mean_error_percent"] = round(float(value), PLACES)
    counts = results.off_path[results.off_path["method"] == EXACT]
    found["off_path.n_targets"] = len(counts)
    asked = results.fanuc.path.n_test * len(results.fanuc.off_path.distances)
    found["off_path.n_left_out"] = asked - len(counts)
    return found


def _errors(name: str, values: dict[str, float]) -> dict[str, float]:
    return {
        f"{name}.mean_position_error_mm": round(MM * values["mean_position_error"], PLACES),
        f"{name}.max_position_error_mm": round(MM * values["max_position_error"], PLACES),
        f"{name}.mean_orientation_error_deg": round(
            DEGREES * values["mean_orientation_error"], PLACES
        ),
    }


def _sections(results: Results, folder: Path) -> list[page.Section]:
    return [
        _configurations(results, folder),
        _tracking(results, folder),
        _study(results, folder),
        _off_path(results, folder),
        _whole(results, folder),
        _arm(results, folder),
    ]


def _configurations(results: Results, folder: Path) -> page.Section:
    lines = []
    for name, network in results.fanuc.networks.items():
        each = "one network a joint" if network.outputs == "one_joint" else "one network for all"
        trainer = results.fanuc.trainers[network.trainer]
        lines.append(
            f"- `{name}`: {each}, x, y, z in, {network.n_hidden} {network.activation} neurons, "
            f"{trainer.kind.replace('_', ' ')}, at most {trainer.n_iterations} passes, "
            f"{network.n_restarts} start{'s' if network.n_restarts > 1 else ''}."
        )
    path = results.fanuc.path
    text = (
        "What is known of the thesis: networks learn joint angles from positions recorded along a "
        "taught path by the generalised delta rule; two configurations are compared. Which they "
        "are, their sizes, samples and results are not available; what stands for them here is "
        f"assumed.\n\n{path.n_training} training and {path.n_test} interleaved test samples of one "
        "path.\n\n" + "\n".join(lines)
    )
    figures = [
        (
            folder / f"figures/training_error_{kind}.png",
            f"Training error of each joint by {kind.replace('_', ' ')}, all starts, the median one "
            f"in full{' (after figures 5.3 to 5.8)' if kind == 'back_propagation' else ''}.",
        )
        for kind in trainer_kinds(results)
    ]
    return page.Section(
        "Two configurations of networks",
        text,
        [folder / "total_errors.md", folder / "passes.md"],
        figures,
    )


def _tracking(results: Results, folder: Path) -> page.Section:
    figures = folder / "figures"
    return page.Section(
        "Path tracking",
        "Test samples, joint by joint, and the end effector when the networks' joints are "
        "commanded.",
        [folder / "path_errors.md"],
        [
            (figures / "path_tracking.png", "Path tracking (after figures 5.9 to 5.14)."),
            (figures / "path_tracking_errors.png", "Error of each joint along the path."),
            (figures / "path_errors.png", "Error of the end effector along the path."),
        ],
    )


def _study(results: Results, folder: Path) -> page.Section:
    joint, figures = results.fanuc.study.joint, folder / "figures"
    return page.Section(
        f"Hidden neurons and learning factor, joint {joint}",
        "",
        [folder / "study_n_hidden.md", folder / "study_learning_factor.md"],
        [
            (figures / "study_n_hidden.png", "Number of hidden neurons (after figure 5.15)."),
            (figures / "study_learning_factor.png", "Learning factor (after figure 5.16)."),
        ],
    )


def _off_path(results: Results, folder: Path) -> page.Section:
    return page.Section(
        "What a network of one path knows off it",
        "",
        [
            folder / f"{name}.md"
            for name in ("off_path", "off_path_orientation", "off_path_success")
        ],
        [(folder / "figures/off_path.png", "Errors and success by distance from the path.")],
    )


def _whole(results: Results, folder: Path) -> page.Section:
    space = results.fanuc.workspace
    sizes = " and ".join(str(n) for n in space.n_hidden)
    trainer = results.fanuc.trainers[space.trainer]
    text = (
        f"`{WHOLE}`: one network an arm configuration, {sizes} {space.activation} neurons, trained "
        f"on {space.n_training} random poses of it ({trainer.kind}, {trainer.n_iterations} "
        "passes). In: position and all nine elements of the rotation matrix. Out, instead of "
        "angles that jump: wrist centre (x, y), joints 2 and 3, cosine of joint 5, and cosine and "
        "sine of joints 4 and 6 times the sine of joint 5, which vanishes where they are free. "
        "Newton steps are damped."
    )
    tables = ("whole_workspace", "conditioning", "configurations", "growth")
    caption = f"Distribution of the errors at random poses; those below {FLOOR:g} stand there."
    return page.Section(
        "The whole workspace against the closed form",
        text,
        [folder / f"{name}.md" for name in tables],
        [(folder / "figures/whole_workspace.png", caption)],
    )


def _arm(results: Results, folder: Path) -> page.Section:
    return page.Section(
        "The arm",
        f"As it stands in params.yaml, with its sources. Reached means {notes.success(results)}.",
        [folder / "joints.md"],
        [(folder / "figures/arm.png", "The arm halfway along the taught path.")],
    )
