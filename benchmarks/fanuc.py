"""Time a pose takes by every method of the six-joint arm, and what more training buys.

    python benchmarks/fanuc.py [times | growth]

times: one pose a call and many poses a call, on one core. growth: networks of arm configuration 0
in other sizes and with other numbers of passes, in seconds of the processor. Without an argument:
both. Needs `make repro` for data/fanuc. Writes reports/benchmarks/fanuc.csv and fanuc_growth.csv,
and .md beside each.
"""

import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import py_opw_kinematics as opw
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform
from threadpoolctl import threadpool_limits

from flexik import parameters, stage
from flexik.datasets.fanuc.tables import (
    POSE_FIELDS,
    growth_checksum,
    joints_of_rows,
    poses_checksum,
    query_checksum,
    read_path,
)
from flexik.datasets.tables import read_table
from flexik.errors import DataError, FlexikError
from flexik.evaluation.fanuc.errors import statistics as error_statistics
from flexik.evaluation.fanuc.errors import workspace_errors
from flexik.learning.training import Architecture, trainer_settings
from flexik.kinematics.serial_arm import Pose, SerialArm, forward
from flexik.parameters import load_parameters
from flexik.positioning.fanuc.methods import (
    JointMethod,
    closed_form,
    interpolated,
    nearest_sample,
    path_networks,
    refined,
    workspace_networks,
)
from flexik.positioning.fanuc.networks import load_path_networks, load_workspace_networks
from flexik.positioning.fanuc.training import WorkspaceTask, train_workspace
from flexik.reporting.tables import write_table

DATA, OUTPUT = Path("data/fanuc"), Path("reports/benchmarks")
N_REPEATS, N_SINGLE, N_BATCHED = 15, 200, 2000
MICROSECONDS, MM, DEGREES = 1e6, 1e3, 180.0 / np.pi
# Hidden neurons of each layer, passes
GROWTH = (
    *(((40, 40), 15), ((40, 40), 60), ((80, 80), 15), ((80, 80), 60)),
    *(((80, 80), 240), ((160, 160), 60)),
)


def methods(fanuc: parameters.Fanuc, arm: SerialArm) -> dict[str, JointMethod]:
    """All methods by name."""
    try:
        known = {
            name: path_networks(load_path_networks(DATA / "networks", fanuc, name))
            for name in fanuc.networks
        }
        whole = workspace_networks(arm, load_workspace_networks(DATA / "workspace_networks", fanuc))
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    steps = fanuc.refinement
    for n_steps in range(steps.n_steps + 1):
        name = f"whole_workspace_refined_{n_steps}" if n_steps else "whole_workspace"
        known[name] = refined(arm, whole, n_steps, steps.damping, steps.orientation_length)
    training, _ = read_path(DATA / "path.parquet", fanuc)
    taught = training[["x", "y", "z"]].to_numpy(), joints_of_rows(training)
    known |= {"nearest_sample": nearest_sample(*taught), "interpolated": interpolated(*taught)}
    return known | {"closed_form": closed_form(arm)}


@dataclass(frozen=True, eq=False)
class Case:
    """A method, poses it is asked for one at a time, and many at once, as it takes them."""

    query: Callable[..., object]
    single: Sequence[tuple[Any, ...]]
    batch_query: Callable[..., object]
    batch: tuple[Any, ...]


def opw_case(fanuc: parameters.Fanuc, target: Pose) -> Case:
    """All configurations by the independent package; of a batch it keeps one of each pose."""
    d, a = ([getattr(joint, name) for joint in fanuc.joints] for name in ("d", "a"))
    model = opw.KinematicModel(
        a1=a[0], a2=-a[2], b=0.0, c1=d[0], c2=a[1], c3=abs(d[3]), c4=abs(d[5])
    )
    robot = opw.Robot(model, degrees=False)
    matrices = np.tile(np.eye(4), (len(target.position), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = target.rotation, target.position
    poses = RigidTransform.from_matrix(matrices)
    single = [(poses[k],) for k in range(min(N_SINGLE, len(matrices)))]
    return Case(robot.inverse, single, robot.batch_inverse, (poses,))


def own_case(method: JointMethod, target: Pose, number: NDArray[np.int64]) -> Case:
    """A method of this repository."""
    rows = [slice(k, k + 1) for k in range(min(N_SINGLE, len(number)))]
    single = [(target.rows(one), number[one]) for one in rows]
    return Case(method, single, method, (target, number))


def measure(fanuc: parameters.Fanuc, arm: SerialArm) -> pd.DataFrame:
    """A row for every method; in each repeat all follow one another."""
    poses = read_table(DATA / "target_poses.parquet", POSE_FIELDS, poses_checksum(fanuc))
    poses = poses.sample(min(N_BATCHED, len(poses)), random_state=1)
    target, number = forward(arm, joints_of_rows(poses)), poses["configuration"].to_numpy()
    known = {name: own_case(method, target, number) for name, method in methods(fanuc, arm).items()}
    known["opw"] = opw_case(fanuc, target)
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
            "settings": query_checksum(fanuc),
        }
        for name, pairs in seconds.items()
    ]
    return pd.DataFrame(rows)


