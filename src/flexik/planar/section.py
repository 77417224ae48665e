"""The section of a planar flexible machine in params.yaml."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from flexik.errors import ParameterError, TrainingError
from flexik.kinematics.machine_file import check_machine, manipulator_of
from flexik.kinematics.manipulator import Manipulator
from flexik.learning.regressor import estimator, load_regressor
from flexik.learning.storage import load_networks
from flexik.learning.torch_module import code_of
from flexik.learning.torch_storage import load_modules
from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import ConditionSet, Points
from flexik.parameters.model import Count, Model, Name, NotNegative, Seed, Share
from flexik.parameters.networks import Axis, Regressor, TorchModule, check_networks
from flexik.parameters.section import CaseSection
from flexik.planar.calibration_section import Calibration
from flexik.planar.measured.campaign_file import own_campaign
from flexik.planar.measured.section import Measured
from flexik.planar.network_section import AnyNetwork, PlanarNetwork
from flexik.positioning.beam_model import theory
from flexik.positioning.beam_network import Settings as BeamNetwork
from flexik.positioning.inverted_network import InvertedSettings
from flexik.positioning.registry import Methods, check_methods

Part = Annotated[float, Field(gt=0, lt=1)]

# Coordinates this close are the same, m or rad
SAME = 1e-9
# Places a side of the raster on which an area must have one that is reached
RASTER = 40
# Share of random targets below which too few of those drawn are reached, see planar.targets
LEAST_SHARE = 0.05
# Most samples of a grid
MOST_SAMPLES = 10_000_000
# Largest payload of samples over the machine's own mass: beyond these it is in another unit
LIGHTEST, HEAVIEST = 0.002, 10.0
# Largest payload that is tested, or selected by, over that of the grid
LESS, MORE = 0.002, 2.0


class Selection(Model):
    """Random set that chooses among restarts.

    n_samples : drawn.
    payload : least and largest, kg.
    seed : of the drawing.
    """

    n_samples: Count
    payload: tuple[NotNegative, NotNegative]
    seed: Seed


class Samples(Model):
    """Poses to learn from and to select by; left out are those with the tip behind a limit.

    grid : values of every drive, m or rad, and of the `payload`, kg.
    selection : random set that chooses among restarts.
    minimum_tip_x : m; samples with the tip behind it are left out; not given: there is no limit.
    maximum_failed_share : of samples without equilibrium; more fails the stage.
    """

    grid: dict[Name, Axis]
    selection: Selection
    minimum_tip_x: float | None = None
    maximum_failed_share: Share = 0.01


class OwnSamples(Model):
    """Samples of a file in place of a model's, see planar.own_samples.

    file : CSV or Parquet, found from the folder of the project; a column for the coordinate of
        each drive (DRIVE_stroke or DRIVE_angle), payload, tip_x and tip_y, with a unit in its
        header, `boom_stroke (mm)`.
    columns : headers of the file, by the name of the column that they stand for.
    selection_share, held_out_share : of the poses, drawn at random; the others are learnt from.
    seed : of the division.
    """

    file: str
    columns: Annotated[dict[Name, str], Field(default_factory=dict)]
    selection_share: Part = 0.2
    held_out_share: Part = 0.2
    seed: Seed = 0

    @model_validator(mode="after")
    def _leaves_some(self) -> Self:
        if self.selection_share + self.held_out_share >= 1.0:
            raise ValueError("held_out_share: leaves nothing to learn from")
        return self


def _which(given: Any) -> str:
    keys = given if isinstance(given, dict) else getattr(type(given), "model_fields", ())
    return "of_a_file" if "file" in keys else "of_a_model"


AnySamples = Annotated[
    Annotated[Samples, Tag("of_a_model")] | Annotated[OwnSamples, Tag("of_a_file")],
    Discriminator(_which),
]


class PlanarSection(CaseSection):
    """A planar flexible machine."""

    calibration: Calibration = Calibration()  # type: ignore[assignment]

    machine: PlanarMachine
    samples: Samples
    networks: Annotated[dict[Name, AnyNetwork], Field(min_length=1)]
    conditions: dict[Name, ConditionSet]
    methods: Methods

    @property
    def manipulator(self) -> Manipulator:
        """Rigid kinematics."""
        return manipulator_of(self.machine)

    @property
    def largest_payload(self) -> float:
        """Of the grid that networks learn from, kg; zero where there is none."""
        return self.samples.grid["payload"].maximum if isinstance(self.samples, Samples) else 0.0

    @property
    def files(self) -> list[Path]:
        """Section tables, and samples and campaigns of the user's own."""
        own = [self.samples.file] if isinstance(self.samples, OwnSamples) else []
        own += [self.calibration.campaign] if self.calibration.campaign else []
        own += (
            [self.measured.campaign.file] if self.measured and self.measured.campaign.file else []
        )
        return [Path(file) for file in (*self.machine.section_files.values(), *own)]

    def file_of(self, name: str) -> Path:
        """File of the trained network `name`."""
        extension = "skops" if isinstance(self.networks[name], Regressor) else "json"
        return self.data / f"networks/{name}.{extension}"

    def has_restarts(self, name: str) -> bool:
        """Whether network `name` comes from several starts, of which a file keeps all."""
        return not isinstance(self.networks[name], Regressor)

    def load_of(self, name: str) -> Callable[[Path], Any]:
        """The function that reads such files: networks and their records."""
        network = self.networks[name]
        if isinstance(network, TorchModule):
            return load_modules
        return load_regressor if isinstance(network, Regressor) else load_networks

    @property
    def measured(self) -> Measured | None:
        """Studies of a measured machine, if there are some."""
        return None

    @property
    def calibration_points(self) -> Points | None:
        """Conditions of the mean error that is fitted, if one is."""
        found = self.calibration.conditions
        if not isinstance(found, str):
            return found
        named = self.conditions.get(found)
        if not isinstance(named, Points):
            raise ValueError(f"calibration.conditions: there are no points {found!r}")
        return named

    def base_of(self, name: str) -> dict[str, Any]:
        """Settings of the beam theory whose remainder network `name` learns, if it does."""
        network = self.networks[name]
        if network.learns != "remainder":
            return {}
        # told here, where code is not counted: that of a theory concerns no other network
        return {"theory": theory, "n_passes": network.n_passes}

    @model_validator(mode="after")
    def _fits_its_machine(self) -> Self:
        self._check_grid()
        self.calibration.check_keys(self.machine)
        self.calibration_points  # noqa: B018  a wrong name shows at once
        if self.measured is not None:
            self.measured.check_methods(self.methods)
        check_networks(self.networks, self.trainers)
        for name, network in self.networks.items():
            if network.corrects and self.networks[network.corrects].learns != "rigid_tip":
                raise ValueError(f"networks.{name}.corrects: expected a network of the rigid_tip")
            if isinstance(network, PlanarNetwork) and len(network.layers) != 1:
                raise ValueError(f"networks.{name}.n_hidden: expected one layer")
        check_methods(self.methods, self.networks)
        for name, method in self.methods.items():
            asked = self.networks.get(method.network or "")
            if isinstance(method, InvertedSettings) and not isinstance(asked, PlanarNetwork):
                raise ValueError(f"methods.{name}.network: expected one of n_hidden units")
            if isinstance(method, BeamNetwork):
                learnt = self.networks[method.network or ""].n_passes
                if method.n_passes != learnt:
                    raise ValueError(
                        f"methods.{name}.n_passes: {method.network!r} learns what {learnt} leave, "
                        f"got {method.n_passes}"
                    )
        if "none" not in self.methods and isinstance(self.samples, Samples):
            raise ValueError("methods.none: expected, the others are compared with it")
        if taken := self.conditions.keys() & type(self.samples).model_fields.keys():
            raise ValueError(f"conditions.{min(taken)}: the name is taken")
        return self

    def _check_grid(self) -> None:
        if not isinstance(self.samples, Samples):
            return
        drives, grid = self.machine.drives, self.samples.grid
        if missing := [name for name in (*drives, "payload") if name not in grid]:
            raise ValueError(f"samples.grid.{missing[0]}: this key is missing")
        n_samples = 1
        for name, axis in grid.items():
            n_samples *= axis.n_values
            if name not in (*drives, "payload"):
                known = ", ".join([*drives, "payload"])
                raise ValueError(f"samples.grid.{name}: unknown, expected one of {known}")
            low, high = drives[name].limits if name in drives else (0.0, np.inf)
            key = f"samples.grid.{name}"
            if axis.minimum < low - SAME:
                raise ValueError(f"{key}.minimum: expected {low:g} or more, got {axis.minimum:g}")
            if axis.maximum > high + SAME:
                raise ValueError(f"{key}.maximum: expected {high:g} or less, got {axis.maximum:g}")
        if n_samples > MOST_SAMPLES:
            raise ValueError(
                f"samples.grid: expected {MOST_SAMPLES} samples or fewer, got {n_samples}"
            )


