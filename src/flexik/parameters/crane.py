"""The section `crane` of params.yaml."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from flexik.parameters.data import Evaluation, Grid, Selection, Workspace
from flexik.parameters.measured import Measured
from flexik.parameters.methods import (
    NETWORK_KIND,
    CombinedModel,
    InvertedModel,
    MethodModel,
    ToleranceStudy,
)
from flexik.parameters.model import Model, Name
from flexik.parameters.networks import (
    AnyNetwork,
    Fitting,
    ModularNetwork,
    NetworkModel,
    SelectedModularNetwork,
    SelectedNetwork,
)
from flexik.parameters.structure import Calibration, Geometry, Illustration, MeshStudy, Structure
from flexik.parameters.trainers import Trainer

# Lengths closer than this are the same, m
LENGTH_TOLERANCE = 1e-9

# Prefixes of metrics, a method of its own, and names that DVC's run cache ignores
TAKEN_NAMES = (
    *("none", "grid", "selection", "select", "workspace", "calibration"),
    *("measured", "adapted", "misjudged"),
    *("trainers", "methods", "inversion", "size", "nfiles"),
)
NETWORK_SECTIONS = (
    *("networks", "modular_networks"),
    *("selected_networks", "selected_modular_networks"),
)


class Crane(Model):
    """The log crane."""

    geometry: Geometry
    structure: Structure
    calibration: Calibration
    mesh_study: MeshStudy
    illustration: Illustration
    grid: Grid
    selection: Selection
    trainers: dict[Name, Trainer]
    networks: Annotated[dict[Name, NetworkModel], Field(min_length=1)]
    modular_networks: dict[Name, ModularNetwork]
    selected_networks: dict[Name, SelectedNetwork]
    selected_modular_networks: dict[Name, SelectedModularNetwork]
    fitting: Fitting
    evaluation: Evaluation
    workspace: Workspace
    methods: dict[Name, MethodModel]
    tolerance_study: ToleranceStudy
    measured: Measured

    @property
    def all_networks(self) -> dict[str, AnyNetwork]:
        """Networks of all four sections by name."""
        sections = (getattr(self, section) for section in NETWORK_SECTIONS)
        return {name: network for section in sections for name, network in section.items()}

    @property
    def studies(self) -> dict[str, SelectedNetwork | SelectedModularNetwork]:
        """Networks of selected size by name."""
        return {**self.selected_networks, **self.selected_modular_networks}

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_lengths()
        self._check_strokes()
        self._check_fitting()
        self._check_names()
        self._check_networks()
        self._check_methods()
        self._check_evaluation()
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

    def _check_fitting(self) -> None:
        for name in ("jib", "extension", "payload"):
            axis, value = getattr(self.grid, name), getattr(self.fitting, name)
            steps = (value - axis.minimum) / axis.increment
            if not axis.minimum <= value <= axis.maximum or abs(steps - round(steps)) > 1e-6:
                raise ValueError(f"fitting.{name}: {value} is no value of grid.{name}")

        shape = (getattr(self.grid, name) for name in ("lift", "jib", "extension", "payload"))
        n_vectors = math.prod(1 + round((a.maximum - a.minimum) / a.increment) for a in shape)
        if self.fitting.n_samples > n_vectors:
            raise ValueError(f"fitting.n_samples: the grid has {n_vectors} vectors")

    def _check_names(self) -> None:
        known: dict[str, str] = {}
        for section in (*NETWORK_SECTIONS, "trainers", "methods"):
            for label in getattr(self, section):
                if label in TAKEN_NAMES:
                    raise ValueError(f"{section}.{label}: the name is taken")
                if section in NETWORK_SECTIONS and label in known:
                    raise ValueError(f"{section}.{label}: stands under {known[label]} too")
                known.setdefault(label, section)

    def _check_networks(self) -> None:
        trainers = {name: network.trainer for name, network in self.all_networks.items()}
        for name, study in self.studies.items():
            trainers[f"{name}.select"] = study.select.trainer
        keys = {self._section(name): trainer for name, trainer in trainers.items()}
        for key, trainer in {**keys, "fitting": self.fitting.trainer}.items():
            if trainer not in self.trainers:
                raise ValueError(
                    f"{key}.trainer: there is no trainer {trainer!r} ({', '.join(self.trainers)})"
                )
        # a modular network is trained after the network it corrects
        correctable: dict[str, NetworkModel | SelectedNetwork] = {
            **self.networks,
            **self.selected_networks,
        }
        known = [name for name, network in correctable.items() if network.kind == "rigid"]
        for section in (self.modular_networks, self.selected_modular_networks):
            for name, network in section.items():
                if network.rigid not in known:
                    raise ValueError(
                        f"{self._section(name)}.rigid: {network.rigid!r} is no network of kind "
                        f"rigid ({', '.join(known) or 'there is none'})"
                    )

    def _section(self, name: str) -> str:
        """Key of a network."""
        label = name.partition(".")[0]
        section = next(s for s in NETWORK_SECTIONS if label in getattr(self, s))
        return f"{section}.{name}"

    def _check_methods(self) -> None:
        networks = self.all_networks
        for label, method in self.methods.items():
            if method.network not in networks:
                raise ValueError(
                    f"methods.{label}.network: there is no network {method.network!r} "
                    f"({', '.join(networks)})"
                )
            needed = NETWORK_KIND[method.method]
            if networks[method.network].kind != needed:
                raise ValueError(
                    f"methods.{label}.network: {method.network!r} is of kind "
                    f"{networks[method.network].kind}, {method.method} needs {needed}"
                )
            if method.n_workspace_targets > self.workspace.n_targets:
                raise ValueError(
                    f"methods.{label}.n_workspace_targets: there are {self.workspace.n_targets} "
                    "(workspace.n_targets)"
                )
        for number, label in enumerate(self.tolerance_study.methods):
            if not isinstance(self.methods.get(label), InvertedModel):
                known = [name for name, m in self.methods.items() if isinstance(m, InvertedModel)]
                raise ValueError(
                    f"tolerance_study.methods.{number}: {label!r} is no method that inverts a "
                    f"network ({', '.join(known) or 'there is none'})"
                )

        corrections = {
            "measured.method": self.measured.method,
            "measured.adaptation.method": self.measured.adaptation.method,
        }
        for key, label in corrections.items():
            if not isinstance(self.methods.get(label), CombinedModel):
                known = [name for name, m in self.methods.items() if isinstance(m, CombinedModel)]
                raise ValueError(
                    f"{key}: {label!r} is no method of kind combined "
                    f"({', '.join(known) or 'there is none'})"
                )

    def _check_evaluation(self) -> None:
        lists = {
            f"{section}.{name}": getattr(getattr(self, section), name)
            for section, names in (
                ("evaluation", ("points", "payloads")),
                ("tolerance_study", ("methods", "tolerances")),
                ("measured", ("points", "payloads")),
            )
            for name in names
        }
        for name, values in lists.items():
            for number, value in enumerate(values):
                if value in values[:number]:
                    raise ValueError(f"{name}.{number}: {value} is there twice")
