"""The section of a SmartEE in params.yaml, and the machine file beside it."""

from collections.abc import Sequence
from operator import attrgetter
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.files import checksum
from flexik.parameters.conditions import check_different
from flexik.parameters.model import Count, Model, Name, Positive, Seed
from flexik.parameters.networks import Network, Sizes, check_networks
from flexik.parameters.section import CaseSection
from flexik.parameters.trainers import RegularisedCg

Names = Annotated[list[Name], Field(min_length=1)]
# More is a slip of the pen, and more than memory holds
MOST_HIDDEN = 300
Rows = Annotated[int, Field(ge=1, le=10**6)]
Hidden = Annotated[int, Field(ge=1, le=MOST_HIDDEN)]
Steps = Annotated[int, Field(ge=0, le=100)]

# The poses that choose among restarts, and conditions the report asks for by name
SELECTION = "selection"
VALIDATION, RANDOM, OUTSIDE, CORNERS = CONDITIONS = ("validation", "random", "outside", "corners")
# The network whose errors stand beside the published ones, and the best one: networks and methods
PUBLISHED, BEST = "network", "best"
# Where errors of all restarts stand among those of conditions
RESTARTS = "restarts"
# Starts of Newton's method that are no network, and methods; and the method that converges
CENTRE, PREVIOUS, NEWTON = "centre", "previous", "newton"


class Machine(Model):
    """Lengths in m, see kinematics.smartee.SmartEEGeometry."""

    first_link: Positive
    second_link: Positive
    base_radius: Positive
    plate_radius: Positive


class Box(Model):
    """The box of poses: position x, y, z and ZYZ Euler angles about their centre."""

    centre: tuple[float, float, Positive]
    half_lengths: tuple[Positive, Positive, Positive]
    half_angles: tuple[Positive, Positive, Positive]


class RandomPoses(Model):
    """Uniform over the box, as many times as large as `extent` says.

    `permutations` adds what the symmetry of the legs makes of each pose, six rows for one.
    """

    kind: Literal["random"] = "random"
    n_poses: Rows
    extent: Positive = 1.0
    permutations: Literal["none", "legs"] = "none"
    seed: Seed


class OutsidePoses(Model):
    """Poses whose distance from the centre of the box is uniform up to `extent` times the box."""

    kind: Literal["outside"]
    n_poses: Rows
    # beyond, angles of the plate pass half a turn
    extent: Annotated[float, Field(gt=1, le=100)]
    seed: Seed


class CornerPoses(Model):
    """The 64 corners of the box."""

    kind: Literal["corners"]


class PathPoses(Model):
    """A closed path, sampled evenly in time: coordinates swing over the box, so often each."""

    kind: Literal["path"]
    cycles: Annotated[list[Count], Field(min_length=6, max_length=6)]
    n_samples: Rows


Poses = Annotated[RandomPoses | OutsidePoses | CornerPoses | PathPoses, Field(discriminator="kind")]


class Samples(Model):
    """The box, and the poses that networks learn from."""

    box: Box
    poses: dict[Name, RandomPoses]


class Method(Model):
    """Newton steps on the closure equations from `start`: centre, previous or a network.

    A method for every number of `n_steps`, 0 is the start itself. With a `tolerance` (of the
    closure error over the squared side of the plate) it stops sooner, and has not converged above
    it; else elbows are taken for right up to the closure error `accepted`. conditions: those it is
    judged on, default all.
    """

    start: Name
    n_steps: Annotated[list[Steps], Field(min_length=1)]
    tolerance: Positive | None = None
    accepted: Positive = 1e-6
    conditions: Names | None = None


class Starts(Model):
    """Study of initial weights, see learning.starts: every trainer from every start of a spread.

    `thresholds` are other errors of success; `tuned` are trainers whose constants were searched.
    """

    poses: Name
    n_hidden: Hidden
    n_starts: Count
    spreads: Annotated[dict[Name, Positive], Field(min_length=1)]
    trainers: Names
    success: Positive
    thresholds: Annotated[list[Positive], Field(min_length=1)]
    tuned: list[Name]
    seed: Seed

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        check_different("trainers", self.trainers)
        return self


class Sensitivity(Model):
    """`trainer` from the first starts of `spread`, with every pair of its two constants."""

    trainer: Name
    spread: Name
    n_starts: Count
    penalties: Annotated[list[Positive], Field(min_length=1)]
    penalty_decreases: Annotated[list[Annotated[float, Field(gt=0, lt=1)]], Field(min_length=1)]


class Tried(Sizes):
    """Numbers of hidden units to compare."""

    maximum: Hidden


class SizeStudy(Model):
    """Study of sizes, see learning.size_selection, on the rows of each of `poses`."""

    poses: Names
    n_hidden: Tried
    n_restarts: Count
    trainer: Name
    seed: Seed


class Draws(Model):
    """Sets of as many poses as the validation has, drawn from the random ones."""

    n_draws: Rows
    seed: Seed