def check(section: PlanarSection) -> None:
    """The machine is one, targets are reached, campaigns of the user's own can be read.

    Raises ParameterError naming the key, or DataError naming file and line.
    """
    try:
        check_machine(section.machine)
    except ValueError as error:
        raise ParameterError(f"{section.machine_file}: {error}") from None
    _check_learners(section)
    if isinstance(section.samples, Samples):
        _check_payloads(section)
    sets: dict[str, Any] = {
        f"conditions.{name}": given for name, given in section.conditions.items()
    }
    if isinstance(section.calibration.conditions, Points):
        sets["calibration.conditions"] = section.calibration.conditions
    if (measured := section.measured) is not None:
        sets["studies.measured.campaign"] = measured.campaign
        sets["studies.measured.adaptation"] = measured.adaptation
    for file in (section.calibration.campaign, measured and measured.campaign.file):
        if file:
            own_campaign(file, section.machine)
    for key, given in sets.items():
        if isinstance(given, Points):
            points = np.array(given.points)
            missed = np.flatnonzero(~_reached(section, points))
            if missed.size:
                x, y = points[missed[0]]
                more = f", nor {missed.size - 1} others" if missed.size > 1 else ""
                raise ParameterError(
                    f"params.yaml: {section.name}.{key}.points.{missed[0]}: the rigid machine does "
                    f"not reach ({x:g}, {y:g}) m{more}"
                )
        elif (share := share_reached(section, given)) < LEAST_SHARE:
            raise ParameterError(
                f"params.yaml: {section.name}.{key}: the machine reaches {share:.1%} of x, y, "
                f"expected {LEAST_SHARE:.0%} or more"
            )


