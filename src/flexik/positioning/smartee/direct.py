"""Direct kinematics of the SmartEE: actuated joints to elbows, by network, Newton's method or both.

The network of De Luca, Mattone and Sciandrone guesses the elbows; what is left of the closure
equations, Newton steps from there remove.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexik.datasets.smartee.poses import inputs_of
from flexik.errors import ParameterError
from flexik.learning.perceptron import Network
from flexik.kinematics.smartee import SmartEEGeometry, inverse
from flexik.kinematics.smartee_newton import newton_steps, solve_elbows
from flexik.kinematics.status import REACHED
from flexik.parameters import SmartEEWorkspace

Array = NDArray[np.float64]

# Elbows (n, 3) at actuated joints (n, 3, 2), rad
Direct = Callable[[Array], Array]


def by_network(geometry: SmartEEGeometry, network: Network, n_steps: int) -> Direct:
    """Elbows of `network`, and `n_steps` Newton steps from there."""

    def elbows(actuated: Array) -> Array:
        return newton_steps(geometry, actuated, network.predict(inputs_of(actuated)), n_steps)

    return elbows


def from_centre(geometry: SmartEEGeometry, start: Array, n_steps: int) -> Direct:
    """`n_steps` Newton steps from the elbows `start` (3,) for every row."""

    def elbows(actuated: Array) -> Array:
        first = np.broadcast_to(start, (len(actuated), 3))
        return newton_steps(geometry, actuated, first, n_steps)

    return elbows


def solved_from_centre(
    geometry: SmartEEGeometry, start: Array, tolerance: float, n_steps: int
) -> Direct:
    """Newton's method from the elbows `start` (3,) until the closure holds to `tolerance`."""

    def elbows(actuated: Array) -> Array:
        return solve_elbows(geometry, actuated, start, tolerance, n_steps).elbows

    return elbows


def along_path(geometry: SmartEEGeometry, actuated: Array, start: Array, n_steps: int) -> Array:
    """Elbows (n, 3) along a path, each by `n_steps` Newton steps from those before it.

    Parameters
    ----------
    actuated : (n, 3, 2) in rad, in the order of time
    start : (3,) elbows before the first sample
    """
    elbows, found = start[None], np.empty((len(actuated), 3))
    # each sample starts where the one before ended
    for k in range(len(actuated)):
        elbows = newton_steps(geometry, actuated[k : k + 1], elbows, n_steps)
        found[k] = elbows[0]
    return found


def centre_elbows(geometry: SmartEEGeometry, workspace: SmartEEWorkspace) -> Array:
    """Elbows (3,) at the centre of the workspace, the plate level.

    Raises ParameterError when the legs do not reach it.
    """
    found = inverse(geometry, np.array([workspace.centre]), np.eye(3)[None])
    if found.status[0] != REACHED:
        raise ParameterError("smartee.workspace.centre: the legs do not reach it")
    return found.joints[0, :, 2]
