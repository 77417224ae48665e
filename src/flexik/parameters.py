"""params.yaml as a validated model: a wrong value is one error that names its key.

Every key is required, none has a default: what a stage computes follows from params.yaml alone,
where DVC watches it. The names `size` and `nfiles` are never used: DVC's run cache ignores them.
"""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from flexik.errors import ParameterError
from flexik.files import checksum

PARAMETERS_FILE = "params.yaml"

# Lengths closer than this are the same, m
LENGTH_TOLERANCE = 1e-9

# Prefixes of metrics, a method of its own, and names that DVC's run cache ignores
TAKEN_NAMES = ("none", "grid", "selection", "select", "calibration", "size", "nfiles")

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float]
Interval = tuple[float, float]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys refused, numbers finite and not from text."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=False, allow_inf_nan=False, coerce_numbers_to_str=False
    )

    @model_validator(mode="before")
    @classmethod
    def _no_text_numbers(cls, data: Any) -> Any:
        # YAML 1.1 reads 1e-5 as text, which pydantic would turn into a number behind one's back
        if isinstance(data, dict):
            for key, value in data.items():
                for entry in _entries(value):
                    if isinstance(entry, bool):
                        raise ValueError(f"{key}: expected no truth value, got {entry!r}")
                    if isinstance(entry, str) and _is_number(entry):
                        raise ValueError(
                            f"{key}: {entry!r} is no YAML number (write 1.0e-5, 1.0e+6)"
                        )
        return data


class Parallel(Model):
    """Where the parallel stages compute."""

    n_workers: Annotated[int, Field(ge=0)]
    scheduler: str | None


class Geometry(Model):
    """Rigid kinematics, see mechanisms.crane.CraneGeometry; m."""

    lift_pivot: Vector
    lift_cylinder_base: Vector
    lift_cylinder_head: Vector
    jib_pivot: Vector
    rocker_pivot: Vector
    jib_cylinder_base: Vector
    coupler_pin: Vector
    extension_start: Vector
    lift_cylinder_length: Positive
    jib_cylinder_length: Positive
    rocker_length: Positive
    coupler_length: Positive
    stroke_maximum: tuple[Positive, Positive, Positive]


class BeamModel(Model):
    """One beam, see multibody.structure.Beam."""

    section: str
    span: Interval
    mass: Positive
    centre_of_mass: float
    mass_span: Interval
    mass_offset: float
    n_elements: Count

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.span[0] <= self.mass_span[0] < self.mass_span[1] <= self.span[1]:
            raise ValueError("mass_span: must increase and lie within span")
        if not self.mass_span[0] < self.centre_of_mass < self.mass_span[1]:
            raise ValueError("centre_of_mass: must lie within mass_span")
        return self


class Beams(Model):
    """The four flexible links."""

    pillar: BeamModel
    lift: BeamModel
    jib: BeamModel
    extension: BeamModel


class RodModel(Model):
    """A rigid two-pin link."""

    mass: Positive
    centre_of_mass: NotNegative


class Structure(Model):
    """What bends and weighs, see multibody.crane.CraneStructure."""

    element: Literal["geometrically_exact", "ancf"]
    youngs_modulus: Positive
    gravity: Positive
    lift_axis_height: float
    jib_axis_height: float
    beams: Beams
    rocker: RodModel
    coupler: RodModel


class Calibration(Model):
    """Fit of the ground spring."""

    stiffness_range: tuple[Positive, Positive]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.stiffness_range[0] < self.stiffness_range[1]:
            raise ValueError("stiffness_range: must increase")
        return self


class MeshStudy(Model):
    """Samples and refinements of the mesh study."""

    n_samples: Count
    refinements: Annotated[list[Count], Field(min_length=2)]
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.refinements != sorted(set(self.refinements)):
            raise ValueError("refinements: must increase, the last one being the reference")
        return self


class Illustration(Model):
    """Sample drawn in the picture of the crane: strokes in m, payload in kg."""

    strokes: tuple[NotNegative, NotNegative, NotNegative]
    payload: NotNegative
    exaggeration: Positive


