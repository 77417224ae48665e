"""Sets of conditions that methods of planar machines are judged on."""

from typing import Annotated, Any, Self

from pydantic import Discriminator, Field, Tag, model_validator

from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    NotNegative,
    Positive,
    Seed,
    Vector,
    check_increase,
)


class Points(Model):
    """Every point with every payload.

    points : x and y, m.
    payloads : kg.
    """

    points: Annotated[list[Vector], Field(min_length=1)]
    payloads: Annotated[list[NotNegative], Field(min_length=1)]

    @model_validator(mode="after")
    def _different(self) -> Self:
        for name in ("points", "payloads"):
            check_different(name, getattr(self, name))
        return self


class RandomTargets(Model):
    """Random targets that the loaded machine reaches, see evaluation.targets.

    n_targets : that many are kept of those drawn.
    x, y : least and largest coordinate of a target, m.
    payload : least and largest, kg.
    tolerance : the loaded tip can be put this near to a target, m.
    n_iterations : most steps towards it.
    seed : of the drawing.
    """

    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[NotNegative, NotNegative]
    tolerance: Positive = 1e-4
    n_iterations: Count = 20
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y", "payload")
        return self


def check_different(name: str, values: list[Any]) -> None:
    """Raise ValueError if a value of the list `name` is there twice."""
    for number, value in enumerate(values):
        if value in values[:number]:
            raise ValueError(f"{name}.{number}: {value} is there twice")


def _kind(given: Any) -> str:
    keys = given if isinstance(given, dict) else getattr(type(given), "model_fields", ())
    return "points" if "points" in keys else "random"


ConditionSet = Annotated[
    Annotated[Points, Tag("points")] | Annotated[RandomTargets, Tag("random")], Discriminator(_kind)
]
