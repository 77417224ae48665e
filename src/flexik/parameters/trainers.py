"""Settings of the trainers of networks: what params.yaml leaves out has the value given here."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Count, Model, NotNegative, Positive, Share

BelowOne = Annotated[float, Field(ge=0, lt=1)]
Shrinking = Annotated[float, Field(gt=0, lt=1)]
Growing = Annotated[float, Field(ge=1)]


class Stopping(Model):
    """When to stop; every trainer has these.

    n_iterations : at most; accepted steps, or passes over the data
    goal : mean squared error of the normalised outputs at which the run ends
    minimum_gradient : Euclidean norm of the gradient of that error at which it ends
    minimum_progress : relative fall of that error over `progress_window` iterations under which
        it ends; 0: never
    progress_window : iterations
    maximum_seconds : wall time after which it ends; results then depend on the machine
    selection_patience : iterations without a new least selection error after which it ends; the
        network of the least selection error is kept, however the run ends
    """

    kind: str = ""
    n_iterations: Count = 1000
    goal: NotNegative = 0.0
    minimum_gradient: NotNegative = 1e-10
    minimum_progress: BelowOne = 0.0
    progress_window: Count = 20
    maximum_seconds: Positive | None = None
    selection_patience: Count | None = None

    def but(self, **changes: Any) -> Self:
        """The same with other values, checked as they are."""
        return type(self)(**dict(self) | changes)


class Damped(Stopping):
    """What both schedules of Levenberg-Marquardt share: damping mu, and where a run ends.

    mu : the first damping
    mu_maximum : a run ends beyond this damping
    """

    mu: Positive
    mu_maximum: Positive = 1e10

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.mu > self.mu_maximum:
            raise ValueError("mu: must not exceed mu_maximum")
        return self


class LevenbergMarquardt(Damped):
    """The published schedule, see learning.levenberg_marquardt; factors are MATLAB's trainlm's.

    mu_decrease, mu_increase : factors of mu after a step that lowers the error, and one that fails
    """

    kind: Literal["levenberg_marquardt"] = "levenberg_marquardt"
    mu: Positive = 1e-3
    mu_decrease: Shrinking = 0.1
    mu_increase: Annotated[float, Field(gt=1)] = 10.0


class LevenbergMarquardtAccelerated(Damped):
    """The default, see learning.accelerated; mu is relative to the diagonal of J^T J.

    acceleration : largest ratio of twice the second-order to the first-order step at which the
        former is added; 0 leaves it out
    """

    kind: Literal["levenberg_marquardt_accelerated"] = "levenberg_marquardt_accelerated"
    n_iterations: Count = 400
    minimum_progress: BelowOne = 1e-2
    progress_window: Count = 10
    mu: Positive = 1e-2
    acceleration: NotNegative = 1.5


class BackPropagation(Stopping):
    """See learning.back_propagation; an iteration is a pass over the data.

    mode : "pattern": a step after each sample, in random order; "batch": one step a pass, along
        the mean of the samples' gradients, so that the learning rate does not depend on their
        number
    learning_rate, momentum : eta and alpha of Rouvinen 1999, equations 51 and 54
    rate_increase : factor of the learning rate after a pass that lowers the error
    rate_decrease : factor after a pass that raises it by more than `error_increase`; that pass is
        taken back and the momentum cleared; all three are MATLAB's traingdx's
    error_increase : factor of the error
    minimum_rate : the run ends when the learning rate falls below it
    """

    kind: Literal["back_propagation"] = "back_propagation"
    mode: Literal["pattern", "batch"] = "batch"
    learning_rate: Positive = 0.01
    momentum: BelowOne = 0.9
    rate_increase: Growing = 1.05
    rate_decrease: Shrinking = 0.7
    error_increase: Growing = 1.04
    minimum_rate: Positive = 1e-12

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum_rate > self.learning_rate:
            raise ValueError("minimum_rate: must not exceed learning_rate")
        return self


class Adam(Stopping):
    """See learning.adam; an iteration is a pass over the data.

    learning_rate, beta_1, beta_2 : of Kingma and Ba 2015
    final_rate : learning rate after n_iterations over the first one, along half a cosine
    batch_size : samples a step, drawn in random order; null: all of them
    """

    kind: Literal["adam"] = "adam"
    learning_rate: Positive = 1e-3
    final_rate: Share = 1.0
    beta_1: BelowOne = 0.9
    beta_2: BelowOne = 0.999
    batch_size: Count | None = None


class Lbfgs(Stopping):
    """See learning.lbfgs.

    memory : number of steps that tell the curvature
    """

    kind: Literal["lbfgs"] = "lbfgs"
    memory: Count = 20


class RegularisedCg(Stopping):
    """See learning.regularised_cg; an iteration is a Newton step.

    `goal` is the paper's epsilon: a round that ends at or below it is a successful training.

    penalty : p of the first round; E is the mean squared error of the normalised outputs
    penalty_decrease : tau, factor of p after a round
    weight_tolerance, error_tolerance : delta and sigma; the training has failed when a round moves
        the weights by at most delta and changes E by at most this share
    round_steps : Newton steps of a round at most
    round_progress : relative fall of the penalised error in a step under which the round ends
    cg_iterations : conjugate gradients of a step at most
    cg_tolerance : relative residual at which they end, or the square root of the norm of the
        gradient where that is smaller
    """

    kind: Literal["regularised_cg"] = "regularised_cg"
    penalty: Positive = 1e-4
    penalty_decrease: Shrinking = 0.03
    weight_tolerance: Positive = 1e-3
    error_tolerance: Positive = 1e-3
    round_steps: Count = 20
    round_progress: BelowOne = 1e-2
    cg_iterations: Count = 50
    cg_tolerance: Shrinking = 0.5


Trainer = Annotated[
    LevenbergMarquardt
    | LevenbergMarquardtAccelerated
    | BackPropagation
    | Adam
    | Lbfgs
    | RegularisedCg,
    Field(discriminator="kind"),
]
