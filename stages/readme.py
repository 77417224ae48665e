"""Put the main tables into the README, between their markers.

Reads reports/crane/positioning_errors.md, metrics.json of every case in reports/ and published
values in data/reference/; writes README.md.
"""

from pathlib import Path

from flexik import stage
from flexik.datasets.tables import read_csv
from flexik.errors import DataError
from flexik.files import read_json, write_text
from flexik.reporting.blocks import replace_block
from flexik.reporting.overview import CASES, overview

README = Path("README.md")
REPORTS, REFERENCE = Path("reports"), Path("data/reference")


def main() -> None:
    """Run the stage."""
    table = REPORTS / "crane/positioning_errors.md"
    try:
        text, errors = README.read_text(encoding="utf-8"), table.read_text(encoding="utf-8")
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be read ({error.strerror})") from None
    metrics = {case: read_json(REPORTS / case / "metrics.json") for case in CASES}
    text = replace_block(text, "overview", overview(metrics, published()))
    write_text(README, replace_block(text, "positioning_errors", errors))


def published() -> dict[str, float]:
    """Published values by the names of reporting.overview."""
    methods, key = ("none", "combined"), ("statistic",)
    errors = read_csv(REFERENCE / "crane/positioning_errors.csv", methods, key, key)
    measured = read_csv(REFERENCE / "crane/measured_errors.csv", ("combined_all",), key, key)
    fits = read_csv(
        REFERENCE / "elastic_arm/fit.csv", ("r_theta_1", "r_theta_2"), ("network",), ("network",)
    )
    peaks = read_csv(
        REFERENCE / "smartee/peaks.csv", ("peak",), ("quantity", "unit"), ("quantity",)
    )
    mean = errors[errors["statistic"] == "mean_error"]
    found = {method: float(mean[method].iloc[0]) for method in methods}
    over_all = dict(zip(measured["statistic"], measured["combined_all"], strict=True))
    found["measured"] = float(over_all["mean_error"])
    found |= {name: float(fits[name].iloc[0]) for name in ("r_theta_1", "r_theta_2")}
    return found | dict(zip(peaks["quantity"], peaks["peak"].astype(float), strict=True))


if __name__ == "__main__":
    stage.run(main)