class Axis(Model):
    """Evenly spaced values from minimum to maximum."""

    minimum: NotNegative
    maximum: NotNegative
    increment: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        steps = (self.maximum - self.minimum) / self.increment
        if self.maximum < self.minimum or abs(steps - round(steps)) > 1e-6:
            raise ValueError("increment: maximum - minimum must be a whole number of increments")
        return self


class Grid(Model):
    """Training grid, table 4.1."""

    lift: Axis
    jib: Axis
    extension: Axis
    payload: Axis
    minimum_tip_x: float
    maximum_failed_share: Share


class Selection(Model):
    """Random set that chooses among restarts."""

    n_samples: Count
    payload: tuple[NotNegative, NotNegative]
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.payload[0] < self.payload[1]:
            raise ValueError("payload: must increase")
        return self


class Stopping(Model):
    """When any trainer stops, see learning.stopping."""

    n_iterations: Count
    goal: NotNegative
    minimum_gradient: NotNegative
    minimum_progress: Annotated[float, Field(ge=0, lt=1)]
    progress_window: Count
    maximum_seconds: Positive | None
    selection_patience: Count | None


class Damped(Stopping):
    """What both schedules of Levenberg-Marquardt share."""

    mu: Positive
    mu_maximum: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.mu > self.mu_maximum:
            raise ValueError("mu: must not exceed mu_maximum")
        return self


class LevenbergMarquardt(Damped):
    """The published schedule, see learning.levenberg_marquardt."""

    kind: Literal["levenberg_marquardt"]
    mu_decrease: Annotated[float, Field(gt=0, lt=1)]
    mu_increase: Annotated[float, Field(gt=1)]


class LevenbergMarquardtAccelerated(Damped):
    """See learning.accelerated."""

    kind: Literal["levenberg_marquardt_accelerated"]
    acceleration: NotNegative


class BackPropagation(Stopping):
    """See learning.back_propagation."""

    kind: Literal["back_propagation"]
    mode: Literal["pattern", "batch"]
    learning_rate: Positive
    momentum: Annotated[float, Field(ge=0, lt=1)]
    rate_increase: Annotated[float, Field(ge=1)]
    rate_decrease: Annotated[float, Field(gt=0, lt=1)]
    error_increase: Annotated[float, Field(ge=1)]
    minimum_rate: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum_rate > self.learning_rate:
            raise ValueError("minimum_rate: must not exceed learning_rate")
        return self


class Adam(Stopping):
    """See learning.adam."""

    kind: Literal["adam"]
    learning_rate: Positive
    beta_1: Annotated[float, Field(ge=0, lt=1)]
    beta_2: Annotated[float, Field(ge=0, lt=1)]
    batch_size: Count | None


class Lbfgs(Stopping):
    """See learning.lbfgs."""

    kind: Literal["lbfgs"]
    memory: Count


TRAINER_KINDS = (
    "levenberg_marquardt",
    "levenberg_marquardt_accelerated",
    "back_propagation",
    "adam",
    "lbfgs",
)
Trainer = Annotated[
    LevenbergMarquardt | LevenbergMarquardtAccelerated | BackPropagation | Adam | Lbfgs,
    Field(discriminator="kind"),
]


class NetworkModel(Model):
    """What a network learns, how large it is, how it is trained."""

    kind: Literal["deflection"]
    n_hidden: Count
    activation: Literal["tanh", "logistic"]
    n_restarts: Count
    seed: Seed
    trainer: Trainer


class Sizes(Axis):
    """Numbers of hidden neurons."""

    minimum: Count
    maximum: Count
    increment: Count


class Select(Model):
    """Study of sizes, see learning.size_selection."""

    n_hidden: Sizes
    n_restarts: Count
    tolerance: NotNegative
    trainer: Trainer


