"""What may be off in a machine, read from its file: places, zeros of drives, play, stiffness.

A drive has one offset for all that shifts its coordinate: a cylinder's length cannot be told from
the zero of its sensor. Beams have one offset together, of the whole deflection, for a network
predicts what they do together.
"""

from typing import NamedTuple

import numpy as np

from flexik.machines.deviations import Expected
from flexik.machines.planar import PlanarMachine
from flexik.multibody.joint_forces import pins_of, point_key, points_of, springs_of
from flexik.positioning.method import Array

DEFLECTION = "deflection"


class Offset(NamedTuple):
    """An offset by name, with what is expected of it and the standard deviation of that.

    unit : m or rad; 1: relative, of how much it gives way.
    """

    name: str
    unit: str
    expected: float
    deviation: float


def dimensions_of(machine: PlanarMachine, expected: Expected) -> list[Offset]:
    """Offsets of the rigid machine: x and y of `points_of`, then the zeros of the drives."""
    found = [
        Offset(f"{end}.{a}", "m", 0.0, expected.pivot) for end in points_of(machine) for a in "xy"
    ]
    length = float(np.hypot(expected.length, expected.stroke_offset))
    zeros = {
        "cylinder": ("retracted", "m", length),
        "telescope": ("retracted", "m", expected.stroke_offset),
        "revolute": ("zero", "rad", expected.angle_offset),
    }
    for name, drive in machine.drives.items():
        zero, unit, deviation = zeros[drive.kind]
        found.append(Offset(f"drives.{name}.{zero}", unit, 0.0, deviation))
    return found


def offsets_of(machine: PlanarMachine, expected: Expected) -> list[Offset]:
    """All offsets: `dimensions_of`, the play of `pins_of`, the deflection, and `springs_of`."""
    found = dimensions_of(machine, expected)
    for key, n_pins in pins_of(machine).items():
        deviation = expected.play_deviation / float(np.sqrt(n_pins))  # mean of its pins
        found.append(Offset(f"{key}.play", "m", expected.play, deviation))
    found.append(Offset(DEFLECTION, "1", 0.0, expected.section))
    return found + [Offset(key, "1", 0.0, expected.spring) for key in springs_of(machine)]


def corrected(machine: PlanarMachine, dimensions: Array) -> PlanarMachine:
    """`machine` with the offsets (d,) of `dimensions_of` added.

    Raises ParameterError where a dimension becomes impossible.
    """
    ends = points_of(machine)
    moved = dimensions[: 2 * len(ends)].reshape(-1, 2)
    found: dict[str, object] = {
        point_key(end): np.add(machine.located(end).point, by).tolist()
        for end, by in zip(ends, moved, strict=True)
    }
    for (name, drive), by in zip(
        machine.drives.items(), dimensions[2 * len(ends) :].tolist(), strict=True
    ):
        zero = "zero" if drive.kind == "revolute" else "retracted"
        found[f"drives.{name}.{zero}"] = getattr(drive, zero) + by
    return machine.with_constants(found)
