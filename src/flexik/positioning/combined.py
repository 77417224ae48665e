"""Method `combined`: rigid inverse, deflection network, corrected target, rigid inverse again.

Source: Rouvinen 1999, section 4.1 and figure 4.7.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from flexik.kinematics.manipulator import Manipulator, RigidSolution
from flexik.kinematics.status import REACHED
from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.genetic import Genetic, GeneticManipulator
from flexik.positioning.method import (
    Answer,
    Array,
    Network,
    planar,
    predicted,
    rigid_inverse,
    take_network,
)

# Corrections end where the predicted deflection changed by less, m
CONVERGED = 1e-9
# Corrections that do: near a fold of the linkage they shrink slowly
MOST_CORRECTIONS = 50
# Halvings of a correction after which the machine does not reach
HALVINGS = 4


class Settings(method.Settings):
    """See Combined; genetic: the rigid inverse by a genetic algorithm; None: in closed form."""

    method: Literal["combined"] = "combined"
    needs: ClassVar[str | None] = "deflection"
    n_corrections: Count = 1
    genetic: Genetic | None = None


@dataclass(frozen=True)
class Combined:
    """Rigid inverse corrected by the deflection that a network predicts.

    manipulator : its inverse is used before and after the correction.
    network : predicts the deflection (flexible minus rigid tip, m) from actuator coordinates and
        payload (kg).
    n_corrections : at most; one as published; more iterate towards coordinates whose own deflection
        is the one corrected.

    Where several are allowed, a correction that leads beyond the reach is halved: on the way there
    a redundant machine may find a pose that sags less. A row that fails all the same, or whose
    last correction was not whole, keeps the coordinates it had and the first failing status.
    Diagnostics: those of the inverse with the prefixes `first_` and `corrected_` (the last pass),
    and the predicted deflection of the last pass, `deflection_x` and `deflection_y`, m.
    """

    manipulator: Manipulator
    network: Network
    n_corrections: int = 1

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        targets, payload = planar(query)
        first = rigid_inverse(self.manipulator, targets, current)
        values, status = first.values.copy(), first.status.copy()
        deflection, rows = np.zeros_like(targets), np.arange(len(targets))
        short = np.full(len(targets), REACHED)
        diagnostics = {f"first_{name}": found for name, found in first.diagnostics.items()}
        for _ in range(self.n_corrections):
            goal = targets[rows]
            found = predicted(self.network, "deflection", values[rows], payload[rows], 2)
            last = self.manipulator.inverse(goal - found, values[rows], goal)
            short[rows] = last.status
            if self.n_corrections > 1:
                found, last = self._nearer(goal, found, deflection[rows], values[rows], last)
            for name, of_rows in last.diagnostics.items():
                diagnostics.setdefault(f"corrected_{name}", of_rows.copy())[rows] = of_rows
            moved = np.abs(found - deflection[rows]).max(axis=1) > CONVERGED
            deflection[rows] = found
            status[rows] = np.where(status[rows] == REACHED, last.status, status[rows])
            reached = status[rows] == REACHED
            values[rows[reached]] = last.values[reached]
            rows = rows[moved & reached]
            if not len(rows):
                break
        status = np.where(status == REACHED, short, status)
        diagnostics |= {"deflection_x": deflection[:, 0], "deflection_y": deflection[:, 1]}
        return Answer(values, status, diagnostics)

    def _nearer(
        self, goal: Array, found: Array, before: Array, values: Array, last: RigidSolution
    ) -> tuple[Array, RigidSolution]:
        """Deflections `found` and solution `last`; beyond the reach nearer to those of `before`."""
        found, parts = found.copy(), (last.values.copy(), last.status.copy())
        diagnostics = {name: of_rows.copy() for name, of_rows in last.diagnostics.items()}
        for _ in range(HALVINGS):
            beyond = parts[1] != REACHED
            if not beyond.any():
                break
            found[beyond] = (found[beyond] + before[beyond]) / 2
            nearer = goal[beyond] - found[beyond]
            again = self.manipulator.inverse(nearer, values[beyond], goal[beyond])
            parts[0][beyond], parts[1][beyond] = again.values, again.status
            for name, of_rows in again.diagnostics.items():
                diagnostics[name][beyond] = of_rows
        return found, RigidSolution(*parts, diagnostics)


def build(settings: Settings, ingredients: method.Ingredients) -> Combined:
    """Method `combined` with the network of `ingredients`."""
    manipulator = ingredients.manipulator
    if settings.genetic is not None:
        manipulator = GeneticManipulator(manipulator, settings.genetic)
    return Combined(manipulator, take_network(ingredients), settings.n_corrections)
