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
# More is a slip of the pen, and more than memory holds
MOST_ROWS, MOST_STEPS, MOST_HIDDEN = 10**6, 100, 300
# Starts of Newton's method that are no network
CENTRE, PREVIOUS = "centre", "previous"


class Geometry(Model):
    """Lengths, see kinematics.smartee.SmartEEGeometry."""

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

    n_poses: Annotated[int, Field(ge=1, le=MOST_ROWS)]
    extent: Positive
    permutations: Literal["none", "legs"]
    seed: Seed


class SmartEENetwork(Learner):
    """A network of the elbows."""

    poses: Name
    n_hidden: Count


class Sensitivity(Model):
    """`trainer` from the starts of `spread`, with every pair of its two constants."""

    trainer: Name
    spread: Name
    n_starts: Count
    penalties: Annotated[list[Positive], Field(min_length=1)]
    penalty_decreases: Annotated[list[Annotated[float, Field(gt=0, lt=1)]], Field(min_length=1)]


class Starts(Model):
    """Study of initial weights, see learning.starts.

    `thresholds` are other errors of success; `tuned` are trainers whose constants were searched.
    """

    poses: Name
    n_hidden: Count
    n_starts: Count
    spreads: dict[Name, Positive]
    trainers: Names
    success: Positive
    thresholds: Annotated[list[Positive], Field(min_length=1)]
    tuned: list[Name]
    sensitivity: Sensitivity
    seed: Seed


class SizeStudy(Model):
    """Study of sizes, see learning.size_selection; the same on the rows of `beside`."""

    poses: Name
    beside: Name
    n_hidden: Sizes
    n_restarts: Count
    trainer: Name
    seed: Seed


class Newton(Model):
    """Newton's method on the closure equations.

    It stops at `tolerance` or after `n_steps`; reports show the first `shown_steps` from the
    centre, and `network_steps` from a network or from the previous pose of a path. Elbows after
    fixed steps are taken for right up to the closure error `accepted`.
    """

    tolerance: Positive
    accepted: Positive
    n_steps: Count
    shown_steps: Annotated[int, Field(ge=1, le=MOST_STEPS)]
    # two steps are what the metrics and the target are about
    network_steps: Annotated[int, Field(ge=2, le=MOST_STEPS)]


class Path(Model):
    """A closed path through the box, sampled evenly in time, see evaluation.smartee."""

    cycles: Annotated[list[Count], Field(min_length=6, max_length=6)]
    n_samples: Annotated[list[Annotated[int, Field(ge=1, le=MOST_ROWS)]], Field(min_length=1)]

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        for number, n_samples in enumerate(self.n_samples):
            if n_samples in self.n_samples[:number]:
                raise ValueError(f"n_samples.{number}: {n_samples} is there twice")
        return self


class Outside(Model):
    """Poses whose distance from the centre of the box is uniform up to `extent` times the box."""

    n_poses: Annotated[int, Field(ge=1, le=MOST_ROWS)]
    # beyond, angles of the plate pass half a turn
    extent: Annotated[float, Field(gt=1, le=100)]
    n_bins: Annotated[int, Field(ge=1, le=1000)]
    seed: Seed


class Draws(Model):
    """Sets of as many poses as the validation has, drawn from the random ones."""

    n_draws: Annotated[int, Field(ge=1, le=MOST_ROWS)]
    seed: Seed


class OtherGeometry(Model):
    """Other values of the dimensions that were not published, and of the height of the box."""

    base_radius: Positive
    plate_radius: Positive
    height: Positive


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
    draws: Draws
    other_geometries: dict[Name, OtherGeometry]

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
        self._check_poses()
        self._check_starts()
        for key, n_hidden in self._hidden().items():
            if n_hidden > MOST_HIDDEN:
                raise ValueError(f"{key}: expected at most {MOST_HIDDEN}, got {n_hidden}")
        for key, trainer in self._trainers().items():
            if trainer not in self.trainers:
                known = ", ".join(self.trainers)
                raise ValueError(f"{key}: there is no trainer {trainer!r} ({known})")
        for key, poses in self._pose_sets().items():
            if poses not in self.poses:
                raise ValueError(f"{key}: there is no data set {poses!r} ({', '.join(self.poses)})")
            if poses in NEEDED:
                raise ValueError(f"{key}: {poses} is kept from training")
        return self

    def _check_poses(self) -> None:
        """No two sets have the same poses."""
        seeds: dict[int, str] = {}
        for name, poses in self.poses.items():
            if poses.seed in seeds:
                raise ValueError(
                    f"poses.{name}.seed: {poses.seed} is that of poses.{seeds[poses.seed]}, "
                    "expected another for every set: the poses would be the same"
                )
            seeds[poses.seed] = name

    def _check_starts(self) -> None:
        for number, name in enumerate(self.starts.trainers):
            if name in self.starts.trainers[:number]:
                raise ValueError(f"starts.trainers.{number}: {name} is there twice")
        if not self.starts.spreads:
            raise ValueError("starts.spreads: expected at least one")
        for number, name in enumerate(self.starts.tuned):
            if name not in self.starts.trainers:
                raise ValueError(f"starts.tuned.{number}: {name} is not in starts.trainers")
        sensitivity = self.starts.sensitivity
        if sensitivity.spread not in self.starts.spreads:
            known = ", ".join(self.starts.spreads)
            raise ValueError(
                f"starts.sensitivity.spread: there is no spread {sensitivity.spread!r} ({known})"
            )
        trainer = self.trainers.get(sensitivity.trainer)
        if trainer is not None and trainer.kind != "regularised_cg":
            raise ValueError(
                f"starts.sensitivity.trainer: {sensitivity.trainer} is {trainer.kind}, expected "
                "regularised_cg, which has these constants"
            )

    def _hidden(self) -> dict[str, int]:
        named = {f"networks.{name}.n_hidden": n.n_hidden for name, n in self.networks.items()}
        named["sizes.n_hidden.maximum"] = self.sizes.n_hidden.maximum
        return named | {"starts.n_hidden": self.starts.n_hidden}

    def _trainers(self) -> dict[str, str]:
        named = {f"networks.{name}.trainer": n.trainer for name, n in self.networks.items()}
        named |= {f"starts.trainers.{k}": name for k, name in enumerate(self.starts.trainers)}
        named["starts.sensitivity.trainer"] = self.starts.sensitivity.trainer
        return named | {"sizes.trainer": self.sizes.trainer}

    def _pose_sets(self) -> dict[str, str]:
        named = {f"networks.{name}.poses": n.poses for name, n in self.networks.items()}
        named |= {"sizes.poses": self.sizes.poses, "sizes.beside": self.sizes.beside}
        return named | {"starts.poses": self.starts.poses}