class SelectedNetwork(Model):
    """A network whose size the selection error chooses."""

    kind: Literal["deflection"]
    select: Select
    activation: Literal["tanh", "logistic"]
    n_restarts: Count
    seed: Seed
    trainer: Trainer


class Evaluation(Model):
    """Test conditions: every point with every payload."""

    points: Annotated[list[Vector], Field(min_length=1)]
    payloads: Annotated[list[NotNegative], Field(min_length=1)]


class Genetic(Model):
    """Genetic rigid inverse, see positioning.genetic."""

    n_individuals: Annotated[int, Field(ge=2)]
    n_current: Annotated[int, Field(ge=0)]
    tolerance: Positive
    n_generations: Count
    seed: Seed

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.n_current > self.n_individuals:
            raise ValueError("n_current: must not exceed n_individuals")
        return self


class MethodModel(Model):
    """A positioning method and what it is built from."""

    method: Literal["combined"]
    network: Name
    inverse: Literal["closed_form", "genetic"]
    genetic: Genetic | None
    n_corrections: Count

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.inverse == "genetic") != (self.genetic is not None):
            raise ValueError("genetic: settings where inverse is genetic, null where it is not")
        return self


class Crane(Model):
    """The log crane."""

    geometry: Geometry
    structure: Structure
    calibration: Calibration
    mesh_study: MeshStudy
    illustration: Illustration
    grid: Grid
    selection: Selection
    networks: Annotated[dict[Name, NetworkModel], Field(min_length=1)]
    selected_networks: dict[Name, SelectedNetwork]
    evaluation: Evaluation
    methods: dict[Name, MethodModel]

    def any_network(self, name: str) -> NetworkModel | SelectedNetwork | None:
        """Network `name`, of given or of selected size; None if there is none."""
        return self.networks.get(name) or self.selected_networks.get(name)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_lengths()
        self._check_strokes()
        self._check_names()
        return self

    def _check_lengths(self) -> None:
        """What the geometry and the beams both say must agree."""
        geometry, beams = self.geometry, self.structure.beams
        expected = {
            "pillar.span.1": (beams.pillar.span[1], geometry.lift_pivot[1], "lift_pivot"),
            "lift.span.0": (beams.lift.span[0], 0.0, "the lift pivot"),
            "lift.span.1": (beams.lift.span[1], geometry.jib_pivot[0], "jib_pivot"),
            "extension.span.0": (beams.extension.span[0], 0.0, "its rear end"),
        }
        for key, (found, value, why) in expected.items():
            if abs(found - value) > LENGTH_TOLERANCE:
                raise ValueError(f"structure.beams.{key}: expected {value:g} m ({why})")
        tip = geometry.coupler_pin[0] + geometry.extension_start[0] + geometry.stroke_maximum[2]
        rear_pad = tip - beams.extension.span[1]
        if rear_pad >= beams.jib.span[1]:
            raise ValueError(
                f"geometry.stroke_maximum.2: the rear pad, at {rear_pad:g} m, would leave the jib"
            )
        lengths = {"rocker": geometry.rocker_length, "coupler": geometry.coupler_length}
        for name, length in lengths.items():
            if getattr(self.structure, name).centre_of_mass > length:
                raise ValueError(f"structure.{name}.centre_of_mass: beyond its length, {length} m")

    def _check_strokes(self) -> None:
        reach = dict(zip(("lift", "jib", "extension"), self.geometry.stroke_maximum, strict=True))
        for name, longest in reach.items():
            if getattr(self.grid, name).maximum > longest + LENGTH_TOLERANCE:
                raise ValueError(f"grid.{name}.maximum: lies beyond the cylinder, {longest} m")
        for stroke, (name, longest) in zip(self.illustration.strokes, reach.items(), strict=True):
            if stroke > longest:
                raise ValueError(f"illustration.strokes: {name} beyond the cylinder, {longest} m")

    def _check_names(self) -> None:
        for section in ("networks", "selected_networks", "methods"):
            for label in getattr(self, section):
                if label in TAKEN_NAMES:
                    raise ValueError(f"{section}.{label}: the name is taken")
        for label in self.selected_networks:
            if label in self.networks:
                raise ValueError(f"selected_networks.{label}: there is such a name under networks")
        for label, method in self.methods.items():
            if self.any_network(method.network) is None:
                known = ", ".join([*self.networks, *self.selected_networks])
                raise ValueError(
                    f"methods.{label}.network: there is no network {method.network!r} ({known})"
                )
        for name in ("points", "payloads"):
            values = getattr(self.evaluation, name)
            for number, value in enumerate(values):
                if value in values[:number]:
                    raise ValueError(f"evaluation.{name}.{number}: {value} is there twice")


