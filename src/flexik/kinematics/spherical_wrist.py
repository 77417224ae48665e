"""Inverse kinematics of a six-joint arm with a spherical wrist in closed form.

The arm's first three joints place the wrist centre, where the axes of the last three meet. Up to
eight arm configurations reach a pose: shoulder, elbow and wrist have two each. Source: Hasan 2005,
chapter 3, is not published in what is known; this is the standard derivation (Pieper 1968).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.errors import ParameterError
from flexik.kinematics.serial_arm import Array, Pose, SerialArm, frames
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED

# Configuration number: 4 if the arm reaches back over axis 1, 2 if the elbow angle is negative, 1
# if joint 5 is negative (the wrist flipped)
N_CONFIGURATIONS = 8
SHOULDER, ELBOW, WRIST = 4, 2, 1

# A joint this far outside its limits is round-off of a pose on the border, rad
LIMIT_TOLERANCE = 1e-9
# A cosine this far above 1 is round-off of a stretched arm
_COSINE_TOLERANCE = 1e-12
# Sine of the angle to a singular pose below which a pose counts as singular; for the shoulder the
# distance of the wrist centre from axis 1 over the longest reach
SINGULAR_SINE = 1e-6
# The same where the free joint cannot be told from the pose any more, and rests
_RESTING_SINE = 1e-12
_TURN = 2.0 * np.pi


class InverseSolution(NamedTuple):
    """Joints of every arm configuration, in the order of their number.

    joints : (n, 8, 6) in rad; nan where OUT_OF_REACH, the angles that would be needed where
        ACTUATOR_LIMIT
    status : (n, 8), a code of kinematics.status
    singular : (n, 8), the arm is as good as singular there: wrist centre on axis 1, arm stretched
        or folded, or axes 4 and 6 in line; where joint 1 or 4 is free, its theta is 0
    """

    joints: Array
    status: NDArray[np.int64]
    singular: NDArray[np.bool_]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Configurations whose joints lie within their limits, (n, 8)."""
        return self.status == REACHED


class _Constants(NamedTuple):
    """Upper arm and forearm in m, angle of the forearm in frame 3, signs of the twists."""

    upper: float
    fore: float
    fore_angle: float
    signs: tuple[float, ...]


def check_spherical_wrist(arm: SerialArm) -> None:
    """Raise ParameterError unless the closed form fits the Denavit-Hartenberg table of `arm`."""
    if arm.n_joints != 6:
        raise ParameterError(f"the closed form needs 6 joints, got {arm.n_joints}")
    for name, zeros in (("d", (2, 3, 5)), ("a", (4, 5, 6))):
        for joint in zeros:
            if (value := getattr(arm, name)[joint - 1]) != 0.0:
                raise ParameterError(f"the closed form needs {name}{joint} = 0, got {value}")
    for joint in (1, 3, 4, 5):
        if abs(np.cos(arm.alpha[joint - 1])) > 1e-12:
            value = arm.alpha[joint - 1]
            raise ParameterError(f"the closed form needs alpha{joint} = +-pi/2, got {value}")
    if abs(np.sin(arm.alpha[1])) > 1e-12:
        raise ParameterError(f"the closed form needs alpha2 = 0 or pi, got {arm.alpha[1]}")
    if arm.a[1] <= 0.0 or np.hypot(arm.a[2], arm.d[3]) == 0.0:
        raise ParameterError("the closed form needs an upper arm a2 > 0 and a forearm (a3, d4)")


