"""Where the end effector comes to stand when joints are commanded, and what counts as reached."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.kinematics.fanuc import configuration
from flexik.kinematics.serial_arm import Array, Pose, SerialArm, forward, pose_errors

STATISTICS = (
    "mean_position_error",
    "median_position_error",
    "max_position_error",
    "mean_orientation_error",
    "median_orientation_error",
    "max_orientation_error",
)


def workspace_errors(
    arm: SerialArm, target: Pose, number: NDArray[np.int64], joints: Array
) -> dict[str, Array]:
    """Columns position_error (n,) in m, orientation_error (n,) in rad, and what else counts.

    within_limits (n,), and in_configuration (n,): whether `joints` (n, 6), rad, are in the arm
    configuration `number` (n,) that was asked for.
    """
    distance, angle = pose_errors(target, forward(arm, joints))
    return {
        "position_error": distance,
        "orientation_error": angle,
        "within_limits": arm.within_limits(joints).astype(np.int64),
        "in_configuration": (configuration(arm, joints) == number).astype(np.int64),
    }


def within(frame: pd.DataFrame, success: Mapping[str, float]) -> pd.Series:
    """Whether each row of a frame of `workspace_errors` counts as reached.

    Errors at most the `position` (m) and the `orientation` (rad) of `success`, joints in their
    limits and in the arm configuration asked for.
    """
    return near_enough(frame, success) & (frame["in_configuration"] == 1)


def near_enough(frame: pd.DataFrame, success: Mapping[str, float]) -> pd.Series:
    """As `within`, in whatever arm configuration."""
    return (
        (frame["within_limits"] == 1)
        & (frame["position_error"] <= success["position"])
        & (frame["orientation_error"] <= success["orientation"])
    )


def statistics(frame: pd.DataFrame, success: Mapping[str, float]) -> dict[str, float]:
    """STATISTICS (m, rad) of a frame of `workspace_errors`; success_rate of `within`; n_targets."""
    found: dict[str, float] = {}
    for name in ("position", "orientation"):
        errors = frame[f"{name}_error"].to_numpy()
        found[f"mean_{name}_error"] = float(errors.mean())
        found[f"median_{name}_error"] = float(np.median(errors))
        found[f"max_{name}_error"] = float(errors.max())
    found["success_rate"] = float(within(frame, success).mean())
    found["n_targets"] = len(frame)
    return found
