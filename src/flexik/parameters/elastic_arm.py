"""The section `elastic_arm` of params.yaml."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    Name,
    NotNegative,
    Positive,
    Seed,
    check_increase,
)
from flexik.parameters.networks import Learner, Sizes
from flexik.parameters.trainers import Trainer

Pair = tuple[Positive, Positive]
Triple = tuple[float, float, float]
# From wood to diamond, Pa; and what a link of half a metre could carry, kg
Stiffness = Annotated[float, Field(ge=1e10, le=1.2e12)]
Payload = Annotated[float, Field(ge=0, le=100)]
# Below a straight angle either way
Degrees = Annotated[float, Field(gt=-180, lt=180)]
Share = Annotated[float, Field(gt=0, lt=1)]

# Prefixes of metrics and files that are no network or method, and names DVC's run cache ignores
TAKEN_NAMES = ("none", "readings", "gauges", "select", "size", "nfiles", "splits")

MAXIMUM_READINGS = 20_000
# Fewest readings of a part: an R needs several
MINIMUM_PART = 5


class Geometry(Model):
    """Lengths and joint limits."""

    lengths: Pair
    theta_1_degrees: tuple[Degrees, Degrees]
    theta_2_degrees: tuple[Degrees, Degrees]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "theta_1_degrees", "theta_2_degrees")
        return self


class Tube(Model):
    """Section of both links."""

    width: Positive
    height: Positive
    wall: Positive

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        if 2 * self.wall >= min(self.width, self.height):
            raise ValueError("wall: leaves nothing of the tube hollow")
        return self


class Structure(Model):
    """What bends and weighs, see multibody.elastic_arm.FlexibleArm."""

    tube: Tube
    youngs_modulus: Stiffness
    density: Positive
    joint_mass: NotNegative
    gravity: Positive
    n_elements: Annotated[int, Field(ge=1, le=200)]


class Gauges(Model):
    """Strain gauges, see datasets.elastic_arm.gauges."""

    deflection_stations: Pair
    strain_stations: Pair
    slopes: tuple[Triple, Triple]
    intercepts: tuple[Triple, Triple]
    noise: NotNegative
    voltage_range: Interval
    resolution: NotNegative
    strain_noise: NotNegative
    strain_resolution: NotNegative
    seed: Seed

    @model_validator(mode="after")
    def _sloping(self) -> Self:
        check_increase(self, "voltage_range")
        for number, slopes in enumerate(self.slopes):
            if 0.0 in slopes:
                raise ValueError(f"slopes.{number}: a gauge of slope zero tells no deflection")
        return self


class DegreeAxis(Model):
    """Evenly spaced angles."""

    minimum: Degrees
    maximum: Degrees
    increment: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        steps = (self.maximum - self.minimum) / self.increment
        if self.maximum < self.minimum or abs(steps - round(steps)) > 1e-6:
            raise ValueError("increment: maximum - minimum must be a whole number of increments")
        return self

    @property
    def n_angles(self) -> int:
        """Number of angles."""
        return round((self.maximum - self.minimum) / self.increment) + 1


class Readings(Model):
    """Poses and payloads of the experiment, and how they are divided."""

    theta_1_degrees: DegreeAxis
    theta_2_degrees: DegreeAxis
    payloads: Annotated[list[Payload], Field(min_length=1)]
    selection_share: Share
    held_out_share: Share
    seed: Seed

    @model_validator(mode="after")
    def _divided(self) -> Self:
        if self.selection_share + self.held_out_share >= 1.0:
            raise ValueError("held_out_share: leaves no reading to train with")
        if len(set(self.payloads)) < len(self.payloads):
            raise ValueError("payloads: one is there twice")
        for name in ("theta_1_degrees", "theta_2_degrees"):
            if (n := getattr(self, name).n_angles) > MAXIMUM_READINGS:
                raise ValueError(f"{name}.increment: {n} angles, at most {MAXIMUM_READINGS}")
        if self.n_readings > MAXIMUM_READINGS:
            raise ValueError(
                f"theta_1_degrees.increment, theta_2_degrees.increment: {self.n_readings} "
                f"readings, at most {MAXIMUM_READINGS}"
            )
        n, least = self.n_readings, MINIMUM_PART
        held_out, selection = round(self.held_out_share * n), round(self.selection_share * n)
        for key, part in (("held_out_share", held_out), ("selection_share", selection)):
            if part < least:
                raise ValueError(f"{key}: {part} of {n} readings, expected {least} or more")
        if n - held_out - selection < least:
            raise ValueError(
                f"selection_share, held_out_share: leave {n - held_out - selection} of {n} "
                f"readings to train with, expected {least} or more"
            )
        return self

    @property
    def n_readings(self) -> int:
        """Number of readings: every pair of angles with every payload."""
        return self.theta_1_degrees.n_angles * self.theta_2_degrees.n_angles * len(self.payloads)


class Splits(Model):
    """Other divisions of the readings, by which one network is trained and judged again."""

    network: Name
    seeds: Annotated[list[Seed], Field(min_length=1)]

    @model_validator(mode="after")
    def _once(self) -> Self:
        if len(set(self.seeds)) < len(self.seeds):
            raise ValueError("seeds: one is there twice")
        return self


class _Kind(Learner):
    """What is learnt, and from which gauges."""

    kind: Literal["gauges", "gauges_without_dx", "gauges_elbow", "deflection", "inverse"]
    readings: Literal["noise_free", "noisy", "noisy_voltages"] | None

    @property
    def has_gauges(self) -> bool:
        """Whether it is given gauges."""
        return self.kind.startswith("gauges")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.has_gauges != (self.readings is not None):
            raise ValueError("readings: of the kinds with gauges, null for the other kinds")
        return self


class ArmNetwork(_Kind):
    """A network of given size."""

    n_hidden: Annotated[list[Count], Field(min_length=1)]


class SelectLayers(Model):
    """Study of sizes: all combinations of the layers' axes, see learning.size_selection."""

    n_hidden: Annotated[list[Sizes], Field(min_length=1)]
    n_restarts: Count
    tolerance: NotNegative
    trainer: Name


