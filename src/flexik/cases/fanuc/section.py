"""The section `fanuc` of params.yaml and the machine file data/machines/fanuc.yaml."""

import itertools
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from flexik.errors import ParameterError
from flexik.parameters.model import Count, Interval, Model, Name, NotNegative, Positive, Seed
from flexik.parameters.networks import Network, check_networks
from flexik.parameters.section import CaseSection
from flexik.parameters.trainers import BackPropagation

# Columns in and out: of position and joints; of kinematics.pose_representation
N_COLUMNS = {"each_joint": (3, 1), "all_joints": (3, 6), "arm_configuration": (12, 9)}
N_JOINTS = 6
PUBLISHED_NETWORKS = ("config1", "config2")
WHOLE, EXACT = "whole_workspace", "closed_form"
# Of the taught samples, without a network
LOOKED_UP = ("nearest_sample", "interpolated")
CONDITIONS = ("path", "off_path", "random_poses")


def _increasing(values: Any) -> Any:
    for number, pair in enumerate(itertools.pairwise(values), start=1):
        # as the report prints them
        one, other = (float(f"{value:g}") for value in pair)
        if one >= other:
            raise ValueError(f"{number}: must exceed the entry before it, in six digits")
    return values


Increasing = AfterValidator(_increasing)
Range = Annotated[Interval, Increasing]


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

    region: Annotated[list[Range], Field(min_length=N_JOINTS, max_length=N_JOINTS)]
    n_via_points: Annotated[int, Field(ge=3)]
    n_training: Annotated[int, Field(ge=2)]
    n_test: Count
    seed: Seed = 1


class Samples(Model):
    """What networks learn from; `n_poses` random ones of each arm configuration."""

    path: Path
    n_poses: Count
    seed: Seed


class OffPath(Model):
    """Targets beside the path."""

    distances: Annotated[list[NotNegative], Field(min_length=1), Increasing]
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

    values: Annotated[list[Count], Field(min_length=1), Increasing]


class FactorStudy(Study):
    """Learning factors."""

    values: Annotated[list[Positive], Field(min_length=1), Increasing]


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
            self._check_network(f"networks.{name}", network)
        self._check_methods()
        for name in type(self.studies).model_fields:
            self._check_study(f"studies.{name}", getattr(self.studies, name))
        return self

    def _check_methods(self) -> None:
        """The methods that the report compares are there; each network has a method that fits."""
        if WHOLE not in self.networks:
            raise ValueError(f"networks.{WHOLE}: expected a network that learns arm_configuration")
        expected: dict[str, str] = dict.fromkeys(self.path_networks, "predicted")
        expected |= {name: name for name in (*LOOKED_UP, EXACT)} | {WHOLE: "arm_configurations"}
        for name in [*self.methods, *expected]:
            if name not in expected:
                raise ValueError(
                    f"methods.{name}: there is no such network ({', '.join(expected)})"
                )
            if name not in self.methods or self.methods[name].kind != expected[name]:
                raise ValueError(f"methods.{name}: expected a method of kind {expected[name]}")

    def _check_network(self, key: str, network: Network) -> None:
        if network.learns not in N_COLUMNS:
            raise ValueError(f"{key}.learns: expected one of {', '.join(N_COLUMNS)}")
        if network.is_selected:
            raise ValueError(f"{key}.n_hidden: expected numbers, sizes are not selected here")
        if network.learns != "arm_configuration" and len(network.layers) != 1:
            # those of one joint each are joined layer by layer
            raise ValueError(f"{key}.n_hidden: expected one layer, got {len(network.layers)}")
        self._check_size(f"{key}.n_hidden", network.learns, network.sizes[0])

    def _check_size(self, key: str, learns: str, n_hidden: tuple[int, ...]) -> None:
        """No network has more weights than numbers to fit."""
        n, source = self.samples.path.n_training, "path.n_training"
        if learns == "arm_configuration":
            n, source = self.samples.n_poses, "n_poses"
        n_inputs, n_outputs = N_COLUMNS[learns]
        weights = n_weights(n_inputs, n_hidden, n_outputs)
        if weights > n * n_outputs:
            raise ValueError(
                f"{key}: {weights} weights, more than the {n * n_outputs} numbers there are to fit "
                f"(samples.{source})"
            )

    def _check_study(self, key: str, study: Study) -> None:
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
        if isinstance(study, SizeStudy):
            for number, size in enumerate(study.values):
                self._check_size(f"{key}.values.{number}", "each_joint", (size,))


def n_weights(n_inputs: int, n_hidden: tuple[int, ...], n_outputs: int) -> int:
    """Weights and biases of a network."""
    sizes = [n_inputs, *n_hidden, n_outputs]
    return sum(units * (before + 1) for before, units in itertools.pairwise(sizes))


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
