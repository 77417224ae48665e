"""What the sections of params.yaml are made of: a strict base model and kinds of numbers."""

import difflib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# Beyond these bounds a count is a slip: it would run for days
Count = Annotated[int, Field(ge=1, le=10_000_000)]
Restarts = Annotated[int, Field(ge=1, le=10_000)]
Units = Annotated[int, Field(ge=1, le=10_000)]
Seed = Annotated[int, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float]
Interval = tuple[float, float]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]


@dataclass(frozen=True)
class Plausible:
    """Accepts 0 and numbers of a size from `low` to `high` in `unit`.

    guesses : units by which a user may have meant another; the first that makes sense is proposed.
    """

    low: float
    high: float
    unit: str
    guesses: tuple[tuple[str, float], ...] = ()

    def __call__(self, value: float) -> float:
        """The number; raises PydanticCustomError."""
        if value == 0 or self.low <= abs(value) <= self.high:
            return value
        hint = ""
        for name, factor in self.guesses:
            if self.low <= abs(value * factor) <= self.high:
                hint = f" ({value:g} {name} would be {value * factor:g})"
                break
        words = f"expected {self.unit} of a size from {self.low:g} to {self.high:g}{hint}"
        raise PydanticCustomError("implausible", "{words}", {"words": words})


def plausible(low: float, high: float, unit: str, **guesses: float) -> AfterValidator:
    """See Plausible."""
    return AfterValidator(Plausible(low, high, unit, tuple(guesses.items())))


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys refused, numbers finite and not from text.

    A docstring tells what the fields are, an entry `name : text` each, see parameters.describe.

    put_in : fields that do not stand in the section itself.
    """

    put_in: ClassVar[frozenset[str]] = frozenset()
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=False, allow_inf_nan=False, coerce_numbers_to_str=False
    )

    @model_validator(mode="before")
    @classmethod
    def _known_keys_and_no_text_numbers(cls, data: Any) -> Any:
        # pydantic does not tell known keys, and turns text into a number behind one's back
        if isinstance(data, dict):
            for key in data:
                if key not in cls.model_fields:
                    known = [name for name in cls.model_fields if name not in cls.put_in]
                    close = difflib.get_close_matches(str(key), known, 1)
                    meant = f", did you mean {close[0]}?" if close else ""
                    raise ValueError(
                        f"{key}: there is no such key{meant} (known: {', '.join(known)})"
                    )
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
            raise ValueError(f"{name}: expected two increasing values, got {low:g} and {high:g}")


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
