"""Errors of every method at the random targets, by the chosen network and by its other starts."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts.arm import FlexibleArm, equilibria, flexible_arm
from flexik.cases.elastic_arm.parts.gauge_method import GaugeNetwork
from flexik.cases.elastic_arm.parts.kinds import KINDS
from flexik.cases.elastic_arm.parts.readings import FIELDS, QUERY
from flexik.cases.elastic_arm.parts.trained import RESTART, Trained, files_of, restarts
from flexik.cases.elastic_arm.section import Gauge, Machine, Network, Section
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import Field, read_table
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import TIP_ERRORS, evaluate, fields_of, tip_judge
from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.positioning import registry
from flexik.positioning.method import Array, Columns, Ingredients, Method, Settings

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
    settings["build"] = None if isinstance(method, Gauge) else registry.build_of(method)
    return {"settings": settings, "inputs": inputs}


def prepare(
    *,
    machine: Machine,
    method: Settings,
    build: registry.Build | None,
    targets: Path,
    network: Network | None = None,
    files: Mapping[str, Path] | None = None,
    shown: Path | None = None,
) -> Work:
    """A method with the network of every start; the table is of the chosen one."""
    query = read_table(targets)[[field.name for field in QUERY]].to_numpy()
    # from the stretched arm: only what no method solves would stay there
    conditions = Conditions(query, np.zeros((len(query), 2)), np.arange(len(query)))
    deformation = read_table(shown)[list(DEFORMATION)].to_numpy() if shown else None
    found: list[Trained | None] = [None]
    if network is not None and files is not None:
        found = list(restarts(method.network or "", network, files))
    function = functools.partial(errors, machine, method, build, conditions, deformation)
    return Work(function, found, functools.partial(written, columns(flexible_arm(machine)), found))


def errors(
    machine: Machine,
    settings: Settings,
    build: registry.Build | None,
    conditions: Conditions,
    deformation: Array | None,
    trained: Trained | None,
    told_too_much: float = 0.0,
) -> dict[str, NDArray]:
    """Long table of a method whose network is `trained`; payloads are told kg too much."""
    arm = flexible_arm(machine)
    method: Method
    if build is not None:
        method = build(
            settings,
            Ingredients(arm.geometry, trained.network if trained else None, machine=machine),
        )
    else:
        assert trained is not None and deformation is not None  # the section sees to it
        inputs = KINDS[trained.settings.learns].inputs
        method = GaugeNetwork(arm.geometry, trained.network, inputs, deformation)
    rows = conditions[: settings.n_targets]
    told = replace(rows, query=rows.query + np.array([0.0, 0.0, told_too_much]))
    judge = tip_judge(lambda angles, _: equilibria(arm, angles, rows.query[:, 2]).tip)
    return evaluate(method, told, judge, columns(arm))


def columns(arm: FlexibleArm) -> Columns:
    """Columns of the long table."""
    lower, upper = (tuple(limits.tolist()) for limits in (arm.geometry.lower, arm.geometry.upper))
    return Columns(QUERY, FIELDS[:2], TIP_ERRORS, lower, upper)


def written(
    columns: Columns, trained: Sequence[Trained | None], results: Sequence[Mapping[str, NDArray]]
) -> dict[str, Writer]:
    """Table of the chosen start, and mean and largest errors of all."""
    pairs = list(zip(trained, results, strict=True))
    kept = next(found for network, found in pairs if network is None or network.is_chosen)
    writers = {".parquet": table(kept, fields_of(kept, columns))}
    rows = [
        network.row
        | {
            "mean_error": found["error"].mean(keepdims=True),
            "max_error": found["error"].max(keepdims=True),
        }
        for network, found in pairs
        if network is not None
    ]
    if rows:
        writers[".restarts.parquet"] = table(stacked(rows, RESTART_FIELDS), RESTART_FIELDS)
    return writers
