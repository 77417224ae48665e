"""Method `beam_model`: `combined` with beam theory in place of a network, without training."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from flexik.machines.planar import PlanarMachine
from flexik.multibody.beam_theory import BeamTheory
from flexik.multibody.flexible import FlexibleMachine
from flexik.parameters.model import Count
from flexik.positioning import method
from flexik.positioning.combined import MOST_CORRECTIONS, Combined

# Passes over the deformed pose; 0: linear theory on the rigid pose
Passes = Annotated[int, Field(ge=0, le=50)]


class Settings(method.Settings):
    """See Combined; n_passes : see multibody.beam_theory.BeamTheory."""

    asks_machine: ClassVar[bool] = True
    method: Literal["beam_model"] = "beam_model"
    n_passes: Passes = 0
    n_corrections: Count = MOST_CORRECTIONS


def theory(machine: PlanarMachine, n_passes: int) -> BeamTheory:
    """Beam theory of `machine`, all constants known."""
    return BeamTheory(FlexibleMachine(machine), n_passes)


def build(settings: Settings, ingredients: method.Ingredients) -> Combined:
    """Method `beam_model` for the machine of `ingredients`."""
    found = theory(method.take_machine(ingredients), settings.n_passes)
    return Combined(ingredients.manipulator, found, settings.n_corrections)
