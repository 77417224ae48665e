"""Reading YAML files and validating what they hold."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from flexik.errors import ParameterError

PARAMETERS_FILE = "params.yaml"
T = TypeVar("T")


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


def validated(model: type[T], data: Any, source: Callable[[list[str]], tuple[str, str]]) -> T:
    """`data` as `model`.

    Raises ParameterError, one line a wrong value; `source` tells file and key of its location.
    """
    try:
        return TypeAdapter(model).validate_python(data)
    except ValidationError as error:
        found = []
        for detail in error.errors():
            location = _keys(detail["loc"], data, detail["type"] == "missing")
            message = _in_our_words(detail)
            if detail["type"] == "value_error":  # our own: "key within the section: what is wrong"
                within, _, message = message.partition(": ")
                location += within.split(".")
            given = detail["input"]
            shown = f", got {'nothing' if given is None else repr(given)}"
            if isinstance(given, dict | list | BaseModel):
                shown = ""
            found.append((location, detail["type"].endswith(_OF_TYPE), f"{message}{shown}"))
        lines = []
        for location, _, message in _likeliest(found):
            file, key = source(location)
            lines.append(f"{file}: {key or 'top level'}: {message}")
        raise ParameterError("\n".join(lines)) from None


# In place of pydantic's own words
_NUMBER, _WHOLE = "expected a number", "expected a whole number"
_LIST, _MAPPING = "expected a list", "expected a mapping of keys to values"
_MESSAGES = {
    "extra_forbidden": "there is no such key",
    "missing": "this key is missing",
    "union_tag_not_found": "key {discriminator} is missing or names none",
    "union_tag_invalid": "{discriminator} is '{tag}', expected one of {expected_tags}",
    **dict.fromkeys(("float_type", "float_parsing"), _NUMBER),
    **dict.fromkeys(("int_type", "int_parsing", "int_parsing_size", "int_from_float"), _WHOLE),
    **dict.fromkeys(("list_type", "tuple_type"), _LIST),
    **dict.fromkeys(("dict_type", "mapping_type", "model_type", "model_attributes_type"), _MAPPING),
    "string_type": "expected a text",
    "finite_number": "expected a finite number",
    "greater_than": "expected more than {gt:g}",
    "greater_than_equal": "expected {ge:g} or more",
    "less_than": "expected less than {lt:g}",
    "less_than_equal": "expected {le:g} or less",
    "literal_error": "expected {expected}",
    "too_short": "expected at least {min_length} of them, got {actual_length}",
    "too_long": "expected at most {max_length} of them, got {actual_length}",
    "string_too_short": "expected a text that is not empty",
    "string_pattern_mismatch": "a name is small letters, digits and _, the first a letter",
}
_OF_TYPE = ("_type", "_parsing", "_from_float")
Mistake = tuple[list[str], bool, str]


def _in_our_words(detail: ErrorDetails) -> str:
    if detail["type"] == "missing" and isinstance(detail["loc"][-1], int):
        return f"expected another entry, got {len(detail['input'])}"
    message = _MESSAGES.get(detail["type"])
    if message is None:
        return detail["msg"].removeprefix("Value error, ")
    return message.format(**detail.get("ctx", {}))


def _likeliest(found: Sequence[Mistake]) -> list[Mistake]:
    """One mistake a key: where a value may be of several types, pydantic tells one for each."""
    kept: list[Mistake] = []
    for location, of_type, message in sorted(found, key=lambda given: (given[1], -len(given[0]))):
        if not (of_type and any(other[: len(location)] == location for other, _, _ in kept)):
            kept.append((location, of_type, message))
    return sorted(kept, key=found.index)


def _keys(location: Sequence[int | str], data: Any, last_missing: bool) -> list[str]:
    """The keys of a location in `data`, without the kinds pydantic adds where there are several."""
    found = []
    for number, part in enumerate(location):
        inside = part in data if isinstance(data, Mapping) else False
        if isinstance(data, list) and isinstance(part, int):
            inside = part < len(data)
        if inside:
            data = data[part]
        if inside or (last_missing and number == len(location) - 1):
            found.append(str(part))
    return found


def overlay(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with the keys of `changes` put in or replaced, mapping by mapping."""
    result = dict(base)
    for key, value in changes.items():
        nested = isinstance(value, Mapping) and isinstance(base.get(key), Mapping)
        result[key] = overlay(base[key], value) if nested else value
    return result


class _UniqueKeyLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
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
