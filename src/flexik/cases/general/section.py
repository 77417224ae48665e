"""The section of any planar flexible machine in params.yaml."""

from typing import Self

from pydantic import model_validator

from flexik.parameters.model import Model, NotNegative
from flexik.planar.section import (
    AnySamples,
    LearningCurves,
    OwnSamples,
    PlanarSection,
    check,
    check_curves,
)

__all__ = ["Section", "check"]


class Picture(Model):
    """Sample drawn in the picture: coordinates in m or rad, payload in kg."""

    values: list[float]
    payload: NotNegative


class Studies(Model):
    """picture: None: all drives in the middle of their limits, the largest payload of the grid."""

    picture: Picture | None = None
    learning_curves: LearningCurves | None = None


class Section(PlanarSection):
    """A machine whose constants are all known."""

    samples: AnySamples  # type: ignore[assignment]
    studies: Studies = Studies()

    @model_validator(mode="after")
    def _is_known(self) -> Self:
        if isinstance(self.samples, OwnSamples):
            self._check_own()
        elif not self.conditions:
            raise ValueError("conditions: expected a set, on which methods are judged")
        if free := self.machine.free:
            raise ValueError(f"machine.{free[0]}: expected a value; this case fits none")
        for name, network in self.networks.items():
            if network.learns == "coordinates" and len(self.machine.drives) != 2:
                raise ValueError(
                    f"networks.{name}.learns: coordinates need a machine of two drives"
                )
        check_curves(self, self.studies.learning_curves)
        shown = self.studies.picture
        if shown is not None and len(shown.values) != len(self.machine.drives):
            raise ValueError(f"studies.picture.values: expected {len(self.machine.drives)} of them")
        return self

    def _check_own(self) -> None:
        if self.conditions or set(self.methods) != {"none"}:
            raise ValueError(
                "conditions: expected {}, and methods: {none: {}}; samples of a file come with no "
                "model to judge methods by, and networks are judged by those held out"
            )
        for name, network in self.networks.items():
            if network.learns == "coordinates":
                raise ValueError(f"networks.{name}.learns: expected deflection, tip or rigid_tip")
