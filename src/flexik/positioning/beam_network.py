"""Method `beam_network`: `combined` with beam theory and a network of what that leaves."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.beam_model import Passes, theory
from flexik.positioning.combined import MOST_CORRECTIONS, Combined
from flexik.positioning.method import Array, Network, take_machine, take_network


class Settings(method.Settings):
    """See Combined; n_passes : of beam theory, those of which the network learnt the remainder."""

    asks_machine: ClassVar[bool] = True
    needs: ClassVar[str | None] = "remainder"
    method: Literal["beam_network"] = "beam_network"
    n_passes: Passes = 2
    n_corrections: Count = MOST_CORRECTIONS


@dataclass(frozen=True)
class Sum:
    """What two networks give together."""

    base: Network
    remainder: Network

    def predict(self, values: Array) -> Array:
        """See flexik.positioning.method.Network."""
        return self.base.predict(values) + self.remainder.predict(values)


def build(settings: Settings, ingredients: method.Ingredients) -> Combined:
    """Method `beam_network` with machine and network of `ingredients`."""
    base = theory(take_machine(ingredients), settings.n_passes)
    deflection = Sum(base, take_network(ingredients))
    return Combined(ingredients.manipulator, deflection, settings.n_corrections)
