"""What all cases reached beside the published values, for the README."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from flexik.reporting.tables import markdown

NOT_AVAILABLE = "not available"
ABSENT = "not in this run"


@dataclass(frozen=True)
class Entry:
    """A row: what is measured, the metric of a case that holds it, and how it is written.

    published : name of the published value, if there is one.
    scale : to the unit of `what`.
    """

    case: str
    what: str
    metric: str
    form: str
    published: str | None = None
    scale: float = 1.0


CASES = {
    "crane": "[log crane](reports/crane/README.md) (Rouvinen)",
    "elastic_arm": "[elastic two-link arm](reports/elastic_arm/README.md) (Al-Khafaji, Jweeg)",
    "smartee": "[parallel manipulator](reports/smartee/README.md) (De Luca and others)",
    "fanuc": "[six-joint arm](reports/fanuc/README.md) (Hasan)",
}
_MEAN = "mean_error_mm"
ENTRIES = (
    Entry("crane", "mean error, not compensated (mm)", f"none.{_MEAN}", ".2f", "none"),
    Entry("crane", "mean error, `combined` (mm)", f"combined.{_MEAN}", ".2f", "combined"),
    Entry("crane", "the same, size by selection error (mm)", f"combined_selected.{_MEAN}", ".2f"),
    Entry(
        "crane",
        "measured: mean error with compensation (mm)",
        f"measured.combined.{_MEAN}",
        ".1f",
        "measured",
    ),
    Entry("crane", "measured: adapted by 9 points (mm)", f"measured.adapted_9.{_MEAN}", ".1f"),
    Entry(
        "elastic_arm",
        "R of theta_1, held-out readings",
        "published_network.r_theta1",
        ".6f",
        "r_theta_1",
    ),
    Entry(
        "elastic_arm",
        "R of theta_2, held-out readings",
        "published_network.r_theta2",
        ".6f",
        "r_theta_2",
    ),
    Entry(
        "elastic_arm", "mean tip error without gauges, `combined` (mm)", f"combined.{_MEAN}", ".2f"
    ),
    Entry("smartee", "peak elbow error (mrad)", "network.peak_elbow_rad", ".2f", "elbow", 1e3),
    Entry("smartee", "peak position error (mm)", "network.peak_position_mm", ".3f", "position"),
    Entry(
        "smartee",
        "peak elbow error, best trainer and data (mrad)",
        "best.peak_elbow_rad",
        ".2f",
        None,
        1e3,
    ),
    Entry(
        "smartee", "the published network and 2 Newton steps (rad)", "newton2.peak_elbow_rad", ".0e"
    ),
    Entry(
        "fanuc",
        "total error of the joints, one network a joint (%)",
        "config1",
        ".2f",
        NOT_AVAILABLE,
    ),
    Entry(
        "fanuc",
        "total error of the joints, one network for all (%)",
        "config2",
        ".2f",
        NOT_AVAILABLE,
    ),
)


def overview(metrics: Mapping[str, Mapping[str, float]], published: Mapping[str, float]) -> str:
    """Table in Markdown.

    Parameters
    ----------
    metrics
        Of every case of CASES.
    published
        Values by the names in ENTRIES, in the unit of the metric.

    A metric that a run with other parameters does not have is told as such.
    """
    rows = []
    for entry in ENTRIES:
        known = ""
        if entry.published == NOT_AVAILABLE:
            known = NOT_AVAILABLE
        elif entry.published is not None:
            known = format(entry.scale * published[entry.published], "g")
        value = _value(metrics[entry.case], entry)
        rows.append(
            {
                "case": CASES[entry.case],
                "what": entry.what,
                "published": known,
                "flexik": ABSENT if value is None else format(entry.scale * value, entry.form),
            }
        )
    return markdown(pd.DataFrame(rows))


def _value(metrics: Mapping[str, float], entry: Entry) -> float | None:
    """A metric, or None; of the six-joint arm the mean over its joints."""
    names = [entry.metric]
    if entry.case == "fanuc":
        names = [f"{entry.metric}.joint{k}_error_percent" for k in range(1, 7)]
    if any(name not in metrics for name in names):
        return None
    return sum(metrics[name] for name in names) / len(names)
