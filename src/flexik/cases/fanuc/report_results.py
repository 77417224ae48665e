"""What the stages of the six-joint arm found, as its report needs it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.fanuc.parts import evaluate
from flexik.cases.fanuc.parts.learning import percent
from flexik.cases.fanuc.parts.tables import (
    COMMANDED_FIELDS,
    JOINT_FIELDS,
    PATH_FIELDS,
    QUERY_FIELDS,
    array,
)
from flexik.cases.fanuc.section import PUBLISHED_NETWORKS, WHOLE, Section, Success
from flexik.datasets.tables import read_csv, read_table
from flexik.errors import DataError
from flexik.kinematics.serial_arm import Array
from flexik.kinematics.status import REACHED
from flexik.reporting.report import digest

BENCHMARKS = Path("reports/benchmarks")
PUBLISHED = Path("data/reference/fanuc/total_errors.csv")
TIMES = ("microseconds_single", "microseconds_batched")
GROWTH = (
    *("n_iterations", "seconds", "mean_position_error_mm"),
    *("mean_orientation_error_deg", "success_percent"),
)
# Studies, and what they vary in words
VARIED = {"n_hidden": "hidden neurons", "learning_factor": "learning factor"}


@dataclass(frozen=True, eq=False)
class Results:
    """Tables of the stages (SI units), published values and timings.

    path : samples of the taught path
    starts, curves : of all networks of the path, with a column `network`
    start_errors : as `errors`, of all starts of the networks of the path, with a column `restart`
    studies : by what was varied
    errors : all methods on all conditions; columns conditions, method, label (the method with its
        Newton steps), reached, met (as reached, in whatever configuration), those of the errors,
        and those of the conditions that are no query
    published : total error percentages by joint and network; nan: not available
    times, growth : of benchmarks/fanuc.py, measured with the settings of now
    """

    section: Section
    path: pd.DataFrame
    starts: pd.DataFrame
    curves: pd.DataFrame
    start_errors: pd.DataFrame
    studies: dict[str, pd.DataFrame]
    errors: pd.DataFrame
    published: pd.DataFrame
    times: pd.DataFrame
    growth: pd.DataFrame

    @property
    def networks(self) -> list[str]:
        """Names of the networks of the path."""
        return list(self.section.path_networks)

    @property
    def n_steps(self) -> int:
        """Newton steps, at most."""
        return self.section.conditions.refinement.n_steps

    @property
    def by_trainer(self) -> dict[str, list[str]]:
        """Names of the networks of the path by the kind of their trainer."""
        found: dict[str, list[str]] = {}
        for name, network in self.section.path_networks.items():
            found.setdefault(self.section.trainers[network.trainer].kind, []).append(name)
        return found

    @cached_property
    def start_means(self) -> dict[str, pd.Series]:
        """By network the total error of each start, mean over the joints, percent."""
        groups = self.starts.groupby(["network", "restart"])["error_percent"].mean()
        return {name: groups[name] for name in self.networks}

    @cached_property
    def error_percents(self) -> dict[str, Array]:
        """Total error of each joint (6,) in percent by method, on the test samples."""
        ranges, rows = np.ptp(array(self.path, JOINT_FIELDS), axis=0), self.of("path")
        return {
            str(name): percent(array(frame, COMMANDED_FIELDS), array(frame, JOINT_FIELDS), ranges)
            for name, frame in rows.groupby("method", sort=False)
        }

    @cached_property
    def statistics(self) -> dict[str, pd.DataFrame]:
        """By conditions a row a label: errors in SI units, share reached, number."""
        return {
            str(conditions): rows.groupby("label", sort=False).agg(
                mean=("error", "mean"),
                median=("error", "median"),
                max=("error", "max"),
                mean_turn=("orientation_error", "mean"),
                max_turn=("orientation_error", "max"),
                reached=("reached", "mean"),
                n=("error", "size"),
            )
            for conditions, rows in self.errors.groupby("conditions", sort=False)
        }

    @cached_property
    def start_shifts(self) -> pd.Series:
        """Mean position error on the path, m, by network and start."""
        rows = having(self.start_errors, conditions="path")
        return rows.groupby(["method", "restart"], sort=False)["error"].mean()

    def of(self, conditions: str) -> pd.DataFrame:
        """Rows of `errors` of some conditions, without columns of others."""
        rows = having(self.errors, conditions=conditions)
        return rows.dropna(axis="columns", how="all")

    def passes_needed(self, error: float) -> pd.DataFrame:
        """By network, joint, start: passes from which on the training error stays below `error`.

        A share of the range; inf where the last pass is not below.
        """
        above = ~(self.curves["training_error"] <= error)
        curves = self.curves.assign(passes=(self.curves["iteration"] + 1.0).where(above, 0.0))
        groups = curves.groupby(["network", "joint", "restart"], sort=False)
        found = groups[["iteration", "passes"]].max().reset_index()
        return found.assign(
            passes=found["passes"].where(found["passes"] <= found["iteration"], np.inf)
        )

    def study_statistics(self, varied: str) -> pd.DataFrame:
        """A row a value of what was varied: errors over the starts in percent, runs ended early."""
        groups = self.studies[varied].groupby("value")
        return (
            groups.agg(
                starts=("restart", "size"),
                median=("error_percent", "median"),
                least=("error_percent", "min"),
                largest=("error_percent", "max"),
                training=("training_percent", "median"),
                early=("stop_reason", lambda reasons: int((reasons != "iterations").sum())),
            )
            .reset_index()
            .astype({"value": int} if varied == "n_hidden" else {})
        )


def having(frame: pd.DataFrame, **chosen: Any) -> pd.DataFrame:
    """Rows whose columns have the values `chosen`."""
    for column, value in chosen.items():
        frame = frame[frame[column] == value]
    return frame


def label(method: str, n_steps: int) -> str:
    """Name of a method with Newton steps after it."""
    return f"{method}_refined_{n_steps}" if n_steps else method


def read(section: Section) -> Results:
    """All of it; raises DataError if something is missing, damaged or impossible."""

    def of_networks(kind: str) -> pd.DataFrame:
        files = {n: section.data / f"networks/{n}.{kind}.parquet" for n in section.path_networks}
        return pd.concat(read_table(file).assign(network=name) for name, file in files.items())

    parts = [part.name for part in evaluate.parts(section)]
    with_starts = [f"{where}/{n}" for where in ("path", "off_path") for n in section.path_networks]
    times = read_csv(BENCHMARKS / "fanuc.csv", TIMES, ("method", "settings"), ("method",))
    growth = read_csv(BENCHMARKS / "fanuc_growth.csv", GROWTH, ("n_hidden", "settings"))
    return Results(
        section=section,
        path=read_table(section.data / "samples/path.parquet", PATH_FIELDS),
        starts=of_networks("starts"),
        curves=of_networks("curves"),
        start_errors=_errors(section, with_starts, ".starts"),
        studies={n: read_table(section.data / f"studies/{n}.parquet") for n in VARIED},
        errors=_errors(section, parts),
        published=published(PUBLISHED),
        times=times[times["settings"] == query_settings(section)],
        growth=growth[growth["settings"] == growth_settings(section)],
    )


def _errors(section: Section, parts: Sequence[str], kind: str = "") -> pd.DataFrame:
    """Results.errors of parts "CONDITIONS/METHOD"; those of all starts: `kind` ".starts"."""
    queries, tables = [field.name for field in QUERY_FIELDS], []
    for part in parts:
        conditions, method = part.split("/")
        asked = read_table(section.data / f"samples/conditions/{conditions}.parquet")
        found = read_table(section.data / f"errors/{part}{kind}.parquet")
        found = found.drop(columns=queries, errors="ignore")
        found = found.join(asked.drop(columns=queries), on="point")
        labels = found["n_steps"].map(partial(label, method))
        tables.append(found.assign(conditions=conditions, method=method, label=labels))
    return judged(pd.concat(tables, ignore_index=True), section.success)


def judged(errors: pd.DataFrame, success: Success) -> pd.DataFrame:
    """`errors` with columns `met`, and `reached` in the arm configuration asked for."""
    near = errors["error"] <= success.position
    near &= errors["orientation_error"] <= success.orientation
    met = near & (errors["status"] == REACHED)
    return errors.assign(met=met, reached=met & (errors["in_configuration"] == 1))


def published(path: Path) -> pd.DataFrame:
    """Published total errors by joint; raises DataError unless they are percentages."""
    table = read_csv(path, ("joint", *PUBLISHED_NETWORKS), keys=("joint",)).set_index("joint")
    for name in PUBLISHED_NETWORKS:
        for joint, value in table[name].items():
            if value < 0.0 or value > 100.0:
                raise DataError(f"{path}: {name}, joint {joint}: expected 0 to 100 %, got {value}")
    return table


def query_settings(section: Section) -> str:
    """Checksum of what the time of a query depends on: arm, sizes, samples, Newton steps."""
    shapes = {n: (e.learns, e.sizes[0], e.activation) for n, e in section.networks.items()}
    steps = section.conditions.refinement.model_dump()
    return digest([section.machine.model_dump(), steps, shapes, section.samples.path.n_training])


def growth_settings(section: Section) -> str:
    """Checksum of what networks of other sizes and passes share with whole_workspace."""
    network, given, samples = section.networks[WHOLE], section.conditions, section.samples
    trainer = section.trainers[network.trainer].but(n_iterations=1)
    parts = (section.machine, given.random_poses, given.refinement, section.success, trainer)
    numbers = (samples.n_poses, samples.seed, network.activation, network.seed)
    return digest([*(part.model_dump() for part in parts), *numbers])
