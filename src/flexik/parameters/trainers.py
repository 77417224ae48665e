"""Settings of the trainers, by kind."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Count, Model, NotNegative, Positive, Share


class Stopping(Model):
    """When any trainer stops, see learning.stopping."""

    n_iterations: Count
    goal: NotNegative
    minimum_gradient: NotNegative
    minimum_progress: Annotated[float, Field(ge=0, lt=1)]
    progress_window: Count
    maximum_seconds: Positive | None
    selection_patience: Count | None


class Damped(Stopping):
    """What both schedules of Levenberg-Marquardt share."""

    mu: Positive
    mu_maximum: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.mu > self.mu_maximum:
            raise ValueError("mu: must not exceed mu_maximum")
        return self


class LevenbergMarquardt(Damped):
    """The published schedule, see learning.levenberg_marquardt."""

    kind: Literal["levenberg_marquardt"]
    mu_decrease: Annotated[float, Field(gt=0, lt=1)]
    mu_increase: Annotated[float, Field(gt=1)]


class LevenbergMarquardtAccelerated(Damped):
    """See learning.accelerated."""

    kind: Literal["levenberg_marquardt_accelerated"]
    acceleration: NotNegative


class BackPropagation(Stopping):
    """See learning.back_propagation."""

    kind: Literal["back_propagation"]
    mode: Literal["pattern", "batch"]
    learning_rate: Positive
    momentum: Annotated[float, Field(ge=0, lt=1)]
    rate_increase: Annotated[float, Field(ge=1)]
    rate_decrease: Annotated[float, Field(gt=0, lt=1)]
    error_increase: Annotated[float, Field(ge=1)]
    minimum_rate: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum_rate > self.learning_rate:
            raise ValueError("minimum_rate: must not exceed learning_rate")
        return self


class Adam(Stopping):
    """See learning.adam."""

    kind: Literal["adam"]
    learning_rate: Positive
    final_rate: Share
    beta_1: Annotated[float, Field(ge=0, lt=1)]
    beta_2: Annotated[float, Field(ge=0, lt=1)]
    batch_size: Count | None


class Lbfgs(Stopping):
    """See learning.lbfgs."""

    kind: Literal["lbfgs"]
    memory: Count


class RegularisedCg(Stopping):
    """See learning.regularised_cg."""

    kind: Literal["regularised_cg"]
    penalty: Positive
    penalty_decrease: Annotated[float, Field(gt=0, lt=1)]
    weight_tolerance: Positive
    error_tolerance: Positive
    round_steps: Count
    round_progress: Annotated[float, Field(ge=0, lt=1)]
    cg_iterations: Count
    cg_tolerance: Annotated[float, Field(gt=0, lt=1)]


TRAINER_KINDS = (
    "levenberg_marquardt",
    "levenberg_marquardt_accelerated",
    "back_propagation",
    "adam",
    "lbfgs",
    "regularised_cg",
)
Trainer = Annotated[
    LevenbergMarquardt
    | LevenbergMarquardtAccelerated
    | BackPropagation
    | Adam
    | Lbfgs
    | RegularisedCg,
    Field(discriminator="kind"),
]
