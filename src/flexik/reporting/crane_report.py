"""The report of the log crane: its tables, figures, metrics and page, from the stages' results."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.crane import counts, kept
from flexik.datasets.evaluations import CONDITION_FIELDS
from flexik.evaluation.errors import STATISTICS, comparison, statistics
from flexik.files import file_checksum, write_json, write_text
from flexik.mechanisms.crane import CraneGeometry
from flexik.parameters import parameters_checksum
from flexik.positioning.initial import initial_positions
from flexik.reporting import (
    crane_figures,
    crane_notes,
    crane_schematic,
    error_figures,
    learning_figures,
    page,
    style,
    tables,
)

SIZE_TABLE = [
    "n_hidden",
    "training_error",
    "selection_error",
    "median_selection_error",
    "worst_selection_error",
    "best_restart",
    "n_failed",
]
BEAMS = ("pillar", "lift", "jib", "extension")


@dataclass(frozen=True)
class Results:
    """What the report is made from; lengths in m.

    grid, selection : tables of datasets.crane.
    errors : frame of evaluation.errors.evaluate by method, `none` among them.
    published : published statistics in mm, see evaluation.errors.comparison.
    published_sizes : n_hidden by kind of network.
    mesh_study : frame of multibody.mesh_study.
    training : a row for every restart of every network.
    studies : frame of learning.size_selection.by_size, and the chosen size, by network.
    shape : see reporting.crane_schematic.
    """

    crane: parameters.Crane
    spring_stiffness: float
    grid: pd.DataFrame
    selection: pd.DataFrame
    errors: dict[str, pd.DataFrame]
    published: pd.DataFrame
    published_sizes: Mapping[str, int]
    mesh_study: pd.DataFrame
    training: pd.DataFrame
    studies: Mapping[str, tuple[pd.DataFrame, int]]
    shape: Mapping[str, Any]

    @property
    def statistics(self) -> dict[str, dict[str, float]]:
        """Statistics by method, m."""
        return {label: statistics(frame) for label, frame in self.errors.items()}

    @property
    def published_columns(self) -> dict[str, str | None]:
        """Published column that stands beside each method of params.yaml; None: there is none."""
        return {
            label: method.method if method.method in self.published.columns else None
            for label, method in self.crane.methods.items()
        }


def write_report(results: Results, folder: Path, published_file: Path) -> None:
    """Write all of the report into `folder`; `published_file` is named in its provenance."""
    _write_metrics(results, folder)
    _write_tables(results, folder)
    _write_figures(results, folder / "figures")
    _write_page(results, folder, published_file)


def _write_metrics(results: Results, folder: Path) -> None:
    """Flat; lengths in mm, rounded to what machines agree on."""
    metrics: dict[str, float] = {}
    for label, found in results.statistics.items():
        for name in STATISTICS:
            metrics[f"{label}.{name}_mm"] = round(1e3 * found[name], 4)
        metrics[f"{label}.n_failed"] = int(found["n_failed"])
    for name, table in (("grid", results.grid), ("selection", results.selection)):
        metrics |= {f"{name}.{key}": value for key, value in counts(table).items()}
    for name, (_, n_hidden) in results.studies.items():
        metrics[f"select.{name}.n_hidden"] = n_hidden
    metrics["calibration.spring_stiffness_nm_per_rad"] = results.spring_stiffness
    write_json(folder / "metrics.json", metrics)


def _write_tables(results: Results, folder: Path) -> None:
    found, published = results.statistics, results.published
    errors = tables.positioning_errors_table(found, published, results.published_columns)
    n = found["none"]["n_conditions"]
    caption = f"Simulated positioning errors over {n} conditions, beside Rouvinen (1999)."
    notes = _errors_notes(results)
    tables.write_table(folder / "positioning_errors", errors, 2, caption, notes)

    fitted = tables.calibration_table(found["none"], published)
    caption = "Uncompensated crane after the fit of the ground spring; mean R is what was fitted."
    notes = [
        *crane_notes.calibration_notes(fitted),
        *crane_notes.worst_point_notes(results.errors["none"]),
    ]
    tables.write_table(folder / "calibration", fitted, {"difference (%)": 1}, caption, notes)

    _write_mesh_table(results, folder)
    caption = (
        "Every restart of every network: root mean square errors of the normalised outputs on the "
        "training grid and on the selection set, which chooses. The selection error can be the "
        "smaller: the grid puts many samples at the ends of strokes and payload, where networks "
        "fit worst; the selection set is drawn uniformly."
    )
    decimals = {"training error": 4, "selection error": 4}
    training = results.training.rename(columns=lambda name: name.replace("_", " "))
    tables.write_table(folder / "training", training, decimals, caption)

    for name, (sizes, _) in results.studies.items():
        _write_sizes_table(results, name, sizes, folder)

    columns = [field.name for field in CONDITION_FIELDS]
    every = [frame[columns].assign(method=label) for label, frame in results.errors.items()]
    # micrometres: what another machine may differ in lies below
    text = pd.concat(every)[["method", *columns]].to_csv(index=False, float_format="%.6f")
    write_text(folder / "errors.csv", text)


def _errors_notes(results: Results) -> list[str]:
    """What the numbers of the table owe to points, payloads and failures."""
    errors = results.errors
    notes = crane_notes.point_notes(results.crane.evaluation.points)
    notes += crane_notes.worse_notes(errors)
    payload = errors["none"]["payload"]
    notes += crane_notes.extrapolation_notes(payload, kept(results.grid)["payload"])
    return [*notes, *crane_notes.failure_notes(errors), *crane_notes.genetic_notes(errors)]


def _write_mesh_table(results: Results, folder: Path) -> None:
    study = results.mesh_study.copy()
    style.require("mesh study", study, ("n_samples", "mean_relative", "max_relative"))
    n_samples = study.pop("n_samples").max()
    shares = {f"{k} (% of deflection)": 100 * study.pop(f"{k}_relative") for k in ("mean", "max")}
    caption = (
        f"Tip against the mesh of refinement {study['refinement'].max()} with "
        f"{results.crane.structure.element} elements, {n_samples} random samples."
    )
    study = tables.mesh_table(study).assign(**shares)
    decimals = {str(name): 2 if name in shares else 3 for name in study}
    tables.write_table(folder / "mesh_study", study, decimals, caption)


def _write_sizes_table(results: Results, name: str, sizes: pd.DataFrame, folder: Path) -> None:
    select = results.crane.selected_networks[name].select
    caption = (
        f"{name}: root mean square errors of the normalised outputs by number of hidden neurons; "
        f"best restart of {select.n_restarts} by selection error."
    )
    n_hidden = list(sizes["n_hidden"])
    chosen = results.studies[name][1]
    notes = [f"chosen: {chosen}, published: {_published_size(results, name)}"]
    if chosen in (n_hidden[0], n_hidden[-1]):
        notes.append(
            "The choice lies at the end of the range: a wider range may have a better size."
        )
    table = sizes[SIZE_TABLE].rename(columns=lambda column: column.replace("_", " "))
    decimals = {str(column): 5 for column in table if "error" in str(column)}
    tables.write_table(folder / "size_selection" / name, table, decimals, caption, notes)


def _published_size(results: Results, name: str) -> int | None:
    """Published n_hidden of the kind of network `name`; None if there is none."""
    return results.published_sizes.get(results.crane.selected_networks[name].kind)


def _write_figures(results: Results, folder: Path) -> None:
    crane, grid, errors = results.crane, results.grid, results.errors
    geometry = CraneGeometry(**crane.geometry.model_dump())
    points = np.array(crane.evaluation.points)
    initial = initial_positions(geometry, points)
    crane_schematic.crane(folder / "crane.png", geometry, results.shape)
    crane_figures.training_points(folder / "training_points.png", grid, geometry)
    crane_figures.test_points(folder / "test_points.png", points, grid)
    crane_figures.initial_positions(folder / "initial_positions.png", geometry, initial, points)
    crane_figures.sequences(folder / "sequences.png", grid)
    crane_figures.normalised_deflection(folder / "normalised_deflection.png", grid)
    for label in crane.methods:
        path = folder / f"positioning_errors_{label}.png"
        error_figures.positioning_errors(path, errors["none"], errors[label], label)
    for name, (sizes, chosen) in results.studies.items():
        path = folder / f"size_selection_{name}.png"
        published, tolerance = (
            _published_size(results, name),
            crane.selected_networks[name].select.tolerance,
        )
        learning_figures.size_selection(path, sizes, chosen, published, tolerance)
    compared = comparison(results.statistics, results.published, results.published_columns)
    error_figures.method_comparison(folder / "method_comparison.png", compared)


def _write_page(results: Results, folder: Path, published_file: Path) -> None:
    crane, figures = results.crane, folder / "figures"
    sections = [
        _errors_section(results, folder),
        page.Section(
            "Flexible model",
            f"Ground spring {results.spring_stiffness / 1e6:.3f} MN m/rad, the one constant that "
            "is fitted.",
            [folder / "calibration.md", folder / "mesh_study.md"],
            [(figures / "crane.png", "The crane, rigid and in static equilibrium.")],
        ),
        _training_section(results, folder),
        _sizes_section(results, folder),
    ]
    made_with = {}
    for name in type(crane).model_fields:
        section = getattr(crane, name)
        parts = section if isinstance(section, dict) else {"": section}
        for label, part in parts.items():
            key = f"crane.{name}.{label}".removesuffix(".")
            made_with[key] = parameters_checksum([part])
    inputs = {str(published_file): file_checksum(published_file)}
    for beam in BEAMS:
        path = getattr(crane.structure.beams, beam).section
        inputs[path] = file_checksum(path)
    page.page(folder / "README.md", "Log crane (Rouvinen 1999)", sections, made_with, inputs)


def _errors_section(results: Results, folder: Path) -> page.Section:
    figures = [(folder / "figures/method_comparison.png", "Mean and largest error by method.")]
    for label in results.crane.methods:
        path = folder / "figures" / f"positioning_errors_{label}.png"
        caption = f"Errors without compensation and with `{label}` (after figure 4.8)."
        figures.append((path, caption))
    return page.Section(
        "Positioning errors",
        "Error = desired minus achieved tip position; achieved by the flexible model at the "
        f"commanded strokes.\n\n{crane_notes.methods_text(results.crane.methods)}\n\n"
        "Every error: [errors.csv](errors.csv), SI units.",
        [folder / "positioning_errors.md"],
        figures,
    )


def _training_section(results: Results, folder: Path) -> page.Section:
    figures = folder / "figures"
    n = counts(results.grid)
    behind = results.crane.grid.minimum_tip_x
    return page.Section(
        "Training data",
        f"Training grid (table 4.1 of the thesis by default): {n['n_samples']} vectors, "
        f"{n['n_kept']} kept, {n['n_left_out']} left out (rigid tip behind x = {behind:g} m), "
        f"{n['n_failed']} failed. The selection set of {len(results.selection)} vectors is drawn "
        "at random, apart from the grid and from the test conditions.",
        [folder / "training.md"],
        [
            (figures / "training_points.png", "Training points (after figure 3.4)."),
            (figures / "test_points.png", "Test points (after figure 4.2)."),
            (figures / "initial_positions.png", "Initial positions (after figure 4.4)."),
            (figures / "sequences.png", "Normalised strokes and payload (after figure 4.5)."),
            (figures / "normalised_deflection.png", "Normalised deflection (after figure 4.6)."),
        ],
    )


def _sizes_section(results: Results, folder: Path) -> page.Section:
    names = list(results.studies)
    return page.Section(
        "Size selection",
        "Networks of every size from several starts (Rouvinen 1999, chapter 2.4.5). Three disjoint "
        "sets: the grid trains, the random selection set chooses restart and size, the test "
        "conditions judge.",
        [folder / "size_selection" / f"{name}.md" for name in names],
        [
            (folder / "figures" / f"size_selection_{name}.png", f"Size selection of {name}.")
            for name in names
        ],
    )