def inverse(arm: SerialArm, target: Pose, near: Array | None = None) -> InverseSolution:
    """All arm configurations that put the end effector on `target` (n poses).

    A joint whose range is wider than a turn can reach a pose at several angles; of those within
    its limits the one closest to `near` (n, 6) or (6,), rad, is given (without `near`: to 0).
    """
    constants = _constants(arm)
    rotation = target.rotation @ _turn_x(-arm.alpha[5])
    centre = target.position - arm.d[5] * rotation[:, :, 2]
    n = len(centre)
    joints = np.empty((n, N_CONFIGURATIONS, 6))
    status = np.full((n, N_CONFIGURATIONS), REACHED, dtype=np.int64)
    singular = np.zeros((n, N_CONFIGURATIONS), dtype=bool)
    for shoulder in (0, SHOULDER):
        for elbow in (0, ELBOW):
            theta, missed, at_arm = _place_centre(arm, constants, centre, shoulder, elbow)
            with np.errstate(invalid="ignore"):
                wrist = _wrist_rotation(arm, constants, theta, rotation)
                for flip in (0, WRIST):
                    k = shoulder + elbow + flip
                    turned, at_wrist = _turn_wrist(constants, wrist, flip)
                    joints[:, k] = np.column_stack([theta, turned]) - np.array(arm.offset)
                    singular[:, k] = ~missed & (at_arm | at_wrist)
                    status[missed, k] = OUT_OF_REACH
    reference = np.broadcast_to(0.0 if near is None else near, (n, 6))[:, None]
    joints[status == OUT_OF_REACH] = np.nan
    joints, beyond = _nearest_turn(arm, joints, reference)
    status[beyond & (status == REACHED)] = ACTUATOR_LIMIT
    return InverseSolution(joints, status, singular)


def configuration(arm: SerialArm, joints: Array) -> NDArray[np.int64]:
    """Number (n,) of the arm configuration that `joints` (n, 6) in rad are in."""
    constants = _constants(arm)
    theta = np.asarray(joints, dtype=float) + np.array(arm.offset)
    bend = theta[:, 2] + constants.fore_angle
    reach = (
        arm.a[0]
        + constants.upper * np.cos(theta[:, 1])
        + constants.fore * np.cos(theta[:, 1] + constants.signs[1] * bend)
    )
    return (
        SHOULDER * (reach < 0.0) + ELBOW * (np.sin(bend) < 0.0) + WRIST * (np.sin(theta[:, 4]) < 0)
    ).astype(np.int64)


def canonical(arm: SerialArm, joints: Array) -> Array:
    """The same pose in the same configuration with the joints (n, 6), rad, on one turn.

    Joint 3 on the turn in which the elbow angle lies in (-pi, pi], so that it does not jump within
    a configuration; joints 1, 4 and 6 on the turn around 0, where they wrap; limits not applied,
    see `admissible`.
    """
    bend = np.asarray(joints, dtype=float)[:, 2] + arm.offset[2] + _constants(arm).fore_angle
    result = wrapped(joints)
    result[:, [1, 4]] = np.asarray(joints)[:, [1, 4]]
    result[:, 2] = wrapped(bend) - _constants(arm).fore_angle - arm.offset[2]
    return result


def admissible(arm: SerialArm, joints: Array) -> Array:
    """`joints` (n, 6), rad, each on the turn within its limits closest to where it is.

    The pose and its configuration stay the same. A joint that no turn brings within its limits
    stays where it is.
    """
    joints = np.asarray(joints, dtype=float)
    turned, _ = _nearest_turn(arm, joints, joints)
    return turned


def wrapped(angles: Array) -> Array:
    """`angles`, rad, on the turn (-pi, pi]."""
    return np.pi - (np.pi - np.asarray(angles, dtype=float)) % _TURN


def reach(arm: SerialArm) -> float:
    """Largest distance of the wrist centre from axis 1, m."""
    constants = _constants(arm)
    return abs(arm.a[0]) + constants.upper + constants.fore


def _constants(arm: SerialArm) -> _Constants:
    signs = tuple(
        float(np.sign(np.cos(alpha) if number == 2 else np.sin(alpha)))
        for number, alpha in enumerate(arm.alpha[:5], start=1)
    )
    across = -signs[2] * arm.d[3]
    angle = float(np.arctan2(across, arm.a[2]))
    return _Constants(arm.a[1], float(np.hypot(arm.a[2], arm.d[3])), angle, signs)


