"""Methods of planar machines by name: the files of this room that have Settings and build."""

import importlib
import pkgutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import BeforeValidator, Field

from flexik.parameters.model import Name
from flexik.parameters.networks import Network
from flexik.positioning.method import Ingredients, Method, Settings

Build = Callable[[Any, Ingredients], Method]


def _found() -> dict[str, tuple[type[Settings], Build]]:
    methods = {}
    for module_info in pkgutil.iter_modules([str(Path(__file__).parent)]):
        # a registry that named its files would count them all as code of each method
        module = importlib.import_module(f"flexik.positioning.{module_info.name}")
        settings = getattr(module, "Settings", None)
        if settings is not None and settings is not Settings:
            methods[module_info.name] = (settings, module.build)
    return methods


METHODS = _found()

if TYPE_CHECKING:
    AnyMethod = Settings
else:
    AnyMethod = Annotated[
        Union[tuple(settings for settings, _ in METHODS.values())],  # noqa: UP007
        Field(discriminator="method"),
    ]


def _with_method(given: Any) -> Any:
    """An entry that is called like a method is this method, unless it says another."""
    if not isinstance(given, dict):
        return given
    return {
        name: {"method": name, **(entry or {})} if name in METHODS and _plain(entry) else entry
        for name, entry in given.items()
    }


def _plain(entry: Any) -> bool:
    return entry is None or isinstance(entry, dict)


# Methods of a section by name
Methods = Annotated[dict[Name, AnyMethod], BeforeValidator(_with_method)]


def build_of(settings: Settings) -> Build:
    """The function that builds the method of `settings`."""
    return METHODS[settings.method][1]


def about(settings: Settings) -> str:
    """What the method of `settings` is, in a sentence: that of its file, without its name."""
    first = (sys.modules[type(settings).__module__].__doc__ or "").partition("\n\n")[0]
    return " ".join(first.partition(": ")[2].split()).rstrip(".")


def check_methods(methods: Mapping[str, Settings], networks: Mapping[str, Network]) -> None:
    """Raise ValueError unless each of `methods` names a network that learnt what it needs."""
    for name, method in methods.items():
        if method.needs is None:
            if method.network is not None:
                raise ValueError(f"methods.{name}.network: {method.method} needs none")
            continue
        network = networks.get(method.network or "")
        if network is None:
            raise ValueError(
                f"methods.{name}.network: there is no network {method.network!r} "
                f"({', '.join(networks)})"
            )
        learnt = network.learns or "correction"
        if learnt != method.needs:
            raise ValueError(
                f"methods.{name}.network: {method.network!r} learns {learnt}, "
                f"{method.method} needs {method.needs}"
            )
