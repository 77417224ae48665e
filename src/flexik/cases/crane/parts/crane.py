"""The flexible crane that the pipeline has calibrated, for parts that put it into equilibrium."""

from functools import cached_property
from pathlib import Path

from flexik.cases.crane.section import SPRING
from flexik.kinematics.crane import CraneGeometry
from flexik.kinematics.machine_file import crane_geometry
from flexik.machines.planar import Fixed, PlanarMachine
from flexik.multibody.flexible import FlexibleMachine
from flexik.planar.constants import known


class FlexibleCrane(FlexibleMachine):
    """The crane; its rigid kinematics are in closed form."""

    @cached_property
    def geometry(self) -> CraneGeometry:
        """Its dimensions."""
        return crane_geometry(self.machine)


def flexible(machine: PlanarMachine, constants: Path) -> FlexibleCrane:
    """The crane `machine` on the ground spring of the file `constants`."""
    return FlexibleCrane(known(machine, constants))


def stiffness_of(crane: FlexibleCrane) -> float:
    """Its ground spring, N m/rad."""
    slew = crane.machine.joints["slew"]
    assert isinstance(slew, Fixed) and isinstance(slew.springs.torsion, float)  # SPRING
    return slew.springs.torsion


def on_spring(machine: PlanarMachine, stiffness: float) -> FlexibleCrane:
    """The crane `machine` on a ground spring of `stiffness` N m/rad."""
    return FlexibleCrane(machine.with_constants({SPRING: stiffness}))
