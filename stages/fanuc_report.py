"""Tables, figures, metrics and the report page of the six-joint arm.

Reads params.yaml: fanuc; what the other fanuc stages wrote; the published values; the timings that
the benchmark wrote.
Writes reports/fanuc/: joints, total_errors, passes, path_errors, study_n_hidden,
study_learning_factor, off_path, off_path_orientation, off_path_success, whole_workspace,
conditioning, configurations and growth (CSV and Markdown), metrics.json, figures/ and README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.fanuc.tables import (
    CURVE_FIELDS,
    OFF_PATH_FIELDS,
    PATH_ERROR_FIELDS,
    START_FIELDS,
    STUDY_FIELDS,
    WORKSPACE_FIELDS,
    evaluation_checksum,
    growth_checksum,
    network_checksum,
    query_checksum,
    read_path,
    study_checksum,
)
from flexik.datasets.tables import Field, read_csv, read_table
from flexik.errors import DataError
from flexik.parameters import load_parameters
from flexik.reporting.fanuc.report import write_report
from flexik.reporting.fanuc.results import PUBLISHED_NETWORKS, Results

DATA, REPORTS = Path("data/fanuc"), Path("reports/fanuc")
PUBLISHED = Path("data/reference/fanuc/total_errors.csv")
BENCHMARKS = Path("reports/benchmarks")
TIMES, GROWTH = BENCHMARKS / "fanuc.csv", BENCHMARKS / "fanuc_growth.csv"
GROWTH_COLUMNS = (
    *("n_iterations", "seconds", "mean_position_error_mm"),
    *("mean_orientation_error_deg", "success_percent"),
)


def main() -> None:
    """Run the stage."""
    fanuc = load_parameters().fanuc
    training, test = read_path(DATA / "path.parquet", fanuc)
    made_with = evaluation_checksum(fanuc)
    results = Results(
        fanuc=fanuc,
        training=training,
        test=test,
        curves=of_networks(fanuc, "curves", CURVE_FIELDS),
        starts=of_networks(fanuc, "starts", START_FIELDS),
        study=read_table(DATA / "study.parquet", STUDY_FIELDS, study_checksum(fanuc)),
        path_errors=read_table(DATA / "path_errors.parquet", PATH_ERROR_FIELDS, made_with),
        off_path=read_table(DATA / "off_path_errors.parquet", OFF_PATH_FIELDS, made_with),
        workspace=read_table(DATA / "workspace_errors.parquet", WORKSPACE_FIELDS, made_with),
        published=published(),
        times=query_times(fanuc),
        growth=growth(fanuc),
    )
    write_report(results, REPORTS, [PUBLISHED])


def of_networks(fanuc: parameters.Fanuc, folder: str, columns: tuple[Field, ...]) -> pd.DataFrame:
    """What all networks of the path have in `folder`."""
    return pd.concat(
        read_table(DATA / folder / f"{name}.parquet", columns, network_checksum(fanuc, name))
        for name in fanuc.networks
    )


def published() -> pd.DataFrame:
    """Published total errors; raises DataError unless they are percentages."""
    table = read_csv(PUBLISHED, ("joint", *PUBLISHED_NETWORKS), keys=("joint",))
    for name in PUBLISHED_NETWORKS:
        wrong = table[(table[name] < 0.0) | (table[name] > 100.0)]
        if len(wrong):
            joint, value = wrong["joint"].iloc[0], wrong[name].iloc[0]
            raise DataError(f"{PUBLISHED}: {name}, joint {joint}: expected 0 to 100 %, got {value}")
    return table


def query_times(fanuc: parameters.Fanuc) -> pd.DataFrame:
    """Times of the methods that were measured with the settings they have now."""
    columns = ("microseconds_single", "microseconds_batched")
    table = read_csv(TIMES, columns, ("method", "settings"), ("method",))
    return table[table["settings"] == query_checksum(fanuc)][["method", *columns]]


def growth(fanuc: parameters.Fanuc) -> pd.DataFrame:
    """Networks of several sizes, if trained on the poses and with the settings of now."""
    table = read_csv(GROWTH, GROWTH_COLUMNS, ("n_hidden", "settings"))
    current = table[table["settings"] == growth_checksum(fanuc)]
    return current[["n_hidden", *GROWTH_COLUMNS]]


if __name__ == "__main__":
    stage.run(main)
