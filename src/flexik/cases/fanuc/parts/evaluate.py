"""Command the joints that every method gives, and see where the end effector comes to stand."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.fanuc.parts.tables import (
    COMMANDED_FIELDS,
    ERROR_FIELDS,
    JOINT_FIELDS,
    PATH_FIELDS,
    POSITION_FIELDS,
    QUERY_FIELDS,
    RESTART,
    STEPS,
    arm_of,
    array,
)
from flexik.cases.fanuc.section import CONDITIONS, EXACT, LOOKED_UP, WHOLE, Refinement, Section
from flexik.datasets.parts import Columns as Table
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import read_table
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import GROUP, STATUS, evaluate
from flexik.kinematics.pose_representation import asked
from flexik.kinematics.serial_arm import Array, SerialArm, forward, pose_errors
from flexik.kinematics.spherical_wrist import configuration
from flexik.learning.storage import load_networks
from flexik.positioning.arm_configurations import ArmConfigurations
from flexik.positioning.closed_form import ClosedForm
from flexik.positioning.interpolated import Interpolated
from flexik.positioning.method import Columns, Method
from flexik.positioning.nearest_sample import NearestSample
from flexik.positioning.predicted import Predicted
from flexik.positioning.refined import Refined

FIELDS = (STEPS, GROUP, *QUERY_FIELDS, *COMMANDED_FIELDS, *ERROR_FIELDS, STATUS)
START_FIELDS = (RESTART, STEPS, GROUP, *ERROR_FIELDS, STATUS)


def parts(section: Section) -> list[Part]:
    """A table of errors of every method under every set of conditions it is asked.

    Networks of the path know no orientation, and are not asked for random poses.
    """
    found = []
    for name, method in section.methods.items():
        for where in CONDITIONS:
            if where == "random_poses" and name in section.path_methods:
                continue
            steps = section.conditions.refinement
            settings = {
                "arm": arm_of(section.machine.joints),
                "kind": method.kind,
                "refinement": None if where == "path" or name == EXACT else steps,
            }
            asked_for = section.data / f"samples/conditions/{where}.parquet"
            inputs = {"asked_for": asked_for, **inputs_of(section, name)}
            found.append(Part(f"{where}/{name}", prepare, settings, inputs))
    return found


def inputs_of(section: Section, name: str) -> dict[str, Path]:
    """Files that the method `name` is made of."""
    if name == WHOLE:
        return {"networks": section.data / f"networks/{name}.json"}
    if name in section.networks:
        files = {"networks": f"{name}.json", "restarts": f"{name}.restarts.json"}
        return {key: section.data / "networks" / file for key, file in files.items()}
    return {"path": section.data / "samples/path.parquet"} if name in LOOKED_UP else {}


def method(section: Section, name: str) -> Method:
    """The method `name`, from the files of the stages before."""
    files = inputs_of(section, name)
    files.pop("restarts", None)
    return _methods(arm_of(section.machine.joints), section.methods[name].kind, **files)[0]


def _methods(
    arm: SerialArm, kind: str, networks: Path | None = None, path: Path | None = None
) -> list[Method]:
    """The method of `kind`; of a file of several networks of the path, a method of each."""
    if networks is not None:
        known = [network for network, _ in load_networks(networks)]
        if kind == "arm_configurations":
            return [ArmConfigurations(arm, dict(enumerate(known)))]
        return [Predicted(network, arm.minimum, arm.maximum) for network in known]
    if path is not None:
        samples = read_table(path, PATH_FIELDS)
        training = samples[samples["is_test"] == 0]
        taught = array(training, POSITION_FIELDS), array(training, JOINT_FIELDS)
        return [NearestSample(*taught) if kind == "nearest_sample" else Interpolated(*taught)]
    return [ClosedForm(arm)]


def prepare(
    *,
    arm: SerialArm,
    kind: str,
    refinement: Refinement | None,
    asked_for: Path,
    networks: Path | None = None,
    restarts: Path | None = None,
    path: Path | None = None,
) -> Work:
    """Errors of the method, and of all starts of its network where there are several."""
    query = array(read_table(asked_for), QUERY_FIELDS)
    chosen = _methods(arm, kind, networks, path)
    starts = [] if restarts is None else _methods(arm, kind, restarts)

    def finish(results: list[Table]) -> Mapping[str, Writer]:
        writers = {".parquet": table(results[0], FIELDS)}
        if starts:
            each = [
                {**r, RESTART.name: np.full(len(r[STEPS.name]), k)}
                for k, r in enumerate(results[1:])
            ]
            writers[".starts.parquet"] = table(stacked(each, START_FIELDS), START_FIELDS)
        return writers

    return Work(partial(errors_of, arm, query, refinement), [*chosen, *starts], finish)


def errors_of(arm: SerialArm, query: Array, steps: Refinement | None, method: Method) -> Table:
    """Columns FIELDS of `method` at queries (n, 13), without and with Newton steps after it."""
    tables, n = [], len(query)
    conditions = Conditions(query, np.zeros((n, 6)), np.arange(n))
    columns = Columns(QUERY_FIELDS, COMMANDED_FIELDS, ERROR_FIELDS, arm.minimum, arm.maximum)
    for n_steps in range((0 if steps is None else steps.n_steps) + 1):
        asked_for = method
        if n_steps and steps is not None:
            asked_for = Refined(arm, method, n_steps, steps.damping, steps.orientation_length)
        found = evaluate(asked_for, conditions, partial(judge, arm), columns)
        tables.append(found | {STEPS.name: np.full(n, n_steps)})
    return stacked(tables, FIELDS)


def judge(arm: SerialArm, query: Array, values: Array) -> dict[str, NDArray]:
    """Columns ERROR_FIELDS: where the end effector comes to stand, and in which configuration."""
    target, number = asked(query)
    distance, angle = pose_errors(target, forward(arm, values))
    there = configuration(arm, values) == number
    found = distance, angle, there.astype(np.int64)
    return {field.name: column for field, column in zip(ERROR_FIELDS, found, strict=True)}
