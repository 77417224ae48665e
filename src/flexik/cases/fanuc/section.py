"""The section `fanuc` of params.yaml and the machine file data/machines/fanuc.yaml."""

import itertools
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.errors import ParameterError
from flexik.parameters.model import Count, Interval, Model, Name, NotNegative, Positive, Seed
from flexik.parameters.networks import Network, check_networks
from flexik.parameters.section import CaseSection
from flexik.parameters.trainers import BackPropagation

# Columns: position; pose and what stands for joints, see kinematics.pose_representation
N_INPUTS = {"each_joint": 3, "all_joints": 3, "arm_configuration": 12}
N_OUTPUTS = {"each_joint": 1, "all_joints": 6, "arm_configuration": 9}
N_JOINTS = 6
PUBLISHED_NETWORKS = ("config1", "config2")
WHOLE, EXACT = "whole_workspace", "closed_form"
# Of the taught samples, without a network
LOOKED_UP = ("nearest_sample", "interpolated")
CONDITIONS = ("path", "off_path", "random_poses")
MM = 1e3


class Joint(Model):
    """A row of the Denavit-Hartenberg table and the limits of the joint."""

    offset: float
    d: float
    a: float
    alpha: float
    minimum: float
    maximum: float

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum >= self.maximum:
            raise ValueError("maximum: must exceed minimum")
        return self


class Machine(Model):
    """The machine file."""

    joints: Annotated[list[Joint], Field(min_length=N_JOINTS, max_length=N_JOINTS)]


class Path(Model):
    """The taught path, see parts.samples."""

    region: Annotated[list[Interval], Field(min_length=N_JOINTS, max_length=N_JOINTS)]
    n_via_points: Annotated[int, Field(ge=3)]
    n_training: Annotated[int, Field(ge=2)]
    n_test: Count
    seed: Seed = 1

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for number, (low, high) in enumerate(self.region):
            if not low < high:
                raise ValueError(f"region.{number}: must increase")
        return self


class Samples(Model):
    """What networks learn from; `n_poses` random ones of each arm configuration."""

    path: Path
    n_poses: Count
    seed: Seed


class OffPath(Model):
    """Targets beside the path."""

    distances: Annotated[list[NotNegative], Field(min_length=1)]
    seed: Seed


class RandomPoses(Model):
    """`n_targets` random poses of each arm configuration."""

    n_targets: Count
    seed: Seed


class Refinement(Model):
    """Damped Newton steps, see kinematics.serial_arm.refine; 1 to `n_steps` are compared."""

    n_steps: Count
    damping: Positive
    orientation_length: Positive


class Conditions(Model):
    """What methods are asked; beside these the test samples of the path."""

    off_path: OffPath
    random_poses: RandomPoses
    refinement: Refinement


class Method(Model):
    """How joints are found for a pose, a file of flexik.positioning.

    `predicted` and `arm_configurations` ask the network that has the name of the method.
    """

    kind: Literal[
        "predicted", "arm_configurations", "nearest_sample", "interpolated", "closed_form"
    ]


class Study(Model):
    """One thing varied for one joint, see parts.study; `n_iterations` passes each."""

    joint: Annotated[int, Field(ge=1, le=N_JOINTS)]
    network: Name
    n_restarts: Count
    n_iterations: Count


class SizeStudy(Study):
    """Numbers of hidden neurons."""

    values: Annotated[list[Count], Field(min_length=1)]


class FactorStudy(Study):
    """Learning factors."""

    values: Annotated[list[Positive], Field(min_length=1)]


class Studies(Model):
    """Effect of the number of hidden neurons and of the learning factor."""

    n_hidden: SizeStudy
    learning_factor: FactorStudy


class Success(Model):
    """A pose counts as reached within these errors."""

    position: Positive
    orientation: Positive