class SelectedArmNetwork(_Kind):
    """A network whose size the selection error chooses."""

    select: SelectLayers


class Workspace(Model):
    """Random targets, see evaluation.targets."""

    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[Payload, Payload]
    payload_error: Positive
    tolerance: Positive
    n_iterations: Count
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y", "payload")
        return self


class GaugeMethod(Model):
    """See positioning.elastic_arm.gauges."""

    method: Literal["gauges"]
    network: Name


class InverseMethod(Model):
    """See positioning.elastic_arm.inverse."""

    method: Literal["inverse"]
    network: Name


class CombinedMethod(Model):
    """See positioning.combined."""

    method: Literal["combined"]
    network: Name
    n_corrections: Count


ArmMethod = Annotated[GaugeMethod | InverseMethod | CombinedMethod, Field(discriminator="method")]
NETWORK_KINDS = {
    "gauges": ("gauges", "gauges_without_dx", "gauges_elbow"),
    "inverse": ("inverse",),
    "combined": ("deflection",),
}


class ElasticArm(Model):
    """The elastic two-link arm."""

    geometry: Geometry
    structure: Structure
    gauges: Gauges
    readings: Readings
    splits: Splits
    trainers: dict[Name, Trainer]
    networks: dict[Name, ArmNetwork]
    selected_networks: dict[Name, SelectedArmNetwork]
    workspace: Workspace
    methods: dict[Name, ArmMethod]

    @property
    def all_networks(self) -> dict[str, ArmNetwork | SelectedArmNetwork]:
        """Networks of both sections by name."""
        return {**self.networks, **self.selected_networks}

    @property
    def gauge_networks(self) -> list[str]:
        """Names of the networks given gauges."""
        return [name for name, network in self.all_networks.items() if network.has_gauges]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_ranges()
        self._check_networks()
        self._check_methods()
        return self

    def _check_ranges(self) -> None:
        for name in ("deflection_stations", "strain_stations"):
            for number, (station, length) in enumerate(
                zip(getattr(self.gauges, name), self.geometry.lengths, strict=True)
            ):
                if station >= length:
                    raise ValueError(f"gauges.{name}.{number}: beyond its link, {length} m")
        for name in ("theta_1_degrees", "theta_2_degrees"):
            axis, (low, high) = getattr(self.readings, name), getattr(self.geometry, name)
            if axis.minimum < low or axis.maximum > high:
                raise ValueError(f"readings.{name}: beyond the joint, {low} to {high}")
        least, most = min(self.readings.payloads), max(self.readings.payloads)
        if self.workspace.payload[0] < least or self.workspace.payload[1] > most:
            raise ValueError(
                f"workspace.payload: beyond the payloads of the readings, {least:g} to {most:g} kg"
            )

    def _check_networks(self) -> None:
        trainers = {f"networks.{name}": n.trainer for name, n in self.networks.items()}
        for name, selected in self.selected_networks.items():
            trainers[f"selected_networks.{name}"] = selected.trainer
            trainers[f"selected_networks.{name}.select"] = selected.select.trainer
            if name in self.networks:
                raise ValueError(f"selected_networks.{name}: stands under networks too")
        for key, trainer in trainers.items():
            if trainer not in self.trainers:
                raise ValueError(
                    f"{key}.trainer: there is no trainer {trainer!r} ({', '.join(self.trainers)})"
                )
        split = self.networks.get(self.splits.network)
        if split is None or split.kind != "gauges":
            raise ValueError(
                f"splits.network: {self.splits.network!r}, expected a name under networks of kind "
                "gauges, the published idea"
            )
        if self.readings.seed in self.splits.seeds:
            raise ValueError("splits.seeds: holds readings.seed, the main division")
        for section in ("networks", "selected_networks", "methods"):
            for name in getattr(self, section):
                if name in TAKEN_NAMES:
                    raise ValueError(f"{section}.{name}: the name is taken")

    def _check_methods(self) -> None:
        networks = self.all_networks
        for label, method in self.methods.items():
            if method.network not in networks:
                raise ValueError(
                    f"methods.{label}.network: there is no network {method.network!r} "
                    f"({', '.join(networks)})"
                )
            needed, kind = NETWORK_KINDS[method.method], networks[method.network].kind
            if kind not in needed:
                raise ValueError(
                    f"methods.{label}.network: {method.network!r} is of kind {kind}, "
                    f"{method.method} needs {' or '.join(needed)}"
                )
            if label in networks and method.network != label:
                raise ValueError(f"methods.{label}: the name of another network than its own")
