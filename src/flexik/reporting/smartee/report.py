"""The report of the SmartEE: its metrics, figures and page, from the stages' results."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexik.datasets.smartee.poses import geometry_of, path_name
from flexik.evaluation.smartee.errors import CORNERS, OUTSIDE
from flexik.files import write_json
from flexik.learning.starts import by_trainer
from flexik.kinematics.smartee import inverse, rotation_zyz
from flexik.kinematics.smartee_newton import CONVERGED
from flexik.parameters import parameters_checksum
from flexik.parameters.smartee import BEST, CENTRE, PREVIOUS, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting import page
from flexik.reporting.smartee import figures, schematic
from flexik.reporting.smartee.draws import draws
from flexik.reporting.smartee.results import QUANTITIES, Results, right
from flexik.reporting.smartee.tables import write_tables

# Pose of the picture, in half extents of the box: x, y, z, ZYZ angles
DRAWN = np.array([[1.0, 0.5, 0.5, 0.0, 1.0, 0.0]])
PAPER_FIGURES = {"elbow": 4, "position": 5, "orientation": 6}


def write_report(results: Results, folder: Path, inputs: Mapping[str, str]) -> None:
    """Write all of the report into `folder`; `inputs` are checksums by file for its provenance."""
    write_json(folder / "metrics.json", metrics(results))
    write_tables(results, folder)
    _write_figures(results, folder / "figures")
    _write_page(results, folder, inputs)


def metrics(results: Results) -> dict[str, float | None]:
    """Flat, four digits; null for what is not finite."""
    found: dict[str, float] = {}
    for name in results.smartee.networks:
        for poses, prefix in ((VALIDATION, ""), (RANDOM, "random_"), (CORNERS, "corners_")):
            for quantity in QUANTITIES:
                key = f"{name}.{prefix}peak_{quantity}_{results.unit(quantity)}"
                found[key] = results.peak(name, 0, poses, quantity)
    for name, share in (
        draws(results).query("error == 'all three'")[["network", "meets (%)"]].values
    ):
        found[f"{name}.draws_share"] = 0.01 * share
    for n_steps in range(1, results.smartee.newton.network_steps + 1):
        for poses, prefix in ((VALIDATION, ""), (RANDOM, "random_")):
            key = f"newton{n_steps}.{prefix}peak_elbow_rad"
            found[key] = results.peak(PUBLISHED, n_steps, poses, "elbow")
        wrong, unnoticed, _ = results.n_wrong(n_steps, OUTSIDE)
        found[f"newton{n_steps}.outside_n_failed"] = wrong
        found[f"newton{n_steps}.outside_n_unnoticed"] = unnoticed
    for label, group in results.newton.groupby("poses", sort=False):
        converged = group[group["status"] == CONVERGED]
        found[f"newton.{label}_n_failed"] = int((~right(group)).sum())
        found[f"newton.{label}_n_wrong"] = int((~right(converged)).sum())
        found[f"newton.{label}_mean_steps"] = float(converged["n_steps"].mean())
    for row in by_trainer(results.starts).to_dict("records"):
        key = f"starts.{row['trainer']}.{row['spread']}"
        found[f"{key}.success_share"] = row["success_share"]
        found[f"{key}.median_error"] = row["median_error"]
    found["closure.largest_condition_number"] = float(results.condition_numbers().max())
    return {key: _rounded(value) for key, value in found.items()}


def _rounded(value: float) -> float | None:
    if isinstance(value, int):
        return value
    return float(f"{value:.4g}") if np.isfinite(value) else None


def _write_figures(results: Results, folder: Path) -> None:
    smartee = results.smartee
    drawn = _drawn_joints(results)
    schematic.mechanism(folder / "mechanism.png", geometry_of(smartee), drawn)
    for quantity, column in QUANTITIES.items():
        unit, factor = results.shown(quantity)
        errors = {
            name: factor
            * results.factor(quantity)
            * results.of(name, 0, VALIDATION)[column].to_numpy()
            for name in smartee.networks
        }
        path, peak = folder / f"{quantity}_errors.png", factor * results.published_peak(quantity)
        figures.pose_errors(path, quantity, unit, errors, peak)
    figures.starts(folder / "starts.png", results.starts, smartee.starts.success)
    figures.newton_steps(folder / "newton_steps.png", newton_curves(results))
    steps = smartee.newton.network_steps
    outside = {
        name if n_steps == 0 else f"{name} + {n_steps} steps": results.of(name, n_steps, OUTSIDE)
        for name in (PUBLISHED, BEST)
        for n_steps in (0, steps)
    }
    figures.outside(folder / "outside.png", outside, smartee.outside.n_bins)
    sizes = {smartee.sizes.poses: results.sizes, smartee.sizes.beside: results.sizes_beside}
    figures.sizes(folder / "sizes.png", sizes, smartee.networks[PUBLISHED].n_hidden)


def _drawn_joints(results: Results) -> np.ndarray:
    space = results.smartee.workspace
    position = np.array([space.centre]) + DRAWN[:, :3] * np.array(space.half_lengths)
    rotation = rotation_zyz(DRAWN[:, 3:] * np.array(space.half_angles))
    return inverse(geometry_of(results.smartee), position, rotation).joints[0]


def newton_curves(results: Results) -> dict[str, dict[int, float]]:
    """Peak elbow error (rad) by Newton steps, by where they start."""
    newton = results.smartee.newton
    curves = {
        f"from {name}, random poses": {
            k: results.peak(name, k, RANDOM, "elbow") for k in range(most + 1)
        }
        for name, most in (
            (CENTRE, newton.shown_steps),
            *((network, newton.network_steps) for network in results.smartee.networks),
        )
    }
    for n_samples in results.smartee.path.n_samples:
        path = path_name(n_samples)
        curves[f"from the previous of {n_samples} samples of the path"] = {
            k: results.peak(PREVIOUS, k, path, "elbow") for k in range(1, newton.network_steps + 1)
        }
    return curves


def _write_page(results: Results, folder: Path, inputs: Mapping[str, str]) -> None:
    shown = folder / "figures"
    sections = [
        page.Section(
            "Mechanism",
            "Three legs carry a plate; pitch and roll of each leg's first link are actuated, the "
            "elbows are passive. The networks map the six actuated angles to the three elbows, "
            "from which the pose follows in closed form.",
            [folder / "other_geometries.md"],
            figures=[(shown / "mechanism.png", "The SmartEE; dashed: where a tip can be.")],
        ),
        page.Section(
            "Errors of the networks",
            "",
            [folder / "peaks.md", folder / "draws.md", folder / "training.md"],
            [
                (
                    shown / f"{quantity}_errors.png",
                    f"{figures.LABELS[quantity].capitalize()} (after figure {number}).",
                )
                for quantity, number in PAPER_FIGURES.items()
            ],
        ),
        page.Section(
            "Network and Newton's method",
            "",
            [folder / "direct_kinematics.md", folder / "newton.md"],
            [(shown / "newton_steps.png", "Peak elbow error against Newton steps.")],
        ),
        page.Section(
            "Initial weights",
            "The paper proposes a weight penalty that fades, against local minima far from the "
            "origin of the weights.",
            [folder / f"{name}.md" for name in ("starts", "thresholds", "sensitivity")],
            [
                (
                    shown / "starts.png",
                    "Errors the starts end with. Success is a cut through curves that are steep: "
                    "a little to the side the shares are others.",
                )
            ],
        ),
        page.Section(
            "Outside the box",
            "",
            [folder / "outside.md"],
            [
                (
                    shown / "outside.png",
                    "Elbow error inside the box and beyond, angles a turn apart taken for the "
                    f"same. What is below {figures.LEAST:g} rad is rounding and drawn there.",
                )
            ],
        ),
        page.Section(
            "Number of hidden neurons",
            "",
            [folder / "sizes.md"],
            [(shown / "sizes.png", "Error against the number of hidden neurons.")],
        ),
    ]
    made_with = {
        f"smartee.{name}": _checksum(getattr(results.smartee, name))
        for name in type(results.smartee).model_fields
    }
    title = "SmartEE parallel manipulator (De Luca, Mattone and Sciandrone)"
    page.page(folder / "README.md", title, sections, made_with, inputs)


def _checksum(section: Any) -> str:
    return parameters_checksum(section.values() if isinstance(section, dict) else [section])