def timed(query: Callable[..., object], arguments: tuple[Any, ...]) -> float:
    """Seconds of a call."""
    started = time.perf_counter()
    query(*arguments)
    return time.perf_counter() - started


def grow(fanuc: parameters.Fanuc, arm: SerialArm) -> pd.DataFrame:
    """A row a network of GROWTH."""
    made_with, space = poses_checksum(fanuc), fanuc.workspace
    training, targets = (
        read_table(DATA / f"{name}_poses.parquet", POSE_FIELDS, made_with)
        for name in ("training", "target")
    )
    joints, asked = (joints_of_rows(t[t["configuration"] == 0]) for t in (training, targets))
    target, number = forward(arm, asked), np.zeros(len(asked), dtype=np.int64)
    steps, rows = fanuc.refinement, []
    for n_hidden, n_iterations in GROWTH:
        trainer = fanuc.trainers[space.trainer].model_dump() | {"n_iterations": n_iterations}
        settings = trainer_settings(trainer.pop("kind"), trainer)
        architecture = Architecture(n_hidden, space.activation)
        task = WorkspaceTask(arm, 0, joints, architecture, settings, space.seed)
        started = time.process_time()
        network, _ = train_workspace(task)
        seconds = time.process_time() - started
        plain = workspace_networks(arm, {0: network})
        method = refined(arm, plain, 3, steps.damping, steps.orientation_length)
        before, after = (
            error_statistics(
                pd.DataFrame(workspace_errors(arm, target, number, each(target, number))),
                fanuc.success.model_dump(),
            )
            for each in (plain, method)
        )
        rows.append(
            {
                "n_hidden": " and ".join(map(str, n_hidden)),
                "n_iterations": n_iterations,
                "seconds": seconds,
                "mean_position_error_mm": MM * before["mean_position_error"],
                "mean_orientation_error_deg": DEGREES * before["mean_orientation_error"],
                "success_percent": 100.0 * after["success_rate"],
                "settings": growth_checksum(fanuc),
            }
        )
        print(rows[-1], flush=True)
    return pd.DataFrame(rows)


def main() -> None:
    """Measure and report."""
    if sys.argv[1:] not in ([], ["times"], ["growth"]):
        raise FlexikError("usage: fanuc.py [times | growth]")
    chosen = sys.argv[1:] or ["times", "growth"]
    fanuc = load_parameters().fanuc
    arm = SerialArm.from_rows([joint.model_dump() for joint in fanuc.joints])
    machine = f"One core, one BLAS thread; numpy {version('numpy')}, py-opw-kinematics "
    machine += f"{version('py-opw-kinematics')}."
    with threadpool_limits(1):
        if "times" in chosen:
            table = measure(fanuc, arm)
            remarks = [
                f"single: one pose a call, the median of {N_SINGLE} poses; batched: one call with "
                f"{N_BATCHED} poses, the time over their number. Least of {N_REPEATS} repeats.",
                "closed_form: all eight arm configurations and limits, then the one asked for. "
                "opw: py-opw-kinematics, all configurations, no limits; batched: one of each pose.",
                machine,
            ]
            decimals = {"microseconds_single": 1, "microseconds_batched": 2}
            write_table(OUTPUT / "fanuc", table, decimals, "Microseconds a pose.", remarks)
        if "growth" in chosen:
            table = grow(fanuc, arm)
            caption = "Networks of the whole workspace, arm configuration 0; seconds of a core."
            remarks = ["One start each.", machine]
            write_table(OUTPUT / "fanuc_growth", table, 2, caption, remarks)


if __name__ == "__main__":
    stage.run(main)
