"""How the networks given gauges follow the readings, and what they read the pose from."""

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.arm import equilibria, flexible_arm
from flexik.cases.elastic_arm.parts.kinds import KINDS, learning_table
from flexik.cases.elastic_arm.parts.readings import ANGLES, HELD_OUT, TRAINING, columns_of
from flexik.cases.elastic_arm.parts.trained import NETWORK, RESTART, Trained, restarts
from flexik.cases.elastic_arm.section import Machine, Network
from flexik.datasets.parts import Work, Writer, rows, stacked, table
from flexik.datasets.tables import Field, read_table
from flexik.evaluation.regression import correlation
from flexik.kinematics.elastic_arm import DEFORMATION, flexible_forward
from flexik.kinematics.machine_file import arm_geometry

Array = NDArray[np.float64]
Columns = Mapping[str, NDArray]

FIT_FIELDS = (
    NETWORK,
    Field("reading", "1", "row of the readings, from 0", "int64"),
    Field("network_theta_1", "rad", "angle of joint 1, by the network"),
    Field("network_theta_2", "rad", "angle of joint 2, by the network"),
    Field("network_p_x", "m", "equation 44 at these angles and the deformation by the gauges"),
    Field("network_p_y", "m", "equation 45 there"),
)
FIT_RESTART_FIELDS = (
    NETWORK,
    *RESTART,
    *(
        Field(f"{part}r_{angle}", "1", f"R of {angle} on the {meaning} readings")
        for part, meaning in (("training_", "training"), ("", "held-out"))
        for angle in ANGLES
    ),
    Field("mean_error", "m", "of the flexible model's tip from that of the held-out reading"),
    Field("max_error", "m", "of the flexible model's tip from that of the held-out reading"),
)
SENSITIVITY_FIELDS = (
    NETWORK,
    *RESTART,
    Field("input", "1", "input that is off, or nothing", "string"),
    Field("change", "1", "by how much it is off, m or rad"),
    Field("mean_error", "m", "of the flexible model's tip from that of the held-out reading"),
)


def prepare_fit(
    *,
    machine: Machine,
    networks: Mapping[str, Network],
    tables: Mapping[str, Path],
    files: Mapping[str, Mapping[str, Path]],
) -> Work:
    """R and tip errors of the networks of all starts; the table is of the chosen ones."""
    function = functools.partial(_fit, machine, _read(tables))
    found = _restarts(networks, files)
    return Work(function, found, functools.partial(_written, found))


def prepare_sensitivity(
    *,
    machine: Machine,
    networks: Mapping[str, Network],
    with_restarts: str,
    tables: Mapping[str, Path],
    files: Mapping[str, Mapping[str, Path]],
) -> Work:
    """Tip errors with no input off, then each by its uncertainty; of one network from every start.

    The uncertainty is that of the gauges with noise, whether the network learnt with it or not.
    """
    function = functools.partial(_sensitivity, machine, _read(tables))
    found = [t for t in _restarts(networks, files) if t.is_chosen or t.name == with_restarts]
    return Work(function, found, rows(*SENSITIVITY_FIELDS))


def _read(tables: Mapping[str, Path]) -> dict[str, pd.DataFrame]:
    return {name: read_table(path) for name, path in tables.items()}


def _restarts(
    networks: Mapping[str, Network], files: Mapping[str, Mapping[str, Path]]
) -> list[Trained]:
    return [t for name, network in networks.items() for t in restarts(name, network, files[name])]


def _fit(machine: Machine, tables: Mapping[str, pd.DataFrame], trained: Trained) -> Columns:
    readings, shown = tables[""], tables[trained.settings.readings]
    angles = trained.network.predict(_inputs(readings, shown, trained.settings.learns))
    tip = flexible_forward(arm_geometry(machine), angles, shown[list(DEFORMATION)].to_numpy())
    part, right = readings["part"].to_numpy(), readings[list(ANGLES)].to_numpy()
    r = [correlation(right[part == p], angles[part == p]) for p in (TRAINING, HELD_OUT)]
    error = _tip_error(machine, angles[part == HELD_OUT], readings[part == HELD_OUT])
    statistics = np.array([*r[0], *r[1], error.mean(), error.max()])[:, None]
    by_reading = columns_of([np.arange(len(angles)), angles, tip], FIT_FIELDS[1:])
    return {**by_reading, **columns_of(list(statistics), FIT_RESTART_FIELDS[3:])}


def _written(trained: Sequence[Trained], results: Sequence[Columns]) -> dict[str, Writer]:
    pairs = list(zip(trained, results, strict=True))
    starts = [{**found, **network.row} for network, found in pairs]
    fits = [
        {**found, "network": np.repeat(network.name, len(found["reading"]))}
        for network, found in pairs
        if network.is_chosen
    ]
    return {
        ".parquet": table(stacked(fits, FIT_FIELDS), FIT_FIELDS),
        ".restarts.parquet": table(stacked(starts, FIT_RESTART_FIELDS), FIT_RESTART_FIELDS),
    }


def _sensitivity(machine: Machine, tables: Mapping[str, pd.DataFrame], trained: Trained) -> Columns:
    held_out = tables[""]["part"] == HELD_OUT
    readings, shown = tables[""][held_out], tables[trained.settings.readings][held_out]
    inputs = _inputs(readings, shown, trained.settings.learns)
    names = KINDS[trained.settings.learns].inputs
    uncertain = gauges.uncertainty(machine).tolist()
    changes = {"nothing": 0.0, **dict(zip(DEFORMATION, uncertain, strict=True))}
    changes = {name: off for name, off in changes.items() if name in ("nothing", *names)}
    asked = [inputs + off * (np.array(names) == name) for name, off in changes.items()]
    errors = [_tip_error(machine, trained.network.predict(x), readings).mean() for x in asked]
    return {
        **{key: np.repeat(value, len(changes)) for key, value in trained.row.items()},
        "input": np.array(list(changes)),
        "change": np.array(list(changes.values())),
        "mean_error": np.array(errors),
    }


def _inputs(readings: pd.DataFrame, shown: pd.DataFrame, learns: str) -> Array:
    """Inputs (n, p) of a network in `readings`."""
    return learning_table(readings, shown)[list(KINDS[learns].inputs)].to_numpy()


def _tip_error(machine: Machine, angles: Array, readings: pd.DataFrame) -> Array:
    """Distance (n,) in m of the tip at `angles`, within the limits, from that of the readings."""
    arm = flexible_arm(machine)
    angles = np.clip(angles, arm.geometry.lower, arm.geometry.upper)
    tip = equilibria(arm, angles, readings["payload"].to_numpy()).tip
    return np.hypot(*(tip - readings[["tip_x", "tip_y"]].to_numpy()).T)
