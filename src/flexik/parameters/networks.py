"""Networks of a case: what each learns, how large it is, how it is trained."""

import itertools
from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexik.parameters.model import Model, Name, NotNegative, Positive, Restarts, Seed, Units


class Axis(Model):
    """Evenly spaced values.

    minimum, maximum : both included.
    increment : a whole number of them lies between.
    """

    minimum: float
    maximum: float
    increment: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        least, most, steps = self.minimum, self.maximum, self.maximum - self.minimum
        if most < least:
            raise ValueError(f"maximum: expected the minimum, {least:g}, or more, got {most:g}")
        steps /= self.increment
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                f"increment: expected a whole number of increments from {least:g} to {most:g}, "
                f"{self.increment:g} makes {steps:.4g}; {(most - least) / round(steps + 0.5):.6g} "
                "would do"
            )
        return self

    @property
    def n_values(self) -> int:
        """Number of values."""
        return round((self.maximum - self.minimum) / self.increment) + 1


class Sizes(Axis):
    """Numbers of hidden units of a layer to choose from."""

    minimum: Units
    maximum: Units
    increment: Units

    def values(self) -> list[int]:
        """All of them."""
        return list(range(self.minimum, self.maximum + 1, self.increment))


class Select(Model):
    """Study of sizes: every size from several starts.

    n_restarts : of each size.
    tolerance : the smallest size within this share of the least selection error is chosen.
    trainer : a name under trainers.
    """

    n_restarts: Restarts = 3
    tolerance: NotNegative = 0.0
    trainer: Name = "study"


Layer = Units | Sizes


class Network(Model):
    """A network; a case says which words `learns` knows.

    n_hidden : units of the hidden layer, or of each of several; where Sizes stand, the selection
        error chooses among all of them.
    corrects : name of a network that this one is added to, so that both are one.
    select : how the size is chosen, if it is.
    activation : of the hidden units.
    n_restarts : trainings from random weights, of which the least selection error is kept.
    seed : of the weights.
    trainer : a name under trainers.
    """

    learns: Name | None = None
    corrects: Name | None = None
    n_hidden: Layer | Annotated[list[Layer], Field(min_length=1)]
    select: Select = Select()
    activation: Literal["tanh", "logistic"] = "tanh"
    n_restarts: Restarts
    seed: Seed = 1
    trainer: Name = "accelerated"

    @property
    def layers(self) -> list[int | Sizes]:
        """Units of each hidden layer, or those to choose from."""
        return self.n_hidden if isinstance(self.n_hidden, list) else [self.n_hidden]

    @property
    def sizes(self) -> list[tuple[int, ...]]:
        """Units of all hidden layers; several where one is to be chosen."""
        choices = (n.values() if isinstance(n, Sizes) else [n] for n in self.layers)
        return list(itertools.product(*choices))

    @property
    def is_selected(self) -> bool:
        """Whether the selection error chooses the size."""
        return any(isinstance(n, Sizes) for n in self.layers)


def check_networks(networks: Mapping[str, Network], trainers: Mapping[str, object]) -> None:
    """Raise ValueError unless trainers and corrected networks that `networks` name are there."""
    for name, network in networks.items():
        named = {"trainer": network.trainer}
        if network.is_selected:
            named["select.trainer"] = network.select.trainer
        elif "select" in network.model_fields_set:
            raise ValueError(f"networks.{name}.select: n_hidden is given, nothing to select")
        for key, trainer in named.items():
            if trainer not in trainers:
                known = ", ".join(trainers)
                raise ValueError(
                    f"networks.{name}.{key}: there is no trainer {trainer!r} ({known})"
                )
        if (network.learns is None) == (network.corrects is None):
            raise ValueError(f"networks.{name}.learns: expected either this or corrects")
        other = networks.get(network.corrects or "")
        if network.corrects is not None and (other is None or other.corrects is not None):
            known = ", ".join(n for n, given in networks.items() if given.corrects is None)
            raise ValueError(
                f"networks.{name}.corrects: {network.corrects!r} is no network that can be "
                f"corrected ({known})"
            )
