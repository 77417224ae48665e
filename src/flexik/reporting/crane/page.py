"""The report page of the log crane."""

from collections.abc import Mapping
from pathlib import Path

from flexik.datasets.crane.grid import counts
from flexik.parameters import parameters_checksum
from flexik.reporting import page
from flexik.reporting.crane import notes as crane_notes
from flexik.reporting.crane.results import Results
from flexik.reporting.crane_measured import report as measured_report

THESIS_FIGURES = {"combined": "4.8", "direct": "4.10", "modular": "4.14", "inverse": "4.18"}


def write_page(results: Results, folder: Path, inputs: Mapping[str, str]) -> None:
    """Write README.md of `folder` from the tables and figures there.

    Parameters
    ----------
    results
        Of the stages.
    folder
        Holds the tables and, in `figures`, the figures.
    inputs
        Checksums by the name of an input file.
    """
    crane = results.crane
    sections = [
        _errors(results, folder),
        _selected(results, folder),
        _workspace(results, folder),
        _inversions(results, folder),
        _cost(folder),
        measured_report.section(results.measured, folder),
        _training_data(results, folder),
        _training(folder),
        _sizes(results, folder),
        _model(results, folder),
    ]
    made_with = {}
    for name in type(crane).model_fields:
        section = getattr(crane, name)
        parts = section if isinstance(section, dict) else {"": section}
        for label, part in parts.items():
            key = f"crane.{name}.{label}".removesuffix(".")
            made_with[key] = parameters_checksum([part])
    page.page(folder / "README.md", "Log crane (Rouvinen 1999)", sections, made_with, inputs)


def _errors(results: Results, folder: Path) -> page.Section:
    figures = [
        (folder / "figures/method_comparison.png", "Mean and largest error by method."),
        *_error_figures(results, folder, "published"),
    ]
    return page.Section(
        "Positioning errors",
        "Error = desired minus achieved tip position; achieved by the flexible model at the "
        f"commanded strokes.\n\n{crane_notes.methods_text(results.crane.methods)}\n\n"
        "Every error: [errors.csv](errors.csv), SI units.",
        [folder / "positioning_errors.md", folder / "without_worst_points.md"],
        figures,
    )


def _error_figures(results: Results, folder: Path, group: str) -> list[tuple[Path, str]]:
    figures = []
    for label in results.groups[group]:
        after = THESIS_FIGURES[results.crane.methods[label].method]
        caption = f"Errors without compensation and with `{label}` (after figure {after})."
        figures.append((folder / "figures" / f"positioning_errors_{label}.png", caption))
    return figures


def _selected(results: Results, folder: Path) -> page.Section:
    return page.Section(
        "Networks of selected size",
        "The same methods with networks whose size the selection error chooses (see size "
        "selection below).",
        [folder / "positioning_errors_selected.md"],
        _error_figures(results, folder, "selected"),
    )


def _workspace(results: Results, folder: Path) -> page.Section:
    space = results.crane.workspace
    return page.Section(
        "Over the whole working area",
        f"{space.n_targets} targets, uniform over the area that the rigid crane reaches and the "
        "loaded one can be put on, each with a random payload. Payloads of the training grid begin "
        f"at {results.crane.grid.payload.minimum:g} kg.",
        [folder / "workspace.md"],
        [
            (
                folder / "figures/error_map.png",
                "Mean error over the working area (variants left out).",
            ),
            (folder / "figures/error_distribution.png", "Distribution of the errors."),
        ],
    )


def _inversions(results: Results, folder: Path) -> page.Section:
    return page.Section(
        "Inverting the networks, and other variants",
        "Gradient descent on the inputs is the published way (equations 59 to 63); damped "
        "Gauss-Newton takes a few steps to the solution that gradient descent approaches. What "
        "remains is the error of the network.",
        [
            folder / "inversions.md",
            folder / "tolerance_study.md",
            folder / "positioning_errors_variants.md",
        ],
        [
            (folder / "figures/tolerance_study.png", "Error and iterations by tolerance."),
            *_error_figures(results, folder, "variants"),
        ],
    )


def _cost(folder: Path) -> page.Section:
    figure = folder / "figures/query_cost.png"
    figures = [(figure, "Cost of a query against accuracy.")] if figure.is_file() else []
    return page.Section("Cost of a query", "", [folder / "query_cost.md"], figures)


def _training_data(results: Results, folder: Path) -> page.Section:
    figures = folder / "figures"
    n = counts(results.grid)
    behind = results.crane.grid.minimum_tip_x
    return page.Section(
        "Training data",
        f"Training grid (table 4.1 of the thesis by default): {n['n_samples']} vectors, "
        f"{n['n_kept']} kept, {n['n_left_out']} left out (rigid tip behind x = {behind:g} m), "
        f"{n['n_failed']} failed. The selection set of {len(results.selection)} vectors is drawn "
        "at random, apart from the grid and from the test conditions. The inverse network learns "
        "from the poses that the rigid inverse takes: beyond the folds of the jib stroke a second "
        "pose has the same tip.",
        [],
        [
            (figures / "training_points.png", "Training points (after figure 3.4)."),
            (figures / "test_points.png", "Test points (after figure 4.2)."),
            (figures / "initial_positions.png", "Initial positions (after figure 4.4)."),
            (figures / "sequences.png", "Normalised strokes and payload (after figure 4.5)."),
            (figures / "normalised_deflection.png", "Normalised deflection (after figure 4.6)."),
            (figures / "normalised_rigid.png", "Normalised rigid tip (after figure 4.12)."),
            *(
                (
                    figures / f"normalised_difference_{name}.png",
                    f"What the correction of `{name}` learns (after figure 4.13).",
                )
                for name in results.crane.modular_networks
            ),
            (figures / "normalised_tip.png", "Normalised flexible tip (after figure 4.17)."),
        ],
    )


def _training(folder: Path) -> page.Section:
    return page.Section(
        "Training",
        "Levenberg-Marquardt against back-propagation (equations 49 to 54, pattern and batch mode) "
        "on the deflection network of published size.",
        [folder / "training_race.md", folder / "training.md"],
        [(folder / "figures/training_race.png", "Training error against time.")],
    )


def _sizes(results: Results, folder: Path) -> page.Section:
    names, figures = list(results.studies), folder / "figures"
    fitting = results.crane.fitting
    overview = [(figures / "size_selections.png", "Errors by size, all networks.")] if names else []
    return page.Section(
        "Size selection",
        "Networks of every size from several starts (Rouvinen 1999, chapter 2.4.5). Three disjoint "
        "sets: the grid trains, the random selection set chooses restart and size, the test "
        "conditions judge.",
        [
            folder / "size_rules.md",
            *(folder / "size_selection" / f"{name}.md" for name in names),
        ],
        [
            *overview,
            *(
                (figures / f"size_selection_{name}.png", f"Size selection of {name}.")
                for name in names
            ),
            (
                figures / "under_and_overfitting.png",
                "Under- and overfitting (after figures 2.9 and 2.10): deflection networks trained "
                f"on {fitting.n_samples} vectors of the grid, along a line of poses that none of "
                "them saw.",
            ),
        ],
    )


def _model(results: Results, folder: Path) -> page.Section:
    return page.Section(
        "Flexible model",
        f"Ground spring {results.spring_stiffness / 1e6:.3f} MN m/rad, the one constant that "
        "is fitted.",
        [folder / "calibration.md", folder / "mesh_study.md"],
        [(folder / "figures/crane.png", "The crane, rigid and in static equilibrium.")],
    )
