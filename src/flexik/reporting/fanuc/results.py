"""What the stages of the six-joint arm found, as its report needs it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.fanuc.tables import COMMANDED, JOINTS, joints_of_rows
from flexik.evaluation.fanuc.errors import statistics
from flexik.kinematics.serial_arm import Array, SerialArm
from flexik.positioning.fanuc.training import percent

PUBLISHED_NETWORKS = ("config1", "config2")
WHOLE, EXACT = "whole_workspace", "closed_form"
# Of the taught samples, without a network
LOOKED_UP = ("nearest_sample", "interpolated")


@dataclass(frozen=True, eq=False)
class Results:
    """Tables of the stages (SI units), published values and timings.

    training, test : samples of the path
    curves, starts, study, path_errors, off_path, workspace : see datasets.fanuc.tables
    published : total error percentages, columns joint and a network's name; nan: not available
    times : columns method, microseconds_single, microseconds_batched; only methods that were
        measured with the settings they have now
    growth : columns n_hidden, n_iterations, seconds and errors, see benchmarks/fanuc.py
    """

    fanuc: parameters.Fanuc
    training: pd.DataFrame
    test: pd.DataFrame
    curves: pd.DataFrame
    starts: pd.DataFrame
    study: pd.DataFrame
    path_errors: pd.DataFrame
    off_path: pd.DataFrame
    workspace: pd.DataFrame
    published: pd.DataFrame
    times: pd.DataFrame
    growth: pd.DataFrame

    @property
    def arm(self) -> SerialArm:
        """The arm."""
        return SerialArm.from_rows([joint.model_dump() for joint in self.fanuc.joints])

    @property
    def networks(self) -> list[str]:
        """Names of the networks of the path."""
        return list(self.fanuc.networks)

    @property
    def of_path(self) -> list[str]:
        """Methods that know the taught path alone."""
        return [*self.networks, *LOOKED_UP]

    @cached_property
    def start_means(self) -> pd.DataFrame:
        """Total error, mean over the joints, percent: a row a start, a column a network."""
        return self.starts.pivot_table(
            index="restart", columns="network", values="error_percent", aggfunc="mean"
        )[self.networks]

    @property
    def success(self) -> dict[str, float]:
        """Errors within which a pose counts as reached."""
        return self.fanuc.success.model_dump()

    @cached_property
    def ranges(self) -> Array:
        """Range of each joint along the path (6,), rad."""
        return np.ptp(joints_of_rows(pd.concat([self.training, self.test])), axis=0)

    @cached_property
    def error_percents(self) -> dict[str, Array]:
        """Total error of each joint (6,) in percent by method, on the test samples.

        Of networks those of the median start.
        """
        return {
            str(name): percent(
                frame[list(COMMANDED)].to_numpy(), frame[list(JOINTS)].to_numpy(), self.ranges
            )
            for name, frame in self.path_errors.groupby("method", sort=False)
        }

    @cached_property
    def on_path(self) -> dict[str, dict[str, float]]:
        """Statistics of evaluation.fanuc.errors by method, on the path."""
        groups = self.path_errors.groupby("method", sort=False)
        return {str(name): statistics(frame, self.success) for name, frame in groups}

    @cached_property
    def on_targets(self) -> dict[str, dict[str, float]]:
        """The same at random poses, by method and Newton steps."""
        frame = self.workspace
        names = [label(*key) for key in zip(frame["method"], frame["n_steps"], strict=True)]
        groups = frame.groupby(np.array(names), sort=False)
        return {str(name): statistics(group, self.success) for name, group in groups}


def label(method: str, n_steps: int) -> str:
    """Name of a method with Newton steps after it."""
    return f"{method}_refined_{n_steps}" if n_steps else method
