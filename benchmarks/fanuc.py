"""Time a pose takes by every method of the six-joint arm, and what more training buys.

    python benchmarks/fanuc.py [times | growth]

times: one pose a call and many poses a call, on one core. growth: networks of arm configuration 0
in other sizes and with other numbers of passes, in seconds of the processor. Without an argument:
both. Needs `make repro` for data/fanuc. Writes reports/benchmarks/fanuc.csv and fanuc_growth.csv,
and .md beside each.
"""

from machine import remark

# isort: split
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import py_opw_kinematics as opw
from scipy.spatial.transform import RigidTransform
from threadpoolctl import threadpool_limits

from flexik import stage
from flexik.cases.case import load
from flexik.cases.fanuc.parts import evaluate
from flexik.cases.fanuc.parts.tables import JOINT_FIELDS, POSE_FIELDS, QUERY_FIELDS, arm_of, array
from flexik.cases.fanuc.parts.train import workspace_lesson
from flexik.cases.fanuc.report_results import growth_settings, judged, label, query_settings
from flexik.cases.fanuc.section import WHOLE, Section
from flexik.datasets.tables import read_table
from flexik.errors import DataError, FlexikError
from flexik.kinematics.pose_representation import asked
from flexik.kinematics.serial_arm import Array, SerialArm
from flexik.learning.training import Architecture, train
from flexik.positioning.arm_configurations import ArmConfigurations
from flexik.positioning.method import Method
from flexik.positioning.refined import Refined
from flexik.reporting.tables import Table

OUTPUT = Path("reports/benchmarks")
N_REPEATS, N_SINGLE, N_BATCHED = 15, 200, 2000
MICROSECONDS, MM, DEGREES = 1e6, 1e3, 180.0 / np.pi
# Hidden neurons of each layer, passes
GROWTH = (
    *(((32, 32), 12), ((32, 32), 50), ((64, 64), 12), ((64, 64), 50)),
    *(((64, 64), 200), ((128, 128), 50)),
)


def methods(section: Section, arm: SerialArm) -> dict[str, Method]:
    """All methods by name."""
    try:
        known = {name: evaluate.method(section, name) for name in section.methods}
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    steps = section.conditions.refinement
    for n_steps in range(1, steps.n_steps + 1):
        known[label(WHOLE, n_steps)] = refined(section, arm, known[WHOLE], n_steps)
    return known


def refined(section: Section, arm: SerialArm, method: Method, n_steps: int) -> Refined:
    """Newton steps of the section after `method`."""
    steps = section.conditions.refinement
    return Refined(arm, method, n_steps, steps.damping, steps.orientation_length)


@dataclass(frozen=True, eq=False)
class Case:
    """A method, poses it is asked for one at a time, and many at once, as it takes them."""

    query: Callable[..., object]
    single: Sequence[tuple[Any, ...]]
    batch_query: Callable[..., object]
    batch: tuple[Any, ...]


