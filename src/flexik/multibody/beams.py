"""Beams as data, and their reduction to finite elements (NumPy only)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from flexik.machines.bodies import MERGE_DISTANCE, TOLERANCE
from flexik.machines.sections import Array, Section

# Elements between two pins, if they vary
FEWEST = 3
# Of the flexibility of an element, what a neighbour may take; and of the second moments of all
# between two pins, what is left at least
MOST_TAKEN, LEAST_LEFT = 0.4, 0.1

# Gauss-Legendre points and weights on [-1, 1], a panel between two rows of a section table
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Beam:
    """A straight flexible link; abscissas in m along its axis, in the link's own frame.

    span : first and last abscissa of the modelled axis.
    mass, centre_of_mass : total mass in kg and abscissa of its centre in m.
    mass_span : abscissas between which the mass lies; its density follows the area of the section
        times a linear factor that gives the mass and its centre.
    mass_offset : distance of the centre of mass from the axis, positive to the left, m.
    n_elements : elements of equal length; pins and pads add nodes.
    shear : E / (k G) with the shear coefficient k of the section; 0: it does not shear.
    """

    section: Section
    youngs_modulus: float
    span: tuple[float, float]
    mass: float
    centre_of_mass: float
    mass_span: tuple[float, float]
    mass_offset: float
    n_elements: int
    shear: float = 0.0

    def integrals(self, abscissa: Array) -> Array:
        """From the first end to `abscissa` (n,): 1/I, x/I, x2/I, 1/A; A, Ax, Ax2 in the mass span.

        (7, n), by Gauss-Legendre points between two rows of the section table.
        """
        knots, sums = self._panels
        k = np.clip(np.searchsorted(knots, abscissa, side="right") - 1, 0, len(knots) - 2)
        return sums[:, k] + self._between(knots[k], abscissa)

    def masses(
        self, start: Array, length: Array, integrals: Sequence[Array], total: Array
    ) -> tuple[Array, Array]:
        """Masses in kg of pieces of the beam, and what of each its second end bears.

        start, length : of the pieces, m.
        integrals, total : A, Ax, Ax2 of each piece and of the beam, see `integrals`.
        """
        area, area_x, area_xx = integrals
        # density follows the area, times a linear factor
        mass = [self.mass, self.mass * self.centre_of_mass]
        factor = np.linalg.solve([total[:2], total[1:]], mass)
        of_piece = factor[0] * area + factor[1] * area_x
        turning = factor[0] * area_x + factor[1] * area_xx - start * of_piece
        return of_piece, np.divide(turning, length, out=np.zeros_like(turning), where=length != 0.0)

    @cached_property
    def _panels(self) -> tuple[Array, Array]:
        """Abscissas (m,) where an integrand has a kink, and the integrals (7, m) up to there."""
        cuts = np.concatenate([self.span, self.section.abscissa, self.mass_span])
        knots = np.unique(cuts[(cuts >= self.span[0]) & (cuts <= self.span[1])])
        sums = np.cumsum(self._between(knots[:-1], knots[1:]), axis=1)
        return knots, np.hstack([np.zeros((len(sums), 1)), sums])

    def _between(self, start: Array, end: Array) -> Array:
        width = (end - start)[:, None]
        x = start[:, None] + width * ((_GAUSS_X + 1) / 2)
        section, (first, last) = self.section, self.mass_span
        area = np.interp(x, section.abscissa, section.area)
        flexibility = 1.0 / np.interp(x, section.abscissa, section.second_moment)
        mass = area * ((x >= first) & (x <= last))
        bending = [flexibility, flexibility * x, flexibility * x**2]
        values = np.stack([*bending, 1.0 / area, mass, mass * x, mass * x**2])
        return (values * width) @ (_GAUSS_W / 2)


@dataclass(frozen=True)
class Elements:
    """Finite elements of a beam: stations (m + 1,) in m, and arrays (m,) over the elements.

    pins : the station nearest to each pin that was asked for.
    bending_stiffness : L / int dx/EI, N m2.
    axial_stiffness : L / int dx/EA, N.
    residual_flexibility : int (x - middle)^2 dx/EI, m/N: what an element of constant curvature
        lacks; and that of shear.
    node_mass : (m + 1,), kg, statically equivalent to the distributed mass.
    mass_ahead : (m + 1,), m, how far ahead of its node each hangs: an element clamped at its ends
        bears its weight by moments there, which tips and rotations of nodes then contain.
    """

    stations: Array
    pins: tuple[int, ...]
    bending_stiffness: Array
    axial_stiffness: Array
    residual_flexibility: Array
    node_mass: Array
    mass_ahead: Array

    @property
    def noise(self) -> float:
        """Norm of the forces in all elements over the round-off of the nodes' places, N/m."""
        along = self.axial_stiffness / np.diff(self.stations)
        # across the axis a short element is the stiffer one
        return float(np.linalg.norm(np.maximum(along, 1.0 / self.residual_flexibility)))


