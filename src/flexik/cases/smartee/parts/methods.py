"""Direct kinematics of the SmartEE as methods: six actuated joint angles in, three elbows out.

The network of De Luca, Mattone and Sciandrone guesses the elbows; what is left of the closure
equations, Newton steps from there remove. Their rivals are Newton steps from the centre of the box
or from the pose before.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.smartee import section
from flexik.cases.smartee.parts.poses import actuated_of, geometry_of
from flexik.cases.smartee.section import Section
from flexik.errors import ParameterError
from flexik.kinematics.smartee import SmartEEGeometry
from flexik.kinematics.smartee_newton import closed, newton_steps, solve_elbows, wrapped
from flexik.learning.storage import load_network
from flexik.positioning.method import Answer, Network, checked

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DirectKinematics:
    """`n_steps` Newton steps from a start.

    start : a network, else where `current` is: the centre of the box, or its first row and from
        there on the elbows of the row before, for rows in the order of time
    tolerance, accepted : of cases.smartee.section.Method
    """

    geometry: SmartEEGeometry
    start: Network | str
    n_steps: int
    tolerance: float | None = None
    accepted: float = 1e-6

    def __call__(self, query: Array, current: Array) -> Answer:
        """Elbows (n, 3) at `query` (n, 6); status and the residual of the closure equations."""
        actuated = actuated_of(checked("query", query, None, 6))
        start = current if isinstance(self.start, str) else self.start.predict(query)
        if self.start == section.PREVIOUS:
            elbows = self._along(actuated, start[:1])
        elif self.tolerance is not None:
            found = solve_elbows(self.geometry, actuated, start, self.tolerance, self.n_steps)
            diagnostics = {"residual": found.residual, "steps": found.n_steps}
            return Answer(found.elbows, found.status, diagnostics)
        else:
            elbows = newton_steps(self.geometry, actuated, start, self.n_steps)
        status, residual = closed(self.geometry, actuated, elbows, self.accepted)
        # angles a turn apart are the same elbow
        turned = (elbows < -np.pi) | (elbows >= np.pi)
        elbows = np.where(turned, wrapped(elbows), elbows)
        return Answer(elbows, status, {"residual": residual})

    def _along(self, actuated: Array, elbows: Array) -> Array:
        """Elbows (n, 3) of a path, each from those before it, the first from `elbows` (1, 3)."""
        found = np.empty((len(actuated), 3))
        for k in range(len(actuated)):
            elbows = newton_steps(self.geometry, actuated[k : k + 1], elbows, self.n_steps)
            found[k] = elbows[0]
        return found


def method(
    machine: section.Machine, settings: section.Method, n_steps: int, network: Path | None
) -> DirectKinematics:
    """Method of `settings` with one of its numbers of steps, from the network in a file if any."""
    start = settings.start if network is None else load_network(network)[0]
    geometry = geometry_of(machine)
    return DirectKinematics(geometry, start, n_steps, settings.tolerance, settings.accepted)


def network_file(chosen: Section, settings: section.Method) -> Path | None:
    """File of the network a method starts from, if any."""
    if settings.start in (section.CENTRE, section.PREVIOUS):
        return None
    return chosen.data / f"networks/{settings.start}.json"


def trained(chosen: Section, name: str, n_steps: int) -> DirectKinematics:
    """Method `name` with `n_steps`; raises FlexikError if there is none, or no network yet."""
    if name not in chosen.methods or n_steps not in chosen.methods[name].n_steps:
        raise ParameterError(f"{chosen.name}.methods: there is no {name!r} of {n_steps} steps")
    settings = chosen.methods[name]
    return method(chosen.machine, settings, n_steps, network_file(chosen, settings))
