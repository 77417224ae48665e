"""Positioning methods and what they are built from."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Count, Model, Name, Positive, Seed


class Genetic(Model):
    """Genetic rigid inverse, see positioning.crane.genetic."""

    n_individuals: Annotated[int, Field(ge=2)]
    n_current: Annotated[int, Field(ge=0)]
    tolerance: Positive
    n_generations: Count
    seed: Seed

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.n_current > self.n_individuals:
            raise ValueError("n_current: must not exceed n_individuals")
        return self


class GradientDescent(Model):
    """Inversion of a network as published, see positioning.inversion."""

    kind: Literal["gradient_descent"]
    learning_rate: Positive
    tolerance: Positive
    n_iterations: Count


class GaussNewton(Model):
    """Inversion of a network by damped Gauss-Newton steps, see positioning.inversion."""

    kind: Literal["gauss_newton"]
    damping: Positive
    tolerance: Positive
    n_iterations: Count


class _Method(Model):
    """What every method has: a network, and how many of the workspace's targets it gets."""

    network: Name
    n_workspace_targets: Annotated[int, Field(ge=0)]


class CombinedModel(_Method):
    """See positioning.combined."""

    method: Literal["combined"]
    inverse: Literal["closed_form", "genetic"]
    genetic: Genetic | None
    n_corrections: Count

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.inverse == "genetic") != (self.genetic is not None):
            raise ValueError("genetic: settings where inverse is genetic, null where it is not")
        return self


class InvertedModel(_Method):
    """See positioning.direct and positioning.modular."""

    method: Literal["direct", "modular"]
    inversion: Annotated[GradientDescent | GaussNewton, Field(discriminator="kind")]


class InverseModel(_Method):
    """See positioning.crane.inverse."""

    method: Literal["inverse"]


MethodModel = Annotated[CombinedModel | InvertedModel | InverseModel, Field(discriminator="method")]
# Kind of network each method is built from
NETWORK_KIND = {
    "combined": "deflection",
    "direct": "direct",
    "modular": "correction",
    "inverse": "inverse",
}


class ToleranceStudy(Model):
    """Tolerances tried with each of `methods`, names of methods that invert a network."""

    methods: Annotated[list[Name], Field(min_length=1)]
    tolerances: Annotated[list[Positive], Field(min_length=1)]
