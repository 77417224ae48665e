"""Methods with the networks that the pipeline trained, as parts name and read them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.kinematics.manipulator import Manipulator
from flexik.learning.storage import load_networks
from flexik.machines.planar import PlanarMachine
from flexik.planar.constants import known, model_inputs
from flexik.planar.section import PlanarSection
from flexik.positioning.method import Ingredients, Method, Network, Settings
from flexik.positioning.registry import Build, build_of


def method_settings(section: PlanarSection, name: str) -> dict[str, Any]:
    """Settings `method`, `build` and `load` of a part that asks method `name` of params.yaml."""
    method = section.methods[name].model_copy(update={"n_targets": None})
    found = {"method": method, "build": build_of(method)}
    return found if method.network is None else found | {"load": section.load_of(method.network)}


def method_inputs(section: PlanarSection, name: str) -> dict[str, Any]:
    """Inputs `network` and `samples`, those that method `name` is built from."""
    method = section.methods[name]
    samples = {name: section.data / "samples" / f"{name}.parquet" for name in method.reads}
    inputs: dict[str, Any] = {"samples": samples}
    if method.network is not None:
        inputs["network"] = section.file_of(method.network)
    return inputs


def trained_method(
    method: Settings,
    build: Build,
    manipulator: Manipulator,
    network: Path | Network | None = None,
    samples: Mapping[str, Path] | None = None,
    machine: PlanarMachine | None = None,
    load: Callable[[Path], Any] = load_networks,
) -> Method:
    """The method of `method_settings` with its trained `network` and its tables of samples.

    machine : all constants known, for methods that ask it.
    """
    trained: Network | None = load(network)[0][0] if isinstance(network, Path) else network
    tables = {name: read_table(path) for name, path in (samples or {}).items()}
    return build(method, Ingredients(manipulator, trained, tables, machine))


def trained_methods(
    methods: Mapping[str, Mapping[str, Any]],
    built_from: Mapping[str, Mapping[str, Any]],
    manipulator: Manipulator,
    machine: PlanarMachine,
) -> dict[str, Method]:
    """Methods of `method_settings` with their `method_inputs`, both by name; see trained_method."""
    return {
        name: trained_method(**given, manipulator=manipulator, **built_from[name], machine=machine)
        for name, given in methods.items()
    }


def method_of(section: PlanarSection, name: str) -> Method:
    """Method `name` of params.yaml, read from the data of the pipeline.

    Raises ParameterError if there is no such method.
    """
    if name not in section.methods:
        others = ", ".join(section.methods)
        raise ParameterError(f"{section.name}.methods: there is no {name!r} ({others})")
    inputs: dict[str, Any] = {"manipulator": section.manipulator, **method_inputs(section, name)}
    if section.methods[name].asks_machine:
        inputs["machine"] = known(section.machine, model_inputs(section).get("constants"))
    return trained_method(**method_settings(section, name), **inputs)