def _check_learners(section: PlanarSection) -> None:
    for name, network in section.networks.items():
        try:
            if isinstance(network, Regressor):
                estimator(network.regressor)
            elif isinstance(network, TorchModule):
                code_of(network.module)
        except TrainingError as error:
            raise ParameterError(f"params.yaml: {section.name}.networks.{name}: {error}") from None


def share_reached(section: PlanarSection, area: Any) -> float:
    """Share of the area `x`, `y` of random targets that the rigid machine reaches."""
    return float(_reached(section, _raster(section, area.x, area.y)).mean())


def payload_fault(largest: float, machine: PlanarMachine) -> str | None:
    """What is wrong with the `largest` payload in kg of samples of `machine`, if anything."""
    mass = sum(mass for _, _, mass in machine.masses().values())
    if largest > HEAVIEST * mass:
        other = f"{largest:g} g would be {largest / 1e3:g}"
        return (
            f"expected kg, {largest:g} is {largest / mass:.3g} times the machine's mass ({other})"
        )
    if 0 < largest < LIGHTEST * mass:
        other = f"{largest:g} t would be {1e3 * largest:g}"
        return f"expected kg, {largest:g} is nothing to a machine of {mass:.4g} ({other})"
    return None


def _check_payloads(section: PlanarSection) -> None:
    """Raise ParameterError where payloads are in another unit, or far from those of the grid."""
    of_grid = section.samples.grid["payload"].maximum
    tested = {"samples.selection.payload": max(section.samples.selection.payload)}
    for name, given in section.conditions.items():
        key = "payloads" if isinstance(given, Points) else "payload"
        tested[f"conditions.{name}.{key}"] = max(getattr(given, key))
    for key, largest in {"samples.grid.payload.maximum": of_grid, **tested}.items():
        fault = payload_fault(largest, section.machine)
        if fault is None and (largest > MORE * of_grid or 0 < largest < LESS * of_grid):
            fault = f"up to {largest:g} kg, expected about the grid's, up to {of_grid:g} kg"
        if fault:
            raise ParameterError(f"params.yaml: {section.name}.{key}: {fault}")


def _reached(section: PlanarSection, points: np.ndarray) -> np.ndarray:
    manipulator = section.manipulator
    middle = np.tile((manipulator.lower + manipulator.upper) / 2, (len(points), 1))
    return manipulator.inverse(points, middle).reached


def _raster(section: PlanarSection, x: tuple[float, float], y: tuple[float, float]) -> np.ndarray:
    axes = np.meshgrid(*(np.linspace(*limits, RASTER) for limits in (x, y)))
    points = np.column_stack([axis.ravel() for axis in axes])
    least = section.samples.minimum_tip_x
    return points if least is None else points[points[:, 0] >= least]
