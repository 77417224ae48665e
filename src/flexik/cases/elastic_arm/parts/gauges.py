"""Strain gauges in place of those of the experiment: voltages from deflections, and back.

Gauges 1 and 2 of a link tell the deflection of its tip, gauge 3 that of a station on it, by
straight calibration lines (Al-Khafaji and Jweeg 2017, equations 48 to 53). The rotation of the tip
is that of the line through the deflections of station and tip (equation 47), less than the slope of
a bent link at its tip. The elongation is the axial strain of a pair of gauges times the length
(equation 54); it knows nothing of the way by which a bent link becomes shorter.

Both gauges of the tip tell the same deflection, but the one of the steeper line spoils it more by
the same noise of its voltage. Their mean is weighted by the inverse squares of the slopes, as least
squares does.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts.readings import deformation_fields
from flexik.cases.elastic_arm.section import LINKS, Machine
from flexik.datasets.tables import Field

Array = NDArray[np.float64]

# Without noise, with noise in all, and with noise in the voltages alone (strains exact)
FREE_OF_NOISE, NOISY, NOISY_VOLTAGES = "noise_free", "noisy", "noisy_voltages"
SHOWN = (FREE_OF_NOISE, NOISY, NOISY_VOLTAGES)
# Noise at the readings and at random targets is not the same
STREAM_OF_READINGS, STREAM_OF_TARGETS = 0, 1


class GaugeReadings(NamedTuple):
    """What gauges show in n poses.

    voltages : (n, 6) in V, gauges 1 to 3 of link 1, then of link 2.
    strains : (n, 2), axial.
    deformation : (n, 6) in m and rad, as kinematics.elastic_arm.DEFORMATION, told from them.
    """

    voltages: Array
    strains: Array
    deformation: Array


FIELDS = (
    *(
        Field(f"voltage_{link}_{gauge}", "V", f"gauge {gauge} of link {link}")
        for link in (1, 2)
        for gauge in (1, 2, 3)
    ),
    *(Field(f"strain_{link}", "1", f"axial strain of link {link}") for link in (1, 2)),
    *deformation_fields("by the gauges"),
    Field("p_x", "m", "tip, forward, by equation 44 from the gauges"),
    Field("p_y", "m", "tip, upward, by equation 45 from the gauges"),
)


def noise_generator(shown: str, seed: int, stream: int) -> np.random.Generator | None:
    """Source of the noise that is `shown`: none where there is none."""
    return None if shown == FREE_OF_NOISE else np.random.default_rng((seed, stream))


def read(
    machine: Machine,
    deformation: Array,
    station_deflection: Array,
    axial_strain: Array,
    generator: np.random.Generator | None,
    *,
    exact_strains: bool = False,
) -> GaugeReadings:
    """What the gauges show of links with `deformation` (n, 6) in m and rad.

    `station_deflection` (n, 2) in m and `axial_strain` (n, 2) are those at the gauges. `generator`
    draws the noise; without it there is neither noise nor resolution nor an end of the range.
    """
    gauges = machine.gauges
    tip = deformation[:, [0, 3]]
    slopes, intercepts = np.array(gauges.slopes), np.array(gauges.intercepts)
    deflection = np.stack([tip, tip, station_deflection], axis=2)
    voltages = ((deflection - intercepts) / slopes).reshape(-1, 6)
    strains = axial_strain
    if generator is not None:
        voltages = np.clip(
            _measured(voltages, gauges.noise, gauges.resolution, generator), *gauges.voltage_range
        )
        if not exact_strains:
            strains = _measured(strains, gauges.strain_noise, gauges.strain_resolution, generator)
    return GaugeReadings(voltages, strains, _deformation(machine, voltages, strains))


def uncertainty(machine: Machine) -> Array:
    """Standard uncertainty (6,) of each deformation variable in m and rad, by noise and resolution.

    A step s adds the standard deviation s / sqrt(12) of an error uniform within it.
    """
    gauges, found = machine.gauges, []
    volt = np.hypot(gauges.noise, gauges.resolution / np.sqrt(12.0))
    strain = np.hypot(gauges.strain_noise, gauges.strain_resolution / np.sqrt(12.0))
    lines = zip(*_arms(machine), np.array(gauges.slopes), strict=True)
    for length, apart, slopes in lines:
        dy = volt * np.linalg.norm(_weights(slopes[:2]) * slopes[:2])
        found += [dy, length * strain, np.hypot(dy, volt * slopes[2]) / apart]
    return np.array(found)


def n_clipped(machine: Machine, voltages: Array) -> int:
    """Number of rows of `voltages` (n, 6) in V with one at an end of the range or beyond."""
    low, high = machine.gauges.voltage_range
    return int(np.any((voltages <= low) | (voltages >= high), axis=1).sum())


def _weights(slopes: Array) -> Array:
    """Weights of gauges of `slopes` in their mean: inverse squares, of sum 1."""
    inverse = 1.0 / slopes**2
    return np.asarray(inverse / inverse.sum())


def _arms(machine: Machine) -> tuple[Array, Array]:
    """Lengths (2,) of the links, and from gauge 3 to the tip (2,), m."""
    beams = [machine.beams[name] for name in LINKS]
    lengths = np.array([beam.span[1] for beam in beams])
    stations = [beam.foot(beam.points["deflection_station"])[0] for beam in beams]
    return lengths, lengths - stations


def _deformation(machine: Machine, voltages: Array, strains: Array) -> Array:
    """Equations 47 to 54, backwards from `voltages` (n, 6) and `strains` (n, 2)."""
    slopes, intercepts = np.array(machine.gauges.slopes), np.array(machine.gauges.intercepts)
    lengths, apart = _arms(machine)
    deflection = voltages.reshape(-1, 2, 3) * slopes + intercepts
    columns = []
    for link in (0, 1):
        tip = deflection[:, link, :2] @ _weights(slopes[link, :2])
        rotation = np.arctan((tip - deflection[:, link, 2]) / apart[link])
        columns += [tip, strains[:, link] * lengths[link], rotation]
    return np.column_stack(columns)


def _measured(values: Array, noise: float, step: float, generator: np.random.Generator) -> Array:
    noisy = values + noise * generator.standard_normal(values.shape)
    return step * np.round(noisy / step) if step > 0.0 else noisy