class Geometry(Model):
    """Other values of the dimensions that were not published, and of the height of the box."""

    base_radius: Positive
    plate_radius: Positive
    height: Positive


class Studies(Model):
    """What varies one thing."""

    starts: Starts
    sensitivity: Sensitivity
    sizes: SizeStudy
    draws: Draws
    geometries: dict[Name, Geometry]


class Section(CaseSection):
    """The parallel manipulator."""

    machine: Machine
    samples: Samples
    networks: dict[Name, Network]
    conditions: dict[Name, Poses]
    methods: dict[Name, Method]
    studies: Studies

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        needed = {
            "samples.poses": (SELECTION,),
            "conditions": CONDITIONS,
            "networks": (PUBLISHED, BEST),
            "methods": (PUBLISHED, BEST, CENTRE, PREVIOUS, NEWTON),
        }
        for where, required in needed.items():
            for name in required:
                if name not in attrgetter(where)(self):
                    raise ValueError(f"{where}.{name}: is missing")
        for name, network in self.networks.items():
            if name in (CENTRE, PREVIOUS):
                raise ValueError(f"networks.{name}: the name is taken")
            if network.corrects or network.is_selected or max(sum(network.sizes, ())) > MOST_HIDDEN:
                raise ValueError(f"networks.{name}.n_hidden: expected numbers up to {MOST_HIDDEN}")
        check_networks(self.networks, self.trainers)
        for key, (where, names) in self._references().items():
            for name in names:
                if name not in (known := attrgetter(where)(self)):
                    raise ValueError(f"{key}: there is no {where} {name!r} ({', '.join(known)})")
                if where == "samples.poses" and name == SELECTION:
                    raise ValueError(f"{key}: {name} is kept from training")
        if RESTARTS in self.conditions:
            raise ValueError(f"conditions.{RESTARTS}: the name is taken")
        for name in CONDITIONS:
            expected = RANDOM if name == VALIDATION else name
            if self.conditions[name].kind != expected:
                raise ValueError(f"conditions.{name}.kind: expected {expected}")
        if not isinstance(self.trainers[self.studies.sensitivity.trainer], RegularisedCg):
            raise ValueError("studies.sensitivity.trainer: expected one of kind regularised_cg")
        return self

    @model_validator(mode="after")
    def _poses_differ(self) -> Self:
        """No two sets have the same poses."""
        seeds: dict[int, str] = {}
        for key, poses in self.sets.items():
            if not isinstance(poses, RandomPoses):
                continue
            if key.startswith("conditions.") and poses.permutations != "none":
                raise ValueError(f"{key}.permutations: expected none")
            if (other := seeds.setdefault(poses.seed, key)) != key:
                raise ValueError(
                    f"{key}.seed: {poses.seed} is that of {other}, expected another for every set: "
                    "the poses would be the same"
                )
        return self

    @property
    def sets(self) -> dict[str, Poses]:
        """All sets of poses by key."""
        samples = {f"samples.poses.{name}": poses for name, poses in self.samples.poses.items()}
        return samples | {f"conditions.{name}": poses for name, poses in self.conditions.items()}

    @property
    def query_key(self) -> str:
        """Checksum of what the time of a query depends on."""
        return checksum(repr((self.machine, self.methods, self.networks)))

    def training_key(self, trainer: str) -> str:
        """Checksum of what the time of a run of the study of starts depends on."""
        starts = self.studies.starts
        poses = self.samples.poses[starts.poses]
        return checksum(repr((self.trainers.get(trainer), poses, starts.n_hidden)))

    def _references(self) -> dict[str, tuple[str, Sequence[str]]]:
        """By key where the names that stand there must be known, and these names."""
        starts, sizes = self.studies.starts, self.studies.sizes
        poses, sensitivity = "samples.poses", self.studies.sensitivity
        found: dict[str, tuple[str, Sequence[str]]] = {
            "studies.starts.poses": (poses, [starts.poses]),
            "studies.starts.trainers": ("trainers", starts.trainers),
            "studies.starts.tuned": ("studies.starts.trainers", starts.tuned),
            "studies.sensitivity.trainer": ("trainers", [sensitivity.trainer]),
            "studies.sensitivity.spread": ("studies.starts.spreads", [sensitivity.spread]),
            "studies.sizes.poses": (poses, sizes.poses),
            "studies.sizes.trainer": ("trainers", [sizes.trainer]),
        }
        for name, network in self.networks.items():
            found[f"networks.{name}.learns"] = (poses, [str(network.learns)])
        for name, method in self.methods.items():
            found[f"methods.{name}.conditions"] = ("conditions", method.conditions or [])
            if method.start not in (CENTRE, PREVIOUS):
                found[f"methods.{name}.start"] = ("networks", [method.start])
        return found


def check(section: Section) -> None:
    """Raise ParameterError when the legs do not reach a pose."""
    from flexik.cases.smartee.parts.poses import check_reach

    check_reach(section)