def _turn_x(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _place_centre(
    arm: SerialArm, constants: _Constants, centre: Array, shoulder: int, elbow: int
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Theta 1 to 3 (n, 3), whether the wrist centre is missed (n,), whether it is singular (n,)."""
    upper, fore, fore_angle, signs = constants
    radius = np.hypot(centre[:, 0], centre[:, 1])
    on_axis = radius < SINGULAR_SINE * reach(arm)
    back = -1.0 if shoulder else 1.0
    theta_1 = np.arctan2(back * centre[:, 1], back * centre[:, 0])
    # on axis 1 every angle is as good
    theta_1 = np.where(radius < _RESTING_SINE * reach(arm), arm.offset[0], theta_1)
    x = back * radius - arm.a[0]
    y = signs[0] * (centre[:, 2] - arm.d[0])
    cosine = (x**2 + y**2 - upper**2 - fore**2) / (2.0 * upper * fore)
    missed = np.abs(cosine) > 1.0 + _COSINE_TOLERANCE
    bend = np.arccos(np.where(missed, np.nan, np.clip(cosine, -1.0, 1.0)))
    if elbow:
        bend = -bend
    with np.errstate(invalid="ignore"):
        straight = np.abs(np.sin(bend)) < SINGULAR_SINE
        lead = np.arctan2(signs[1] * fore * np.sin(bend), upper + fore * np.cos(bend))
    theta = np.column_stack([theta_1, np.arctan2(y, x) - lead, bend - fore_angle])
    return theta, missed, on_axis | straight


def _wrist_rotation(arm: SerialArm, constants: _Constants, theta: Array, rotation: Array) -> Array:
    """Rotation (n, 3, 3) from frame 3 to the last frame without its twist."""
    padded = np.zeros((len(theta), 6))
    padded[:, :3] = theta - np.array(arm.offset[:3])
    to_elbow = SerialArm(*(getattr(arm, name)[:3] for name in arm.__dataclass_fields__))
    third = frames(to_elbow, padded[:, :3]).rotation[:, 3]
    return third.swapaxes(1, 2) @ rotation


def _turn_wrist(constants: _Constants, wrist: Array, flip: int) -> tuple[Array, NDArray[np.bool_]]:
    """Theta 4 to 6 (n, 3), and whether the axes of joints 4 and 6 are in line (n,)."""
    s4, s5 = constants.signs[3:]
    side = -1.0 if flip else 1.0
    sine = np.hypot(wrist[:, 0, 2], wrist[:, 1, 2])
    in_line = sine < SINGULAR_SINE
    theta_4 = np.arctan2(side * s5 * wrist[:, 1, 2], side * s5 * wrist[:, 0, 2])
    # in line only the sum or the difference of joints 4 and 6 counts: joint 4 rests
    theta_4 = np.where(sine < _RESTING_SINE, 0.0, theta_4)
    theta_5 = np.arctan2(side * sine, -s4 * s5 * wrist[:, 2, 2])
    # joint 6 from what joints 4 and 5 leave: near a singular pose joint 4 is as uncertain as the
    # pose makes it, and joint 6 takes it back
    (c4, n4), (c5, n5) = ((np.cos(theta), np.sin(theta)) for theta in (theta_4, theta_5))
    x = np.column_stack([c4 * c5, n4 * c5, s4 * n5])
    y = s4 * s5 * np.column_stack([n4, -c4, np.zeros_like(c4)])
    rest = np.stack([x, y], axis=1) @ wrist[:, :, :2]
    theta_6 = np.arctan2(rest[:, 1, 0] - rest[:, 0, 1], rest[:, 0, 0] + rest[:, 1, 1])
    return np.column_stack([theta_4, theta_5, theta_6]), in_line


def _nearest_turn(arm: SerialArm, joints: Array, near: Array) -> tuple[Array, NDArray[np.bool_]]:
    """`joints` (..., 6) on the admissible turn closest to `near`, and whether one has none."""
    low, high = np.array(arm.minimum), np.array(arm.maximum)
    first = np.ceil((low - LIMIT_TOLERANCE - joints) / _TURN)
    last = np.floor((high + LIMIT_TOLERANCE - joints) / _TURN)
    beyond = first > last
    turn = np.round((near - joints) / _TURN)
    turn = np.where(beyond, turn, np.clip(turn, first, last))
    turned = joints + _TURN * turn
    limited = np.where(beyond, turned, np.clip(turned, low, high))
    return limited, np.any(beyond, axis=-1)
