"""The constants of a machine that the pipeline has calibrated, for parts."""

from pathlib import Path
from typing import Any

from flexik.errors import DataError
from flexik.files import read_json
from flexik.machines.planar import PlanarMachine
from flexik.planar.section import PlanarSection


def model_inputs(section: PlanarSection) -> dict[str, Any]:
    """Inputs `sections` of a part that solves the flexible machine, and `constants` if fitted."""
    found: dict[str, Any] = {"sections": section.machine.section_files}
    if section.machine.free:
        found["constants"] = section.data / "constants/constants.json"
    return found


def known(machine: PlanarMachine, constants: Path | None = None) -> PlanarMachine:
    """`machine` with the fitted `constants` of a file; raises DataError if it is damaged."""
    if constants is None:
        return machine
    found = read_json(constants)
    values = found.get("constants") if isinstance(found, dict) else None
    if not isinstance(values, dict) or sorted(values) != sorted(machine.free):
        raise DataError(f"{constants}: expected constants {', '.join(machine.free)}")
    return machine.with_constants(values)
