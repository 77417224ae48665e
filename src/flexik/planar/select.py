"""Networks of many sizes from several starts, of which the selection error chooses the size.

A correction is judged with the rigid network that it corrects, which is trained here already.
"""

from pathlib import Path
from typing import Any

from flexik.datasets.parts import Part, Work
from flexik.learning.size_selection import select
from flexik.learning.storage import load_network
from flexik.learning.training import Architecture
from flexik.machines.planar import PlanarMachine
from flexik.parameters.trainers import Stopping
from flexik.planar.learning import lesson
from flexik.planar.section import PlanarSection
from flexik.planar.train import based_on, data_inputs, described, part

CORRECTED = "corrected"


def parts(section: PlanarSection) -> list[Part]:
    """A part a network whose size is to be chosen, and `corrected/RIGID` for corrections."""
    selected = {n: network for n, network in section.networks.items() if network.is_selected}
    corrected = sorted({n.corrects for n in selected.values() if n.corrects is not None})
    sizes = section.data / "sizes"
    found = [part(section, name, f"{CORRECTED}/{name}", sizes) for name in corrected]
    for name, network in selected.items():
        settings = described(section, name) | {
            "activation": network.activation,
            "sizes": network.sizes,
            "n_restarts": network.select.n_restarts,
            "tolerance": network.select.tolerance,
            "trainer": section.trainers[network.select.trainer],
        }
        inputs: dict[str, Any] = data_inputs(section, name)
        if network.corrects is not None:
            inputs["rigid"] = sizes / CORRECTED / f"{network.corrects}.json"
        found.append(Part(name, prepare, settings, inputs))
    return found


def prepare(
    *,
    machine: PlanarMachine,
    kind: str,
    activation: str,
    sizes: list[tuple[int, ...]],
    n_restarts: int,
    tolerance: float,
    seed: int,
    trainer: Stopping,
    grid: Path,
    selection: Path,
    rigid: Path | None = None,
    **model: Any,
) -> Work:
    """A size from one start is an item; `model` is what `based_on` takes."""
    base = based_on(machine, **model) if rigid is None else load_network(rigid)[0]
    architecture = Architecture(sizes[0], activation)
    taught = lesson(kind, architecture, trainer, seed, machine, grid, selection, base)
    return select(taught, sizes, n_restarts, tolerance)
