"""From poses to joints: networks of a taught path or the whole workspace, closed form, look-ups.

A method takes the targets and the number of the arm configuration that each is asked for, and gives
joints (n, 6) in rad; nan where it has none.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from flexik.datasets.fanuc.samples import nearest_on
from flexik.kinematics.fanuc import admissible, inverse
from flexik.kinematics.pose_representation import joints_of, pose_inputs
from flexik.kinematics.serial_arm import Array, Pose, SerialArm, refine
from flexik.positioning.method import Network, PositioningError

JointMethod = Callable[[Pose, NDArray[np.int64]], Array]


def closed_form(arm: SerialArm) -> JointMethod:
    """The analytical inverse; nan where the configuration does not reach within the limits."""

    def method(target: Pose, number: NDArray[np.int64]) -> Array:
        found = inverse(arm, target)
        rows = np.arange(len(number))
        reached = found.reached[rows, number]
        return np.where(reached[:, None], found.joints[rows, number], np.nan)

    return method


def nearest_sample(positions: Array, joints: Array) -> JointMethod:
    """Joints of the taught sample nearest in position: what needs no network.

    `positions` (m, 3) in m and `joints` (m, 6) in rad of the samples. Looks neither at the
    orientation nor at the configuration.
    """

    def method(target: Pose, number: NDArray[np.int64]) -> Array:
        distance = np.linalg.norm(target.position[:, None] - positions, axis=2)
        return joints[np.argmin(distance, axis=1)]

    return method


def interpolated(positions: Array, joints: Array) -> JointMethod:
    """As `nearest_sample`, but linear between two samples that follow one another on the path."""

    def method(target: Pose, number: NDArray[np.int64]) -> Array:
        there = nearest_on(positions, target.position)
        before, after = joints[there.segment], joints[there.segment + 1]
        return before + there.share[:, None] * (after - before)

    return method


def path_networks(networks: Mapping[tuple[int, ...], Network]) -> JointMethod:
    """Networks from position alone, by the joints (numbers from 1) that each gives.

    They know one configuration and the orientations of their path, so that they look at neither.
    Raises PositioningError unless every joint has one network.
    """
    given = [joint for joints in networks for joint in joints]
    if sorted(given) != list(range(1, 7)):
        raise PositioningError(f"expected networks for joints 1 to 6, each once, got {given}")

    def method(target: Pose, number: NDArray[np.int64]) -> Array:
        joints = np.empty((len(number), 6))
        for numbers, network in networks.items():
            joints[:, np.array(numbers) - 1] = network.predict(target.position)
        return joints

    return method


def workspace_networks(arm: SerialArm, networks: Mapping[int, Network]) -> JointMethod:
    """One network an arm configuration, from position and orientation.

    Joints turn to where their limits admit them, if a turn is all that is in the way.

    Raises PositioningError when asked for a configuration without a network.
    """

    def method(target: Pose, number: NDArray[np.int64]) -> Array:
        joints = np.empty((len(number), 6))
        for each in np.unique(number):
            if int(each) not in networks:
                raise PositioningError(f"no network for arm configuration {each}")
            rows = number == each
            outputs = networks[int(each)].predict(pose_inputs(target.rows(rows)))
            joints[rows] = admissible(arm, joints_of(arm, outputs, int(each)))
        return joints

    return method


def refined(
    arm: SerialArm, method: JointMethod, n_steps: int, damping: float, orientation_length: float
) -> JointMethod:
    """`method` and damped Newton steps after it, see kinematics.serial_arm.refine."""

    def steps(target: Pose, number: NDArray[np.int64]) -> Array:
        joints = method(target, number)
        return refine(arm, target, joints, n_steps, damping, orientation_length)

    return steps if n_steps else method
