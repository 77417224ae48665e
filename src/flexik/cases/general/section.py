"""The section of any planar flexible machine in params.yaml."""

from typing import Self

from pydantic import model_validator

from flexik.parameters.model import Model, NotNegative
from flexik.planar.measured.section import Measured
from flexik.planar.section import AnySamples, OwnSamples, PlanarSection, check

__all__ = ["Section", "check"]


class Picture(Model):
    """Sample drawn in the picture: coordinates in m or rad, payload in kg."""

    values: list[float]
    payload: NotNegative


class Studies(Model):
    """picture: None: all drives in the middle of their limits, the largest payload of the grid.

    measured : None: no machine as built is measured.
    """

    picture: Picture | None = None
    measured: Measured | None = None


class Section(PlanarSection):
    """A machine of a file and nothing else."""

    samples: AnySamples  # type: ignore[assignment]
    studies: Studies = Studies()

    @property
    def measured(self) -> Measured | None:
        """Studies of a machine as built."""
        return self.studies.measured

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if isinstance(self.samples, OwnSamples):
            self._check_own()
        elif not self.conditions:
            raise ValueError("conditions: expected a set, on which methods are judged")
        for name, network in self.networks.items():
            if network.learns == "coordinates" and len(self.machine.drives) != 2:
                raise ValueError(
                    f"networks.{name}.learns: coordinates need a machine of two drives"
                )
        shown = self.studies.picture
        if shown is not None and len(shown.values) != len(self.machine.drives):
            raise ValueError(f"studies.picture.values: expected {len(self.machine.drives)} of them")
        return self

    def _check_own(self) -> None:
        if self.machine.free and self.calibration.campaign is None and self.calibration.ranges:
            raise ValueError("calibration: expected known, or campaign; there are no conditions")
        if self.studies.measured is not None:
            raise ValueError("studies.measured: samples of a file come with no model to measure")
        if self.conditions or set(self.methods) != {"none"}:
            raise ValueError(
                "conditions: expected {}, and methods: {none: {}}; samples of a file come with no "
                "model to judge methods by, and networks are judged by those held out"
            )
        for name, network in self.networks.items():
            if network.learns == "coordinates":
                raise ValueError(f"networks.{name}.learns: expected deflection, tip or rigid_tip")