def discretise(
    beam: Beam, pins: Sequence[tuple[float, ...]], refinement: int = 1
) -> list[Elements]:
    """Cut `beam` into elements with a node at every abscissa of pins and at both ends.

    One mesh for each entry of `pins`; many at once take a tenth of the time of each alone. No
    element is longer than the span over `n_elements * refinement`. Where the section varies there
    are three or more between two pins, if none becomes shorter than MERGE_DISTANCE; pins closer
    than that to another station share its node.
    """
    longest = (beam.span[1] - beam.span[0]) / (beam.n_elements * refinement)
    # elements make up for each other's varying sections, see _centred
    shortest = np.inf if np.ptp(beam.section.second_moment) == 0.0 else MERGE_DISTANCE
    stations = [np.array(_stations(beam.span, of_mesh, longest, shortest)) for of_mesh in pins]
    return _reduce(beam, stations, pins)


def _stations(
    span: tuple[float, float], pins: tuple[float, ...], longest: float, shortest: float
) -> list[float]:
    stations = [span[0], span[1]]
    for pin in pins:
        # corners may be just as far apart, but for round-off
        if min(abs(pin - s) for s in stations) > MERGE_DISTANCE - TOLERANCE:
            stations.append(pin)
    stations.sort()
    mesh = [stations[0]]
    for start, end in pairwise(stations):
        least = max(1, min(FEWEST, int((end - start) / shortest)))
        n = max(least, math.ceil((end - start) / longest - 1e-6))
        mesh += [start + (end - start) / n * k for k in range(1, n)] + [end]
    return mesh


def _centred(
    bending: Array, off: Array, middle: Array, residual: Array, apart: list[int], ends: Array
) -> tuple[Array, Array]:
    """Flexibilities of bending and their second moments, as elements of one hinge carry them.

    The hinge of an element is in its `middle`, that of its flexibility `off` it, m. A share of the
    flexibility goes to the element beside it on that side, or comes from the one on the other. All
    elements between two of the nodes `apart`, where forces may turn the beam, bear the same force
    across: of second moments their sum counts. So where moments are linear between those nodes
    every moment up to the second stays, and a mesh errs by what it errs with a uniform beam.
    Elements before `ends` are none.
    """
    number = np.arange(len(bending))
    part = np.searchsorted(np.unique(apart), number, side="right")
    part[ends - 1] = part.max() + 1 + np.arange(len(ends))
    after = np.append(part[1:] == part[:-1], False)
    before = np.append(False, after[:-1])
    ahead = np.where(off > 0, after, ~before & after)
    to = np.where(ahead, 1, np.where(before, -1, 0))
    other = number + to
    distance = np.where(to == 0, 1.0, middle[other] - middle)
    given = np.where(to == 0, 0.0, bending * off / distance)
    given = np.maximum(given, -MOST_TAKEN * bending[other])
    moved = bending - given
    np.add.at(moved, other, given)
    whole = np.bincount(part, residual)
    left = np.maximum(whole - np.bincount(part, given * distance**2), LEAST_LEFT * whole)
    return moved, residual * (left / np.where(whole > 0.0, whole, 1.0))[part]


def nearest(stations: Array, abscissa: float) -> int:
    """Number of the station nearest to `abscissa` in m."""
    return int(np.abs(stations - abscissa).argmin())


def _reduce(
    beam: Beam, stations: Sequence[Array], pins: Sequence[tuple[float, ...]]
) -> list[Elements]:
    """Integrate section and mass over the elements between `stations` of every mesh."""
    if not stations:
        return []
    nodes = np.concatenate(stations)
    ends = np.cumsum([len(of_mesh) for of_mesh in stations])
    sums = beam.integrals(nodes)
    # the last of each mesh is no element
    bending, first, second, axial, area, area_x, area_xx = np.diff(sums, append=0.0)
    length, middle = np.diff(nodes, append=0.0), (nodes + np.append(nodes[1:], 0.0)) / 2
    residual = second - 2 * middle * first + middle**2 * bending + beam.shear * axial
    of_element, at_end = beam.masses(nodes, length, (area, area_x, area_xx), sums[4:, ends[0] - 1])
    at_start, stiffness = of_element - at_end, beam.youngs_modulus * length
    numbers = [
        tuple(nearest(of_mesh, pin) for pin in at)
        for of_mesh, at in zip(stations, pins, strict=True)
    ]
    begins = ends - [len(of_mesh) for of_mesh in stations]
    apart = [begin + k for begin, at in zip(begins, numbers, strict=True) for k in (0, *at)]
    bending, residual = _centred(bending, first / bending - middle, middle, residual, apart, ends)
    found = []
    # inwards at both ends: m L / 12 of a uniform element, and 0 where the mass lies at an end
    turning = _ratio(at_start * at_end * length / 3, of_element)
    for of_mesh, begin, end, at in zip(stations, begins, ends, numbers, strict=True):
        of = slice(begin, end - 1)
        mass = np.append(at_start[of], 0.0) + np.append(0.0, at_end[of])
        inwards = np.append(turning[of], 0.0) - np.append(0.0, turning[of])
        elements = Elements(
            of_mesh,
            at,
            stiffness[of] / bending[of],
            stiffness[of] / axial[of],
            residual[of] / beam.youngs_modulus,
            mass,
            _ratio(inwards, mass),
        )
        found.append(elements)
    return found


def _ratio(moment: Array, mass: Array) -> Array:
    """Their ratio, 0 where there is no mass."""
    return np.divide(moment, mass, out=np.zeros(len(mass)), where=mass > 0.0)
