"""The manipulator that a machine file describes: the general one, or a closed form of its own."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from flexik.errors import ParameterError
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.kinematics.manipulator import Array, Manipulator
from flexik.kinematics.planar import PlanarManipulator
from flexik.machines.crane import CraneGeometry
from flexik.machines.planar import PlanarMachine, faults, read_machine

# The tips of a closed form and of the general solution agree this well, m, at so many poses
TOLERANCE, N_POSES = 1e-9, 500


def read_manipulator(path: Path | str) -> tuple[PlanarMachine, Manipulator]:
    """The machine in the file `path`, and its rigid kinematics.

    Raises ParameterError, one line a mistake, that names file, key and what was expected.
    """
    machine = read_machine(path)
    try:
        return machine, manipulator_of(machine)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None


def manipulator_of(machine: PlanarMachine) -> Manipulator:
    """Kinematics of `machine`.

    Raises ParameterError, which names the key, where its bodies are free or held twice, its loops
    do not close over the strokes, or its closed form is another machine's.
    """
    general = PlanarManipulator(machine)
    if machine.kinematics == "general":
        return general
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
    return closed


def check_machine(machine: PlanarMachine) -> None:
    """Raise ValueError, for models of machine files, if sections, masses or bodies are wrong."""
    wrong = faults(machine)
    try:
        if not wrong:
            manipulator_of(machine)
    except ParameterError as error:
        wrong = [str(error)]
    if wrong:
        raise ValueError("; ".join(wrong))


def crane_geometry(machine: PlanarMachine) -> CraneGeometry:
    """Dimensions of a crane by the names of data/machines/planar/crane.yaml.

    Raises ParameterError if a body, point or drive bears none of these names.
    """

    def between(first: str, second: str) -> tuple[float, float]:
        x, y = (_point(machine, second) - _point(machine, first)).tolist()
        return x, y

    def cylinder(name: str) -> float:
        drive = machine.drives.get(name)
        if drive is None or drive.kind != "cylinder":
            raise ParameterError(f"kinematics: crane expects a cylinder drives.{name}")
        return drive.retracted

    lift, jib, extension = _limits(machine, 3)[1]
    pillar = _point(machine, "ground.flange") - _point(machine, "pillar.flange")
    pivot = (pillar + _point(machine, "pillar.lift_pivot")).tolist()
    return CraneGeometry(
        lift_pivot=(pivot[0], pivot[1]),
        lift_cylinder_base=between("pillar.lift_pivot", "pillar.lift_cylinder_base"),
        lift_cylinder_head=between("lift.lift_pivot", "lift.lift_cylinder_head"),
        jib_pivot=between("lift.lift_pivot", "lift.jib_pivot"),
        rocker_pivot=between("lift.jib_pivot", "lift.rocker_pivot"),
        jib_cylinder_base=between("lift.rocker_pivot", "lift.jib_cylinder_base"),
        coupler_pin=between("jib.jib_pivot", "jib.coupler_pin"),
        extension_start=between("jib.coupler_pin", "jib.extension_start"),
        lift_cylinder_length=cylinder("lift"),
        jib_cylinder_length=cylinder("jib"),
        rocker_length=float(np.hypot(*between("rocker.rocker_pivot", "rocker.rocker_head"))),
        coupler_length=float(np.hypot(*between("coupler.rocker_head", "coupler.coupler_pin"))),
        stroke_maximum=(lift, jib, extension),
    )


def arm_geometry(machine: PlanarMachine) -> ArmGeometry:
    """Dimensions of a two-link arm by the names of data/machines/planar/elastic_arm.yaml."""
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
