"""The crane's report: its values, metrics and page from what the stages made."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from flexik.cases.crane.measured_report import measured
from flexik.cases.crane.parts.fields import STROKES
from flexik.cases.crane.report_figures import figures
from flexik.cases.crane.report_results import REFERENCE, Results, read
from flexik.cases.crane.report_tables import calibration, tables
from flexik.cases.crane.section import Section
from flexik.evaluation.errors import STATISTICS
from flexik.kinematics.status import REACHED, STATUS_MEANING
from flexik.planar.samples import counts
from flexik.positioning.registry import about
from flexik.reporting.report import Content, write_case
from flexik.reporting.style import MM

# Columns of errors.csv
CONDITION_COLUMNS = [
    *("method", "point", "target_x", "target_y", "payload", *STROKES),
    *("achieved_x", "achieved_y", "error_x", "error_y", "error", "status"),
]


def report(section: Section) -> None:
    """Write tables, figures and page."""
    sections = section.machine.section_files.values()
    made_from: list[Path | str] = [*sections, *sorted(REFERENCE.glob("*.csv"))]
    whole = content(read(section)) | measured(section)
    write_case(section, Path(__file__).with_name("page.md.j2"), whole, made_from)


def content(results: Results) -> Content:
    """All but the measured campaign."""
    rows = pd.concat([frame.assign(method=label) for label, frame in results.errors.items()])
    # micrometres: what another machine may differ in lies below
    errors = rows[CONDITION_COLUMNS].to_csv(index=False, float_format="%.6f")
    return Content(
        tables(results), figures(results), metrics(results), values(results), {"errors.csv": errors}
    )


def metrics(results: Results) -> dict[str, float]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    found: dict[str, float] = {}
    for label, statistics in results.statistics.items():
        lengths = {name: statistics[name] for name in STATISTICS}
        found |= _millimetres(label, lengths) | {f"{label}.n_failed": statistics["n_failed"]}
        if label in results.spread:
            spread = results.spread[label][["mean_error", "max_error"]].agg(
                ["min", "median", "max"]
            )
            lengths = {f"{k}_{name}": v for name in spread for k, v in spread[name].items()}
            found |= _millimetres(f"{label}.restarts", lengths)
        if at_random := results.workspace_statistics.get(label):
            lengths = {f"workspace_{k}": v for k, v in at_random.items() if k.endswith("_error")}
            found |= _millimetres(label, lengths)
            found[f"{label}.workspace_n_failed"] = at_random["n_failed"]
    for name, samples in (("grid", results.grid), ("selection", results.selection)):
        found |= {f"{name}.{key}": value for key, value in counts(samples).items()}
    for name, (_, n_hidden) in results.studies.items():
        found[f"select.{name}.n_hidden"] = n_hidden
    found["calibration.spring_stiffness_nm_per_rad"] = results.spring_stiffness
    return found


def _millimetres(prefix: str, lengths: Mapping[str, float]) -> dict[str, float]:
    return {f"{prefix}.{name}_mm": round(MM * value, 4) for name, value in lengths.items()}


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page say, by name."""
    section, methods = results.section, results.methods
    inverted = [section.methods[name] for name in section.studies.tolerance.methods]
    used = [name for label in results.groups["published"] if (name := methods[label].network)]
    return {
        "results": results,
        "section": section,
        "methods": methods,
        "about": {label: about(method) for label, method in section.methods.items()},
        "of_published_size": all(
            section.networks[name].n_hidden == results.published_size(name) for name in used
        ),
        "reached": REACHED,
        "meaning": STATUS_MEANING,
        "descends": all(m.inversion.kind == "gradient_descent" for m in inverted),  # type: ignore[attr-defined]
        "has_cost": results.query_cost().drop(columns="published").dropna().size > 0,
        "grid": counts(results.grid),
        "calibration": calibration(results).frame.to_dict("records"),
        "least_selection_error": results.training.groupby("network")["selection_error"].min(),
    }
