"""What models of files say of themselves: their keys, for docs/ and for comments in new files.

Descriptions stand in the docstrings of the models, an entry `name : text` a field (or several names
with commas, or `name: text`); kinds, ranges and defaults are those of the fields.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import yaml
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from flexik.parameters.model import Model, Plausible

_ENTRY = re.compile(r"(?m)^(\w+(?:, \w+)*) ?: (.*(?:\n(?: +.*))*)")
_BOUNDS = {"ge": "{} or more", "gt": "more than {}", "le": "at most {}", "lt": "less than {}"}
_PLAIN = {
    float: "number",
    int: "whole number",
    str: "text",
    bool: "true or false",
    Any: "anything",
    NoneType: "null",
}


@dataclass(frozen=True)
class Key:
    """A key of a model: its name, what it takes, its default (empty: it must stand) and meaning."""

    name: str
    takes: str
    default: str
    text: str


def models_in(*roots: Any) -> list[type[Model]]:
    """Models that the annotations `roots` hold, however deep, each once, outer ones first."""
    found: list[type[Model]] = []
    waiting = [*roots]
    while waiting:
        kind = waiting.pop(0)
        if isinstance(kind, type) and issubclass(kind, Model):
            if kind not in found:
                found.append(kind)
                waiting += [
                    f.annotation for n, f in kind.model_fields.items() if n not in kind.put_in
                ]
        else:
            waiting += [part for part in get_args(kind) if get_origin(kind) is not Literal]
    return found


def keys(model: type[Model]) -> list[Key]:
    """The keys of `model`, that which tells its kind first."""
    texts = _texts(model)
    found = [
        Key(name, _takes(field.annotation, field.metadata), _default(field), texts.get(name, ""))
        for name, field in model.model_fields.items()
        if name not in model.put_in
    ]
    first = kind_of(model).partition(": ")[0]
    return sorted(found, key=lambda key: key.name != first)


def summary(model: type[Model]) -> str:
    """The docstring of `model` without the entries of its fields."""
    return " ".join(_ENTRY.sub("", inspect.cleandoc(model.__doc__ or "")).split())


def title(model: type[BaseModel]) -> str:
    """What `model` is called in docs/: its kind, or the words of its name."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", model.__name__).lower()
    return kind_of(model).partition(": ")[2].replace("_", " ") or words


def kind_of(model: type[BaseModel]) -> str:
    """`kind: box` for one of several models that a key of this name tells apart, or nothing."""
    for name, field in model.model_fields.items():
        if get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1:
            return f"{name}: {get_args(field.annotation)[0]}"
    return ""


def commented(text: str, root: type[Model]) -> str:
    """The YAML `text` of a `root` without its comments; where a key first stands, what it is."""
    bare = re.sub(r"(?m)^\s*#.*\n", "", text)
    lines = [re.sub(r"\s#.*", "", line).rstrip() for line in bare.splitlines()]
    told: set[tuple[type[Model], str]] = set()
    tree = yaml.compose("\n".join(lines))
    for line, model, name in _placed(tree, root):
        words = {key.name: key for key in keys(model)}.get(name.removesuffix("_degrees"))
        if words and words.text and (model, name) not in told and "  # " not in lines[line]:
            told.add((model, name))
            lines[line] += f"  # {_first(words.text)}"
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines).strip("\n")) + "\n"


def _placed(node: yaml.Node | None, kind: Any) -> Iterator[tuple[int, type[Model], str]]:
    """Line, model and name of the keys of block mappings in `node`, which is a `kind`."""
    if not isinstance(node, yaml.MappingNode):
        return
    given = {key.value: value for key, value in node.value}
    kind = _chosen(kind, given)
    for key, value in node.value:
        if isinstance(kind, type) and issubclass(kind, Model):
            field = kind.model_fields.get(key.value)
            inside = field.annotation if field else None
            if not node.flow_style:
                yield key.start_mark.line, kind, key.value
        else:
            inside = get_args(kind)[1] if get_origin(kind) is dict else None
        yield from _placed(value, inside)


def _chosen(kind: Any, given: Mapping[str, yaml.Node]) -> Any:
    """The one of several kinds that a mapping with the keys `given` is."""
    if get_origin(kind) is Annotated:
        return _chosen(get_args(kind)[0], given)
    if get_origin(kind) not in (Union, UnionType):
        return kind
    parts = [_chosen(part, given) for part in get_args(kind)]
    models = [part for part in parts if isinstance(part, type) and issubclass(part, Model)]
    for model in models:
        name, _, word = kind_of(model).partition(": ")
        if name in given and given[name].value == word:
            return model
    return next((m for m in models if given.keys() <= m.model_fields.keys()), None)


def _texts(model: type[BaseModel]) -> dict[str, str]:
    """Descriptions by field, those of base classes too."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        for names, text in _ENTRY.findall(inspect.cleandoc(vars(base).get("__doc__") or "")):
            found |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    return found


def _first(text: str) -> str:
    """The beginning of a description, for a comment."""
    return re.split(r"(?<=\w)[;:.] |\.$", text, maxsplit=1)[0]


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return ""
    value = field.get_default(call_default_factory=True)
    if isinstance(value, BaseModel):
        return "its defaults"
    if value is None or value in ({}, ()):
        return "none"
    return f"{value:g}" if isinstance(value, float) else f"{value}".strip("()")


def _takes(kind: Any, metadata: Any = ()) -> str:
    """What a field of `kind` takes, in words."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _takes(parts[0], (*parts[1:], *metadata))
    if origin is Literal:
        return " or ".join(f"`{part}`" for part in parts)
    if origin in (Union, UnionType):
        words = [_takes(part, metadata) for part in parts if part is not NoneType]
        return " or ".join(dict.fromkeys(words))
    if origin is dict:
        return f"mapping of names to: {_takes(parts[1])}"
    if origin is list or (origin is tuple and parts[-1] is Ellipsis):
        return f"list of: {_takes(parts[0])}"
    if origin is tuple:
        words = list(dict.fromkeys(map(_takes, parts)))
        return f"list of {len(parts)}: {' and '.join(words)}"
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"[{title(kind)}](#{title(kind).replace(' ', '-')})"
    return "".join([_PLAIN.get(kind, str(kind)), *_bounds(metadata)])


def _bounds(metadata: Any) -> Iterator[str]:
    """Unit and range."""
    for part in metadata:
        for inner in getattr(part, "metadata", [part]):  # Field() in Annotated
            if isinstance(inner, AfterValidator) and isinstance(inner.func, Plausible):
                unit = inner.func
                low = f"{unit.low:g} to " if unit.low else "up to "
                yield f", {unit.unit} ({low}{unit.high:g})"
            for name, words in _BOUNDS.items():
                if (bound := getattr(inner, name, None)) is not None:
                    yield f", {words.format(bound)}"
