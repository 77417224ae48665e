"""Reading and validating params.yaml."""

import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, Field, ValidationError

from flexik.errors import ParameterError
from flexik.files import checksum
from flexik.parameters.crane import Crane
from flexik.parameters.elastic_arm import ElasticArm
from flexik.parameters.fanuc import Fanuc
from flexik.parameters.model import Model
from flexik.parameters.smartee import SmartEE

PARAMETERS_FILE = "params.yaml"


class Parallel(Model):
    """Where the parallel stages compute."""

    n_workers: Annotated[int, Field(ge=0)]
    scheduler: str | None


class Parameters(Model):
    """The whole of params.yaml."""

    parallel: Parallel
    crane: Crane
    fanuc: Fanuc
    smartee: SmartEE
    elastic_arm: ElasticArm


def load_parameters(path: Path | str = PARAMETERS_FILE) -> Parameters:
    """Read and validate `path`.

    Raises ParameterError, one line a wrong key, if the file is missing, no YAML, or a value is
    unknown, missing or out of range.
    """
    return validate(read_yaml(path), str(path))


def read_yaml(path: Path | str) -> dict[str, Any]:
    """Mapping in the YAML file `path`; raises ParameterError if it is none or doubles a key."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise ParameterError(f"{path}: expected text in UTF-8 ({error.reason})") from None
    try:
        data = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        detail = " ".join(str(error).split())
        raise ParameterError(f"{path}: no valid YAML: {detail}") from None
    if not isinstance(data, dict):
        raise ParameterError(f"{path}: expected a mapping of keys to values")
    return data


def validate(data: dict[str, Any], source: str = PARAMETERS_FILE) -> Parameters:
    """`data` as Parameters; raises ParameterError naming `source` and the wrong keys."""
    try:
        return Parameters.model_validate(data)
    except ValidationError as error:
        lines = []
        for detail in error.errors():
            key = ".".join(_without_tags([str(p) for p in detail["loc"]])) or "top level"
            message = detail["msg"].removeprefix("Value error, ")
            if detail["type"] == "value_error":  # our own: "key within the section: what is wrong"
                within, _, message = message.partition(": ")
                key = f"{key}.{within}"
            given = detail["input"]
            shown = f", got {given!r}" if not isinstance(given, dict | list | BaseModel) else ""
            lines.append(f"{source}: {key}: {message}{shown}")
        raise ParameterError("\n".join(lines)) from None


def _without_tags(location: list[str]) -> list[str]:
    """The keys of a location, without the kind pydantic adds where a section has several."""
    before = ["", "", *location]
    tags = {
        k
        for k in range(len(location))
        if before[k + 1] == "inversion" or before[k] in ("trainers", "methods")
    }
    return [part for k, part in enumerate(location) if k not in tags]


def overlay(base: dict[str, Any], changes: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """`base` with the keys of `changes` replaced, mapping by mapping.

    Raises ParameterError for a key that `base` does not have.
    """
    result = dict(base)
    for key, value in changes.items():
        if key not in base:
            raise ParameterError(f"profile: {prefix}{key} is no key of {PARAMETERS_FILE}")
        nested = isinstance(value, dict) and isinstance(base[key], dict)
        result[key] = overlay(base[key], value, f"{prefix}{key}.") if nested else value
    return result


def parameters_checksum(sections: Iterable[BaseModel]) -> str:
    """SHA-256 of the values of `sections`, the same for equal values."""
    return checksum(*(json.dumps(s.model_dump(mode="json"), sort_keys=True) for s in sections))


class _UniqueKeyLoader(yaml.SafeLoader):
    """Refuses a key that stands twice in a mapping."""


def _unique_mapping(loader: _UniqueKeyLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    keys = [loader.construct_object(key) for key, _ in node.value]
    for key in keys:
        if keys.count(key) > 1:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} stands twice", node.start_mark
            )
    return loader.construct_mapping(node, deep=True)


# numbers like 1e-05, which YAML 1.2 and DVC know and write, and YAML 1.1 takes for text
_UniqueKeyLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)
_UniqueKeyLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)
