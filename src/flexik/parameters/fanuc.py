"""The section `fanuc` of params.yaml."""

import itertools
import re
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
)
from flexik.parameters.trainers import BackPropagation, Trainer

# Names of metrics, methods of their own, and names that DVC's run cache ignores
TAKEN_NAMES = (
    *("closed_form", "whole_workspace", "nearest_sample", "interpolated", "opw"),
    *("path", "random_poses", "off_path", "study", "size", "nfiles", "networks", "trainers"),
)
# A method with Newton steps after it
TAKEN_END = re.compile(r"_refined_\d+$")
# Columns: position; pose and what stands for joints, see kinematics.pose_representation
N_POSITION, N_JOINTS, N_POSE, N_OUTPUTS = 3, 6, 12, 9
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


class Refinement(Model):
    """Damped Newton steps, see kinematics.serial_arm.refine."""

    damping: Positive
    orientation_length: Positive
    n_steps: Count


class Success(Model):
    """A pose counts as reached within these errors."""

    position: Positive
    orientation: Positive


class Path(Model):
    """The taught path, see datasets.fanuc.path."""

    region: Annotated[list[Interval], Field(min_length=6, max_length=6)]
    n_via_points: Annotated[int, Field(ge=3)]
    n_training: Annotated[int, Field(ge=2)]
    n_test: Count
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for number, (low, high) in enumerate(self.region):
            if not low < high:
                raise ValueError(f"region.{number}: must increase")
        return self


class PathNetwork(Model):
    """Networks of a taught path: position to one joint each, or to all joints at once."""

    outputs: Literal["one_joint", "all_joints"]
    n_hidden: Count
    activation: Literal["tanh", "logistic"]
    seed: Seed
    n_restarts: Count
    trainer: Name


class Study(Model):
    """Sizes and learning factors for one joint, see stages/fanuc_study.py."""

    joint: Annotated[int, Field(ge=1, le=6)]
    network: Name
    n_hidden: Annotated[list[Count], Field(min_length=1)]
    learning_factors: Annotated[list[Positive], Field(min_length=1)]
    n_restarts: Count
    trainer: Name


class OffPath(Model):
    """Targets beside the path."""

    distances: Annotated[list[NotNegative], Field(min_length=1)]
    seed: Seed


class WorkspaceNetworks(Model):
    """One network an arm configuration, on random poses of the whole workspace."""

    n_training: Count
    n_targets: Count
    n_hidden: Annotated[list[Count], Field(min_length=1)]
    activation: Literal["tanh", "logistic"]
    seed: Seed
    trainer: Name


class Fanuc(Model):
    """The six-joint arm."""

    joints: Annotated[list[Joint], Field(min_length=6, max_length=6)]
    refinement: Refinement
    success: Success
    path: Path
    trainers: Annotated[dict[Name, Trainer], Field(min_length=1)]
    networks: Annotated[dict[Name, PathNetwork], Field(min_length=1)]
    study: Study
    off_path: OffPath
    workspace: WorkspaceNetworks

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for number, (joint, (low, high)) in enumerate(
            zip(self.joints, self.path.region, strict=True)
        ):
            if low < joint.minimum or high > joint.maximum:
                raise ValueError(f"path.region.{number}: reaches beyond the limits of the joint")
        for name in self.networks:
            if name in TAKEN_NAMES or TAKEN_END.search(name):
                raise ValueError(f"networks.{name}: the name is taken")
        trainers = {f"networks.{name}": network.trainer for name, network in self.networks.items()}
        trainers |= {"study": self.study.trainer, "workspace": self.workspace.trainer}
        for key, trainer in trainers.items():
            if trainer not in self.trainers:
                raise ValueError(
                    f"{key}.trainer: there is no trainer {trainer!r} ({', '.join(self.trainers)})"
                )
        self._check_study()
        for name in ("n_hidden", "learning_factors"):
            check_entries("study", name, getattr(self.study, name))
        distances = self.off_path.distances
        check_entries("off_path", "distances", distances)
        for number, pair in enumerate(itertools.pairwise(distances), start=1):
            one, other = (f"{MM * distance:g} mm" for distance in pair)
            if one == other:
                raise ValueError(
                    f"off_path.distances.{number}: prints as {one}, as the entry before it"
                )
        self._check_sizes()
        return self

    def _check_sizes(self) -> None:
        """No network has more weights than numbers to fit."""
        n_training = self.path.n_training
        for name, network in self.networks.items():
            n_outputs = 1 if network.outputs == "one_joint" else N_JOINTS
            check_size(
                f"networks.{name}.n_hidden",
                n_weights(N_POSITION, [network.n_hidden], n_outputs),
                n_training * n_outputs,
                "path.n_training",
            )
        for number, size in enumerate(self.study.n_hidden):
            weights = n_weights(N_POSITION, [size], 1)
            check_size(f"study.n_hidden.{number}", weights, n_training, "path.n_training")
        space = self.workspace
        check_size(
            "workspace.n_hidden",
            n_weights(N_POSE, space.n_hidden, N_OUTPUTS),
            space.n_training * N_OUTPUTS,
            "workspace.n_training",
        )

    def _check_study(self) -> None:
        trainer = self.trainers[self.study.trainer]
        if not isinstance(trainer, BackPropagation):
            raise ValueError(
                f"study.trainer: {self.study.trainer!r} is not of kind back_propagation, which "
                "alone has a learning factor and momentum"
            )
        if trainer.rate_increase != 1.0:
            raise ValueError(
                f"study.trainer: {self.study.trainer!r} has rate_increase "
                f"{trainer.rate_increase:g}, expected 1: a factor that stays what it is"
            )
        known = [name for name, each in self.networks.items() if each.outputs == "one_joint"]
        if self.study.network not in known:
            raise ValueError(
                f"study.network: {self.study.network!r} is no network with one joint as output "
                f"({', '.join(known) or 'there is none'})"
            )


def n_weights(n_inputs: int, n_hidden: list[int], n_outputs: int) -> int:
    """Weights and biases of a network."""
    sizes = [n_inputs, *n_hidden, n_outputs]
    return sum(units * (before + 1) for before, units in itertools.pairwise(sizes))


def check_size(key: str, weights: int, numbers: int, samples: str) -> None:
    """Raise ValueError if there are more `weights` than `numbers` of `samples` to fit."""
    if weights > numbers:
        raise ValueError(
            f"{key}: {weights} weights, more than the {numbers} numbers there are to fit "
            f"({samples})"
        )


def check_entries(section: str, name: str, values: list[float] | list[int]) -> None:
    """Raise ValueError unless `values` increase."""
    for number, (one, other) in enumerate(itertools.pairwise(values), start=1):
        if other <= one:
            raise ValueError(f"{section}.{name}.{number}: must exceed the entry before it")
