"""Networks: what each learns, how large it is, how it is trained."""

from typing import Annotated, Literal

from pydantic import Field

from flexik.parameters.data import Axis
from flexik.parameters.model import Count, Model, Name, NotNegative, Seed

Kind = Literal["deflection", "direct", "rigid", "inverse"]
CORRECTION: Literal["correction"] = "correction"


class Learner(Model):
    """What every network has; `trainer` is a name under trainers."""

    activation: Literal["tanh", "logistic"]
    n_restarts: Count
    seed: Seed
    trainer: Name


class Sizes(Axis):
    """Numbers of hidden neurons."""

    minimum: Count
    maximum: Count
    increment: Count

    def values(self) -> list[int]:
        """All of them."""
        return list(range(self.minimum, self.maximum + 1, self.increment))


class Select(Model):
    """Study of sizes, see learning.size_selection."""

    n_hidden: Sizes
    n_restarts: Count
    tolerance: NotNegative
    trainer: Name


class NetworkModel(Learner):
    """A network of given size."""

    kind: Kind
    n_hidden: Count


class SelectedNetwork(Learner):
    """A network whose size the selection error chooses."""

    kind: Kind
    select: Select


class ModularNetwork(Learner):
    """A correction of given size to the network `rigid`, and both joined into one."""

    rigid: Name
    n_hidden: Count

    @property
    def kind(self) -> Literal["correction"]:
        """What is learnt."""
        return CORRECTION


class SelectedModularNetwork(Learner):
    """The same with a correction whose size the selection error chooses."""

    rigid: Name
    select: Select

    @property
    def kind(self) -> Literal["correction"]:
        """What is learnt."""
        return CORRECTION


AnyNetwork = NetworkModel | SelectedNetwork | ModularNetwork | SelectedModularNetwork


class Fitting(Model):
    """Networks of several sizes on a thinned grid, see stages/crane_fitting.py."""

    n_samples: Count
    n_hidden: Annotated[list[Count], Field(min_length=1)]
    jib: NotNegative
    extension: NotNegative
    payload: NotNegative
    trainer: Name
    seed: Seed
