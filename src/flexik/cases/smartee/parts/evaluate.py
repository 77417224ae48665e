"""Errors of the direct kinematics of the SmartEE, and their spread over restarts of a training."""

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.smartee.parts.errors import COLUMNS, conditions_of, judge_of
from flexik.cases.smartee.parts.methods import method, network_file
from flexik.cases.smartee.parts.poses import (
    ACTUATED_FIELDS,
    POSE_FIELDS,
    centre_elbows,
    extent_of,
    geometry_of,
    values,
)
from flexik.cases.smartee.section import (
    CORNERS,
    RANDOM,
    RESTARTS,
    VALIDATION,
    Box,
    Machine,
    Method,
    Section,
)
from flexik.datasets.parts import Part, Work, Writer, rows, stacked, table, whole
from flexik.datasets.tables import Field, read_table
from flexik.evaluation.errors import evaluate, fields_of
from flexik.learning.perceptron import Network
from flexik.learning.storage import load_restarts

N_STEPS = Field("n_steps", "1", "Newton steps at most", "int64")
EXTENT = Field("extent", "1", "largest coordinate of the pose, in half extents of the box")
# Largest errors of the network of every restart
RESTART_FIELDS = (
    Field("restart", "1", "number of the start, from 0", "int64"),
    Field("conditions", "1", "name of the set of poses", "string"),
    *(Field(f.name, f.unit, f"largest {f.description}") for f in COLUMNS.errors),
)


def parts(section: Section) -> list[Part]:
    """Parts CONDITIONS/METHOD, and restarts/NETWORK."""
    shared = {"machine": section.machine, "box": section.samples.box}
    found, data = [], section.data
    for name, settings in section.methods.items():
        file = network_file(section, settings)
        network = {} if file is None else {"network": file}
        for conditions in settings.conditions or section.conditions:
            inputs = {"rows": data / f"samples/{conditions}.parquet", **network}
            given = {**shared, "settings": settings}
            found.append(Part(f"{conditions}/{name}", prepare_errors, given, inputs))
    poses = {name: data / f"samples/{name}.parquet" for name in (VALIDATION, RANDOM, CORNERS)}
    for name in section.networks:
        files = {"restarts": data / f"networks/{name}.restarts.json", "poses": poses}
        found.append(
            Part(f"{RESTARTS}/{name}", prepare_restarts, {"machine": section.machine}, files)
        )
    return found


def prepare_errors(**settings: Any) -> Work:
    """Errors of a method, by each of its numbers of steps, on a set of conditions."""
    return whole(judged, **settings)


def judged(
    machine: Machine, box: Box, settings: Method, rows: Path, network: Path | None = None
) -> dict[str, Writer]:
    """Table of errors, a row a number of steps and a pose; the queries stand in `rows`."""
    poses = read_table(rows)
    conditions = conditions_of(poses, centre_elbows(machine, box))
    judge = judge_of(geometry_of(machine), poses)
    extent = extent_of(box, values(poses, POSE_FIELDS))
    tables: list[dict[str, NDArray]] = []
    for n_steps in settings.n_steps:
        asked = method(machine, settings, n_steps, network)
        tables.append(evaluate(asked, conditions, judge, COLUMNS))
        tables[-1] |= {N_STEPS.name: np.full(len(poses), n_steps), EXTENT.name: extent}
    left_out = {field.name for field in (*COLUMNS.query, N_STEPS, EXTENT)}
    known = [field for field in fields_of(tables[0], COLUMNS) if field.name not in left_out]
    fields = [N_STEPS, EXTENT, *known]
    return {".parquet": table(stacked(tables, fields), fields)}


def prepare_restarts(*, machine: Machine, restarts: Path, poses: dict[str, Path]) -> Work:
    """Largest errors of the networks of all restarts, those that were not chosen too."""
    sets = [(name, read_table(file)) for name, file in poses.items()]
    function = functools.partial(largest, machine, load_restarts(restarts))
    return Work(function, sets, rows(*RESTART_FIELDS))


def largest(
    machine: Machine, networks: dict[int, Network], item: tuple[str, pd.DataFrame]
) -> dict[str, NDArray]:
    """Columns RESTART_FIELDS of all `networks` on a named set of poses."""
    conditions, poses = item
    query, judge = values(poses, ACTUATED_FIELDS), judge_of(geometry_of(machine), poses)
    errors = [judge(query, network.predict(query)) for network in networks.values()]
    return {
        "restart": np.array(list(networks)),
        "conditions": np.repeat(conditions, len(networks)),
        **{f.name: np.array([e[f.name].max() for e in errors]) for f in COLUMNS.errors},
    }