class Section(CaseSection):
    """The six-joint arm."""

    machine: Machine
    samples: Samples
    networks: dict[Name, Network]
    conditions: Conditions
    methods: dict[Name, Method]
    studies: Studies
    success: Success

    @property
    def path_networks(self) -> dict[str, Network]:
        """Networks of the taught path."""
        return {n: each for n, each in self.networks.items() if each.learns != "arm_configuration"}

    @property
    def path_methods(self) -> list[str]:
        """Methods that know the taught path alone."""
        return [*self.path_networks, *LOOKED_UP]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for number, (joint, (low, high)) in enumerate(
            zip(self.machine.joints, self.samples.path.region, strict=True)
        ):
            if low < joint.minimum or high > joint.maximum:
                raise ValueError(
                    f"samples.path.region.{number}: reaches beyond the limits of the joint"
                )
        check_networks(self.networks, self.trainers)
        for name, network in self.networks.items():
            self._check_network(name, network)
        self._check_methods()
        for name in ("n_hidden", "learning_factor"):
            self._check_study(name)
        distances = self.conditions.off_path.distances
        check_entries("conditions.off_path.distances", distances)
        for number, pair in enumerate(itertools.pairwise(distances), start=1):
            one, other = (f"{MM * distance:g} mm" for distance in pair)
            if one == other:
                raise ValueError(
                    f"conditions.off_path.distances.{number}: prints as {one}, as the entry before"
                )
        return self

    def _check_methods(self) -> None:
        """The methods that the report compares are there; each network has a method that fits."""
        expected = dict.fromkeys(self.path_networks, "predicted")
        expected |= {name: name for name in (*LOOKED_UP, EXACT)} | {WHOLE: "arm_configurations"}
        for name in self.methods:
            if name not in expected:
                raise ValueError(
                    f"methods.{name}: there is no such network ({', '.join(expected)})"
                )
        for name, kind in expected.items():
            if name not in self.methods or self.methods[name].kind != kind:
                raise ValueError(f"methods.{name}: expected a method of kind {kind}")
        if WHOLE not in self.networks:
            raise ValueError(f"networks.{WHOLE}: expected a network that learns arm_configuration")

    def _check_network(self, name: str, network: Network) -> None:
        """No network has more weights than numbers to fit."""
        key = f"networks.{name}"
        if network.learns not in N_INPUTS:
            raise ValueError(f"{key}.learns: expected one of {', '.join(N_INPUTS)}")
        if network.is_selected:
            raise ValueError(f"{key}.n_hidden: expected numbers, sizes are not selected here")
        if network.learns != "arm_configuration" and len(network.layers) != 1:
            # those of one joint each are joined layer by layer
            raise ValueError(f"{key}.n_hidden: expected one layer, got {len(network.layers)}")
        samples = self.samples
        whole = network.learns == "arm_configuration"
        n, source = (
            (samples.n_poses, "n_poses") if whole else (samples.path.n_training, "path.n_training")
        )
        n_in, n_out = N_INPUTS[network.learns], N_OUTPUTS[network.learns]
        check_size(f"{key}.n_hidden", n_weights(n_in, network.sizes[0], n_out), n * n_out, source)

    def _check_study(self, name: str) -> None:
        study, key = getattr(self.studies, name), f"studies.{name}"
        check_entries(f"{key}.values", study.values)
        known = [n for n, each in self.networks.items() if each.learns == "each_joint"]
        if study.network not in known:
            raise ValueError(
                f"{key}.network: {study.network!r} is no network of one joint "
                f"({', '.join(known) or 'there is none'})"
            )
        trainer = self.trainers[self.networks[study.network].trainer]
        if not isinstance(trainer, BackPropagation) or trainer.rate_increase != 1.0:
            raise ValueError(
                f"{key}.network: {study.network!r} is not trained by back_propagation with a "
                "constant learning factor (rate_increase 1)"
            )
        sizes = study.values if isinstance(study, SizeStudy) else []
        for number, size in enumerate(sizes):
            n = self.samples.path.n_training
            weights = n_weights(N_INPUTS["each_joint"], (size,), 1)
            check_size(f"{key}.values.{number}", weights, n, "path.n_training")


def n_weights(n_inputs: int, n_hidden: tuple[int, ...], n_outputs: int) -> int:
    """Weights and biases of a network."""
    sizes = [n_inputs, *n_hidden, n_outputs]
    return sum(units * (before + 1) for before, units in itertools.pairwise(sizes))


def check_size(key: str, weights: int, numbers: int, samples: str) -> None:
    """Raise ValueError if there are more `weights` than `numbers` of `samples` to fit."""
    if weights > numbers:
        raise ValueError(
            f"{key}: {weights} weights, more than the {numbers} numbers there are to fit "
            f"(samples.{samples})"
        )


def check_entries(key: str, values: list[float] | list[int]) -> None:
    """Raise ValueError unless `values` increase."""
    for number, (one, other) in enumerate(itertools.pairwise(values), start=1):
        if other <= one:
            raise ValueError(f"{key}.{number}: must exceed the entry before it")


def check(section: Section) -> None:
    """Raise ParameterError unless the closed form fits the arm and the path keeps its limits."""
    from flexik.cases.fanuc.parts.samples import taught_path
    from flexik.cases.fanuc.parts.tables import arm_of
    from flexik.kinematics.spherical_wrist import check_spherical_wrist

    try:
        arm = arm_of(section.machine.joints)
        check_spherical_wrist(arm)
    except ParameterError as error:
        raise ParameterError(f"{section.machine_file}: joints: {error}") from None
    try:
        taught_path(arm, section.samples.path)
    except ParameterError as error:
        raise ParameterError(f"params.yaml: {section.name}.samples.path: {error}") from None
