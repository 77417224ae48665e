"""The crane's report: its values, tables, figures, metrics and page from what the stages made."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.crane.measured_report import measured
from flexik.cases.crane.parts.samples import counts
from flexik.cases.crane.report_figures import figures
from flexik.cases.crane.report_results import REFERENCE, Results, read
from flexik.cases.crane.report_tables import calibration, every_condition, tables
from flexik.cases.crane.section import Section
from flexik.evaluation.errors import STATISTICS, workspace_statistics
from flexik.kinematics.status import REACHED, STATUS_MEANING
from flexik.reporting.report import Content, made_from, write_report
from flexik.reporting.style import MM

DATA, REPORTS = Path("data/crane"), Path("reports/crane")
MACHINE = Path("data/machines/crane.yaml")
# Statistics of random targets that are metrics
WORKSPACE = ("mean_error", "median_error", "p95_error", "p99_error", "max_error")
CALIBRATION_TARGET = 10.0  # %, accepted difference from the published
# Columns of errors.csv
CONDITION_COLUMNS = (
    *("point", "target_x", "target_y", "payload"),
    *("lift_stroke", "jib_stroke", "extension_stroke"),
    *("achieved_x", "achieved_y", "error_x", "error_y", "error", "status"),
)


def report(section: Section) -> None:
    """Write reports/crane."""
    results = read(section, DATA)
    write_report(
        REPORTS,
        Path(__file__).with_name("page.md.j2"),
        content(results) | measured(section),
        sources=made_from(
            section,
            [
                MACHINE,
                *section.machine.structure.beams.sections.values(),
                *sorted(REFERENCE.glob("*.csv")),
            ],
        ),
        record=DATA / "report.json",
    )


def content(results: Results) -> Content:
    """All but the measured campaign."""
    errors = every_condition(dict(results.errors), CONDITION_COLUMNS)
    return Content(
        tables(results), figures(results), metrics(results), values(results), {"errors.csv": errors}
    )


def metrics(results: Results) -> dict[str, float]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    found: dict[str, float] = {}
    for label, statistics in results.statistics.items():
        for name in STATISTICS:
            found[f"{label}.{name}_mm"] = round(MM * statistics[name], 4)
        found[f"{label}.n_failed"] = int(statistics["n_failed"])
        if label in results.spread:
            for name in ("mean_error", "max_error"):
                spread = MM * results.spread[label][name]
                for which in ("min", "median", "max"):
                    found[f"{label}.restarts.{which}_{name}_mm"] = round(spread.agg(which), 4)
        if (frame := results.workspace[label]).empty:
            continue
        over_workspace = workspace_statistics(frame)
        for name in WORKSPACE:
            found[f"{label}.workspace_{name}_mm"] = round(MM * over_workspace[name], 4)
        found[f"{label}.workspace_n_failed"] = int(over_workspace["n_failed"])
    for name, samples in (("grid", results.grid), ("selection", results.selection)):
        found |= {f"{name}.{key}": value for key, value in counts(samples).items()}
    for name, (_, n_hidden) in results.studies.items():
        found[f"select.{name}.n_hidden"] = n_hidden
    found["calibration.spring_stiffness_nm_per_rad"] = results.spring_stiffness
    return found


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page say, by name."""
    section, payload = results.section, results.errors["none"]["payload"]
    trained = results.kept["payload"].min(), results.kept["payload"].max()
    keys = ("method", "network", "n_corrections", "genetic", "inversion")
    sizes = {results.methods[label].network: label for label in results.groups["published"]}
    tolerance_of = [
        section.methods[name].model_dump() for name in section.studies.tolerance.methods
    ]
    return {
        "results": results,
        "section": section,
        "methods": {
            label: {key: getattr(method, key, None) for key in keys}
            for label, method in results.methods.items()
        },
        "of_published_size": all(
            section.networks[name].n_hidden == results.published_size(name)
            for name in sizes
            if name
        ),
        "has_stand_in": (2.0, -3.95) in results.points,
        "trained_payload": trained,
        "n_extrapolated": int((~payload.between(*trained)).sum()),
        "worse": worse(results.errors),
        "failures": failures(results.errors),
        "workspace_failures": failures(results.workspace),
        "genetic": genetic(results.errors),
        "no_better": no_better(results),
        "descends": all(m["inversion"]["kind"] == "gradient_descent" for m in tolerance_of),
        "has_cost": not results.query_cost().drop(columns="published").dropna().empty,
        "grid": counts(results.grid),
        "far": far_from_published(results),
        "worst": worst_condition(results.errors["none"]),
    }


def worse(errors: Mapping[str, pd.DataFrame]) -> dict[str, dict[str, float]]:
    """By method, in how many conditions it does worse than none, and by how much at most (m)."""
    found = {}
    for label, frame in errors.items():
        excess = frame["error"].to_numpy() - errors["none"]["error"].to_numpy()
        found[label] = {"n": int((excess > 0).sum()), "of": len(frame), "most": excess.max()}
    return found


def failures(errors: Mapping[str, pd.DataFrame]) -> dict[str, dict[str, Any]]:
    """By method that failed: in how many conditions, and in how many for each reason."""
    found = {}
    for label, frame in errors.items():
        failed = frame.loc[frame["status"] != REACHED, "status"]
        if len(failed):
            codes = failed.value_counts().sort_index()
            reasons = {STATUS_MEANING[int(str(code))]: int(n) for code, n in codes.items()}
            found[label] = {"n": len(failed), "reasons": reasons}
    return found


def genetic(errors: Mapping[str, pd.DataFrame]) -> dict[str, dict[str, float]]:
    """By method with a genetic inverse: generations for the corrected target, mean and most."""
    name = "corrected_n_generations"
    return {
        label: {"mean": frame[name].mean(), "most": int(frame[name].max())}
        for label, frame in errors.items()
        if name in frame
    }


def no_better(results: Results) -> list[dict[str, Any]]:
    """Methods that the selected size does not improve, with the selection errors and starts."""
    least = results.training.groupby("network")["selection_error"].min()
    found = []
    for label in results.groups["selected"]:
        given = results.methods[label].method
        if given in results.statistics and (
            results.statistics[label]["mean_error"] > results.statistics[given]["mean_error"]
        ):
            names = [str(results.methods[name].network) for name in (label, given)]
            found.append(
                {
                    "method": label,
                    "given": given,
                    "errors": [least[name] for name in names],
                    "starts": [results.networks[name].n_restarts for name in names],
                }
            )
    return found


def far_from_published(results: Results) -> list[dict[str, Any]]:
    """Statistics without compensation that differ by more than CALIBRATION_TARGET."""
    fitted = calibration(results).rename(columns={"difference (%)": "difference"})
    far = ~(np.abs(fitted["difference"]) <= CALIBRATION_TARGET)
    return fitted[far].to_dict("records")


def worst_condition(frame: pd.DataFrame) -> dict[str, Any]:
    """The condition with the largest error, and the largest of the other points (m)."""
    worst = frame.iloc[int(frame["error"].to_numpy().argmax())]
    others = frame.loc[frame["point"] != worst["point"], "error"]
    found = {str(name): value for name, value in worst.items()}
    return found | {"others": others.max() if len(others) else None}
