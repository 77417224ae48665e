"""Errors of methods on the taught path, beside it, and all over the workspace."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.fanuc.samples import beside
from flexik.datasets.fanuc.tables import COMMANDED, joint_columns
from flexik.evaluation.fanuc.errors import workspace_errors
from flexik.kinematics.fanuc import configuration, inverse
from flexik.kinematics.serial_arm import Array, SerialArm, forward, smallest_singular_value
from flexik.positioning.fanuc.methods import JointMethod, refined

Methods = Mapping[str, JointMethod]


def errors_on_path(arm: SerialArm, methods: Methods, share: Array, joints: Array) -> pd.DataFrame:
    """Rows of PATH_ERROR_FIELDS: every method at the poses of `joints` (n, 6) in rad."""
    target, number = forward(arm, joints), configuration(arm, joints)
    frames = []
    for name, method in methods.items():
        commanded = method(target, number)
        columns = {
            "share": share,
            **joint_columns(joints),
            **joint_columns(commanded, COMMANDED),
            **workspace_errors(arm, target, number, commanded),
        }
        frames.append(pd.DataFrame(columns).assign(method=name))
    return pd.concat(frames, ignore_index=True)


def errors_beside_path(
    arm: SerialArm,
    methods: Methods,
    exact: Methods,
    joints: Array,
    rows: NDArray[np.int64],
    distances: list[float],
    seed: int,
    refinement: Mapping[str, float],
) -> pd.DataFrame:
    """Rows of OFF_PATH_FIELDS: targets at `distances`, m, from the path of `joints` (n, 6).

    They belong to the samples `rows` of the path. Left out are targets that the arm configuration
    of the path does not reach, and those nearer to another part of the path; they are missing in
    the rows of every method. `methods` are refined too, `exact` ones are not.
    """
    found = beside(forward(arm, joints), rows, distances, seed)
    number = configuration(arm, joints)[found.row]
    reached = inverse(arm, found.pose).reached[np.arange(len(number)), number]
    target, number, distance = found.pose.rows(reached), number[reached], found.distance[reached]
    frames = [
        pd.DataFrame(workspace_errors(arm, target, number, method(target, number))).assign(
            method=name, n_steps=np.int64(n_steps), distance=distance
        )
        for name, n_steps, method in _variants(arm, methods, exact, refinement)
    ]
    return pd.concat(frames, ignore_index=True)


def errors_on_targets(
    arm: SerialArm,
    methods: Methods,
    exact: Methods,
    number: NDArray[np.int64],
    joints: Array,
    refinement: Mapping[str, float],
) -> pd.DataFrame:
    """Rows of WORKSPACE_FIELDS: every method at the poses of `joints` (n, 6) in rad.

    `number` (n,) is the arm configuration asked for.
    """
    target = forward(arm, joints)
    singular = smallest_singular_value(arm, joints, refinement["orientation_length"])
    flagged = inverse(arm, target).singular[np.arange(len(number)), number]
    frames = [
        pd.DataFrame(workspace_errors(arm, target, number, method(target, number))).assign(
            method=name,
            n_steps=np.int64(n_steps),
            configuration=number,
            singular_value=singular,
            singular=flagged.astype(np.int64),
        )
        for name, n_steps, method in _variants(arm, methods, exact, refinement)
    ]
    return pd.concat(frames, ignore_index=True)


def _variants(
    arm: SerialArm, methods: Methods, exact: Methods, refinement: Mapping[str, float]
) -> Iterator[tuple[str, int, JointMethod]]:
    """Name, Newton steps and the method with them."""
    damping, length = refinement["damping"], refinement["orientation_length"]
    for name, method in methods.items():
        for n_steps in range(int(refinement["n_steps"]) + 1):
            yield name, n_steps, refined(arm, method, n_steps, damping, length)
    for name, method in exact.items():
        yield name, 0, method