class Parameters(Model):
    """The whole of params.yaml."""

    parallel: Parallel
    crane: Crane


def load_parameters(path: Path | str = PARAMETERS_FILE) -> Parameters:
    """Read and validate `path`.

    Raises ParameterError, one line a wrong key, if the file is missing, no YAML, or a value is
    unknown, missing or out of range.
    """
    return validate(read_yaml(path), str(path))


def read_yaml(path: Path | str) -> dict[str, Any]:
    """Mapping in the YAML file `path`; raises ParameterError if it is none or doubles a key."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise ParameterError(f"{path}: expected text in UTF-8 ({error.reason})") from None
    try:
        data = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        detail = " ".join(str(error).split())
        raise ParameterError(f"{path}: no valid YAML: {detail}") from None
    if not isinstance(data, dict):
        raise ParameterError(f"{path}: expected a mapping of keys to values")
    return data


def validate(data: dict[str, Any], source: str = PARAMETERS_FILE) -> Parameters:
    """`data` as Parameters; raises ParameterError naming `source` and the wrong keys."""
    try:
        return Parameters.model_validate(data)
    except ValidationError as error:
        lines = []
        for detail in error.errors():
            parts = [str(part) for part in detail["loc"]]
            # the tag of a trainer's kind is no key
            parts = [
                part
                for part, before in zip(parts, ["", *parts], strict=False)
                if before != "trainer" or part not in TRAINER_KINDS
            ]
            key = ".".join(parts) or "top level"
            message = detail["msg"].removeprefix("Value error, ")
            if detail["type"] == "value_error":  # our own: "key within the section: what is wrong"
                within, _, message = message.partition(": ")
                key = f"{key}.{within}"
            given = detail["input"]
            shown = f", got {given!r}" if not isinstance(given, dict | list | BaseModel) else ""
            lines.append(f"{source}: {key}: {message}{shown}")
        raise ParameterError("\n".join(lines)) from None


def overlay(base: dict[str, Any], changes: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """`base` with the keys of `changes` replaced, mapping by mapping.

    Raises ParameterError for a key that `base` does not have.
    """
    result = dict(base)
    for key, value in changes.items():
        if key not in base:
            raise ParameterError(f"profile: {prefix}{key} is no key of {PARAMETERS_FILE}")
        nested = isinstance(value, dict) and isinstance(base[key], dict)
        result[key] = overlay(base[key], value, f"{prefix}{key}.") if nested else value
    return result


def parameters_checksum(sections: Iterable[BaseModel]) -> str:
    """SHA-256 of the values of `sections`, the same for equal values."""
    return checksum(*(json.dumps(s.model_dump(mode="json"), sort_keys=True) for s in sections))


class _UniqueKeyLoader(yaml.SafeLoader):
    """Refuses a key that stands twice in a mapping."""


def _unique_mapping(loader: _UniqueKeyLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    keys = [loader.construct_object(key) for key, _ in node.value]
    for key in keys:
        if keys.count(key) > 1:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} stands twice", node.start_mark
            )
    return loader.construct_mapping(node, deep=True)


_UniqueKeyLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)


def _entries(value: Any) -> Iterator[Any]:
    """`value`, or the entries of lists however deep."""
    if isinstance(value, list):
        for entry in value:
            yield from _entries(entry)
    else:
        yield value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
