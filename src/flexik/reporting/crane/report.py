"""The report of the log crane: its metrics, figures and page, from the stages' results."""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik.datasets.crane.grid import counts, kept
from flexik.datasets.crane.learning import correction, on_line
from flexik.evaluation.errors import STATISTICS, comparison, workspace_statistics
from flexik.files import file_checksum, write_json
from flexik.kinematics.crane import CraneGeometry
from flexik.multibody.crane.assembly import flexible_crane
from flexik.parameters import ModularNetwork
from flexik.positioning.crane.initial import initial_positions
from flexik.reporting.crane import error_figures, fitting_figures, learning_figures, method_figures
from flexik.reporting.crane import figures as crane_figures
from flexik.reporting.crane import schematic as crane_schematic
from flexik.reporting.crane.page import write_page
from flexik.reporting.crane.results import Results
from flexik.reporting.crane.tables import query_cost, write_tables
from flexik.reporting.crane_measured import report as measured_report
from flexik.reporting.style import MM

BEAMS = ("pillar", "lift", "jib", "extension")
# Statistics of random targets that are metrics
WORKSPACE = ("mean_error", "median_error", "p95_error", "p99_error", "max_error")
TOO_FEW, TOO_MANY = "too few", "too many"


def write_report(results: Results, folder: Path, published_files: list[Path]) -> None:
    """Write all of the report into `folder`; `published_files` are named in its provenance."""
    write_json(folder / "metrics.json", metrics(results))
    write_tables(results, folder)
    _write_figures(results, folder / "figures")
    nominal = flexible_crane(results.crane, results.spring_stiffness)
    measured_report.write(results.measured, nominal, results.crane.grid.payload.minimum, folder)
    inputs = {str(path): file_checksum(path) for path in published_files}
    for beam in BEAMS:
        path = getattr(results.crane.structure.beams, beam).section
        inputs[path] = file_checksum(path)
    write_page(results, folder, inputs)


def metrics(results: Results) -> dict[str, float]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    found: dict[str, float] = {}
    for label, values in results.statistics.items():
        for name in STATISTICS:
            found[f"{label}.{name}_mm"] = round(MM * values[name], 4)
        found[f"{label}.n_failed"] = int(values["n_failed"])
        if (frame := results.workspace[label]).empty:
            continue
        values = workspace_statistics(frame)
        for name in WORKSPACE:
            found[f"{label}.workspace_{name}_mm"] = round(MM * values[name], 4)
        found[f"{label}.workspace_n_failed"] = int(values["n_failed"])
    for name, table in (("grid", results.grid), ("selection", results.selection)):
        found |= {f"{name}.{key}": value for key, value in counts(table).items()}
    for name, (_, n_hidden) in results.studies.items():
        found[f"select.{name}.n_hidden"] = n_hidden
    found |= measured_report.metrics(results.measured)
    found["calibration.spring_stiffness_nm_per_rad"] = results.spring_stiffness
    return found


def _write_figures(results: Results, folder: Path) -> None:
    _write_crane_figures(results, folder)
    crane, errors = results.crane, results.errors
    for label in crane.methods:
        path = folder / f"positioning_errors_{label}.png"
        error_figures.positioning_errors(path, errors["none"], errors[label], label)
    for name, (sizes, chosen) in results.studies.items():
        path = folder / f"size_selection_{name}.png"
        tolerance = crane.studies[name].select.tolerance
        published = results.published_size(name)
        learning_figures.size_selection(path, sizes, chosen, published, tolerance)
    if results.studies:
        fitting_figures.size_selections(
            folder / "size_selections.png",
            {name: sizes for name, (sizes, _) in results.studies.items()},
            {name: chosen for name, (_, chosen) in results.studies.items()},
            {name: results.published_size(name) for name in results.studies},
        )
    compared = comparison(results.statistics, results.published.errors, results.published_columns)
    error_figures.method_comparison(folder / "method_comparison.png", compared)
    groups = results.groups
    frames = {
        label: frame
        for label, frame in results.workspace.items()
        if len(frame) and label not in groups["variants"]
    }
    method_figures.error_map(folder / "error_map.png", frames)
    method_figures.error_distribution(folder / "error_distribution.png", frames)
    method_figures.tolerance_study(
        folder / "tolerance_study.png",
        {str(label): study for label, study in results.tolerances.groupby("method", sort=False)},
        results.published.tolerances,
    )
    method_figures.training_race(folder / "training_race.png", results.training_curves)
    _write_fitting(results, folder)
    cost = query_cost(results).rename(
        columns={
            "single (us)": "microseconds_single",
            "batched (us)": "microseconds_batched",
            "mean R (mm)": "mean_error",
        }
    )
    measured = cost.drop(columns="published").dropna()
    if len(measured):
        method_figures.operations(folder / "query_cost.png", measured)


def _write_crane_figures(results: Results, folder: Path) -> None:
    crane, grid = results.crane, results.grid
    geometry = CraneGeometry(**crane.geometry.model_dump())
    points = np.array(crane.evaluation.points)
    initial = initial_positions(geometry, points)
    crane_schematic.crane(folder / "crane.png", geometry, results.shape)
    crane_figures.training_points(folder / "training_points.png", grid, geometry)
    crane_figures.test_points(folder / "test_points.png", points, grid)
    crane_figures.initial_positions(folder / "initial_positions.png", geometry, initial, points)
    crane_figures.sequences(folder / "sequences.png", grid)
    crane_figures.normalised_deflection(folder / "normalised_deflection.png", grid)
    crane_figures.normalised_rigid(folder / "normalised_rigid.png", grid)
    crane_figures.normalised_tip(folder / "normalised_tip.png", grid)
    for name, network in crane.modular_networks.items():
        path = folder / f"normalised_difference_{name}.png"
        values = difference(results, network)
        crane_figures.normalised_difference(path, values)


def difference(results: Results, network: ModularNetwork) -> np.ndarray:
    """What the correction of `network` learns from (n, 2), m."""
    return correction(kept(results.grid), results.networks[network.rigid])


def _write_fitting(results: Results, folder: Path) -> None:
    fitting, table = results.crane.fitting, results.fitting
    sizes = sorted(fitting.n_hidden)
    titles = {n_hidden: f"{n_hidden} hidden neurons" for n_hidden in sizes}
    if len(sizes) > 1:
        titles[sizes[0]] += f": {TOO_FEW}"
        titles[sizes[-1]] += f": {TOO_MANY}"
    curves = pd.DataFrame(
        {
            "panel": table["n_hidden"].map(titles),
            "x": table["lift_stroke"],
            "truth": MM * table["model_y"],
            "network": MM * table["network_y"],
        }
    )
    grid = kept(results.grid)
    lines = grid[on_line(grid, fitting.jib, fitting.extension, fitting.payload)]
    samples = pd.concat(
        pd.DataFrame(
            {
                "panel": title,
                "x": lines["lift_stroke"],
                "value": MM * (lines["tip_y"] - lines["rigid_y"]),
            }
        )
        for title in titles.values()
    )
    fitting_figures.under_and_overfitting(
        folder / "under_and_overfitting.png",
        curves,
        samples,
        "lift stroke (m)",
        "vertical deflection (mm)",
    )
