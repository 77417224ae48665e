"""Beams as data, and their reduction to finite elements (NumPy only)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexik.machines.sections import Array, Section

# Below this distance two stations of a beam share a node: short elements are so stiff that the
# round-off floor of the solver rises above its tolerance, m
MERGE_DISTANCE = 0.03

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
    """

    section: Section
    youngs_modulus: float
    span: tuple[float, float]
    mass: float
    centre_of_mass: float
    mass_span: tuple[float, float]
    mass_offset: float
    n_elements: int


@dataclass(frozen=True)
class Elements:
    """Finite elements of a beam: stations (m + 1,) in m, and arrays (m,) over the elements.

    pins : the station nearest to each pin that was asked for.
    bending_stiffness : L / int dx/EI, N m2.
    axial_stiffness : L / int dx/EA, N.
    residual_flexibility : int (x - middle)^2 dx/EI, m/N: what an element of constant curvature
        lacks.
    node_mass : (m + 1,), kg, statically equivalent to the distributed mass.
    """

    stations: Array
    pins: tuple[int, ...]
    bending_stiffness: Array
    axial_stiffness: Array
    residual_flexibility: Array
    node_mass: Array


def discretise(beam: Beam, pins: tuple[float, ...], refinement: int = 1) -> Elements:
    """Cut `beam` into elements with a node at every abscissa of `pins` and at both ends.

    No element is longer than the span over `n_elements * refinement`; pins closer than
    MERGE_DISTANCE to another station share its node.
    """
    stations = [beam.span[0], beam.span[1]]
    for pin in pins:
        if min(abs(pin - s) for s in stations) > MERGE_DISTANCE:
            stations.append(pin)
    stations.sort()
    longest = (beam.span[1] - beam.span[0]) / (beam.n_elements * refinement)
    mesh = [stations[0]]
    for start, end in pairwise(stations):
        n = max(1, int(np.ceil((end - start) / longest - 1e-6)))
        mesh += [start + (end - start) / n * k for k in range(1, n)] + [end]
    return _reduce(beam, np.array(mesh), pins)


def nearest(stations: Array, abscissa: float) -> int:
    """Number of the station nearest to `abscissa` in m."""
    return int(np.abs(stations - abscissa).argmin())


def _reduce(beam: Beam, stations: Array, pins: tuple[float, ...]) -> Elements:
    """Integrate section and mass over the elements between `stations`."""
    x, w, element = _quadrature(beam, stations)
    n = len(stations) - 1
    length = stations[1:] - stations[:-1]
    section = beam.section
    area = np.interp(x, section.abscissa, section.area)
    second_moment = np.interp(x, section.abscissa, section.second_moment)
    flexibility = 1.0 / (beam.youngs_modulus * second_moment)
    middle = (stations[:-1] + stations[1:]) / 2
    bending = _sums(element, w * flexibility, n)
    axial = _sums(element, w / (beam.youngs_modulus * area), n)
    residual = _sums(element, w * flexibility * (x - middle[element]) ** 2, n)

    # density follows the area, times a linear factor
    with_mass = (x >= beam.mass_span[0]) & (x <= beam.mass_span[1])
    weight = w * np.where(with_mass, area, 0.0)
    moments = np.array([np.sum(weight), np.sum(weight * x), np.sum(weight * x**2)])
    factor = np.linalg.solve(
        [moments[:2], moments[1:]], [beam.mass, beam.mass * beam.centre_of_mass]
    )
    slice_mass = weight * (factor[0] + factor[1] * x)
    along = (x - stations[element]) / length[element]
    node_mass = _sums(element, slice_mass * (1 - along), n + 1)
    node_mass += _sums(element + 1, slice_mass * along, n + 1)
    nodes = tuple(nearest(stations, pin) for pin in pins)
    return Elements(stations, nodes, length / bending, length / axial, residual, node_mass)


def _sums(group: NDArray[np.int64], values: Array, n_groups: int) -> Array:
    return np.bincount(group, values, n_groups).astype(np.float64)


def _quadrature(beam: Beam, stations: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Abscissas, weights and element numbers; panels end at stations, table rows and mass ends."""
    cuts = np.concatenate([stations, beam.section.abscissa, beam.mass_span])
    cuts = np.sort(cuts[(cuts >= stations[0]) & (cuts <= stations[-1])])
    # np.unique, several times faster: meshes are made by the ten thousand
    cuts = cuts[np.append(True, cuts[1:] != cuts[:-1])]
    width = cuts[1:] - cuts[:-1]
    x = (cuts[:-1, None] + width[:, None] * ((_GAUSS_X + 1) / 2)).ravel()
    w = (width[:, None] * (_GAUSS_W / 2)).ravel()
    element = np.searchsorted(stations, x, side="right") - 1
    return x, w, element