def opw_case(arm: SerialArm, query: Array) -> Case:
    """All configurations by the independent package; of a batch it keeps one of each pose."""
    d, a = arm.d, arm.a
    model = opw.KinematicModel(
        a1=a[0], a2=-a[2], b=0.0, c1=d[0], c2=a[1], c3=abs(d[3]), c4=abs(d[5])
    )
    robot, target = opw.Robot(model, degrees=False), asked(query)[0]
    matrices = np.tile(np.eye(4), (len(query), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = target.rotation, target.position
    poses = RigidTransform.from_matrix(matrices)
    single = [(poses[k],) for k in range(min(N_SINGLE, len(matrices)))]
    return Case(robot.inverse, single, robot.batch_inverse, (poses,))


def own_case(method: Method, query: Array) -> Case:
    """A method of this repository."""
    current = np.zeros((len(query), 6))
    single = [(query[k : k + 1], current[:1]) for k in range(min(N_SINGLE, len(query)))]
    return Case(method, single, method, (query, current))


def measure(section: Section, arm: SerialArm) -> pd.DataFrame:
    """A row for every method; in each repeat all follow one another."""
    poses = read_table(section.data / "samples" / "conditions/random_poses.parquet")
    poses = poses.sample(min(N_BATCHED, len(poses)), random_state=1)
    query = np.ascontiguousarray(array(poses, QUERY_FIELDS))
    known = {name: own_case(method, query) for name, method in methods(section, arm).items()}
    known["opw"] = opw_case(arm, query)
    seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in known}
    for _ in range(N_REPEATS):
        for name, case in known.items():
            alone = statistics.median(timed(case.query, one) for one in case.single)
            seconds[name].append((alone, timed(case.batch_query, case.batch) / len(poses)))
    rows = [
        {
            "method": name,
            "microseconds_single": MICROSECONDS * min(pair[0] for pair in pairs),
            "microseconds_batched": MICROSECONDS * min(pair[1] for pair in pairs),
            "settings": query_settings(section),
        }
        for name, pairs in seconds.items()
    ]
    return pd.DataFrame(rows)


def timed(query: Callable[..., object], arguments: tuple[Any, ...]) -> float:
    """Seconds of a call."""
    started = time.perf_counter()
    query(*arguments)
    return time.perf_counter() - started


def grow(section: Section, arm: SerialArm) -> pd.DataFrame:
    """A row a network of GROWTH."""
    poses, targets = (
        read_table(section.data / "samples" / "poses.parquet", POSE_FIELDS),
        read_table(section.data / "samples" / "conditions/random_poses.parquet"),
    )
    joints = array(poses[poses["configuration"] == 0], JOINT_FIELDS)
    query = array(targets[targets["configuration"] == 0], QUERY_FIELDS)
    network, rows = section.networks[WHOLE], []
    for n_hidden, n_iterations in GROWTH:
        settings = section.trainers[network.trainer].but(n_iterations=n_iterations)
        architecture = Architecture(n_hidden, network.activation)
        lesson = workspace_lesson(arm, joints, architecture, settings, network.seed)
        train(replace(lesson, settings=settings.but(n_iterations=1)))  # imports, first calls
        started = time.process_time()
        found, _ = train(lesson)
        seconds = time.process_time() - started
        plain = ArmConfigurations(arm, {0: found})
        steps = section.conditions.refinement.model_copy(update={"n_steps": 3})
        errors = pd.DataFrame(evaluate.errors_of(arm, query, steps, plain))
        before, after = (errors[errors["n_steps"] == n_steps] for n_steps in (0, 3))
        reached = judged(after, section.success)["reached"]
        rows.append(
            {
                "n_hidden": " and ".join(map(str, n_hidden)),
                "n_iterations": n_iterations,
                "seconds": seconds,
                "mean_position_error_mm": MM * before["error"].mean(),
                "mean_orientation_error_deg": DEGREES * before["orientation_error"].mean(),
                "success_percent": 100.0 * reached.mean(),
                "settings": growth_settings(section),
            }
        )
        print(rows[-1], flush=True)
    return pd.DataFrame(rows)


def main() -> None:
    """Measure and report."""
    if sys.argv[1:] not in ([], ["times"], ["growth"]):
        raise FlexikError("usage: fanuc.py [times | growth]")
    chosen = sys.argv[1:] or ["times", "growth"]
    section = load("fanuc")
    arm = arm_of(section.machine.joints)
    with threadpool_limits(1):
        if "times" in chosen:
            table = measure(section, arm)
            remarks = [
                f"single: one pose a call, the median of {N_SINGLE} poses; batched: one call with "
                f"{N_BATCHED} poses, the time over their number. Least of {N_REPEATS} repeats.",
                "closed_form: all eight arm configurations and limits, then the one asked for. "
                "opw: py-opw-kinematics, all configurations, no limits; batched: one of each pose.",
                remark(1, "numpy", "py-opw-kinematics"),
            ]
            decimals = {"microseconds_single": 1, "microseconds_batched": 2}
            Table(table, decimals).write(OUTPUT / "fanuc", "Microseconds a pose.", remarks)
        if "growth" in chosen:
            table = grow(section, arm)
            caption = "Networks of the whole workspace, arm configuration 0; seconds of a core."
            remarks = ["One start each.", remark(1, "numpy")]
            Table(table, 2).write(OUTPUT / "fanuc_growth", caption, remarks)


if __name__ == "__main__":
    stage.run(main)
