"""A beam that bends under forces on its stations, by Euler and Bernoulli (NumPy only)."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.machines.bodies import Beam
from flexik.machines.sections import Array
from flexik.multibody import beams
from flexik.multibody.flexible import places_of

# Abscissas this close are the same, m
SAME = 1e-9


class Bent(NamedTuple):
    """A beam in its body's frame: nodes (n, m, 2) in m, and their rotations (n, m) in rad."""

    nodes: Array
    turn: Array


@dataclass(frozen=True)
class Span:
    """A beam cut at its stations, per row, which are in no order, and into equal panels between.

    beam, along : of the file, and along its abscissa.
    x : (n, m) abscissas of the nodes, increasing.
    node_of : (n, c) number of the node of every station.
    """

    beam: Beam
    along: beams.Beam
    x: Array
    node_of: NDArray[np.intp]

    @classmethod
    def cut(cls, beam: Beam, along: beams.Beam, stations: Array, n_panels: int) -> "Span":
        """`beam` cut at `stations` (n, c), into `n_panels` or somewhat more."""
        order = np.argsort(stations, axis=1, kind="stable")
        rank = np.argsort(order, axis=1, kind="stable")
        ordered = np.take_along_axis(stations, order, axis=1)
        panels = -(-n_panels // (stations.shape[1] - 1))
        share = np.arange(panels) / panels
        inner = ordered[:, :-1, None] + np.diff(ordered, axis=1)[:, :, None] * share
        x = np.hstack([inner.reshape(len(stations), -1), ordered[:, -1:]])
        return cls(beam, along, x, rank * panels)

    @cached_property
    def straight(self) -> Bent:
        """Not loaded."""
        places = places_of(self.beam, self.x.ravel()).reshape(*self.x.shape, 2)
        return Bent(places, np.zeros(self.x.shape))

    @cached_property
    def direction(self) -> Array:
        """Angle (n, m - 1) of the panels, not loaded, rad."""
        if len(self.beam.axis) == 2:
            return np.full_like(self.x[:, 1:], self.beam.place(self.beam.start)[1])
        step = np.diff(np.array(self.beam.axis), axis=0)
        corners = self.beam.start + np.cumsum(np.hypot(*step.T))[:-1]
        middle = (self.x[:, 1:] + self.x[:, :-1]) / 2
        return np.arctan2(step[:, 1], step[:, 0])[np.searchsorted(corners, middle)]

    @cached_property
    def integrals(self) -> Array:
        """Of every panel (7, n, m - 1), see Beam.integrals."""
        sums = self.along.integrals(self.x.ravel()).reshape(7, *self.x.shape)
        return np.diff(sums, axis=2)

    @cached_property
    def node_mass(self) -> Array:
        """Masses (n, m) in kg of the nodes, statically those of the panels."""
        integrals, length = self.integrals[4:], np.diff(self.x, axis=1)
        total = integrals.sum(axis=2)[:, 0]
        of_panel, at_end = self.along.masses(self.x[:, :-1], length, [*integrals], total)
        found = np.zeros_like(self.x)
        found[:, :-1] += of_panel - at_end
        found[:, 1:] += at_end
        return found

    @cached_property
    def mass_offset(self) -> Array:
        """Where the mass of every node lies from it (n, 2) in m, in the frame of the body."""
        if self.beam.centre is None:
            return np.zeros((len(self.x), 2))
        share = self.node_mass / self.along.mass
        on_axis = np.einsum("nm,nmi->ni", share, self.straight.nodes)
        return np.array(self.beam.centre) - on_axis

    def bent(self, before: Bent, loads: Array) -> Bent:
        """Bent by `loads` (n, m, 3) on the nodes, which lie as `before`.

        loads : forces in N along the axes of the body's frame, and moments about its origin, N m.
        """
        beyond = np.cumsum(loads[:, ::-1], axis=1)[:, ::-1][:, 1:]
        moment = [
            beyond[..., 2] - nodes[..., 0] * beyond[..., 1] + nodes[..., 1] * beyond[..., 0]
            for nodes in (before.nodes[:, :-1], before.nodes[:, 1:])
        ]
        at = self.direction + (before.turn[:, 1:] + before.turn[:, :-1]) / 2
        c, s = np.cos(at), np.sin(at)
        tension, shear = (
            c * beyond[..., 0] + s * beyond[..., 1],
            c * beyond[..., 1] - s * beyond[..., 0],
        )
        a, b, length = self.x[:, :-1], self.x[:, 1:], np.diff(self.x, axis=1)
        zero, first, second, axial = self.integrals[:4]
        over = 1.0 / (self.along.youngs_modulus * np.maximum(length, SAME))
        rotation = over * (moment[0] * (b * zero - first) + moment[1] * (first - a * zero))
        rise = over * (
            moment[0] * (b * (b * zero - first) - (b * first - second))
            + moment[1] * (b * (first - a * zero) - (second - a * first))
        )
        rise += self.along.shear * shear * axial / self.along.youngs_modulus
        stretched = length + tension * axial / self.along.youngs_modulus
        turn = np.zeros_like(before.turn)
        turn[:, 1:] = np.cumsum(rotation, axis=1)
        at = self.direction + turn[:, :-1]
        c, s = np.cos(at), np.sin(at)
        # the chord of a panel that turned by rise over length
        ahead = stretched - np.where(length > SAME, rise**2 / 2, 0.0) / np.maximum(length, 0.01)
        nodes = np.empty_like(before.nodes)
        nodes[:, 0] = self.straight.nodes[:, 0]
        step = np.stack([c * ahead - s * rise, s * ahead + c * rise], axis=-1)
        nodes[:, 1:] = nodes[:, :1] + np.cumsum(step, axis=1)
        return Bent(nodes, turn)
