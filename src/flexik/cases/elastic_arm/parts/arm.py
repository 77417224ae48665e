"""The flexible arm of the machine file in static equilibrium, and how its links are deformed."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexik.cases.elastic_arm.section import LINKS, Machine
from flexik.errors import SolverError
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.kinematics.machine_file import arm_geometry
from flexik.machines.sections import Array
from flexik.multibody import planar
from flexik.multibody.beams import nearest
from flexik.multibody.flexible import FlexibleMachine


class FlexibleArm(FlexibleMachine):
    """The arm; its rigid kinematics are in closed form."""

    @cached_property
    def geometry(self) -> ArmGeometry:
        """Lengths and joint limits."""
        return arm_geometry(self.machine)


class Equilibria(NamedTuple):
    """Static equilibria of n samples; NaN where none was found.

    tip : (n, 2) in m.
    deformation : (n, 6) in m and rad, columns kinematics.elastic_arm.DEFORMATION.
    station_deflection : (n, 2) in m, across each link at its deflection station.
    axial_strain : (n, 2) of each link at its strain station.
    """

    tip: Array
    deformation: Array
    station_deflection: Array
    axial_strain: Array


def flexible_arm(machine: Machine) -> FlexibleArm:
    """The arm of a machine file."""
    return FlexibleArm(machine)


def solve(
    arm: FlexibleArm, angles: Array, payload: Array
) -> tuple[Equilibria, dict[int, SolverError]]:
    """Equilibria at `angles` (n, 2) in rad with `payload` (n,) in kg, and the rows that failed."""
    found, failures = planar.solve(arm, angles, payload, _deformed, size=12)
    return Equilibria(*np.split(found, [2, 8, 10], axis=1)), failures


def equilibria(arm: FlexibleArm, angles: Array, payload: Array) -> Equilibria:
    """Equilibria as by `solve`; raises the SolverError of the first row that fails."""
    found, failures = solve(arm, angles, payload)
    if failures:
        raise next(iter(failures.values()))
    return found


def _deformed(model: planar.PlanarModel) -> Array:
    """Columns (12,) of Equilibria, of the last solution."""
    base, turned = np.zeros(2), 0.0
    deformation: list[float] = []
    deflections, strains = [], []
    for name, angle in zip(LINKS, model.values, strict=True):
        turned += angle
        beam, link = model.machine.beams[name], model.beams[name]
        axis = np.array([np.cos(turned), np.sin(turned)])
        across = np.array([-axis[1], axis[0]])
        deflected, strained = (
            nearest(link.stations, beam.foot(beam.points[f"{what}_station"])[0])
            for what in ("deflection", "strain")
        )
        rotation, at_end = link.rotation(-1), link.position(-1) - base
        length = float(link.stations[-1])
        deformation += [float(at_end @ across), float(at_end @ axis) - length, rotation - turned]
        deflections.append(float((link.position(deflected) - base) @ across))
        strains.append(link.axial_strain(strained))
        base, turned = base + at_end, rotation
    return np.array([*base, *deformation, *deflections, *strains])
