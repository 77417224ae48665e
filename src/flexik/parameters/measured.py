"""The measured crane: its stand-in, the campaign, and what is learnt from measurements."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    Name,
    NotNegative,
    Positive,
    Seed,
    Vector,
    check_increase,
)


class Deviations(Model):
    """How far a crane may be off, see multibody.crane_measured.as_built.Magnitudes."""

    pivot: NotNegative
    length: NotNegative
    play: NotNegative
    play_spread: NotNegative
    stroke_offset: NotNegative
    repeatability: NotNegative
    section: NotNegative
    spring: NotNegative


class Expected(Model):
    """What an adaptation expects before measuring, see positioning.crane_measured.adapted."""

    measurement: Positive
    repeatability: NotNegative
    pivot: Positive
    length: Positive
    stroke_offset: Positive
    play: NotNegative
    play_deviation: Positive
    section: Positive
    spring: Positive


class Adaptation(Model):
    """Cranes that are adapted, measurements for it, and targets to judge by."""

    method: Name
    n_cranes: Count
    n_measurements: Annotated[list[Count], Field(min_length=1)]
    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[NotNegative, NotNegative]
    n_corrections: Count
    expected: Expected
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y", "payload")
        if self.n_measurements != sorted(set(self.n_measurements)):
            raise ValueError("n_measurements: must increase")
        return self


class Measured(Model):
    """Campaign of chapter 4.6."""

    source: Literal["as_built", "file"]
    file: str
    method: Name
    points: Annotated[list[Vector], Field(min_length=1)]
    payloads: Annotated[list[NotNegative], Field(min_length=1)]
    noise: NotNegative
    deviations: Deviations
    seed: Seed
    adaptation: Adaptation

    @model_validator(mode="after")
    def _without_load(self) -> Self:
        if 0.0 not in self.payloads:
            raise ValueError("payloads: expected 0, the reference of the errors, among them")
        return self
