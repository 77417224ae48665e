"""Networks from several starts; the selection set chooses among them."""

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexik.datasets.parts import Part, Work
from flexik.learning.fit import fit
from flexik.learning.modular import combine
from flexik.learning.payload_polynomial import Predictor
from flexik.learning.perceptron import Network, quantities
from flexik.learning.size_selection import read_layers
from flexik.learning.storage import load_network
from flexik.learning.training import Architecture
from flexik.machines.planar import PlanarMachine
from flexik.parameters.trainers import Stopping
from flexik.planar.constants import known, model_inputs
from flexik.planar.fields import TIP
from flexik.planar.learning import lesson
from flexik.planar.section import PlanarSection

Theory = Callable[[PlanarMachine, int], Predictor]


def parts(section: PlanarSection) -> list[Part]:
    """A part a network."""
    return [part(section, name, name, section.data / "networks") for name in section.networks]


def part(section: PlanarSection, name: str, as_name: str, rigid_folder: Path) -> Part:
    """Network `name` as part `as_name`; the rigid one that it corrects is in `rigid_folder`."""
    network = section.networks[name]
    settings = described(section, name) | {
        "activation": network.activation,
        "n_hidden": None if network.is_selected else network.sizes[0],
        "n_restarts": network.n_restarts,
        "trainer": section.trainers[network.trainer],
    }
    inputs: dict[str, Any] = data_inputs(section, name)
    if network.is_selected:
        inputs["size"] = section.data / "sizes" / f"{name}.json"
    if network.corrects is not None:
        inputs["rigid"] = rigid_folder / f"{network.corrects}.json"
    return Part(as_name, prepare, settings, inputs)


def described(section: PlanarSection, name: str) -> dict[str, Any]:
    """Settings of what network `name` learns."""
    network = section.networks[name]
    return {
        "machine": section.machine,
        "kind": network.learns or "correction",
        "seed": network.seed,
        **section.base_of(name),
    }


def data_inputs(section: PlanarSection, name: str) -> dict[str, Any]:
    """Tables that network `name` learns from and is chosen by, and files of its machine."""
    folder = section.data / "samples"
    tables = {name: folder / f"{name}.parquet" for name in ("grid", "selection")}
    return tables | (model_inputs(section) if section.networks[name].learns == "remainder" else {})


def prepare(
    *,
    machine: PlanarMachine,
    kind: str,
    activation: str,
    n_hidden: tuple[int, ...] | None,
    n_restarts: int,
    seed: int,
    trainer: Stopping,
    grid: Path,
    selection: Path,
    size: Path | None = None,
    rigid: Path | None = None,
    **model: Any,
) -> Work:
    """A start is an item; corrections are joined to the network they correct.

    model : what `based_on` takes.
    """
    architecture = Architecture(n_hidden or read_layers(_needed(size)), activation)
    corrected = None if rigid is None else load_network(rigid)[0]
    base = corrected or based_on(machine, **model)
    taught = lesson(kind, architecture, trainer, seed, machine, grid, selection, base)
    finished = None if corrected is None else functools.partial(joined, corrected)
    return fit(taught, n_restarts, finished)


def based_on(
    machine: PlanarMachine,
    theory: Theory | None = None,
    n_passes: int = 0,
    constants: Path | None = None,
    sections: object = None,
) -> Predictor | None:
    """Beam theory of `machine`, where a network learns what it leaves."""
    return theory(known(machine, constants), n_passes) if theory else None


def joined(rigid: Network, correction: Network) -> Network:
    """One network of the tip: `rigid` plus what it lacks."""
    both = combine(rigid, replace(correction, outputs=rigid.outputs))
    return replace(both, outputs=tuple(quantities(TIP)))


def _needed(path: Path | None) -> Path:
    assert path is not None  # where n_hidden is not given, its choice is an input
    return path
