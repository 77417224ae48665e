"""The section of an elastic two-link arm in params.yaml, and the machine file beside it."""

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from flexik.errors import ParameterError
from flexik.kinematics.machine_file import arm_geometry, check_machine
from flexik.kinematics.status import REACHED
from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import RandomTargets
from flexik.parameters.model import Interval, Model, Name, NotNegative, Positive, Seed
from flexik.parameters.networks import Axis, check_networks
from flexik.parameters.networks import Network as AnyNetwork
from flexik.parameters.section import CaseSection
from flexik.positioning import method, registry


def _increasing(interval: Any) -> Any:
    if interval[0] >= interval[1]:
        raise ValueError("must increase")
    return interval


def _different(values: list[Any]) -> list[Any]:
    if len(set(values)) < len(values):
        raise ValueError("a value is there twice")
    return values


def _sloping(slope: float) -> float:
    if slope == 0.0:
        raise ValueError("a gauge of slope zero tells no deflection")
    return slope


Triple = tuple[float, float, float]
Slope = Annotated[float, AfterValidator(_sloping)]
# What a link of half a metre could carry, kg
Payload = Annotated[float, Field(ge=0, le=100)]
# Below a straight angle either way
Degrees = Annotated[float, Field(gt=-180, lt=180)]
Share = Annotated[float, Field(gt=0, lt=1)]

# Prefixes of metrics that are no network or method
TAKEN_NAMES = ("readings", "select", "splits")

LINKS = ("link_1", "link_2")
STATIONS = {"deflection_station", "strain_station"}
# Of an angle in degrees and back
ROUND_OFF = 1e-9
MAXIMUM_READINGS = 20_000
# Fewest readings of a part: an R needs several
MINIMUM_PART = 5


class Gauges(Model):
    """Strain gauges, see parts/gauges.py."""

    slopes: tuple[tuple[Slope, Slope, Slope], tuple[Slope, Slope, Slope]]
    intercepts: tuple[Triple, Triple]
    noise: NotNegative
    voltage_range: Annotated[Interval, AfterValidator(_increasing)]
    resolution: NotNegative
    strain_noise: NotNegative
    strain_resolution: NotNegative


class Machine(PlanarMachine):
    """The machine file: two links with points for gauges, and the gauges."""

    instruments: Gauges

    @model_validator(mode="after")
    def _is_the_arm(self) -> Self:
        for name in LINKS:
            points = self.beams[name].points if name in self.beams else {}
            if not set(points) >= STATIONS:
                stations = ", ".join(sorted(STATIONS))
                raise ValueError(f"bodies.{name}: expected a beam with points {stations}")
        check_machine(self)
        return self

    @property
    def gauges(self) -> Gauges:
        """The strain gauges."""
        return self.instruments

    @property
    def limits_degrees(self) -> dict[str, tuple[float, float]]:
        """Joint limits by drive."""
        limits = {name: np.degrees(drive.limits) for name, drive in self.drives.items()}
        return {name: (float(low), float(high)) for name, (low, high) in limits.items()}


class DegreeAxis(Axis):
    """Evenly spaced angles."""

    minimum: Degrees
    maximum: Degrees


class Samples(Model):
    """Poses and payloads of the readings, their division, and the seed of the gauges' noise."""

    theta_1_degrees: DegreeAxis
    theta_2_degrees: DegreeAxis
    payloads: Annotated[list[Payload], Field(min_length=1), AfterValidator(_different)]
    selection_share: Share
    held_out_share: Share
    seed: Seed
    noise_seed: Seed

    @model_validator(mode="after")
    def _divided(self) -> Self:
        n = self.n_readings
        if n > MAXIMUM_READINGS:
            raise ValueError(
                f"theta_1_degrees.increment, theta_2_degrees.increment: {n} readings, at most "
                f"{MAXIMUM_READINGS}"
            )
        held_out, selection = round(self.held_out_share * n), round(self.selection_share * n)
        parts = {"held_out_share": held_out, "selection_share": selection}
        parts["held_out_share, selection_share"] = n - held_out - selection
        for key, part in parts.items():
            if part < MINIMUM_PART:
                what = "are left to train with" if "," in key else f"of {n}"
                raise ValueError(f"{key}: {part} readings {what}, expected {MINIMUM_PART} or more")
        return self

    @property
    def n_readings(self) -> int:
        """Number of readings: every pair of angles with every payload."""
        return self.theta_1_degrees.n_values * self.theta_2_degrees.n_values * len(self.payloads)


