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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.section import Machine
from flexik.datasets.tables import Field

Array = NDArray[np.float64]

# Without noise, with noise in all, and with noise in the voltages alone (strains exact)
FREE_OF_NOISE, NOISY, NOISY_VOLTAGES = "noise_free", "noisy", "noisy_voltages"
SHOWN = (FREE_OF_NOISE, NOISY, NOISY_VOLTAGES)
# Noise at the readings and at random targets is not the same
STREAM_OF_READINGS, STREAM_OF_TARGETS = 0, 1


@dataclass(frozen=True)
class Gauges:
    """Gauges of both links.

    lengths, stations : of the links, and of gauge 3 from the joints, m.
    slopes, intercepts : calibration lines, m/V and m, by link those of gauges 1 to 3.
    noise, resolution : standard deviation and step of a voltage, V.
    voltage_range : least and largest voltage that is measured, V; what is beyond is clipped.
    strain_noise, strain_resolution : the same of an axial strain.
    """

    lengths: tuple[float, float]
    stations: tuple[float, float]
    slopes: tuple[tuple[float, float, float], tuple[float, float, float]]
    intercepts: tuple[tuple[float, float, float], tuple[float, float, float]]
    noise: float
    voltage_range: tuple[float, float]
    resolution: float
    strain_noise: float
    strain_resolution: float


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
    *(
        Field(f"{name}_{link}", unit, f"{meaning} of link {link}, by its gauges")
        for link in (1, 2)
        for name, unit, meaning in (
            ("dy", "m", "deflection across the tip"),
            ("dx", "m", "elongation"),
            ("dphi", "rad", "rotation of the tip"),
        )
    ),
    Field("p_x", "m", "tip, forward, by equation 44 from the gauges"),
    Field("p_y", "m", "tip, upward, by equation 45 from the gauges"),
)


def gauges_of(machine: Machine, shown: str = NOISY) -> Gauges:
    """The gauges of `machine` as `shown` says: strains exact where noisy_voltages."""
    given = machine.gauges.model_dump(exclude={"deflection_stations", "strain_stations"})
    if shown == NOISY_VOLTAGES:
        given |= {"strain_noise": 0.0, "strain_resolution": 0.0}
    return Gauges(machine.geometry.lengths, machine.gauges.deflection_stations, **given)


def noise_generator(shown: str, seed: int, stream: int) -> np.random.Generator | None:
    """Source of the noise that is `shown`: none where there is none."""
    return None if shown == FREE_OF_NOISE else np.random.default_rng((seed, stream))


def read(
    gauges: Gauges,
    deformation: Array,
    station_deflection: Array,
    axial_strain: Array,
    generator: np.random.Generator | None,
) -> GaugeReadings:
    """What `gauges` show of links with `deformation` (n, 6) in m and rad.

    `station_deflection` (n, 2) in m and `axial_strain` (n, 2) are those at the gauges. `generator`
    draws the noise; without it there is neither noise nor resolution nor an end of the range.
    """
    tip = deformation[:, [0, 3]]
    slopes, intercepts = np.array(gauges.slopes), np.array(gauges.intercepts)
    deflection = np.stack([tip, tip, station_deflection], axis=2)
    voltages = ((deflection - intercepts) / slopes).reshape(-1, 6)
    strains = axial_strain
    if generator is not None:
        voltages = np.clip(
            _measured(voltages, gauges.noise, gauges.resolution, generator), *gauges.voltage_range
        )
        strains = _measured(strains, gauges.strain_noise, gauges.strain_resolution, generator)
    return GaugeReadings(voltages, strains, _deformation(gauges, voltages, strains))


def uncertainty(gauges: Gauges) -> Array:
    """Standard uncertainty (6,) of each deformation variable in m and rad, by noise and resolution.

    A step s adds the standard deviation s / sqrt(12) of an error uniform within it.
    """
    volt = np.hypot(gauges.noise, gauges.resolution / np.sqrt(12.0))
    strain = np.hypot(gauges.strain_noise, gauges.strain_resolution / np.sqrt(12.0))
    found = []
    for length, station, slopes in zip(
        gauges.lengths, gauges.stations, np.array(gauges.slopes), strict=True
    ):
        dy = volt * np.linalg.norm(_weights(slopes[:2]) * slopes[:2])
        found += [dy, length * strain, np.hypot(dy, volt * slopes[2]) / (length - station)]
    return np.array(found)


def n_clipped(gauges: Gauges, voltages: Array) -> int:
    """Number of rows of `voltages` (n, 6) in V with one at an end of the range or beyond."""
    low, high = gauges.voltage_range
    return int(np.any((voltages <= low) | (voltages >= high), axis=1).sum())


def _weights(slopes: Array) -> Array:
    """Weights of gauges of `slopes` in their mean: inverse squares, of sum 1."""
    inverse = 1.0 / slopes**2
    return np.asarray(inverse / inverse.sum())


def _deformation(gauges: Gauges, voltages: Array, strains: Array) -> Array:
    """Equations 47 to 54, backwards from `voltages` (n, 6) and `strains` (n, 2)."""
    slopes, intercepts = np.array(gauges.slopes), np.array(gauges.intercepts)
    deflection = voltages.reshape(-1, 2, 3) * slopes + intercepts
    columns = []
    for link in (0, 1):
        tip = deflection[:, link, :2] @ _weights(slopes[link, :2])
        apart = gauges.lengths[link] - gauges.stations[link]
        rotation = np.arctan((tip - deflection[:, link, 2]) / apart)
        columns += [tip, strains[:, link] * gauges.lengths[link], rotation]
    return np.column_stack(columns)


def _measured(values: Array, noise: float, step: float, generator: np.random.Generator) -> Array:
    noisy = values + noise * generator.standard_normal(values.shape)
    return step * np.round(noisy / step) if step > 0.0 else noisy
