"""What the sections of params.yaml are made of: a strict base model and kinds of numbers."""

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float]
Interval = tuple[float, float]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys refused, numbers finite and not from text."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=False, allow_inf_nan=False, coerce_numbers_to_str=False
    )

    @model_validator(mode="before")
    @classmethod
    def _no_text_numbers(cls, data: Any) -> Any:
        # pydantic would turn text into a number behind one's back
        if isinstance(data, dict):
            for key, value in data.items():
                for entry in _entries(value):
                    if isinstance(entry, bool):
                        raise ValueError(f"{key}: expected no truth value, got {entry!r}")
                    if isinstance(entry, str) and _is_number(entry):
                        raise ValueError(f"{key}: expected a number, got the text {entry!r}")
        return data


def check_increase(section: Model, *names: str) -> None:
    """Raise ValueError unless each of the intervals `names` of `section` increases."""
    for name in names:
        low, high = getattr(section, name)
        if not low < high:
            raise ValueError(f"{name}: must increase")


def _entries(value: Any) -> Iterator[Any]:
    """`value`, or the entries of lists however deep."""
    if isinstance(value, list):
        for entry in value:
            yield from _entries(entry)
    else:
        yield value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