class Network(AnyNetwork):
    """A network; `readings` tells what the gauges show that it learns from, see parts/gauges.py."""

    corrects: None = None
    learns: Literal[
        "gauges", "gauges_without_dx", "gauges_elbow", "deflection", "coordinates", "tip"
    ]
    readings: Literal["noise_free", "noisy", "noisy_voltages"] = "noise_free"

    @property
    def has_gauges(self) -> bool:
        """Whether it is given gauges."""
        return self.learns.startswith("gauges")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if not self.has_gauges and self.readings != "noise_free":
            raise ValueError("readings: of networks that are given gauges")
        return self


class Gauge(method.Settings):
    """Settings of method `gauges`, see parts/gauge_method.py."""

    needs: ClassVar[str | None] = "gauges"
    method: Literal["gauges"]


AnyMethod = Annotated[Gauge | registry.AnyMethod, Field(discriminator="method")]


class Splits(Model):
    """Other divisions of the readings, by which one network is trained and judged again."""

    network: Name
    seeds: Annotated[list[Seed], Field(min_length=1), AfterValidator(_different)]


class Studies(Model):
    """What varies one thing.

    payload_error : kg more told than there is, to see what it costs.
    """

    splits: Splits
    payload_error: Positive


class Section(CaseSection):
    """The elastic two-link arm."""

    machine: Machine
    samples: Samples
    networks: dict[Name, Network]
    conditions: Annotated[dict[Name, RandomTargets], Field(min_length=1)]
    methods: dict[Name, AnyMethod]
    studies: Studies

    @property
    def largest_payload(self) -> float:
        """Of the readings, kg."""
        return max(self.samples.payloads)

    @property
    def gauge_networks(self) -> dict[str, Network]:
        """Networks that are given gauges, by name."""
        return {name: network for name, network in self.networks.items() if network.has_gauges}

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_networks(self.networks, self.trainers)
        self._check_ranges()
        self._check_splits()
        self._check_methods()
        return self

    def _check_ranges(self) -> None:
        for name in ("theta_1_degrees", "theta_2_degrees"):
            axis = getattr(self.samples, name)
            low, high = self.machine.limits_degrees[name.removesuffix("_degrees")]
            if axis.minimum < low - ROUND_OFF or axis.maximum > high + ROUND_OFF:
                raise ValueError(f"samples.{name}: beyond the joint, {low:g} to {high:g}")
        least, most = min(self.samples.payloads), max(self.samples.payloads)
        for name, drawn in self.conditions.items():
            if name == "readings":
                raise ValueError(f"conditions.{name}: the name is taken")
            if drawn.payload[0] < least or drawn.payload[1] > most:
                raise ValueError(
                    f"conditions.{name}.payload: beyond those of the readings, {least:g} to "
                    f"{most:g} kg"
                )

    def _check_splits(self) -> None:
        network = self.networks.get(self.studies.splits.network)
        if network is None or network.learns != "gauges" or network.is_selected:
            raise ValueError(
                f"studies.splits.network: {self.studies.splits.network!r}, expected a network of "
                "given size that learns gauges, the published idea"
            )
        if self.samples.seed in self.studies.splits.seeds:
            raise ValueError("studies.splits.seeds: holds samples.seed, the main division")

    def _check_methods(self) -> None:
        if not any(given.method == "none" for given in self.methods.values()):
            raise ValueError("methods: none is not there, which the others are compared with")
        others = {k: given for k, given in self.methods.items() if not isinstance(given, Gauge)}
        registry.check_methods(others, self.networks)
        for label, given in self.methods.items():
            if label not in others and given.network not in self.gauge_networks:
                raise ValueError(
                    f"methods.{label}.network: {given.network!r} is no network given gauges "
                    f"({', '.join(self.gauge_networks)})"
                )
            if label in self.networks and given.network != label:
                raise ValueError(f"methods.{label}: the name of another network than its own")
        for name in {*self.networks, *self.methods}.intersection(TAKEN_NAMES):
            raise ValueError(f"methods.{name}: the name is taken")


def check(section: Section) -> None:
    """Some of the area of random targets is reached; raises ParameterError naming the key."""
    geometry = arm_geometry(section.machine)
    for name, drawn in section.conditions.items():
        x, y = np.meshgrid(np.linspace(*drawn.x, 50), np.linspace(*drawn.y, 50))
        targets = np.column_stack([x.ravel(), y.ravel()])
        if not (geometry.inverse(targets, np.zeros_like(targets)).status == REACHED).any():
            key = f"{section.name}.conditions.{name}.x"
            raise ParameterError(
                f"params.yaml: {key}: the rigid arm reaches nothing of the area of x and y"
            )
