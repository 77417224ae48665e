"""Samples to learn from, to select by and to judge by."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    NotNegative,
    Positive,
    Seed,
    Share,
    Vector,
    check_increase,
)


class Axis(Model):
    """Evenly spaced values from minimum to maximum."""

    minimum: NotNegative
    maximum: NotNegative
    increment: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        steps = (self.maximum - self.minimum) / self.increment
        if self.maximum < self.minimum or abs(steps - round(steps)) > 1e-6:
            raise ValueError("increment: maximum - minimum must be a whole number of increments")
        return self


class Grid(Model):
    """Training grid, table 4.1."""

    lift: Axis
    jib: Axis
    extension: Axis
    payload: Axis
    minimum_tip_x: float
    maximum_failed_share: Share


class Selection(Model):
    """Random set that chooses among restarts."""

    n_samples: Count
    payload: tuple[NotNegative, NotNegative]
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "payload")
        return self


class Evaluation(Model):
    """Test conditions: every point with every payload."""

    points: Annotated[list[Vector], Field(min_length=1)]
    payloads: Annotated[list[NotNegative], Field(min_length=1)]


class Workspace(Model):
    """Random targets that the loaded crane reaches, see evaluation.targets."""

    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[NotNegative, NotNegative]
    tolerance: Positive
    n_iterations: Count
    seed: Seed

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y", "payload")
        return self
