"""The section `smartee` of params.yaml."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Count, Model, Name, Positive, Seed
from flexik.parameters.networks import Learner, Sizes
from flexik.parameters.trainers import Trainer

Names = Annotated[list[Name], Field(min_length=1)]

# Data sets that stages ask for by name; networks may learn from any other
SELECTION, VALIDATION, RANDOM = "selection", "validation", "random"
NEEDED = (SELECTION, VALIDATION, RANDOM)
# The network whose errors stand beside the published ones, and the best one
PUBLISHED, BEST = "network", "best"
# Starts of Newton's method that are no network
CENTRE, PREVIOUS = "centre", "previous"


class Geometry(Model):
    """Lengths, see mechanisms.smartee.SmartEEGeometry."""

    first_link: Positive
    second_link: Positive
    base_radius: Positive
    plate_radius: Positive


class Workspace(Model):
    """The box of poses: position x, y, z and ZYZ Euler angles about their centre."""

    centre: tuple[float, float, Positive]
    half_lengths: tuple[Positive, Positive, Positive]
    half_angles: tuple[Positive, Positive, Positive]


class PoseSet(Model):
    """Random poses: uniform over the box, as many times as large as `extent` says.

    `permutations` adds what the symmetry of the legs makes of each pose, six rows for one.
    """

    n_poses: Count
    extent: Positive
    permutations: Literal["none", "legs"]
    seed: Seed


class SmartEENetwork(Learner):
    """A network of the elbows."""

    poses: Name
    n_hidden: Count


class Starts(Model):
    """Study of initial weights, see learning.starts."""

    poses: Name
    n_hidden: Count
    n_starts: Count
    spreads: dict[Name, Positive]
    trainers: Names
    success: Positive
    seed: Seed


class SizeStudy(Model):
    """Study of sizes, see learning.size_selection."""

    poses: Name
    n_hidden: Sizes
    n_restarts: Count
    trainer: Name
    seed: Seed


class Newton(Model):
    """Newton's method on the closure equations.

    It stops at `tolerance` or after `n_steps`; reports show the first `shown_steps` from the
    centre, and `network_steps` from a network or from the previous pose of a path.
    """

    tolerance: Positive
    n_steps: Count
    shown_steps: Count
    network_steps: Count


class Path(Model):
    """A closed path through the box, sampled evenly in time, see evaluation.smartee."""

    cycles: tuple[Count, Count, Count, Count, Count, Count]
    n_samples: Annotated[list[Count], Field(min_length=1)]


class Outside(Model):
    """Poses whose distance from the centre of the box is uniform up to `extent` times the box."""

    n_poses: Count
    extent: Annotated[float, Field(gt=1)]
    n_bins: Count
    seed: Seed


class SmartEE(Model):
    """The parallel manipulator."""

    geometry: Geometry
    workspace: Workspace
    poses: dict[Name, PoseSet]
    trainers: dict[Name, Trainer]
    networks: dict[Name, SmartEENetwork]
    starts: Starts
    sizes: SizeStudy
    newton: Newton
    path: Path
    outside: Outside

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for section, names in (("poses", NEEDED), ("networks", (PUBLISHED, BEST))):
            for name in names:
                if name not in getattr(self, section):
                    raise ValueError(f"{section}.{name}: is missing")
        for name in (CENTRE, PREVIOUS):
            if name in self.networks:
                raise ValueError(f"networks.{name}: the name is taken")
        for name in NEEDED:
            if self.poses[name].permutations != "none":
                raise ValueError(f"poses.{name}.permutations: expected none (poses are compared)")
        for key, trainer in self._trainers().items():
            if trainer not in self.trainers:
                known = ", ".join(self.trainers)
                raise ValueError(f"{key}: there is no trainer {trainer!r} ({known})")
        for key, poses in self._pose_sets().items():
            if poses not in self.poses:
                raise ValueError(f"{key}: there is no data set {poses!r} ({', '.join(self.poses)})")
            if poses in NEEDED:
                raise ValueError(f"{key}: {poses} is kept from training")
        for number, name in enumerate(self.starts.trainers):
            if name in self.starts.trainers[:number]:
                raise ValueError(f"starts.trainers.{number}: {name} is there twice")
        if not self.starts.spreads:
            raise ValueError("starts.spreads: expected at least one")
        return self

    def _trainers(self) -> dict[str, str]:
        named = {f"networks.{name}.trainer": n.trainer for name, n in self.networks.items()}
        named |= {f"starts.trainers.{k}": name for k, name in enumerate(self.starts.trainers)}
        return named | {"sizes.trainer": self.sizes.trainer}

    def _pose_sets(self) -> dict[str, str]:
        named = {f"networks.{name}.poses": n.poses for name, n in self.networks.items()}
        return named | {"starts.poses": self.starts.poses, "sizes.poses": self.sizes.poses}
