"""The manipulator that a machine file describes: the general one, or a closed form of its own."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.kinematics.loops import Linkage
from flexik.kinematics.manipulator import Array, Manipulator
from flexik.kinematics.planar import PlanarManipulator
from flexik.machines.planar import PlanarMachine, faults, read_machine

# The tips of a closed form and of the general solution agree this well, m, at so many poses
TOLERANCE, N_POSES = 1e-9, 500


def read_manipulator(path: Path | str) -> tuple[PlanarMachine, Manipulator]:
    """The machine in the file `path`, and its rigid kinematics.

    Raises ParameterError, one line a mistake, that names file, key and what was expected.
    """
    machine = read_machine(path)
    try:
        check_kinematics(machine)
        return machine, manipulator_of(machine)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None


def manipulator_of(machine: PlanarMachine, near: Linkage | None = None) -> Manipulator:
    """Kinematics of `machine`; raises ParameterError, which names the key, if they are not.

    near : see kinematics.loops.Linkage.
    """
    if machine.kinematics == "general":
        return PlanarManipulator(machine, near)
    return _CLOSED_FORMS[machine.kinematics](machine)


def check_kinematics(machine: PlanarMachine) -> None:
    """Raise ParameterError, which names the key, if `machine` is no mechanism.

    Its bodies are free or held twice, its loops do not close over the strokes, or its closed form
    is another machine's.
    """
    general = PlanarManipulator(machine)
    if machine.kinematics == "general":
        return
    closed = _CLOSED_FORMS[machine.kinematics](machine)
    limits = (closed.lower, general.lower), (closed.upper, general.upper)
    if not all(np.array_equal(*pair) for pair in limits):
        raise ParameterError(f"kinematics: expected general, {machine.kinematics} has other limits")
    share = np.random.default_rng(0).random((N_POSES, len(general.lower)))
    values = general.lower + share * (general.upper - general.lower)
    off = float(np.abs(closed.forward(values) - general.forward(values)).max())
    if not off <= TOLERANCE:
        raise ParameterError(
            f"kinematics: expected general, the closed form {machine.kinematics} is another "
            f"machine's: its tips lie up to {off:.3g} m off"
        )


def check_machine(machine: PlanarMachine) -> None:
    """Raise ValueError, for models of machine files, if sections, masses or bodies are wrong."""
    wrong = faults(machine)
    try:
        if not wrong:
            check_kinematics(machine)
    except ParameterError as error:
        wrong = [str(error)]
    if wrong:
        raise ValueError("; ".join(wrong))


def crane_geometry(machine: PlanarMachine) -> CraneGeometry:
    """Dimensions of a crane by the names of data/machines/crane.yaml.

    Raises ParameterError if a body, point or drive bears none of these names.
    """
    pillar = _point(machine, "ground.flange") - _point(machine, "pillar.flange")
    frames = {"pillar": pillar, "lift": -_point(machine, "lift.lift_pivot")}
    frames["jib"] = -_point(machine, "jib.jib_pivot")

    def point(reference: str) -> tuple[float, float]:
        x, y = (frames[reference.partition(".")[0]] + _point(machine, reference)).tolist()
        return x, y

    def distance(first: str, second: str) -> float:
        return float(np.hypot(*(_point(machine, second) - _point(machine, first))))

    def cylinder(name: str) -> float:
        drive = machine.drives.get(name)
        if drive is None or drive.kind != "cylinder":
            raise ParameterError(f"kinematics: crane expects a cylinder drives.{name}")
        return drive.retracted

    telescope = machine.drives.get("extension")
    if telescope is None or telescope.kind != "telescope":
        raise ParameterError("kinematics: crane expects a telescope drives.extension")
    # the tip slides along the pads
    beside = _point(machine, "extension.tip") - _point(machine, "extension.rear_pad")
    start = point("jib.extension_start")[0] + telescope.retracted
    lift, jib, extension = _limits(machine, 3)[1]
    return CraneGeometry(
        lift_pivot=point("pillar.lift_pivot"),
        lift_cylinder_base=point("pillar.lift_cylinder_base"),
        lift_cylinder_head=point("lift.lift_cylinder_head"),
        jib_pivot=point("lift.jib_pivot"),
        rocker_pivot=point("lift.rocker_pivot"),
        jib_cylinder_base=point("lift.jib_cylinder_base"),
        coupler_pin=point("jib.coupler_pin"),
        extension_start=(start, point("jib.front_pad")[1] + float(beside[1])),
        lift_cylinder_length=cylinder("lift"),
        jib_cylinder_length=cylinder("jib"),
        rocker_length=distance("rocker.rocker_pivot", "rocker.rocker_head"),
        coupler_length=distance("coupler.rocker_head", "coupler.coupler_pin"),
        stroke_maximum=(lift, jib, extension),
    )


def arm_geometry(machine: PlanarMachine) -> ArmGeometry:
    """Dimensions of a two-link arm by the names of data/machines/elastic_arm.yaml."""
    ends = ("link_1.joint_1", "link_1.joint_2"), ("link_2.joint_2", "link_2.tip")
    lengths = [float(np.hypot(*(_point(machine, b) - _point(machine, a)))) for a, b in ends]
    low, high = _limits(machine, 2)
    return ArmGeometry((lengths[0], lengths[1]), ((low[0], high[0]), (low[1], high[1])))


_CLOSED_FORMS: dict[str, Callable[[PlanarMachine], Manipulator]] = {
    "crane": lambda machine: CraneManipulator(crane_geometry(machine)),
    "elastic_arm": arm_geometry,
}


def _point(machine: PlanarMachine, reference: str) -> Array:
    try:
        return np.array(machine.located(reference).point)
    except ValueError as error:
        raise ParameterError(
            f"kinematics: {machine.kinematics} needs {reference}: {error}"
        ) from None


def _limits(machine: PlanarMachine, n_drives: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Least and largest coordinates; raises ParameterError unless there are `n_drives`."""
    limits = [drive.limits for drive in machine.drives.values()]
    if len(limits) != n_drives:
        raise ParameterError(f"kinematics: {machine.kinematics} expects {n_drives} drives")
    return tuple(low for low, _ in limits), tuple(high for _, high in limits)
