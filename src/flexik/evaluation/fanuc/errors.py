"""Where the end effector comes to stand when joints are commanded, and what counts as reached."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from flexik.mechanisms.serial_arm import Array, Pose, SerialArm, forward, pose_errors

STATISTICS = (
    "mean_position_error",
    "median_position_error",
    "max_position_error",
    "mean_orientation_error",
    "median_orientation_error",
    "max_orientation_error",
)


def workspace_errors(arm: SerialArm, target: Pose, joints: Array) -> dict[str, Array]:
    """Columns position_error (n,) in m, orientation_error (n,) in rad and within_limits (n,)."""
    distance, angle = pose_errors(target, forward(arm, joints))
    return {
        "position_error": distance,
        "orientation_error": angle,
        "within_limits": arm.within_limits(joints).astype(np.int64),
    }


def statistics(frame: pd.DataFrame, success: Mapping[str, float]) -> dict[str, float]:
    """STATISTICS (m, rad) of a frame of `workspace_errors`; success_rate; n_targets.

    `success` holds the largest `position` and `orientation` error of a pose that counts as
    reached; its joints lie in their limits.
    """
    found: dict[str, float] = {}
    reached = frame["within_limits"].to_numpy() == 1
    for name in ("position", "orientation"):
        errors = frame[f"{name}_error"].to_numpy()
        found[f"mean_{name}_error"] = float(errors.mean())
        found[f"median_{name}_error"] = float(np.median(errors))
        found[f"max_{name}_error"] = float(errors.max())
        reached &= errors <= success[name]
    found["success_rate"] = float(reached.mean())
    found["n_targets"] = len(frame)
    return found
