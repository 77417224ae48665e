"""Tables, figures, metrics and the report page of the SmartEE.

Reads params.yaml: smartee; what the other smartee stages wrote; the published peaks; the timings
that the benchmarks wrote.
Writes reports/smartee/: peaks, draws, other_geometries, training, direct_kinematics, newton,
starts, thresholds, sensitivity, outside and sizes (CSV and Markdown), metrics.json, figures/ and
README.md.
"""

from pathlib import Path

import pandas as pd

from flexik import parameters, stage
from flexik.datasets.smartee.poses import ACTUATED_FIELDS, ELBOW_FIELDS, read_poses, values
from flexik.datasets.smartee.provenance import (
    evaluation_checksum,
    query_checksum,
    sizes_checksum,
    starts_checksum,
    training_time_checksum,
)
from flexik.datasets.tables import read_csv, read_table
from flexik.evaluation.smartee.errors import ERROR_FIELDS, NEWTON_FIELDS, linear_error
from flexik.files import file_checksum
from flexik.learning import size_selection, starts
from flexik.parameters import load_parameters
from flexik.reporting.smartee.report import write_report
from flexik.reporting.smartee.results import Results, current

DATA, REPORTS = Path("data/smartee"), Path("reports/smartee")
BENCHMARKS, PUBLISHED = Path("reports/benchmarks"), Path("data/reference/smartee/peaks.csv")
TRAINING_COLUMNS = ("restart", "n_hidden", "n_iterations", "training_error", "selection_error")
REASON = ("stop_reason",)


def main() -> None:
    """Run the stage."""
    smartee = load_parameters().smartee
    made_with = evaluation_checksum(smartee)
    learnt = read_poses(DATA / "poses", smartee, smartee.starts.poses)
    training = {
        name: read_csv(DATA / "networks" / f"{name}_training.csv", TRAINING_COLUMNS, REASON)
        for name in smartee.networks
    }
    published = read_csv(PUBLISHED, ("peak",), ("quantity", "unit"), ("quantity",))
    results = Results(
        smartee=smartee,
        errors=read_table(DATA / "errors.parquet", ERROR_FIELDS, made_with),
        newton=read_table(DATA / "newton.parquet", NEWTON_FIELDS, made_with),
        starts=read_table(DATA / "starts.parquet", starts.FIELDS, starts_checksum(smartee)),
        sensitivity=read_table(
            DATA / "sensitivity.parquet", starts.FIELDS, starts_checksum(smartee)
        ),
        linear_error=linear_error(values(learnt, ACTUATED_FIELDS), values(learnt, ELBOW_FIELDS)),
        sizes=by_size(smartee, "sizes", smartee.sizes.poses),
        sizes_beside=by_size(smartee, "sizes_beside", smartee.sizes.beside),
        training=pd.concat(training, names=["network"]).reset_index(level="network"),
        random=read_poses(DATA / "poses", smartee, "random"),
        published=published.set_index("quantity"),
        query_times=query_times(smartee),
        training_times=training_times(smartee),
    )
    write_report(results, REPORTS, {str(PUBLISHED): file_checksum(PUBLISHED)})


def by_size(smartee: parameters.SmartEE, file: str, poses: str) -> pd.DataFrame:
    """Errors of the study of sizes on the rows of `poses`."""
    made_with = sizes_checksum(smartee, poses)
    runs = read_table(DATA / f"{file}.parquet", size_selection.FIELDS, made_with)
    return size_selection.by_size(runs)


def query_times(smartee: parameters.SmartEE) -> pd.DataFrame:
    """Microseconds by method and number of steps."""
    columns = ("n_steps", "microseconds_single", "microseconds_batched")
    keys = ("method", "n_steps")
    table = read_csv(BENCHMARKS / "smartee.csv", columns, ("method", "settings"), keys)
    return current(table, query_checksum(smartee))


def training_times(smartee: parameters.SmartEE) -> pd.DataFrame:
    """Seconds and long runs by trainer and spread."""
    columns = ("n_starts", "long_factor", "seconds", "long_seconds", "long_error")
    texts, keys = ("trainer", "spread", "settings"), ("trainer", "spread")
    table = read_csv(BENCHMARKS / "smartee_training.csv", columns, texts, keys)
    checksums = {name: training_time_checksum(smartee, name) for name in smartee.starts.trainers}
    return current(table, checksums, "trainer")


if __name__ == "__main__":
    stage.run(main)
