"""Errors of every method at the random targets, by the chosen network and by its other starts."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts.arm import flexible_arm
from flexik.cases.elastic_arm.parts.gauge_method import GaugeNetwork
from flexik.cases.elastic_arm.parts.kinds import KINDS
from flexik.cases.elastic_arm.parts.readings import FIELDS
from flexik.cases.elastic_arm.parts.trained import RESTART, Trained, files_of, restarts
from flexik.cases.elastic_arm.section import Gauge, Machine, Network, Section
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import Field, read_table
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import TIP_ERRORS, evaluate, fields_of, tip_judge
from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.multibody.elastic_arm import FlexibleArm, equilibria
from flexik.positioning import registry
from flexik.positioning.method import Array, Columns, Ingredients, Method, Settings

QUERY = (
    Field("target_x", "m", "target, forward"),
    Field("target_y", "m", "target, upward"),
    Field("payload", "kg", "point mass at the tip"),
)
RESTART_FIELDS = (
    *RESTART,
    Field("mean_error", "m", "over all conditions"),
    Field("max_error", "m", "over all conditions"),
)


def parts(section: Section) -> list[Part]:
    """A table of errors for every method and set of conditions; `.restarts.parquet` by start."""
    return [
        Part(f"{conditions}/{label}", prepare, **described(section, conditions, label))
        for conditions in section.conditions
        for label in section.methods
    ]


def described(section: Section, conditions: str, label: str) -> dict[str, dict[str, Any]]:
    """Settings and inputs of a method on a set of conditions."""
    method, samples = section.methods[label], section.data / "samples"
    settings: dict[str, Any] = {"machine": section.machine, "method": method}
    inputs: dict[str, Any] = {"targets": samples / f"{conditions}.parquet"}
    if method.network is not None:
        network = section.networks[method.network]
        settings["network"], inputs["files"] = network, files_of(section, method.network)
        if network.has_gauges:
            inputs["shown"] = samples / f"{conditions}.{network.readings}.parquet"
    settings["build"] = gauge_method if isinstance(method, Gauge) else registry.build_of(method)
    return {"settings": settings, "inputs": inputs}


def prepare(
    *,
    machine: Machine,
    method: Settings,
    build: Callable[..., Method],
    targets: Path,
    network: Network | None = None,
    files: Mapping[str, Path] | None = None,
    shown: Path | None = None,
) -> Work:
    """A method with the network of every start; the table is of the chosen one."""
    conditions = conditions_of(targets)
    deformation = read_table(shown)[list(DEFORMATION)].to_numpy() if shown else None
    found: list[Trained | None] = [None]
    if network is not None and files is not None:
        found = list(restarts(method.network or "", network, files))
    function = functools.partial(errors, machine, method, build, conditions, deformation)
    return Work(function, found, functools.partial(written, columns(flexible_arm(machine)), found))


def errors(
    machine: Machine,
    settings: Settings,
    build: Callable[..., Method],
    conditions: Conditions,
    deformation: Array | None,
    trained: Trained | None,
    told_too_much: float = 0.0,
) -> dict[str, NDArray]:
    """Long table of a method whose network is `trained`; payloads are told kg too much."""
    arm = flexible_arm(machine)
    ingredients = Ingredients(arm.geometry, trained.network if trained else None)
    extra = () if deformation is None or trained is None else (trained.learns, deformation)
    method = build(settings, ingredients, *extra)
    rows = conditions[: settings.n_targets]
    told = replace(rows, query=rows.query + np.array([0.0, 0.0, told_too_much]))
    judge = tip_judge(lambda angles, _: equilibria(arm, angles, rows.query[:, 2]).tip)
    return evaluate(method, told, judge, columns(arm))


def gauge_method(
    settings: Settings, ingredients: Ingredients, learns: str, deformation: Array
) -> GaugeNetwork:
    """Method `gauges` that is told `deformation` (n, 6)."""
    assert ingredients.network is not None  # the section sees to it
    return GaugeNetwork(
        ingredients.manipulator, ingredients.network, KINDS[learns].input_names, deformation
    )


def conditions_of(targets: Path) -> Conditions:
    """Targets and payloads, from the stretched arm: only what no method solves would stay there."""
    query = read_table(targets)[[field.name for field in QUERY]].to_numpy()
    return Conditions(query, np.zeros((len(query), 2)), np.arange(len(query)))


def columns(arm: FlexibleArm) -> Columns:
    """Columns of the long table."""
    lower, upper = (tuple(limits.tolist()) for limits in (arm.geometry.lower, arm.geometry.upper))
    return Columns(QUERY, FIELDS[:2], TIP_ERRORS, lower, upper)


def written(
    columns: Columns, trained: Sequence[Trained | None], results: Sequence[Mapping[str, NDArray]]
) -> dict[str, Writer]:
    """Table of the chosen start, and mean and largest errors of all."""
    kept = next(k for k, network in enumerate(trained) if network is None or network.is_chosen)
    fields = fields_of(results[kept], columns)
    writers = {".parquet": table(results[kept], fields)}
    if trained[kept] is not None:
        rows = [
            {
                **network.row,
                "mean_error": np.mean(found["error"], keepdims=True),
                "max_error": np.max(found["error"], keepdims=True),
            }
            for network, found in zip(trained, results, strict=True)
            if network is not None
        ]
        writers[".restarts.parquet"] = table(stacked(rows, RESTART_FIELDS), RESTART_FIELDS)
    return writers
